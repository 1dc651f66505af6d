"""`echousd export`, `render`, `convert`: a room as one file or a picture; a published checkpoint as one file."""

from pathlib import Path
from typing import Any

import typer

from echomodel.files import check_free
from echousd.cli.options import AsJson, Layout, Replace, ReplacePicture, Room, Written, documented_command
from echousd.cli.output import check_picture, say_done

app = typer.Typer()


@documented_command(app, "export")
def export(
    room: Room, output: Path, reader: str | None = None, arkit: bool = False, search: list[Path] | None = None,
    layout: Layout = None, physics: bool | None = None, pictures: bool = True, force: Replace = False,
    json: Written = False,
) -> None:  # fmt: skip
    """Write a room as one file: usdz for the web or ARKit, glb, or flat USD.

    Readers that compose no layers, as three.js and tinyusdz, find nothing in a room's root layer: they need this file.
    Those that ignore purposes draw its colliders: --no-physics.
    """
    from echousd.exporting.formats import export as write

    path = write(
        room, output, reader=reader, arkit=arkit, force=force, search=search or (), layout=layout, physics=physics,
        pictures=pictures,
    )  # fmt: skip
    say_done(json, [path], [str(path)])


TURN = "turntable"


@documented_command(app, "render")
def render(
    room: Room, output: Path, view: str = "hero", cameras: bool = False, quality: str = "fast",
    size: int | None = None, frames: int = 24, colors: str = "materials", layout: Layout = None,
    light: str | None = None, force: ReplacePicture = False, json: Written = False,
) -> None:  # fmt: skip
    """Draw a room from inside, from above, from a corner, from all around, or through each of its cameras."""
    from echousd.draw.from_files import render as draw
    from echousd.draw.from_files import render_cameras, render_turn
    from echousd.draw.pictures import gif, png
    from echousd.draw.rendering import QUALITIES, VIEWS
    from echousd.stage.files import write_all

    if quality not in QUALITIES:
        raise ValueError(f"--quality is {quality!r}, allowed: {', '.join(QUALITIES)}")
    usual, rays = QUALITIES[quality]
    size = usual if size is None else size
    asked: Any = {"size": size, "colors": colors, "rays": rays, "layout": layout, "light": light}
    if view not in (*VIEWS, TURN):
        raise ValueError(f"--view is {view!r}, allowed: {', '.join((*VIEWS, TURN))}")
    if cameras:
        if view != "hero":
            raise ValueError(f"--view is {view!r}, which --cameras does not use; leave one of them out")
        if output.suffix.lower() == ".png":
            raise ValueError(f"{output}: with --cameras the output is a folder, a picture for each camera")
        drawn = render_cameras(room, **asked)
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
            turn = render_turn(room, frames=frames, **asked)
            files = {output: gif(turn)}
        else:
            files = {output: png(draw(room, view=view, **asked))}
    write_all(files)
    say_done(json, list(files), map(str, files))


@documented_command(app, "convert")
def convert(
    source: Path, output: Path, bounds: Path | None = None, classes: Path | None = None, force: Replace = False,
    json: AsJson = False,
) -> None:  # fmt: skip
    """Convert a published EchoScene, EchoLayout or VQ-VAE checkpoint.

    Sizes and switches are read off the parameter names. Nothing in the file is executed: it is refused if it holds
    anything but tensors and numbers. The result carries config, vocabulary and box statistics.
    """
    if output.suffix != ".safetensors":
        raise ValueError(f"{output}: the output's name must end by .safetensors")
    check_free(output, force=force)
    from echoscene import checkpoint

    statistics = checkpoint.read_bounds(bounds) if bounds else None
    names = classes.read_text("utf-8").split("\n") if classes else None
    names = [name.strip() for name in names if name.strip()] if names else None
    config = checkpoint.convert(source, output, classes=names, statistics=statistics)
    parts = [name for name in ("encoder", "layout", "shape", "vqvae") if getattr(config, name) is not None]
    echo = config.layout or config.shape
    lines = [f"{output}: {', '.join(parts)}, {output.stat().st_size / 1e6:.1f} MB"]
    if config.encoder:
        timed = "with" if echo and echo.time_in_echo else "without"
        lines.append(f"{config.encoder.classes} classes, {timed} time embedding in the echo")
    if config.layout and statistics is None:
        lines.append("no box statistics: sampling boxes needs a conversion with --bounds")
    has = {"parts": parts, "bytes": output.stat().st_size, "boxes": statistics is not None}
    say_done(json, [output], lines, {**has, "classes": config.encoder.classes if config.encoder else None})
