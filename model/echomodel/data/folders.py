"""Folders of data that are filled bit by bit and can be taken up again."""

from __future__ import annotations

import json
from pathlib import Path

from echomodel.files import write_json


def claim(folder: Path, plan: dict) -> None:
    """Remember what a folder is being filled with (`plan.json`).

    Raises ValueError for a folder that was begun with something else.
    """
    note = folder / "plan.json"
    if not note.exists():
        write_json(note, plan)
        return
    found = json.loads(note.read_text("utf-8"))
    wrong = [key for key in plan if found.get(key) != plan[key]]
    if wrong:
        told = ", ".join(f"{key} {found.get(key)!r}" for key in wrong if key != "categories") or "other categories"
        raise ValueError(f"{folder}: was begun with {told}; choose another folder or remove it")
