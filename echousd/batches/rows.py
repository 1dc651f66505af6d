"""What a journal's line and a manifest's row say of a room, and whether what was read is such a line."""

from __future__ import annotations

import math
import re
from pathlib import PurePosixPath
from typing import Any

from echousd.folder.manifest import MAX_SEED

ID = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,254}")  # name of a room's folder and root layer
ROOTS = (".usda", ".usdc", ".usd")
SURROGATE = re.compile(r"[\ud800-\udfff]")
LATEST = 1e11  # seconds since 1970
LONGEST = 16 * 2**20  # bytes of one line of a run's files
ROUNDS = 1000  # of drafts
FARTHEST = 1e6  # metres

# column -> what it is where a room has none; the order is that of the manifest
COLUMNS: dict[str, Any] = {
    "id": "", "state": "missing", "source": "", "seed": 0, "type": "", "graph": "", "weights": "", "version": "",
    "shapes": "", "root": "", "bounds": [], "objects": 0, "categories": {}, "relations_asked": 0,
    "relations_kept": 0, "living_faults": [], "collisions": 0, "restless": 0, "check": False, "check_errors": [],
    "faces": 0, "bytes": 0, "licences": [], "sha256": "", "seconds": 0.0, "error": "",
}  # fmt: skip


def is_row(row: Any) -> bool:
    """Whether a line of a journal is one that we write; a run's folder may come from anybody."""
    if not isinstance(row, dict) or not isinstance(row.get("room"), str) or not _is_number(row.get("when")):
        return False
    if not 0 <= row["when"] < LATEST:
        return False
    if not all(_fits(name, row.get(name, default), default) for name, default in COLUMNS.items()):
        return False
    rounds = row.get("rounds", 1)
    if type(rounds) is not int or not 0 <= rounds <= ROUNDS or not _fits("stored", row.get("stored", {}), {}):
        return False
    if row.get("state") == "failed":
        return "error" in row and not row.get("root")
    bounds = row.get("bounds", [])
    whole = len(bounds) == 6 and all(abs(side) <= FARTHEST for side in bounds) and bool(row.get("sha256"))
    return row.get("state") == "done" and whole and _is_root(row.get("root", ""))


def is_text(value: Any) -> bool:
    """Whether a value is a text that a file in UTF-8 can hold."""
    return isinstance(value, str) and not SURROGATE.search(value)


def _fits(name: str, value: Any, default: Any) -> bool:
    """Whether a value is one that a column holds: of its type, in its range."""
    if isinstance(default, bool):
        return isinstance(value, bool)
    if isinstance(default, int):
        return type(value) is int and 0 <= value <= MAX_SEED
    if isinstance(default, float):
        return _is_number(value) and value >= 0
    if isinstance(default, list):
        return isinstance(value, list) and all(map(_is_number if name == "bounds" else is_text, value))
    if isinstance(default, dict):
        return isinstance(value, dict) and all(is_text(key) and _fits("", count, 0) for key, count in value.items())
    return is_text(value)


def _is_number(value: Any) -> bool:
    return type(value) is int or (type(value) is float and math.isfinite(value))


def _is_root(name: str) -> bool:
    path = PurePosixPath(name)
    return path.name == name and path.suffix in ROOTS and ID.fullmatch(path.stem) is not None
