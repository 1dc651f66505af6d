"""Damaged files of a finished room: bits flipped, pieces cut out, zeroed or doubled; and what a command makes of it."""

from __future__ import annotations

import contextlib
import io
import os
import random
import resource
import shutil
import signal
import tempfile
from dataclasses import dataclass
from pathlib import Path

from mutations import COMMANDS

from echousd.cli.main import run

SECONDS = 60  # of the processor for one command
PATIENCE = 120  # seconds of the clock: whoever waits for something takes no processor
MEMORY = 12 << 30  # address space of its process, most of it never touched
GROWTH = 2 << 20  # kB that it may add
KINDS = ("bit", "bits", "bytes", "zeros", "cut", "twice")


@dataclass(frozen=True)
class Flip:
    """Damage to one file of a room: its path below the room's folder, the kind of damage and the seed of its places."""

    path: str
    kind: str
    seed: int


def flipped(content: bytes, flip: Flip) -> bytes:
    """The damaged file."""
    draw = random.Random(f"{flip.path} {flip.kind} {flip.seed}")
    out, size = bytearray(content), len(content)
    if not size:
        return content
    start = draw.randrange(size) if draw.random() < 0.5 else draw.randrange(min(size, 512))  # half of them in the head
    end = min(size, start + draw.choice((1, 4, 16, 256)))
    if flip.kind in ("bit", "bits"):
        for _ in range(1 if flip.kind == "bit" else 32):
            out[start if flip.kind == "bit" else draw.randrange(size)] ^= 1 << draw.randrange(8)
    elif flip.kind == "bytes":
        out[start:end] = draw.randbytes(end - start)
    elif flip.kind == "zeros":
        out[start:end] = bytes(end - start)
    elif flip.kind == "cut":
        del out[start : end if draw.random() < 0.5 else size]
    else:
        out[start:end] = out[start:end] * 2
    return bytes(out)


def files_of(room: Path) -> list[str]:
    """The files that a command may read of a room, as paths below its folder."""
    found = (path.relative_to(room.parent).as_posix() for path in room.parent.rglob("*") if path.is_file())
    return sorted(path for path in found if not path.endswith(".lock"))


def fault(room: Path, flip: Flip, command: str) -> str:
    """What is wrong with how a command takes a damaged file, "" for nothing; runs in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="echousd-flips-") as scratch:
        folder = Path(scratch) / room.parent.name
        shutil.copytree(room.parent, folder)
        path = folder / flip.path
        path.write_bytes(flipped(path.read_bytes(), flip))
        return end_of(COMMANDS[command](folder / room.name, Path(scratch) / "out"), Path(scratch))


def end_of(words: list[str], folder: Path, again: bool = True) -> str:
    """What is wrong with how a command ends, "" for nothing; its message must name a file below `folder` or a prim."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    said = folder / "said.txt"
    child = os.fork()
    if not child:
        code = 99
        with contextlib.suppress(BaseException):
            signal.alarm(PATIENCE)
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            out, err = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = run(words)
            said.write_text(out.getvalue() * (code == 0) + err.getvalue(), errors="replace")
        os._exit(code)
    _, status, used = os.wait4(child, 0)
    code = os.waitstatus_to_exitcode(status)
    text = said.read_text() if said.exists() else ""
    last = (text.strip().splitlines() or [""])[-1]
    if code == -signal.SIGALRM and used.ru_utime + used.ru_stime < 5 and again:
        return end_of(words, folder, again=False)  # a fork may wait for a thread that only its parent has
    if code not in (0, 1, 2):
        return f"ends with {code} after {used.ru_utime + used.ru_stime:.0f} s: {last}"
    if code == 2 and not (str(folder) in last or "</" in last):
        return f"names neither file nor prim: {last}"
    if "\x1b" in text:
        return "a control character on the terminal"
    grown = used.ru_maxrss - before
    return f"{grown >> 10} MB more memory" if grown > GROWTH else ""
