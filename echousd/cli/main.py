"""`echousd`: gathers the commands of all topics and turns errors into one line and an exit code."""

import gc
import importlib
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from functools import cache
from typing import Any

import typer

from echomodel.files import tables
from echousd.cli.output import one_line, prepare, quiet, safe

# Module of a topic -> the commands that its `app` has. A module is imported when its command is called, or for the
# help on all; it must not import torch or pxr at module level (start-up time).
TOPICS: dict[str, list[str]] = tables("topics.toml", __file__)
BAD_INPUT, OWN_FAULT, INTERRUPTED, CLOSED_PIPE = 2, 70, 130, 141
MOST_PARTS = 500
GARBAGE = 200_000  # objects made between two looks for garbage: imports make a million and none of it


def _version(wanted: bool) -> None:
    if wanted:
        from echousd import __version__

        typer.echo(f"echousd {__version__}")
        raise typer.Exit


def _options(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
    quiet: bool = typer.Option(False, "--quiet", help="Say errors, warnings and data alone; may stand anywhere."),
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error; may stand anywhere."),
) -> None:
    """Author indoor scenes in USD from semantic scene graphs."""


def main() -> None:
    """Entry point of the `echousd` command."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # torch's threads sleep between products
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's products are small: a second thread is waited for
    warnings.formatwarning = lambda message, *_, **__: f"warning: {safe(str(message))}\n"  # no line of our source
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: PTH123, SIM115  # `echousd check room.usda >&-`
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: PTH123, SIM115
    gc.set_threshold(GARBAGE)
    code = run(sys.argv[1:])
    gc.freeze()  # else the end of the process looks through all objects that are left, three times
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command line (without the program's name) and return its exit code; errors go to stderr as one line."""
    arguments = list(arguments)
    own = arguments[: arguments.index("--")] if "--" in arguments else arguments
    debug = "--debug" in own
    quiet.set("--quiet" in own)
    arguments = [word for word in own if word not in ("--debug", "--quiet")] + arguments[len(own) :]
    try:
        _check_depth(arguments)
        first = next((word for word in arguments if not word.startswith("-")), "")
        root = command(*(topic for topic, words in TOPICS.items() if first in words))
        result = root.main(args=arguments or ["--help"], prog_name="echousd", standalone_mode=False)
        sys.stdout.flush()
        if result == INTERRUPTED:  # typer's way to pass on Ctrl-C
            return _complain("interrupted", INTERRUPTED, debug)
        return result if isinstance(result, int) else 0
    except BrokenPipeError:  # `echousd graph room.usda | head`: nobody reads on
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115  # the interpreter flushes it once more
        return CLOSED_PIPE
    except SystemExit as ended:  # rich and typer end the program themselves in that case
        return CLOSED_PIPE if isinstance(ended.__context__, BrokenPipeError) else int(ended.code or 0)
    except (typer.Abort, KeyboardInterrupt):
        return _complain("interrupted", INTERRUPTED, debug)
    except Exception as error:
        message, code = _explained(error)
        lines = getattr(error, "lines", [message])  # all faults of a graph's file
        for line in lines:
            _complain(line, code, debug and line == lines[-1])
        return code


def _check_depth(arguments: Sequence[str]) -> None:
    """Raises ValueError for a path of more folders than Python follows when it makes them."""
    for word in arguments:
        parts = word.count("/") + 1
        if parts > MOST_PARTS:
            raise ValueError(f"{word[:40]}...: a path of {parts} parts, allowed: {MOST_PARTS}")


@cache
def command(*topics: str) -> Any:
    """The root command (a click group) with the commands of some topics, of all where none is named."""
    app = typer.Typer(
        name="echousd",
        help="Author indoor scenes in USD from semantic scene graphs.",
        epilog="Exit codes: 0 done, 1 a check failed, 2 bad input, 70 a fault of echousd itself.",
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
    )
    app.callback()(_options)
    for topic in topics or TOPICS:
        own = importlib.import_module(f"echousd.cli.{topic}").app
        app.registered_commands += own.registered_commands
        app.registered_groups += own.registered_groups
    root = typer.main.get_command(app)
    prepare(root)
    return root


def _explained(error: Exception) -> tuple[str, int]:
    """One line and the exit code for an error."""
    if hasattr(error, "format_message"):  # a wrong command line
        context = getattr(error, "ctx", None)
        hint = f" (try: {context.command_path} --help)" if context is not None else ""
        return error.format_message().rstrip(".") + hint, BAD_INPUT
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename is not None else ""
        return where + error.strerror, BAD_INPUT
    if isinstance(error, ValueError | OSError | ImportError):
        return str(error), BAD_INPUT
    return f"unexpected {type(error).__name__}: {error} (a fault of echousd; --debug shows where)", OWN_FAULT


def _complain(message: str, code: int, debug: bool) -> int:
    if debug:
        traceback.print_exc()
    typer.secho("error:", fg="red", bold=True, err=True, nl=False)
    typer.echo(f" {one_line(message)}", err=True)
    return code
