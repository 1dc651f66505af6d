"""A row of an index, or a file of one's own, as the geometry of an object that fills its box."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import trimesh
from pxr import Sdf, Tf, UsdUtils

from echousd.assets.catalogues.entry import Entry
from echousd.assets.describe import described, digest_of
from echousd.assets.measure import measure
from echousd.assets.measured import Measured
from echousd.assets.model_file import STAGES, ModelFile, check_reach, joined, split
from echousd.assets.record import AssetRecord, Vector
from echousd.assets.table import Library
from echousd.exporting.packing import PACKED, LeftOut, asset_paths
from echousd.shapes.colliders import hull_of
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.shapes.originals.conversion import ROOT, converted
from echousd.shapes.originals.original import CONVERTED, Original
from echousd.stage.files import said
from echousd.textures import READABLE


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


TAKEN = (*STAGES, *PACKED, *READABLE, ".mdl", ".mtlx", ".hdr")
MAX_TOTAL = 4 * 2**30  # bytes of one model with all that it needs


def collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    """(name of its layer, name -> content) of a USD model and the files that it depends on.

    Files that are not there stay missing, as they are. Raises ValueError that names the file for one that lies out of
    the library's folder, is of a kind that no model needs, or where all together are too large.
    """
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the exception says as well
    try:
        return _collected(model)
    except Tf.ErrorException as error:
        raise ValueError(f"{model}: cannot be collected with the files that it depends on ({said(error)})") from None
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence


def _collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    layers, others, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(model.path)))
    named = [str(layer.realPath) for layer in layers] + [str(path) for path in others]
    top, total = os.path.realpath(model.top), 0
    for name in named:
        path = name.partition("[")[0]
        if os.path.commonpath([top, os.path.realpath(path)]) != top:
            raise ValueError(f"{model}: {_named_by(layers, path)}depends on {path}, allowed: files below {model.top}")
        if Path(path).suffix.lower() not in TAKEN:
            warnings.warn(f"{model}: depends on {path}, which is left out", LeftOut, stacklevel=2)
        total += Path(path).stat().st_size
    if total > MAX_TOTAL:
        raise ValueError(f"{model}: {total} bytes with all that it needs, allowed: {MAX_TOTAL}")
    if model.suffix == ".usdz":
        return model.path.name, {model.path.name: model.path.read_bytes()}
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        if not UsdUtils.LocalizeAsset(Sdf.AssetPath(str(model.path)), folder):
            raise ValueError(f"{model}: cannot be collected with the files that it depends on")
        found = [p for p in sorted(Path(folder).rglob("*")) if p.is_file() and p.suffix.lower() in TAKEN]
        return model.path.name, {p.relative_to(folder).as_posix(): p.read_bytes() for p in found}


def _named_by(layers: Sequence[Sdf.Layer], path: str) -> str:
    """`<prim or property path> ` of who names a file, "" where no value does (a layer that is referred to)."""
    real = os.path.realpath(path)
    for layer in layers:
        for where, name in asset_paths(layer):
            if os.path.realpath(layer.ComputeAbsolutePath(name)) == real:
                return f"{where} "
    return ""
