"""Files of others are read in another process first: OpenUSD may end the one that reads a damaged file.

Not read twice is what a room's manifest or a store's key says was written so, and text that cannot be nested deeply.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from echomodel import files
from echomodel.late import Late
from echousd.graph.files import CRATE
from echousd.pending import DEEP
from echousd.stage.encoding import StageError

READER = Path(__file__).with_name("reader.py")
PATIENCE = 600.0  # seconds for all files of one call
NESTED = 4_000  # brackets that a text may open: OpenUSD is at its end where some 10,000 stand within each other
stored = Late("echousd.store:stored")
LARGE = 64 * 2**20  # bytes of a file that is looked at here, before it is read

# Path, size and time of files -> why they cannot be read, "" where they can with all that they name.
_known: dict[tuple[str, int, int], str] = {}
_read_here: set[tuple[str, int, int]] = set()  # the same of those that this process may read, whatever they name


def check_apart(path: str | os.PathLike[str]) -> None:
    """Raises StageError for a stage that ends the process that reads it, and names the file."""
    for fault in fatal([Path(path)]).values():
        raise StageError(fault)


def check_harmless(path: Path, stage: Path | None = None) -> None:
    """Raises StageError for a file that ends the process that reads it, which another does where this may be.

    Arguments:
        stage: what the other process reads, None = the file.
    """
    if not _harmless(path):
        check_apart(stage or path)


def _harmless(path: Path) -> bool:
    """Whether this process may read a file: it was read apart, or is ours, or a text that cannot be nested deeply."""
    stamp = _stamp(path)
    if stamp in _read_here:
        return True
    if stamp[1] > LARGE:
        return False
    try:
        content = path.read_bytes()
    except OSError:  # told by whoever opens it next
        return True
    packed = content.startswith((CRATE, b"PK"))
    text = not packed and sum(content.count(mark) for mark in (b"{", b"[", b"(")) <= NESTED
    if not (text or _listed(path, files.digest(content)) or stored(path)):
        return False
    _read_here.add(stamp)
    return True


def _listed(path: Path, digest: str) -> bool:
    """Whether the manifest of a room that a file may lie in says that the room was written with it."""
    for folder in path.resolve().parents[:DEEP]:
        for listing in (place for place in folder.glob("*.json") if place.with_suffix(".usda").is_file()):
            with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
                if digest in _digests(listing, listing.stat().st_mtime_ns):
                    return True
    return False


@lru_cache(maxsize=16)
def _digests(listing: Path, changed: int) -> frozenset[str]:
    return frozenset(files.read_json(listing, LARGE)["files"].values())


def just_written(paths: Iterable[Path]) -> None:
    """Have files that this process has just written taken for harmless."""
    _read_here.update(map(_stamp, paths))


def fatal(paths: Iterable[Path]) -> dict[Path, str]:
    """Those of some USD files that end the process that reads them, or take far too much memory: a sentence for each.

    Whatever else is wrong with a file is told by whoever opens it next. A file that did not change since is not read
    a second time.
    """
    stamps = {path: _stamp(path) for path in paths if path.is_file()}
    todo = [path for path, stamp in stamps.items() if stamp not in _known]
    while todo:
        last, why, read = _read(todo)
        count = todo.index(last) if last in todo else len(todo)
        _known.update({stamps[path]: "" for path in todo[:count]})
        _read_here.update(map(_stamp, read))
        if last is not None:
            _known[stamps[last]] = why
        todo = todo[count + 1 :]
    return {path: _known[stamp] for path, stamp in stamps.items() if _known[stamp]}


def _read(paths: list[Path]) -> tuple[Path | None, str, list[Path]]:
    """The first of the files that the process did not survive, what became of it, and all files that it did survive."""
    words = [sys.executable, "-P", str(READER)]
    request = json.dumps({"files": [str(path) for path in paths], "memory": [files.HELD, files.EACH]})
    try:
        done = subprocess.run(
            words, input=request, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,  # USD quotes a damaged layer there
            text=True, timeout=PATIENCE, check=False,
        )  # fmt: skip
        code, output = done.returncode, done.stdout
    except subprocess.TimeoutExpired as late:
        code, output = None, (late.stdout or b"").decode() if isinstance(late.stdout, bytes) else late.stdout or ""
    names = [json.loads(line) for line in output.splitlines() if line.endswith('"')]
    if code == 0 or not names:  # without a name it could not begin, and says nothing of any file
        return None, "", [Path(name) for name in names if Path(name).is_file()]
    asked = [str(path) for path in paths]
    last = next((name for name in reversed(names) if name in asked), asked[0])
    how = "does not come to an end" if code is None else f"ends the program ({f'signal {-code}' if code < 0 else code})"
    output = f"{names[-1] if names else last}: reading it {how}; it is damaged, or made to do that"
    return Path(last), output, []


def _stamp(path: Path) -> tuple[str, int, int]:
    found = path.stat()
    return os.path.realpath(path), found.st_size, found.st_mtime_ns
