"""Folders of data that are filled bit by bit and can be taken up again."""

from __future__ import annotations

from pathlib import Path

from echomodel.files import read_json, write_json

LARGEST = 2**24  # bytes of a note


def read_note(path: Path, **kinds: type) -> dict:
    """What a folder of data says of itself, a JSON object.

    Arguments:
        kinds: fields that it must have, and their types.

    Raises ValueError, with the file's path, for anything else.
    """
    try:
        found = read_json(path, LARGEST)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror or error})") from None
    wrong = [key for key, kind in kinds.items() if not isinstance(found, dict) or type(found.get(key)) is not kind]
    if wrong or not isinstance(found, dict):
        told = ", ".join(f"{key} ({kinds[key].__name__})" for key in wrong) or "an object"
        raise ValueError(f"{path}: not what a set of data says of itself, missing: {told}")
    return found


def claim(folder: Path, plan: dict) -> None:
    """Remember what a folder is being filled with (`plan.json`).

    Raises ValueError for a folder that was begun with something else.
    """
    note = folder / "plan.json"
    if not note.exists():
        write_json(note, plan)
        return
    found = read_note(note)
    wrong = [key for key in plan if found.get(key) != plan[key]]
    if wrong:
        told = ", ".join(f"{key} {found.get(key)!r}" for key in wrong if key != "categories") or "other categories"
        raise ValueError(f"{folder}: was begun with {told}; choose another folder or remove it")
