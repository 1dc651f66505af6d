"""What reaches a terminal, a file or a script: nothing that a terminal obeys, no NaN; what all commands have."""

from __future__ import annotations

import json
import math
import re
import time
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.options import click_options

if TYPE_CHECKING:
    from echousd.make.finished import Written

LONGEST_WORD = 300  # characters: a path is shorter, a name of a million is a prank
LONGEST_LINE = 4000
ENDLESS = re.compile(r"(?<![\w./-])(-?\d)(\d{39,})(?:\.\d+)?(?![\w/-]|\.\w)")  # a number that is no part of a path
_began: ContextVar[float] = ContextVar("_began", default=0.0)  # when the command did
quiet: ContextVar[bool] = ContextVar("quiet", default=False)  # whether errors, warnings and data alone are said


def safe(text: str) -> str:
    """A text without characters that a terminal obeys (escapes, bells, reversed writing); long words are cut."""
    shown = "".join(
        c if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Zl", "Zp")
        else c.encode("unicode_escape").decode() if ord(c) > 31 else f"\\x{ord(c):02x}"
        for c in text[: 16 * LONGEST_LINE]
    )  # fmt: skip
    shown = ENDLESS.sub(lambda number: f"{number[1]}.{number[2][:3]}e+{len(number[2])}", shown)
    cut = re.sub(rf"(\S{{{LONGEST_WORD - 20}}})\S{{40,}}(\S{{10}})", r"\1...\2", shown)
    return cut if len(cut) <= 16 * LONGEST_LINE else cut[: 16 * LONGEST_LINE] + "..."


def one_line(text: str) -> str:
    """`safe` text in one line of bounded length."""
    line = " ".join(safe(text).split())
    return line if len(line) <= LONGEST_LINE else line[: LONGEST_LINE - 3] + "..."


def say(text: str, *, err: bool = False) -> None:
    """Print a line that may hold names from files."""
    if not quiet.get():
        typer.echo(safe(text), err=err)


def say_error(text: str) -> None:
    """Print a line about something that failed to stderr, with `--quiet` as well."""
    typer.echo(safe(text), err=True)


def counted(number: int, word: str) -> str:
    """`1 object`, `2 objects`."""
    return f"{number} {word}{'s' * (number != 1)}"


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
    """Raises ValueError where a file is that is no picture of ours, unless it is replaced by `force`."""
    from echousd.draw.pictures import is_ours

    if not force and path.exists() and not is_ours(path):
        raise ValueError(f"{path}: exists and is no picture of echousd; choose another place or use --force")


LARGEST = 2**63 - 1  # what a layer, a manifest and a tensor can hold


def prepare(command: Any) -> None:
    """What all commands below a group have in common, in place.

    They remember when they began, refuse NaN, infinities and huge numbers, and one that keeps some of its options off
    the first page of its help has a flag that shows them.
    """
    for below in getattr(command, "commands", {}).values():
        prepare(below)
    if command.callback is not None:
        command.callback = _checked(command.callback)
    if any(getattr(option, "hidden", False) for option in command.params) and not hasattr(command, "commands"):
        command.params += click_options(HELP_ALL)


def _checked(callback: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(callback)
    def call(*values: Any, **options: Any) -> Any:
        _began.set(time.perf_counter())
        for name, value in options.items():
            for number in value if isinstance(value, tuple | list) else (value,):
                flag, whole = f"--{name.replace('_', '-')}", isinstance(number, int)
                if name == "seed" and whole and not 0 <= number <= LARGEST:
                    raise ValueError(f"seed is {number}, allowed: 0 to {LARGEST}")
                if isinstance(number, float) and not math.isfinite(number):
                    raise ValueError(f"{flag} is {number}, allowed: a finite number")
                if whole and abs(number) > LARGEST:
                    raise ValueError(f"{flag} is {number}, allowed: -{LARGEST} to {LARGEST}")
        return callback(*values, **options)

    return call


def _show_all(context: typer.Context, wanted: bool) -> None:
    if wanted:
        for option in context.command.params:
            option.hidden = False  # type: ignore[attr-defined]
        context.command.get_help(context)
        raise typer.Exit


HELP_ALL = Parameter(
    "help_all", Parameter.KEYWORD_ONLY, default=False,
    annotation=Annotated[bool, typer.Option(
        "--help-all", help="Show this with all options.", is_eager=True, callback=_show_all, expose_value=False
    )],
)  # fmt: skip


@contextmanager
def telling_faults() -> Iterator[None]:
    """Leave it to `report` to tell what a finished room does not keep."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the room has faults")
        yield


def report(made: Sequence[Written], *, json: bool = False, more: Mapping[str, Any] | None = None) -> None:
    """Say what was made and what the graphs asked for in vain; exit code 1 for faults.

    Arguments:
        made: the rooms.
        json: as one JSON object instead of lines.
        more: further entries of the JSON object.
    """
    faults = [fault for each in made for fault in each.room.faults]
    files = [path for each in made for path in (each.root, each.preview) if path]
    content = _written(files, faults, {"rooms": [_room(each) for each in made], **(more or {})})
    say_found(json, content, (line for each in made for line in room_lines(each)), ok=not faults)


def _written(files: Sequence[Path], faults: Sequence[str], more: Mapping[str, Any] | None) -> dict[str, Any]:
    """Which files were written, previews too, not the layers below a room's root; what is wrong, and how long it took.

    Arguments:
        faults: a sentence each.
        more: further entries.
    """
    content = {"ok": not faults, "written": [str(path) for path in files], "faults": list(faults)}
    return {**content, "seconds": round(time.perf_counter() - _began.get(), 3), **(more or {})}


def say_done(
    json: bool, files: Sequence[Path], lines: Iterable[str], more: Mapping[str, Any] | None = None,
    faults: Sequence[str] = (),
) -> None:  # fmt: skip
    """Say what a command has written: as one JSON object, or in lines; exit code 1 for faults."""
    say_found(json, _written(files, faults, more), [*lines, *(f"fault    {fault}" for fault in faults)], ok=not faults)


def say_found(json: bool, content: Mapping[str, Any], lines: Iterable[str], *, ok: bool = True) -> None:
    """Say what a command has found: the content as one JSON object, or lines; exit code 1 where it is not good."""
    if json:
        say_json(content, indent=2)
    else:
        for line in lines:
            say(line)
    if not ok:
        raise typer.Exit(1)


def _room(written: Written) -> dict[str, Any]:
    room = written.room
    return {
        "room": str(written.root),
        "preview": str(written.preview) if written.preview else None,
        "objects": len(room.names),
        "layouts": [found.to_json() for found in room.outcomes],
        "notes": list(room.notes),
    }


def room_lines(written: Written) -> Iterator[str]:
    """What became of a room."""
    room = written.room
    yield f"room     {written.root}"
    if written.preview is not None:
        yield f"preview  {written.preview}"
    for number, found in enumerate(room.outcomes):
        counts, several = found.counts(), len(room.outcomes) > 1
        kept = f"{counts['kept']} of {counts['kept'] + counts['broken']} measured relations kept"
        yield f"layout_{number} {kept}" if several else f"graph    {counted(len(room.names), 'object')}, {kept}"
        yield from (f"broken   {verdict.sentence} (margin {verdict.margin:+.2f})" for verdict in found.broken)
        yield from (f"collide  {hit.first} and {hit.second} by {hit.depth:.3f} m" for hit in found.collisions)
        yield from (f"restless {sentence}" for sentence in found.restless)
    yield from (f"note     {note}" for note in room.notes)
