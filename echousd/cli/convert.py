"""`echousd convert`: a published checkpoint as one safetensors file."""

from __future__ import annotations

import time
from pathlib import Path

import typer

from echousd.cli.options import AsJson
from echousd.cli.report import say_done

SOURCE = typer.Argument(..., metavar="IN.pth", help="Published checkpoint, a file written by torch.save.")
OUTPUT = typer.Option(..., "--output", "-o", metavar="OUT.safetensors", help="File to write.")
BOUNDS = typer.Option(
    None, "--bounds", metavar="TXT", help="centered_bounds_*_trainval.txt of the data set: box statistics to store."
)
CLASSES = typer.Option(None, "--classes", metavar="TXT", help="Class names in the order of their ids, one a line.")
FORCE = typer.Option(False, "--force", help="Replace OUT.safetensors if it exists.")


def register(app: typer.Typer) -> None:
    """Add the command to the `echousd` application."""
    app.command("convert")(convert)


def convert(
    source: Path = SOURCE,
    output: Path = OUTPUT,
    bounds: Path | None = BOUNDS,
    classes: Path | None = CLASSES,
    force: bool = FORCE,
    json: AsJson = False,
) -> None:
    """Convert a published EchoScene, EchoLayout or VQ-VAE checkpoint.

    Sizes and switches are read off the parameter names. Nothing in the file is executed: it is refused if it holds
    anything but tensors and numbers. The result carries config, vocabulary and box statistics.

    Example: echousd convert model2050.pth -o echoscene.safetensors --bounds centered_bounds_all_trainval.txt
    """
    started = time.perf_counter()
    if output.suffix != ".safetensors":
        raise ValueError(f"{output}: the output's name must end by .safetensors")
    if output.exists() and not force:
        raise ValueError(f"{output}: exists already (--force replaces it)")
    from echoscene import checkpoint
    from echoscene.checkpoint import read_bounds

    statistics = read_bounds(bounds) if bounds else None
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
    say_done(json, [output], started, lines, {**has, "classes": config.encoder.classes if config.encoder else None})
