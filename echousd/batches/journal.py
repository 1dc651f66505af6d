"""The journal of a shard: one JSON line for every room that was made or failed, only ever appended to."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from echousd.batches.plan import LONGEST, STATE, STORE, is_row
from echousd.folder.lock import LOCK
from echousd.folder.manifest import find_manifest
from echousd.folder.within import check_links, inside
from echousd.pending import STAGING
from echousd.store import Store

JOURNAL = "journal.jsonl"


class Journal:
    """Appends lines and has them on the disk before it goes on.

    Arguments:
        folder: of the shard (`shard_folder`).
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = inside(folder, JOURNAL, f"{folder}: the run")
        torn = self.path.is_file() and self.path.stat().st_size and not _ends_line(self.path)
        links = getattr(os, "O_NOFOLLOW", 0)
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | links, 0o644)
        if torn:  # of a run that was killed while it wrote: its half line is no room
            os.write(self._file, b"\n")

    def append(self, row: dict[str, Any]) -> None:
        """Add one line; raises OSError where the disk is full, after which no half line counts."""
        content = (json.dumps(row, sort_keys=True, ensure_ascii=False) + "\n").encode("utf-8", "replace")
        written = os.write(self._file, content)
        if written != len(content):
            raise OSError(28, "No space left on device", str(self.path))
        os.fsync(self._file)

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._file)


def shard_folder(folder: Path, shard: tuple[int, int]) -> Path:
    """Where a shard keeps its journal and its lock; raises ValueError where a link leads out of the run's folder."""
    return inside(folder, f"{STATE}/shard_{shard[0]}_of_{shard[1]}", f"{folder}: the run")


def read_journals(folder: Path) -> dict[str, dict[str, Any]]:
    """Room id -> its last line in the journals of all shards; a room that is done stays done."""
    found: dict[str, dict[str, Any]] = {}
    for path in sorted((folder / STATE).glob(f"shard_*/{JOURNAL}")):
        check_links(folder, path, f"{folder}: the run has {path.relative_to(folder)}")
        if not path.is_file():
            raise ValueError(f"{path}: not a regular file, allowed: a journal")
        for row in _rows(path):
            before = found.get(row["room"])
            if before is None or before["when"] <= row["when"]:
                found[row["room"]] = row
    return found


def room_digest(folder: Path) -> str:
    """SHA-256 of a room's files, their paths and bytes; "" where there is none. Nothing is read through a link."""
    if not folder.is_dir():
        return ""
    total = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_symlink() or p.is_file()):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink():
            total.update(f"{name}\0link\n".encode())
        elif name != LOCK and not name.startswith(f"{STAGING}/"):
            with path.open("rb") as file:
                total.update(f"{name}\0{hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return total.hexdigest()


def fault_of(folder: Path, row: dict[str, Any], stored: Collection[str]) -> str:
    """What is wrong with a room that the journal calls done, "" where nothing is.

    Arguments:
        folder: of the room. row: its line in the journal. stored: keys of what is whole in the run's store.
    """
    if not folder.is_dir():
        return "missing"
    if room_digest(folder) != row["sha256"]:
        return "changed since it was made"
    manifest = find_manifest(folder, Path(row["root"]).stem) or {}
    missing = set((manifest.get("stored") or {}).values()) - set(stored)
    return f"{len(missing)} of its assets are missing in the store or changed" if missing else ""


def whole_keys(folder: Path, *, mend: bool = False) -> set[str]:
    """Keys of what is whole in the store of a run; `mend` takes away what is not, for its rooms to put it again."""
    place = inside(folder, STORE, f"{folder}: the run")
    if not place.is_dir():
        return set()
    store = Store.open(place)
    wrong = set(store.wrong())
    for key in wrong if mend else ():
        store.remove(key)
    return set(store.keys()) - wrong


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    with path.open("rb") as file:
        while line := file.readline(LONGEST):
            try:
                row = json.loads(line)
            except (ValueError, RecursionError):
                continue  # torn by a kill or a power cut, or longer than any of ours
            if is_row(row):
                yield row


def _ends_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"
