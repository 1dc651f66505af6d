"""Objaverse with the annotations of objathor: what each object is, what it rests on, how it is turned, its licence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.catalogues.tables import json_of, words
from echousd.assets.model_file import MODELS, ModelFile

TABLES = ("annotations.json", "annotations.json.gz")
RESTS = (("onCeiling", "ceiling"), ("onWall", "wall"), ("onFloor", "floor"), ("onObject", "surface"))


def entries(folder: Path, tell: Told) -> list[Entry]:
    """Annotated objects whose models are there; pickled ones are never opened."""
    table = _table(folder)
    assert table is not None
    told = json_of(table)
    if not isinstance(told, dict):
        raise ValueError(f"{table}: found a {type(told).__name__}, allowed: uid -> annotation")
    files = {p.stem: p for p in sorted(folder.rglob("*")) if p.suffix.lower() in MODELS}
    found = [_entry(uid, files[uid], folder, said) for uid, said in told.items() if uid in files and _is(said)]
    missing = len(told) - len(found)
    if missing:
        tell(f"{table}: {missing} of {len(told)} objects have no model below {folder}")
    return found


def _entry(uid: str, path: Path, folder: Path, said: Mapping[str, Any]) -> Entry:
    about = said.get("license_info") if _is(said.get("license_info")) else {}
    licence = (about or {}).get("license") or said.get("license") or ""
    author = (about or {}).get("creator_display_name") or (about or {}).get("creator_username") or ""
    turn = _turn(said)
    size = said.get("size")
    dims = np.array(size, float) / 100 if _is_size(size) else None
    if dims is not None and turn is not None:
        dims = np.abs(turn @ dims)
    placement = next((word for flag, word in RESTS if said.get(flag)), "")
    tags = [words(said.get(name)) for name in ("description", "style")]
    materials = said.get("materials")
    tags += [str(word) for word in materials] if isinstance(materials, list) else []
    return Entry(
        uid,
        ModelFile(path, folder),
        words(said.get("category")) or uid,
        words=tuple(filter(None, (words(said.get("category")), words(said.get("synset"))))),
        dims=dims,
        turn=turn,
        licence=str(licence),
        author=str(author),
        placement=placement,
        tags=tuple(filter(None, tags)),
    )


def _turn(said: Mapping[str, Any]) -> np.ndarray | None:
    """From `frontView`: the number of the quarter view, anticlockwise, that shows the front."""
    view = said.get("frontView")
    if not isinstance(view, int) or isinstance(view, bool) or not 0 <= view < 4:
        return None
    c, s = round(np.cos(-view * np.pi / 2)), round(np.sin(-view * np.pi / 2))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], float)


def _is_size(size: Any) -> bool:
    return (
        isinstance(size, list)
        and len(size) == 3
        and all(isinstance(v, int | float) and not isinstance(v, bool) and 0 < v < 1e5 for v in size)
    )


def _is(value: Any) -> bool:
    return isinstance(value, dict)


def _table(folder: Path) -> Path | None:
    return next((folder / name for name in TABLES if (folder / name).is_file()), None)


CATALOGUE = Catalogue("Objaverse with objathor's annotations", _table, entries)
