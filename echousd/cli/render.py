"""`echousd render`: a picture of any stage, without a GPU or a display."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import Layout, Room, Written
from echousd.cli.output import check_picture
from echousd.cli.report import say_done

TURN = "turntable"


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd render out/bedroom/bedroom.usda -o top.png --view top")(render)


def render(
    room: Room,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Picture to write (.png; .gif of a turntable); with --cameras a folder.",
            show_default=False,
        ),
    ],
    view: Annotated[
        str,
        typer.Option(
            help="hero (from inside), dollhouse (from above a corner), top, every-camera (those of --cameras side by "
            "side), sheet (six views), turntable (a GIF)."
        ),
    ] = "hero",
    cameras: Annotated[
        bool, typer.Option("--cameras", help="A picture through each camera of the stage, named after it.")
    ] = False,
    quality: Annotated[str, typer.Option(help="fast, or fine: more rays, 1280 pixels across.")] = "fast",
    size: Annotated[int | None, typer.Option(help="Pixels across a picture, else by --quality.")] = None,
    frames: Annotated[int, typer.Option(help="Pictures of a turntable.", min=2, max=360)] = 24,
    colors: Annotated[str, typer.Option(help="materials, or class: one colour per category.")] = "materials",
    layout: Layout = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is no picture of ours.")] = False,
    json: Written = False,
) -> None:
    """Draw a room from inside, from above, from a corner, from all around, or through each of its cameras."""
    from echousd.draw.pictures import gif, png
    from echousd.draw.rendering import QUALITIES, VIEWS, render_cameras, render_turn
    from echousd.draw.rendering import render as draw
    from echousd.folder.found import room_at
    from echousd.stage.files import write_all

    started = time.perf_counter()
    room = room_at(room)
    if quality not in QUALITIES:
        raise ValueError(f"--quality is {quality!r}, allowed: {', '.join(QUALITIES)}")
    usual, rays = QUALITIES[quality]
    size = usual if size is None else size
    if view not in (*VIEWS, TURN):
        raise ValueError(f"--view is {view!r}, allowed: {', '.join((*VIEWS, TURN))}")
    if cameras:
        if view != "hero":
            raise ValueError(f"--view is {view!r}, which --cameras does not use; leave one of them out")
        if output.suffix.lower() == ".png":
            raise ValueError(f"{output}: with --cameras the output is a folder, a picture for each camera")
        drawn = render_cameras(room, size=size, colors=colors, rays=rays, layout=layout)
        pictures = {output / f"{name}.png": picture for name, picture in drawn.items()}
        for path in pictures:
            check_picture(path, force=force)
        files = {path: png(picture) for path, picture in pictures.items()}
    else:
        ending = ".gif" if view == TURN else ".png"
        if output.suffix.lower() != ending:
            kind = "a turntable is" if view == TURN else "pictures are"
            raise ValueError(f"{output}: {kind} written as {ending}, found {output.suffix or 'no ending'!r}")
        check_picture(output, force=force)
        if view == TURN:
            turn = render_turn(room, frames=frames, size=size, colors=colors, rays=rays, layout=layout)
            files = {output: gif(turn)}
        else:
            files = {output: png(draw(room, view=view, size=size, colors=colors, rays=rays, layout=layout))}
    write_all(files)
    say_done(json, list(files), started, map(str, files))
