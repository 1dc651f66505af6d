"""Files of others are read in another process first: OpenUSD may end the one that reads a damaged file."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from echomodel import files
from echousd.stage.encoding import StageError
from echousd.stage.vouched import read_here, stamp_of

READER = Path(__file__).with_name("reader.py")
PATIENCE = 600.0  # seconds for all files of one call

# Path, size and time of files -> why they cannot be read, "" where they can with all that they name.
_known: dict[tuple[str, int, int], str] = {}


def check_apart(path: str | os.PathLike[str]) -> None:
    """Raises StageError for a stage that ends the process that reads it, and names the file."""
    for fault in fatal([Path(path)]).values():
        raise StageError(fault)


def fatal(paths: Iterable[Path]) -> dict[Path, str]:
    """Those of some USD files that end the process that reads them, or take far too much memory: a sentence for each.

    Whatever else is wrong with a file is told by whoever opens it next. A file that did not change since is not read
    a second time.
    """
    stamps = {path: stamp_of(path) for path in paths if path.is_file()}
    todo = [path for path, stamp in stamps.items() if stamp not in _known]
    while todo:
        last, why, read = _read(todo)
        count = todo.index(last) if last in todo else len(todo)
        _known.update({stamps[path]: "" for path in todo[:count]})
        read_here.update(map(stamp_of, read))
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
