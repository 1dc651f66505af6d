"""The journal of a run that moves a room's files into place: what it says, and how it is read with doubt (no pxr)."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from echomodel.files import digest, flush
from echousd.folder.manifest import LARGEST, Digest
from echousd.folder.within import check_links, inside
from echousd.pending import JOURNAL, STAGING

DONE = "done.json"  # the journal of a run that has more to do once its files are in place


class Move(BaseModel):
    """A staged file that belongs at `to`; `over` is the digest of what it may replace there, "" for nothing."""

    model_config = ConfigDict(extra="forbid", strict=True)

    staged: Annotated[str, Field(pattern=r"^[0-9]{1,9}$")]
    to: str
    digest: Digest
    over: Digest = ""


class Removal(BaseModel):
    """A file that goes if it still has this digest."""

    model_config = ConfigDict(extra="forbid", strict=True)

    path: str
    digest: Digest


class Journal(BaseModel):
    """All that is left to do once every file of a run is staged, in order.

    `run` is what it does, "" = nobody asks; `kept` are files that are not ours, and what each is called from then on.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    echousd_journal: Literal[2] = 2
    run: Annotated[str, Field(max_length=200)] = ""
    move: list[Move]
    remove: list[Removal]
    kept: dict[str, str] = {}


def digest_of(path: Path) -> str:
    """Digest of the plain file at `path`, "" where there is none."""
    try:
        return digest(path.read_bytes()) if path.is_file() else ""
    except OSError:
        return ""


def write_journal(staging: Path, journal: Journal) -> None:
    """Put the journal beside its staged files: these are on the disk before, and it is there as a whole."""
    for entry in journal.move:
        flush(staging / entry.staged)
    (staging / "journal.new").write_text(journal.model_dump_json(), "utf-8")
    flush(staging / "journal.new")
    (staging / "journal.new").replace(staging / JOURNAL)
    flush(staging)


def read_journal(folder: Path, name: str = JOURNAL) -> Journal | None:
    """The journal of an interrupted run in `folder`; None where it had not come so far, or cannot be read any more.

    Arguments:
        name: `JOURNAL`, or `DONE` for that of a run whose files are in place.

    Raises ValueError for entries that name anything outside of the folder; nothing was changed then.
    """
    path = folder / STAGING / name
    check_links(folder, path, f"{path} is read")
    if not path.is_file():
        return None
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError("it is too large")
        journal = Journal.model_validate(json.loads(path.read_bytes()))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(
            f"{path}: {where} is {first.get('input')!r:.100} ({first['msg'].lower()}); "
            f"delete {folder / STAGING} to give the interrupted run up"
        ) from None
    except (ValueError, RecursionError):  # emptied by a power cut, as some disks do
        warnings.warn(f"{path}: cannot be read; the interrupted run is given up, generate the room again", stacklevel=3)
        return None
    for number, entry in enumerate(journal.move):
        place = inside(folder, entry.to, f"{path}: move[{number}]")
        _check_place(folder, place, f"{path}: move[{number}]")
        check_links(folder, folder / STAGING / entry.staged, f"{path}: move[{number}] takes {entry.staged}")
    for number, removal in enumerate(journal.remove):
        place = inside(folder, removal.path, f"{path}: remove[{number}]")
        _check_place(folder, place, f"{path}: remove[{number}]")
    return journal


def _check_place(folder: Path, place: Path, entry: str) -> None:
    if place.relative_to(folder).parts[0] == STAGING:
        raise ValueError(f"{entry} names {place}, where runs keep their own files; allowed: the room's files")
