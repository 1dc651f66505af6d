"""`echousd render`: a picture of any stage, without a GPU or a display."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echousd.cli.output import check_picture, say
from echousd.cli.report import say_written

if TYPE_CHECKING:
    from PIL import Image


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd render out/bedroom/bedroom.usda -o top.png --view top")(render)


def render(
    room: Annotated[Path, typer.Argument(help="Room (.usda, .usdc, .usd, .usdz) or its folder.", show_default=False)],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="Picture to write (.png); with --cameras a folder.", show_default=False),
    ],
    view: Annotated[
        str, typer.Option(help="top, perspective, eye, or every-camera: those of --cameras side by side.")
    ] = "perspective",
    cameras: Annotated[
        bool, typer.Option("--cameras", help="A picture through each camera of the stage, named after it.")
    ] = False,
    size: Annotated[int, typer.Option(help="Pixels on each side.")] = 512,
    colors: Annotated[str, typer.Option(help="materials, or class: one colour per category.")] = "materials",
    layout: Annotated[int | None, typer.Option(help="Which layout; default: the one it shows.", min=0)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is no picture of ours.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print what was written and seconds as JSON.")] = False,
) -> None:
    """Draw a room from above, from a corner, from inside, or through each of its cameras."""
    from echousd.rendering import render as draw
    from echousd.rendering import render_cameras
    from echousd.room.found import room_at
    from echousd.stage.files import write_all

    started = time.perf_counter()
    room = room_at(room)
    if cameras:
        if view != "perspective":
            raise ValueError(f"--view is {view!r}, which --cameras does not use; leave one of them out")
        if output.suffix.lower() == ".png":
            raise ValueError(f"{output}: with --cameras the output is a folder, a picture for each camera")
        drawn = render_cameras(room, size=size, colors=colors, layout=layout)
        pictures = {output / f"{name}.png": picture for name, picture in drawn.items()}
        for path in pictures:
            check_picture(path, force=force)
    else:
        if output.suffix.lower() != ".png":
            raise ValueError(f"{output}: pictures are written as .png, found {output.suffix or 'no ending'!r}")
        check_picture(output, force=force)
        pictures = {output: draw(room, view=view, size=size, colors=colors, layout=layout)}
    write_all({path: _png(picture) for path, picture in pictures.items()})
    if json:
        say_written(list(pictures), started)
        return
    for path in pictures:
        say(str(path))


def _png(picture: Image.Image) -> bytes:
    """The picture's file, which says that it is ours."""
    import io

    from PIL.PngImagePlugin import PngInfo

    buffer, mark = io.BytesIO(), PngInfo()
    mark.add_text("Software", "echousd")
    picture.save(buffer, "PNG", pnginfo=mark)
    return buffer.getvalue()
