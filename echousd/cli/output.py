"""What reaches a terminal or a file of the user's: no control characters, no endless words, nobody else's picture."""

from __future__ import annotations

import json
import math
import re
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TextIO

import typer

LONGEST_WORD = 300  # characters: a path is shorter, a name of a million is a prank
LONGEST_LINE = 4000
ENDLESS = re.compile(r"(?<![\w./-])(-?\d)(\d{39,})(?:\.\d+)?(?![\w/-]|\.\w)")  # a number that is no part of a path
MARK = b"echousd"
HEAD = 2048  # bytes in which a picture of ours says so
_errors: ContextVar[TextIO | None] = ContextVar("_errors", default=None)


def safe(text: str) -> str:
    """A text without characters that a terminal obeys (escapes, bells, reversed writing); long words are cut."""
    shown = "".join(
        c if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Zl", "Zp") else _escaped(c)
        for c in text[: 16 * LONGEST_LINE]
    )
    shown = ENDLESS.sub(lambda number: f"{number[1]}.{number[2][:3]}e+{len(number[2])}", shown)
    cut = re.sub(rf"(\S{{{LONGEST_WORD - 20}}})\S{{40,}}(\S{{10}})", r"\1...\2", shown)
    return cut if len(cut) <= 16 * LONGEST_LINE else cut[: 16 * LONGEST_LINE] + "..."


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode() if ord(character) > 31 else f"\\x{ord(character):02x}"


def one_line(text: str) -> str:
    """`safe` text in one line of bounded length."""
    line = " ".join(safe(text).split())
    return line if len(line) <= LONGEST_LINE else line[: LONGEST_LINE - 3] + "..."


def say(text: str, *, err: bool = False) -> None:
    """Print a line that may hold names from files."""
    typer.echo(safe(text), err=err)


def say_error(text: str) -> None:
    """Print a line about something that failed to stderr, with `--quiet` as well."""
    typer.echo(safe(text), file=_errors.get() or sys.stderr)


@contextmanager
def errors_to(stream: TextIO) -> Iterator[None]:
    """Have `say_error` print to a stream."""
    before = _errors.set(stream)
    try:
        yield
    finally:
        _errors.reset(before)


def say_json(found: Any, *, indent: int | None = None) -> None:
    """Print plain data as JSON; a number that is none becomes null."""
    typer.echo(json.dumps(plain_json(found), indent=indent, allow_nan=False))


def plain_json(found: Any) -> Any:
    """Plain data that JSON can hold: numbers that are none become null."""
    if isinstance(found, float):
        return found if math.isfinite(found) else None
    if isinstance(found, dict):
        return {key: plain_json(value) for key, value in found.items()}
    return [plain_json(value) for value in found] if isinstance(found, list | tuple) else found


def check_picture(path: Path, *, force: bool) -> None:
    """Refuse to replace a file that is no picture of ours; raises ValueError.

    Arguments:
        path: the picture to write; ours say `echousd` in their first bytes.
        force: replace whatever is there.
    """
    if force or not path.exists():
        return
    try:
        ours = path.is_file() and MARK in path.open("rb").read(HEAD)
    except OSError:
        ours = False
    if not ours:
        raise ValueError(f"{path}: exists and is no picture of echousd; choose another file or use --force")
