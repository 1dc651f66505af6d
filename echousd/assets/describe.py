"""One entry of a catalogue becomes one row of the index: opened, measured, named, turned to the front."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from trimesh.sample import sample_surface

from echomodel.boxes2d import upright
from echomodel.data.sheet import thumbnail
from echomodel.files import within_memory
from echomodel.vocabulary import vocabulary
from echousd.assets.catalogues import Entry
from echousd.assets.colors import dominant
from echousd.assets.licences import UNKNOWN, spdx
from echousd.assets.measure import Measured, measure
from echousd.assets.model_file import ModelFile
from echousd.assets.naming import category_of, likely_unit
from echousd.assets.record import UPRIGHT, Z_UP, AssetRecord, vector
from echousd.assets.reference import relative
from echousd.textures import encoded

PLACEMENT = {"floor": "floor", "table": "surface", "wall": "wall", "ceiling": "ceiling"}
SIDE = 96  # pixels of a thumbnail


def described(entry: Entry, library: Path, *, full: bool = True, encoder: object = None) -> AssetRecord:
    """The row of a model; what is wrong with it is its `fault`.

    Arguments:
        entry: of a catalogue. library: the index, which its paths become relative to.
        encoder: a model whose encoder makes the descriptor, None = there is none.
        full: with a picture, which a model that is not chosen among others does not need.
    """
    record = left_out(entry, library, "")
    try:
        with within_memory(entry.file.path, str(entry.file)):
            record = replace(record, sha256=digest_of(entry.file))
        return _read(record, entry, measure(entry.file, painted=full), full, encoder)
    except ValueError as error:
        return replace(record, fault=str(error))


def left_out(entry: Entry, library: Path, fault: str) -> AssetRecord:
    """The row of a model that is not opened, and why."""
    return AssetRecord(
        id=entry.key, uri=relative(entry.file.path, library) + (f"!{entry.file.member}" if entry.file.member else ""),
        root=relative(entry.file.top, library), stamp=stamp(entry.file.path), name=entry.name,
        licence=spdx(entry.licence), author=entry.author, tags=entry.tags, fault=fault,
    )  # fmt: skip


def _read(record: AssetRecord, entry: Entry, found: Measured, full: bool, encoder: object) -> AssetRecord:
    turn = np.array(Z_UP if found.z_up else UPRIGHT).reshape(3, 3) if entry.turn is None else entry.turn
    if found.yaw:
        turn = upright(-found.yaw) @ turn
    placed = found.points @ turn.T
    low, high = placed.min(0), placed.max(0)
    extents = high - low
    metres = entry.metres or found.metres
    known = extents * metres if metres else entry.dims
    category, confidence = entry.category, 1.0
    if not category and not entry.decided:
        labels = (*entry.words, *found.labels)
        category, confidence = category_of(labels, entry.name, entry.group, known)
    if metres is None and entry.dims is None:
        metres = likely_unit(category, extents) if category else None
        if metres is not None and category:
            category, confidence = category_of((*entry.words, *found.labels), entry.name, entry.group, extents * metres)
    record = replace(
        record, category=category, confidence=round(confidence, 3), turn=tuple(turn.ravel().tolist()),
        joints=found.joints, rigid=found.bodies or found.colliders or found.joints > 0, prim=found.prim,
        materials=found.materials, variants=found.variants, missing=found.missing,
        licence=record.licence if record.licence != UNKNOWN else spdx(found.licence),
        author=record.author or found.author,
    )  # fmt: skip
    fault = "" if category else f"{entry.file}: {entry.name!r} is of no known category; set `category` in the table"
    if metres is None and entry.dims is None and category:
        return replace(record, fault=f"{entry.file}: says no unit, and its size tells none; set `metres` in the table")
    dims = entry.dims if entry.dims is not None else (high - low) * float(metres or 1.0)
    record = replace(record, low=vector(low), high=vector(high), dims=vector(np.maximum(dims, 1e-4)))
    record = _faced(record, entry, found)
    if category and not (entry.category or entry.decided):
        shape = found.turned(np.array(record.turn).reshape(3, 3))
        category = named_by_shape(category, shape, np.array(record.dims))
        record = replace(record, category=category)
    row = vocabulary().category(category) if category else None
    if not full:
        return record
    placement = entry.placement or (PLACEMENT[row.support] if row else "floor")
    shape = found.turned(np.array(record.turn).reshape(3, 3))
    shape.apply_scale(np.array(record.dims) / np.maximum(np.array(record.high) - np.array(record.low), 1e-12))
    record = replace(record, placement=placement, fault=fault, colors=dominant(found.coats))
    record = replace(record, thumbnail=encoded(thumbnail(shape, SIDE)))
    if encoder is not None and not fault:
        from echomodel.tsdf import tsdf_from_mesh
        from echousd.assets.descriptor import descriptors

        (numbers,) = descriptors(encoder, tsdf_from_mesh(shape)[None]).tolist()
        record = replace(record, descriptor=tuple(round(number, 5) for number in numbers))
    return record


def _faced(record: AssetRecord, entry: Entry, found: Measured) -> AssetRecord:
    """The record with its front at +Z: as the catalogue says, else by shape where that is clear, else as it lies."""
    known = entry.turn is not None  # a catalogue that knows how a model stands knows its front
    if known or not record.category:
        return replace(record, front_confidence=1.0 if known else 0.0)
    quarters, evidence = front_by_shape(found.turned(np.array(record.turn).reshape(3, 3)), record.category)
    if quarters and evidence >= SURE:
        return replace(record.turned(quarters), front_confidence=round(min(0.5 + evidence, 0.95), 3))
    return replace(record, front_confidence=round(min(0.5 + evidence, 0.95) if not quarters else 0.5, 3))


def digest_of(file: ModelFile) -> str:
    """sha256 of a model's file (of its member in an archive)."""
    with file.opened() as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def stamp(path: Path) -> str:
    """Size and time of a file, "" where there is none."""
    try:
        found = path.stat()
    except OSError:
        return ""
    return f"{found.st_size}:{found.st_mtime_ns}"


SAMPLES = 4000
SURE = 0.12  # share by which one side must outdo its opposite to be believed against a convention


def front_by_shape(mesh: trimesh.Trimesh, category: str) -> tuple[int, float]:
    """(quarters, evidence): quarter turns about +Y, counter-clockwise from above, that bring the front to +Z.

    Arguments:
        mesh: +Y up, any unit. category: of the vocabulary; what looks alike from all sides has no evidence.

    Seats, sofas and beds are highest at their back; cases and screens are plain and flat there and stand with it, the
    wide side, to the wall. Evidence is 0 where nothing tells, and near 1 where all does.
    """
    role = vocabulary().category(category).role
    points, face = sample_surface(mesh, SAMPLES, seed=0)
    low, high = points.min(0), points.max(0)
    size = np.maximum(high - low, 1e-9)
    at = (points - low) / size  # 0 to 1
    if role in ("seat", "sofa", "bed"):
        scores = _heights(at)
    elif role in ("storage", "screen"):
        scores = _plainness(at, mesh.face_normals[face], size)
    else:
        return 0, 0.0
    # scores: how much each side, +Z, +X, -Z, -X in the order of quarter turns, looks like a back
    opposite = np.roll(scores, 2)
    best = int(np.argmax(scores - opposite))
    back_to_front = (best + 2) % 4
    evidence = float(scores[best] - opposite[best])
    # a front at +X (place 1) comes to +Z by turning clockwise once, that is three quarters counter-clockwise
    return (4 - back_to_front) % 4, evidence


def _heights(at: np.ndarray) -> np.ndarray:
    """Of the surface in the upper part, how much lies near each side, as shares of what lies there."""
    upper = at[:, 1] > 0.62
    if upper.sum() < 20:
        upper = at[:, 1] > 0.5
    lean = [at[:, 2], at[:, 0], 1 - at[:, 2], 1 - at[:, 0]]
    return np.array([(upper & (side > 0.68)).sum() / max(upper.sum(), 1) for side in lean])


def _plainness(at: np.ndarray, normals: np.ndarray, size: np.ndarray) -> np.ndarray:
    """How much of each side is one plane at its very end, weighted by how wide the side is."""
    axes = ((2, 1.0), (0, 1.0), (2, -1.0), (0, -1.0))
    wide = max(size[0], size[2])
    found = []
    for axis, sign in axes:
        end = at[:, axis] > 0.99 if sign > 0 else at[:, axis] < 0.01
        facing = np.abs(normals[:, axis]) > 0.9
        across = size[0] if axis == 2 else size[2]
        near = at[:, axis] > 0.6 if sign > 0 else at[:, axis] < 0.4
        found.append((end & facing).sum() / max((near & facing).sum(), 1) * (across / wide) ** 2)
    return np.array(found)


OPEN, CLOSED = 0.35, 0.75  # share of the front that is filled, of open shelves at most and of closed ones at least
CORNER = 0.04  # share of a sofa's surface that lies in the quarter before one half of its back, at most
LOUNGE = 0.72  # metres: a chair as deep and as low as that is for leaning back
LOUNGE_HEIGHT = 0.95


def named_by_shape(category: str, mesh: trimesh.Trimesh, dims: np.ndarray) -> str:
    """A category, or the one beside it in the vocabulary that the shape tells.

    Arguments:
        category: by name. mesh: in the object frame, any unit. dims: (3) metres.
    """
    if category in ("multi_seat_sofa", "loveseat_sofa", "sofa") and dims[2] > 1.2 and dims[0] > 1.6:
        return "l_shaped_sofa" if _has_empty_corner(mesh) else category
    if category in ("bookshelf", "cabinet") and dims[1] > 0.5:
        filled = _front_filled(mesh)
        if category == "bookshelf" and filled > CLOSED:
            return "cabinet"
        return "bookshelf" if category == "cabinet" and filled < OPEN and dims[1] > 1.2 else category
    return "lounge_chair" if category == "chair" and dims[2] > LOUNGE and dims[1] < LOUNGE_HEIGHT else category


def _places(mesh: trimesh.Trimesh, count: int = SAMPLES) -> np.ndarray:
    """(n, 3) float, 0 to 1 in the mesh's box, of places on its surface."""
    low, high = mesh.bounds
    return (sample_surface(mesh, count, seed=0)[0] - low) / np.maximum(high - low, 1e-9)


def _has_empty_corner(mesh: trimesh.Trimesh) -> bool:
    at = _places(mesh)
    front = at[:, 2] > 0.7
    share = [float((front & side).mean()) for side in (at[:, 0] < 0.35, at[:, 0] > 0.65)]
    return min(share) < CORNER < max(share)


def _front_filled(mesh: trimesh.Trimesh) -> float:
    """Share of the front, seen squarely, behind which something stands in the first quarter of the depth."""
    at = _places(mesh, 12_000)
    near = at[at[:, 2] > 0.8]
    seen = np.zeros((16, 16), bool)
    seen[tuple((near[:, :2] * 16).astype(int).clip(0, 15).T)] = True
    return float(seen.mean())
