"""A row of an index, or a file of one's own, as the geometry of an object that fills its box."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from echousd.assets.catalogues.entry import Entry
from echousd.assets.describe import described, digest_of
from echousd.assets.measure import measure
from echousd.assets.measured import Measured
from echousd.assets.model_file import MODELS, STAGES, ModelFile, check_reach
from echousd.assets.record import AssetRecord, Vector
from echousd.assets.table import Library
from echousd.shapes.colliders import collider
from echousd.shapes.geometry import Collider, Geometry, Origin, Part
from echousd.shapes.originals.collecting import collected
from echousd.shapes.originals.conversion import ROOT, converted
from echousd.shapes.originals.original import CONVERTED, Original


def is_file(asset: str) -> bool:
    """Whether a node's `asset` is the file of a model, and not the id of one in a library."""
    return Path(split(asset)[0]).suffix.lower() in MODELS


def split(asset: str) -> tuple[str, str]:
    """(file, prim path) of `kitchen.usda</World/Sofa>`, the path empty where none is told."""
    file, angle, prim = asset.partition("<")
    return (file, prim.removesuffix(">")) if angle and prim.endswith(">") else (asset, "")


def joined(file: str, prim: str) -> str:
    """The inverse of `split`."""
    return f"{file}<{prim}>" if prim else file


def own_file(asset: str) -> ModelFile:
    """Where a model of one's own lies; its textures may lie in its folder and below."""
    file, prim = split(asset)
    return ModelFile(Path(file), Path(file).parent, prim=prim)


def own_record(asset: str, category: str) -> AssetRecord:
    """The row of a model of one's own, as if it were indexed; raises ValueError that names the file."""
    file = own_file(asset)
    key = joined(file.path.name, file.prim)
    record = described(Entry(key, file, file.path.stem, category=category), file.path, full=False)
    if record.fault:
        raise ValueError(record.fault)
    return record


def library_file(library: Library, record: AssetRecord) -> ModelFile:
    """Where a model of a library lies; raises ValueError where it is gone or is another one than was indexed."""
    path, member = library.path(record)
    model = ModelFile(path, library.root(record), member)
    check_reach(path, model.top, (), f"{library.file}: asset {record.id!r}")
    try:
        same = digest_of(model) == record.sha256
    except ValueError as error:
        raise ValueError(f"{library.file}: asset {record.id!r}: {error}; index the folder again") from None
    if not same:
        raise ValueError(f"{library.file}: asset {record.id!r}: {model} was changed since; index the folder again")
    return model


def geometry_of(
    model: ModelFile, record: AssetRecord, category: str, size: Vector, source: str, *, collect: bool = False
) -> Geometry:
    """The geometry of a model that fills `size` metres; raises ValueError that names its file.

    Arguments:
        model, record: the model's file and its row. category: of the object. source: name of the shape source.
        collect: take a USD model along with all that it needs, instead of referring to where it lies.
    """
    found = measure(model)
    pose = record.pose(size)
    points = found.points @ pose[:3, :3].T + pose[:3, 3]
    mesh = trimesh.Trimesh(points, found.faces, process=False)
    original = _original(model, found, pose, collect)
    origin = Origin(source, record.licence, record.author, asset=record.id, sha256=record.sha256)
    return Geometry((Part("mesh", mesh, {}),), (hull_of(mesh, category),), origin, original=original)


def _original(model: ModelFile, found: Measured, pose: np.ndarray, collect: bool) -> Original:
    if model.suffix not in STAGES:
        return Original(pose, ROOT, files=converted(model))
    # a payload brings the prim's own transform, and none of those above it
    main, files = collected(model) if collect else (CONVERTED, {})
    layer = None if collect else model.path.absolute()
    return Original(pose @ found.above, found.prim, layer, files, main, found.bodies, found.colliders)


def hull_of(mesh: trimesh.Trimesh, category: str) -> Collider:
    """What an object collides with, whatever its mesh is like."""
    try:
        return collider(mesh, category)
    except Exception:  # qhull and the simplifier fail on flat and broken meshes in their own ways
        low, high = mesh.bounds
        box = trimesh.creation.box(np.maximum(high - low, 1e-3))
        box.apply_translation((low + high) / 2)
        return Collider("collider", box, "convexHull")
