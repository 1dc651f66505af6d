"""The journal of a run: which staged files go where, on the disk before the first of them moves."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from echomodel.files import digest, flush
from echousd.folder.manifest import Digest
from echousd.pending import JOURNAL

DONE = "done.json"  # the journal of a run that has more to do once its files are in place


class Move(BaseModel, extra="forbid", strict=True):
    """A staged file that belongs at `to`; `over` is the digest of what it may replace there, "" for nothing."""

    staged: Annotated[str, Field(pattern=r"^[0-9]{1,9}$")]
    to: str
    digest: Digest
    over: Digest = ""


class Removal(BaseModel, extra="forbid", strict=True):
    """A file that goes if it still has this digest."""

    path: str
    digest: Digest


class Journal(BaseModel, extra="forbid", strict=True):
    """All that is left to do once every file of a run is staged, in order.

    `run` is what it does, "" = nobody asks; `kept` are files that are not ours, and what each is called from then on.
    """

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


def flush_all(places: Iterable[Path]) -> None:
    """Have files and folders on the disk itself, many at once."""
    with ThreadPoolExecutor() as pool:  # one after another a room's hundred files wait a third of a second
        list(pool.map(flush, places))


def write_journal(staging: Path, journal: Journal) -> None:
    """Put the journal beside its staged files: these are on the disk before, and it is there as a whole."""
    flush_all(staging / entry.staged for entry in journal.move)
    (staging / "journal.new").write_text(journal.model_dump_json(), "utf-8")
    flush(staging / "journal.new")
    (staging / "journal.new").replace(staging / JOURNAL)
    flush(staging)
