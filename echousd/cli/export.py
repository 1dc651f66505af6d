"""`echousd export`, `render`, `convert`: a room as one file or a picture; a published checkpoint as one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from echomodel.files import check_free
from echousd.cli.options import AsJson, Layout, Replace, ReplacePicture, Room, Written
from echousd.cli.output import check_picture, say_done

app = typer.Typer()


@app.command(epilog="Example: echousd export out/bedroom/bedroom.usda -o bedroom.usdz")
def export(
    room: Room,
    output: Annotated[Path, typer.Option("-o", "--output", help="A .usdz, .glb, .usda or .usdc; a folder with --for.")],
    reader: Annotated[
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
    force: Replace = False,
    json: Written = False,
) -> None:
    """Write a room as one file: usdz for the web or ARKit, glb, or flat USD.

    Readers that compose no layers, as three.js and tinyusdz, find nothing in a room's root layer: they need this file.
    Those that ignore purposes draw its colliders: --no-physics.
    """
    from echousd.exporting.formats import export as write
    from echousd.folder.found import room_at

    path = write(
        room_at(room), output, reader=reader, arkit=arkit, force=force, search=search or (), layout=layout,
        physics=physics, pictures=pictures,
    )  # fmt: skip
    say_done(json, [path], [str(path)])


TURN = "turntable"


@app.command(epilog="Example: echousd render out/bedroom/bedroom.usda -o top.png --view top")
def render(
    room: Room,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="Picture to write (.png; .gif of a turntable); with --cameras a folder."),
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
    light: Annotated[str | None, typer.Option(help="day, evening or night; else as the room shows.")] = None,
    force: ReplacePicture = False,
    json: Written = False,
) -> None:
    """Draw a room from inside, from above, from a corner, from all around, or through each of its cameras."""
    from echousd.draw.from_files import render as draw
    from echousd.draw.from_files import render_cameras, render_turn
    from echousd.draw.pictures import gif, png
    from echousd.draw.rendering import QUALITIES, VIEWS
    from echousd.folder.found import room_at
    from echousd.stage.files import write_all

    room = room_at(room)
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


@app.command("convert")
def convert(
    source: Annotated[
        Path, typer.Argument(metavar="IN.pth", help="Published checkpoint, a file written by torch.save.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="OUT.safetensors", help="File to write.")],
    bounds: Annotated[
        Path | None,
        typer.Option(metavar="TXT", help="centered_bounds_*_trainval.txt of the data set: box statistics to store."),
    ] = None,
    classes: Annotated[
        Path | None, typer.Option(metavar="TXT", help="Class names in the order of their ids, one a line.")
    ] = None,
    force: Replace = False,
    json: AsJson = False,
) -> None:
    """Convert a published EchoScene, EchoLayout or VQ-VAE checkpoint.

    Sizes and switches are read off the parameter names. Nothing in the file is executed: it is refused if it holds
    anything but tensors and numbers. The result carries config, vocabulary and box statistics.

    Example: echousd convert model2050.pth -o echoscene.safetensors --bounds centered_bounds_all_trainval.txt
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
