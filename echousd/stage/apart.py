"""Files of others are read in another process first: OpenUSD may end the one that reads a damaged file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from echomodel import files
from echousd.stage.encoding import StageError

READER = Path(__file__).with_name("reader.py")
PATIENCE = 600.0  # seconds for all files of one call

_known: dict[tuple[str, int, int], str] = {}  # path, size, time -> why it cannot be read, "" where it can


def check_apart(path: str | os.PathLike[str]) -> None:
    """Raises StageError for a stage that ends the process that reads it, and names the file."""
    for told in fatal([Path(path)]).values():
        raise StageError(told)


def fatal(paths: Iterable[Path]) -> dict[Path, str]:
    """Those of some USD files that end the process that reads them, or take far too much memory: a sentence for each.

    Whatever else is wrong with a file is told by whoever opens it next. A file that did not change since is not read
    a second time.
    """
    stamps = {path: _stamp(path) for path in paths if path.is_file()}
    todo = [path for path, stamp in stamps.items() if stamp not in _known]
    while todo:
        last, why = _read(todo)
        count = todo.index(last) if last in todo else len(todo)
        _known.update({stamps[path]: "" for path in todo[:count]})
        if last is not None:
            _known[stamps[last]] = why
        todo = todo[count + 1 :]
    return {path: _known[stamp] for path, stamp in stamps.items() if _known[stamp]}


def _read(paths: list[Path]) -> tuple[Path | None, str]:
    """The first of the files that the process did not survive, and what became of it."""
    words = [sys.executable, "-P", str(READER)]
    given = json.dumps({"files": [str(path) for path in paths], "memory": [files.HELD, files.EACH]})
    try:
        done = subprocess.run(words, input=given, capture_output=True, text=True, timeout=PATIENCE, check=False)
        code, told = done.returncode, done.stdout
    except subprocess.TimeoutExpired as late:
        code, told = None, (late.stdout or b"").decode() if isinstance(late.stdout, bytes) else late.stdout or ""
    names = [json.loads(line) for line in told.splitlines() if line.endswith('"')]
    if code == 0 or not names:  # without a name it could not begin, and says nothing of any file
        return None, ""
    given_names = [str(path) for path in paths]
    last = next((name for name in reversed(names) if name in given_names), given_names[0])
    how = "does not come to an end" if code is None else f"ends the program ({f'signal {-code}' if code < 0 else code})"
    return Path(last), f"{names[-1] if names else last}: reading it {how}; it is damaged, or made to do that"


def _stamp(path: Path) -> tuple[str, int, int]:
    found = path.stat()
    return os.path.realpath(path), found.st_size, found.st_mtime_ns
