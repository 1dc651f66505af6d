"""`echousd`: gathers the commands of all topics and turns errors into one line and an exit code."""

from __future__ import annotations

import importlib

import typer

app = typer.Typer(
    name="echousd",
    help="Author indoor scenes in USD from semantic scene graphs.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)

# Each topic's module defines `register(app)`; it must not import torch or pxr at module level (start-up time).
TOPICS = ()


def main() -> None:
    """Entry point of the `echousd` command."""
    for topic in TOPICS:
        importlib.import_module(f"echousd.cli.{topic}").register(app)
    app()
