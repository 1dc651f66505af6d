"""`echousd render`: a picture of any stage, without a GPU or a display."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.output import check_picture, say


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd render out/bedroom/bedroom.usda -o top.png --view top")(render)


def render(
    room: Annotated[Path, typer.Argument(help="Room (.usda, .usdc, .usd, .usdz).", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Picture to write (.png).", show_default=False)],
    view: Annotated[str, typer.Option(help="top, perspective, eye or every-camera.")] = "perspective",
    size: Annotated[int, typer.Option(help="Pixels on each side.")] = 512,
    colors: Annotated[str, typer.Option(help="materials, or class: one colour per category.")] = "materials",
    layout: Annotated[int | None, typer.Option(help="Which layout; default: the one it shows.", min=0)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is no picture of ours.")] = False,
) -> None:
    """Draw a room from above, from a corner, from inside, or through each of its cameras."""
    import io

    from PIL.PngImagePlugin import PngInfo

    from echousd.render import render_file
    from echousd.stage.files import write_whole

    if output.suffix.lower() != ".png":
        raise ValueError(f"{output}: pictures are written as .png, found {output.suffix or 'no ending'!r}")
    check_picture(output, force=force)
    buffer, mark = io.BytesIO(), PngInfo()
    mark.add_text("Software", "echousd")
    render_file(room, view=view, size=size, colors=colors, layout=layout).save(buffer, "PNG", pnginfo=mark)
    write_whole(output, buffer.getvalue())
    say(str(output))
