"""`echousd assets`: libraries of other people's furniture."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import AsJson
from echousd.cli.report import say_done

assets_app = typer.Typer(
    help="Libraries of furniture: index them, look through them; a room's own as packages.", no_args_is_help=True
)
SHOWN = 20  # faults that are told; the table holds all


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.add_typer(assets_app, name="assets")


@assets_app.command(epilog="Example: echousd assets index ~/models -o models.parquet")
def index(
    folders: Annotated[list[Path], typer.Argument(help="Folders of models, or libraries.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="The index (.parquet).", show_default=False)],
    workers: Annotated[int, typer.Option(help="Processes; 0: one for each core.", min=0, max=256)] = 0,
    table: Annotated[
        Path | None, typer.Option(help="Table of corrections; default: beside the index, where there is one.")
    ] = None,
    descriptors: Annotated[
        bool, typer.Option("--descriptors", help="Also say what each shape is like, for generate --shapes guided.")
    ] = False,
    json: AsJson = False,
) -> None:
    """Index a library: what its models are, how large, where their front is, and whose they are.

    Models that did not change since the last run are not read again. What cannot be used is listed.
    """
    from rich.console import Console
    from rich.progress import Progress

    from echousd.assets.index import index as make

    if table is not None and not table.is_file():
        raise ValueError(f"{table}: no such file, allowed: a table that `echousd assets review` wrote")
    started, console = time.perf_counter(), Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("Reading the models", total=None)
        done = make(
            folders,
            output,
            workers=workers or os.cpu_count() or 1,
            table=table or output.with_suffix(".csv"),
            descriptors=descriptors,
            progress=lambda count, of: bar.update(task, completed=count, total=of),
        )
    counts = {"models": done.models, "usable": done.usable, "read": done.read}
    lines = [f"left out {fault}" for fault in done.faults[:SHOWN]]
    if len(done.faults) > SHOWN:
        lines.append(f"left out {len(done.faults) - SHOWN} more: echousd assets review {output}")
    lines.append(f"index    {output}: {done.models} models, {done.usable} usable, {done.read} read")
    for folder in folders:
        if not folder.resolve().is_relative_to(output.resolve().parent):
            lines.append(f"note     {folder} is not below the index: generate asks for --allow-outside {folder}")
    say_done(json, [output], started, lines, {**counts, "left_out": list(map(str, done.faults))})


@assets_app.command(epilog="Example: echousd assets review models.parquet")
def review(
    library: Annotated[Path, typer.Argument(help="Index (.parquet).", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder; default: INDEX_review, beside it.")
    ] = None,
    json: AsJson = False,
) -> None:
    """Write what there is to look at and to correct: a page, a sheet of pictures for each category, and the table.

    The table lies beside the index; what it says counts when the library is indexed again.
    """
    from echousd.assets.index import read_corrections, write_table
    from echousd.assets.review import left_out, write_page, write_sheets
    from echousd.assets.table import read_library

    started, found = time.perf_counter(), read_library(library)
    records = list(found.records.values())
    folder = output or library.with_name(f"{library.stem}_review")
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: is a file, the output must be a folder")
    sheets = write_sheets(folder, records)
    write_page(folder / "review.html", records)
    table = library.with_suffix(".csv")
    write_table(table, records, read_corrections(table) if table.exists() else None)
    reasons = {reason: len(members) for reason, members in left_out(records).items()}
    page = folder / "review.html"
    lines = [
        *(f"left out {count}: {reason}" for reason, count in reasons.items()),
        f"page     {page}",
        f"sheets   {len(sheets)} in {folder}",
        f"table    {table}: correct it and run echousd assets index again",
    ]
    say_done(json, [page, *sheets, table], started, lines, {"models": len(records), "left_out": reasons})


@assets_app.command(epilog="Example: echousd assets pack out/bedroom -o packages")
def pack(
    room: Annotated[Path, typer.Argument(help="Room, or its folder.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the packages.", show_default=False)],
    asset: Annotated[list[str] | None, typer.Option(help="Name of an asset; may be repeated; default: all.")] = None,
    author: Annotated[str, typer.Option(help="Who is told as the author.")] = "EchoUSD",
    force: Annotated[bool, typer.Option("--force", help="Replace packages that are there.")] = False,
    json: AsJson = False,
) -> None:
    """Write a room's furniture as packages for SimReady hosts: Z up, payload folder, picture, provenance.

    Needs the extra render.
    """
    from echousd.folder.found import room_at
    from echousd.layers.simready import pack as write

    started = time.perf_counter()
    done = write(room_at(room), output, names=asset or (), author=author, force=force)
    lines = [f"left out {sentence}" for sentence in done.left]
    lines += [f"package  {path}" for path in done.layers]
    lines += [f"note     {sentence}" for sentence in done.hangs]
    say_done(json, list(done.layers), started, lines, {"left_out": list(done.left), "hangs": list(done.hangs)})
