"""Habitat Synthetic Scenes (HSSD): glb models and a table of their categories, their up and their front."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.catalogues.tables import rows_of
from echousd.assets.model_file import ModelFile

HEAD = 4096  # characters of a table that may name its columns
NAMES = ("main_category", "wnsynsetkey", "main_wnsynsetkey", "category", "super_category")


def entries(folder: Path, tell: Told) -> list[Entry]:
    """Models of the table whose files are there; parts of decomposed models are left out."""
    table = _table(folder)
    assert table is not None
    files = {p.stem: p for p in sorted(folder.rglob("*.glb")) if "decomposed" not in p.parts}
    rows = rows_of(table)
    found = [_entry(row, files[row["id"]], folder) for row in rows if row.get("id") in files]
    if len(found) < len(rows):
        tell(f"{table}: {len(rows) - len(found)} of {len(rows)} objects have no model below {folder}")
    return found


def _entry(row: dict[str, str], path: Path, folder: Path) -> Entry:
    turn = _turn(row.get("up", ""), row.get("front", ""))
    return Entry(
        row["id"],
        ModelFile(path, folder),
        row.get("name") or row["id"],
        words=tuple(filter(None, (row.get(name, "") for name in NAMES))),
        turn=turn,
        licence="CC-BY-NC-4.0",
        author="HSSD (Habitat Synthetic Scenes Dataset)",
        tags=tuple(filter(None, (row.get("style", ""), row.get("material", "")))),
    )


def _turn(up: str, front: str) -> np.ndarray | None:
    """The rotation whose rows are the object's axes, from two vectors as texts `x,y,z`; None where they are none."""
    try:
        high, ahead = (np.array([float(v) for v in said.replace(",", " ").split()]) for said in (up, front))
    except ValueError:
        return None
    if len(high) != 3 or len(ahead) != 3 or not (np.isfinite(high).all() and np.isfinite(ahead).all()):
        return None
    if min(np.linalg.norm(high), np.linalg.norm(ahead)) < 1e-6:
        return None
    high = high / np.linalg.norm(high)
    ahead = ahead - high * (ahead @ high)
    if np.linalg.norm(ahead) < 1e-6:
        return None
    ahead = ahead / np.linalg.norm(ahead)
    return np.stack([np.cross(high, ahead), high, ahead])


def _table(folder: Path) -> Path | None:
    """A table with the columns `id`, `up` and `front` in a folder or in its `semantics` or `metadata`."""
    for place in (folder, folder / "semantics", folder / "metadata"):
        for path in sorted(place.glob("*.csv")) if place.is_dir() else ():
            if not path.is_file():
                continue
            with path.open(encoding="utf-8", errors="replace") as file:
                columns = [word.strip().strip('"').lower() for word in file.readline(HEAD).split(",")]
            if {"id", "up", "front"} <= set(columns):
                return path
    return None


CATALOGUE = Catalogue("HSSD", _table, entries)
