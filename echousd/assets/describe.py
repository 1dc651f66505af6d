"""One entry of a catalogue becomes one row of the index: opened, measured, named, turned to the front."""

from __future__ import annotations

import hashlib
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.files import within_memory
from echomodel.vocabulary import vocabulary
from echousd.assets.catalogues.entry import Entry
from echousd.assets.colors import dominant
from echousd.assets.front import SURE, front_by_shape
from echousd.assets.licences import UNKNOWN, spdx
from echousd.assets.likeness import named_by_shape
from echousd.assets.measure import measure
from echousd.assets.measured import Measured
from echousd.assets.model_file import ModelFile
from echousd.assets.naming import category_of, likely_unit
from echousd.assets.record import UPRIGHT, Z_UP, AssetRecord, vector
from echousd.assets.shape import supports, thumbnail

PLACEMENT = {"floor": "floor", "table": "surface", "wall": "wall", "ceiling": "ceiling"}
BLOCK = 2**20


def described(entry: Entry, library: Path, *, full: bool = True, encoder: object = None) -> AssetRecord:
    """The row of a model; what is wrong with it is its `fault`.

    Arguments:
        entry: of a catalogue. library: the index, which its paths become relative to.
        encoder: a model whose encoder makes the descriptor, None = there is none.
        full: with picture and level surfaces, which a model that is not chosen among others does not need.
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
        id=entry.key,
        uri=relative(entry.file.path, library) + (f"!{entry.file.member}" if entry.file.member else ""),
        root=relative(entry.file.top, library),
        stamp=stamp(entry.file.path),
        name=entry.name,
        licence=spdx(entry.licence),
        author=entry.author,
        tags=entry.tags,
        fault=fault,
    )


def _read(record: AssetRecord, entry: Entry, found: Measured, full: bool, encoder: object) -> AssetRecord:
    turn = np.array(Z_UP if found.z_up else UPRIGHT).reshape(3, 3) if entry.turn is None else entry.turn
    if found.yaw:
        c, s = np.cos(found.yaw), np.sin(found.yaw)
        turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ turn
    extents = np.ptp(found.points @ turn.T, axis=0)
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
        record,
        category=category,
        confidence=round(confidence, 3),
        turn=tuple(turn.ravel().tolist()),
        joints=found.joints,
        rigid=found.bodies or found.colliders or found.joints > 0,
        prim=found.prim,
        materials=found.materials,
        variants=found.variants,
        missing=found.missing,
        licence=record.licence if record.licence != UNKNOWN else spdx(found.licence),
        author=record.author or found.author,
    )
    fault = "" if category else f"{entry.file}: {entry.name!r} is of no known category; set `category` in the table"
    if metres is None and entry.dims is None and category:
        return replace(record, fault=f"{entry.file}: says no unit, and its size tells none; set `metres` in the table")
    low, high = _bounds(found, turn)
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
    record = replace(record, placement=placement, supports=supports(shape), thumbnail=thumbnail(shape), fault=fault)
    record = replace(record, colors=dominant(found.coats))
    if encoder is not None and not fault:
        from echousd.assets.descriptor import descriptors, grid_of

        (numbers,) = descriptors(encoder, grid_of(shape)[None]).tolist()
        record = replace(record, descriptor=tuple(round(number, 5) for number in numbers))
    return record


def _faced(record: AssetRecord, entry: Entry, found: Measured) -> AssetRecord:
    """The record with its front at +Z: as the catalogue says, else by shape where that is clear, else as it lies."""
    if entry.front_known or not record.category:
        return replace(record, front_confidence=1.0 if entry.front_known else 0.0)
    quarters, evidence = front_by_shape(found.turned(np.array(record.turn).reshape(3, 3)), record.category)
    if quarters and evidence >= SURE:
        return replace(record.turned(quarters), front_confidence=round(min(0.5 + evidence, 0.95), 3))
    return replace(record, front_confidence=round(min(0.5 + evidence, 0.95) if not quarters else 0.5, 3))


def _bounds(found: Measured, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = found.points @ turn.T
    return points.min(0), points.max(0)


def digest_of(file: ModelFile) -> str:
    """sha256 of a model's file (of its member in an archive)."""
    sha = hashlib.sha256()
    with file.opened() as content:
        while block := content.read(BLOCK):
            sha.update(block)
    return sha.hexdigest()


def stamp(path: Path) -> str:
    """Size and time of a file, "" where there is none."""
    try:
        found = path.stat()
    except OSError:
        return ""
    return f"{found.st_size}:{found.st_mtime_ns}"


def relative(path: Path, library: Path) -> str:
    """A path as it is stored: relative to the index's folder where that can be said, with forward slashes."""
    here = library.absolute().parent
    try:
        return Path(os.path.relpath(path.absolute(), here)).as_posix()
    except ValueError:  # on another drive
        return path.absolute().as_posix()
