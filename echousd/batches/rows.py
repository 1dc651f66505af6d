"""What a journal's line and a manifest's row say of a room, and whether what was read is such a line."""

from __future__ import annotations

import math
import re
from pathlib import PurePosixPath
from typing import Any

ID = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,254}")  # name of a room's folder and root layer
ROOTS = (".usda", ".usdc", ".usd")

# column -> what it is where a room has none; the order is that of the manifest
COLUMNS: dict[str, Any] = {
    "id": "", "state": "missing", "source": "", "seed": 0, "type": "", "graph": "", "weights": "", "version": "",
    "shapes": "", "root": "", "bounds": [], "objects": 0, "categories": {}, "relations_asked": 0,
    "relations_kept": 0, "living_faults": [], "collisions": 0, "check": False, "check_errors": [],
    "faces": 0, "bytes": 0, "licences": [], "sha256": "", "seconds": 0.0, "error": "",
}  # fmt: skip


def is_row(row: Any) -> bool:
    """Whether a line of a journal is one that we write; a run's folder may come from anybody."""
    if not isinstance(row, dict) or not isinstance(row.get("room"), str) or not _is_number(row.get("when")):
        return False
    if not all(_fits(row.get(name, default), default) for name, default in COLUMNS.items()):
        return False
    if type(row.get("rounds", 1)) is not int or not _fits(row.get("stored", {}), {}):
        return False
    if row.get("state") == "failed":
        return "error" in row and not row.get("root")
    whole = len(row.get("bounds", ())) == 6 and all(map(_is_number, row["bounds"])) and bool(row.get("sha256"))
    return row.get("state") == "done" and whole and _is_root(row.get("root", ""))


def _fits(value: Any, default: Any) -> bool:
    """Whether a value is of the type of a column."""
    if isinstance(default, bool):
        return isinstance(value, bool)
    if isinstance(default, int | float):
        return _is_number(value)
    if isinstance(default, list):
        return isinstance(value, list) and all(isinstance(part, str) or _is_number(part) for part in value)
    if isinstance(default, dict):
        return isinstance(value, dict) and all(map(_is_number, value.values()))
    return isinstance(value, str)


def _is_number(value: Any) -> bool:
    return type(value) is int or (type(value) is float and math.isfinite(value))


def _is_root(name: str) -> bool:
    path = PurePosixPath(name)
    return path.name == name and path.suffix in ROOTS and ID.fullmatch(path.stem) is not None
