"""Options that several commands have in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

AsJson = Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for another process that writes the folder.")]
Weights = Annotated[Path | None, typer.Option(help="Weights file or folder; default: those that ship.")]
Assets = Annotated[Path | None, typer.Option(help="Index of a library (assets index).", show_default=False)]
Outside = Annotated[
    list[Path] | None,
    typer.Option(
        "--allow-outside",
        help="Folder in which models may lie besides those of the graph and of the index; may be repeated.",
        show_default=False,
    ),
]
Stretch = Annotated[float, typer.Option(help="How much models may be stretched.", min=1, max=4)]
Licenses = Annotated[
    str | None, typer.Option(help="Licences of models that are allowed, such as CC0,CC-BY; default: all.")
]
