"""`echousd export`: a room as one file for other software."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import Layout, Room, Written
from echousd.cli.report import say_done


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd export out/bedroom/bedroom.usda -o bedroom.usdz")(export)


def export(
    room: Room,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="A .usdz, .glb, .usda or .usdc; a folder with --for.", show_default=False),
    ],
    for_: Annotated[
        str | None,
        typer.Option(
            "--for", help="sceneeval: its sceneState, a glb for every object; habitat: a data set of the room or home."
        ),
    ] = None,
    arkit: Annotated[
        bool, typer.Option("--arkit", help="usdz for Apple's viewers: a usdc inside, Y up, without lights and graph.")
    ] = False,
    search: Annotated[
        list[Path] | None,
        typer.Option(help="Folder besides the room's own whose files may be taken along; may be repeated."),
    ] = None,
    layout: Layout = None,
    physics: Annotated[
        bool | None,
        typer.Option(
            "--physics/--no-physics", help="Bodies, colliders and scene, or none of it; default: in flat USD alone."
        ),
    ] = None,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Images, or plain colours alone (MuJoCo reads no JPEG).")
    ] = True,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is in the way.")] = False,
    json: Written = False,
) -> None:
    """Write a room as one file: usdz for the web or ARKit, glb, or flat USD.

    Readers that compose no layers, as three.js and tinyusdz, find nothing in a room's root layer: they need this file.
    Those that ignore purposes draw its colliders: --no-physics.
    """
    from echousd.exporting import export as write
    from echousd.exporting.habitat import export_habitat
    from echousd.exporting.sceneeval import export_sceneeval
    from echousd.folder.found import room_at

    started = time.perf_counter()
    room = room_at(room)
    if for_ is not None:
        others: dict[str, Callable[[Path, Path], list[Path]]] = {
            "sceneeval": export_sceneeval,
            "habitat": export_habitat,
        }
        if for_ not in others:
            raise ValueError(f"--for is {for_!r}, allowed: {', '.join(others)}")
        written = others[for_](room, output)
        say_done(json, written, started, [str(written[0])])
        return
    path = write(
        room, output, arkit=arkit, force=force, search=search or (), layout=layout, physics=physics, pictures=pictures
    )
    say_done(json, [path], started, [str(path)])
