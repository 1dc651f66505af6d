"""Sets of real meshes: flood-filled distances, stretched copies, a fifth of every class held out, attribution."""

from __future__ import annotations

import hashlib
import os
import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from echomodel.data.shapeset import ShapeRecord, ShapeSet, finish_set, write_shard
from echomodel.files import whole_file, write_text
from echomodel.progress import StepListener
from echomodel.tsdf import tsdf_from_mesh
from echomodel.vocabulary import vocabulary

HELD_OUT = 0.2


@dataclass(frozen=True, eq=False)
class MeshModel:
    """A model to learn from.

    Arguments:
        key: unique in the set. category: of the vocabulary. name, licence, author: for the attribution.
        version: another word where `load` gives another mesh than before.
        load: its surface in the object frame, metres; raises ValueError that names its file.
    """

    key: str
    category: str
    name: str
    licence: str
    author: str
    version: str
    load: Callable[[], trimesh.Trimesh]


def build_meshes(
    directory: str | os.PathLike[str], models: Sequence[MeshModel], *, copies: int = 2,
    progress: StepListener | None = None, skipped: Callable[[str], None] | None = None,
) -> ShapeSet:  # fmt: skip
    """Turn models into a shape set with ATTRIBUTION.md; a fifth of each class, by the hash of its key, is held out.

    Arguments:
        directory: folder of the set.
        copies: stored shapes per training mesh: itself, its mirror image, further ones alternating. The grid is
            normalised to the box, so that stretching shows in the size alone: copies have sizes stretched by about 8 %
            per axis. Held-out meshes are stored once, as they are.
        progress: called with (meshes done, meshes in all).
        skipped: called with one line for every mesh that could not be used.

    Meshes that are done are kept in `parts/`, so that an interrupted build goes on where it stopped.
    """
    folder = Path(directory)
    if not models:
        raise ValueError(f"{folder}: no model to learn from, allowed: a library with usable models")
    (folder / "parts").mkdir(parents=True, exist_ok=True)
    records, names, kept, held = [], [], [], held_out(models)
    for done, model in enumerate(models, 1):
        try:
            tsdf, size = _distances(folder, model)
        except ValueError as error:
            if skipped:
                skipped(str(error))
            continue
        finally:
            if progress:
                progress(done, len(models))
        kept.append(model)
        made = _copies(tsdf, size, model, 1 if model.key in held else copies, model.key in held)
        records += made
        names += [model.key] * len(made)
    for stale in folder.glob("shapes-*.bin"):
        stale.unlink()
    write_shard(folder / "shapes-0000.bin", records)
    write_text(folder / "ATTRIBUTION.md", attribution(kept))
    return finish_set(folder, {"kind": "meshes", "names": names}, len(records))


def held_out(models: Sequence[MeshModel]) -> frozenset[str]:
    """The keys of a fifth of every class, those that hash lowest."""
    members: dict[str, list[str]] = defaultdict(list)
    for model in models:
        members[model.category].append(model.key)
    ranked = (sorted(keys, key=lambda key: hashlib.sha256(key.encode()).hexdigest()) for keys in members.values())
    return frozenset(key for keys in ranked for key in keys[: round(HELD_OUT * len(keys))])


def _distances(folder: Path, model: MeshModel) -> tuple[np.ndarray, np.ndarray]:
    """TSDF and size of one mesh, from `parts/` where it was made before."""
    version = hashlib.sha256(f"{model.key} {model.version}".encode()).hexdigest()[:16]
    part = folder / "parts" / f"{re.sub(r'[^A-Za-z0-9]+', '-', model.key).strip('-')[:60]}_{version}.npz"
    if not part.exists():
        mesh = model.load()
        mesh.update_faces(mesh.area_faces > 0)
        tsdf, size = tsdf_from_mesh(mesh), np.asarray(mesh.extents, float)
        with whole_file(part) as beside, beside.open("wb") as file:
            np.savez_compressed(file, tsdf=np.rint(tsdf * 127).astype(np.int8), size=size)
    with np.load(part) as stored:
        return stored["tsdf"].astype(np.float32) / 127, stored["size"]


def _copies(tsdf: np.ndarray, size: np.ndarray, model: MeshModel, copies: int, held: bool) -> list[ShapeRecord]:
    category = vocabulary().category_id(model.category)
    rng = np.random.default_rng(int.from_bytes(hashlib.sha256(model.key.encode()).digest()[:8], "big"))
    records = [ShapeRecord(tsdf, category, -1, size, held)]
    for number in range(1, copies):
        stretched = size * np.exp(rng.normal(0, 0.08, 3))
        records.append(ShapeRecord(tsdf[::-1] if number % 2 else tsdf, category, -1, stretched, False))
    return records


def attribution(models: Sequence[MeshModel]) -> str:
    """Text of ATTRIBUTION.md: every model with its author, grouped by licence."""
    lines = ["# Models used", "", "Converted to signed distance grids; names, authors and licences from their library."]
    by_licence: dict[str, list[MeshModel]] = defaultdict(list)
    for model in sorted(models, key=lambda model: (model.licence, model.key)):
        by_licence[model.licence].append(model)
    for licence, members in by_licence.items():
        lines += ["", f"## {licence}", "", "| model | name | author |", "|---|---|---|"]
        lines += [f"| {m.key} | {m.name} | {m.author} |" for m in members]
    return "\n".join(lines) + "\n"
