"""`--quiet` on every command: nothing but errors, warnings and the data that another option asks for."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from functools import wraps
from inspect import Parameter
from typing import Annotated, Any, TextIO

import typer

from echousd.cli.options import click_options


def _show_all(context: typer.Context, wanted: bool) -> None:
    if wanted:
        for option in context.command.params:
            option.hidden = False  # type: ignore[attr-defined]
        context.command.get_help(context)
        raise typer.Exit


def _flag(name: str, help: str, **more: Any) -> Parameter:
    option = typer.Option(f"--{name.replace('_', '-')}", help=help, **more)
    return Parameter(name, Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, option])


QUIET = _flag("quiet", "Say errors and warnings alone.")
HELP_ALL = _flag("help_all", "Show this with all options.", is_eager=True, callback=_show_all, expose_value=False)
DATA = ("--json", "--yaml", "--dot", "--schema")  # options that ask for data on stdout


def add_quiet(command: Any) -> None:
    """Give a command, or every command below a click group, the flag `--quiet`; exit codes stay what they are."""
    below = getattr(command, "commands", None)
    for each in (below or {}).values():
        add_quiet(each)
    if below is None:
        data = [option.name for option in command.params if set(option.opts) & set(DATA)]
        command.params += click_options(QUIET)
        command.callback = _hushed(command.callback, data)


def add_help_all(command: Any) -> None:
    """Give every command that keeps some of its options off the first page of its help the flag that shows them."""
    for below in getattr(command, "commands", {}).values():
        add_help_all(below)
    if any(getattr(option, "hidden", False) for option in command.params) and not hasattr(command, "commands"):
        command.params += click_options(HELP_ALL)


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
