"""`--quiet` on every command: nothing but errors, warnings and the data that another option asks for."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from functools import wraps
from typing import Annotated, Any, TextIO

import typer

HELP = "Print errors and warnings alone, and what --json asks for."
DATA = ("--json", "--yaml", "--dot", "--schema")  # options that ask for data on stdout


def add_quiet(command: Any) -> None:
    """Give a command, or every command below a click group, the flag `--quiet`; exit codes stay what they are."""
    below = getattr(command, "commands", None)
    for each in (below or {}).values():
        add_quiet(each)
    if below is None:
        data = [option.name for option in command.params if set(option.opts) & set(DATA)]
        command.params.append(_option())
        command.callback = _hushed(command.callback, data)


def _option() -> Any:
    """The flag as typer makes it of a function's argument."""

    def flag(quiet: Annotated[bool, typer.Option("--quiet", help=HELP)] = False) -> None: ...

    alone = typer.Typer(add_completion=False)
    alone.command()(flag)
    return typer.main.get_command(alone).params[0]


def _hushed(callback: Callable[..., Any], data: list[str]) -> Callable[..., Any]:
    @wraps(callback)
    def call(*values: Any, quiet: bool = False, **options: Any) -> Any:
        if not quiet:
            return callback(*values, **options)
        with silence(stdout=not any(options.get(name) for name in data)):
            return callback(*values, **options)

    return call


@contextmanager
def silence(*, stdout: bool) -> Iterator[None]:
    """Drop what is printed on stderr but warnings, and on stdout if wanted."""
    from echousd.cli.output import errors_to

    errors = sys.stderr

    def warn(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        errors.write(warnings.formatwarning(message, category, filename, lineno, line))

    with open(os.devnull, "w") as nowhere, warnings.catch_warnings(), ExitStack() as held:  # noqa: PTH123
        warnings.showwarning = warn
        held.enter_context(errors_to(errors))
        held.enter_context(redirect_stderr(nowhere))
        if stdout:
            held.enter_context(redirect_stdout(nowhere))
        yield
