"""`echousd assets`: libraries of other people's furniture; `echousd store`: where many rooms keep assets once."""

import os
from functools import partial
from pathlib import Path

import typer

from echousd.cli.options import AsJson, documented_command
from echousd.cli.output import say_done, say_found

assets_app = typer.Typer(
    help="Libraries of furniture: index them, look through them; a room's own as packages.", no_args_is_help=True
)
app = typer.Typer()
app.add_typer(assets_app, name="assets")
SHOWN = 20  # faults that are told; the table holds all


@documented_command(assets_app, "assets index")
def index(
    folders: list[Path], output: Path, workers: int = 0, table: Path | None = None, descriptors: bool = False,
    json: AsJson = False,
) -> None:  # fmt: skip
    """Index a library: what its models are, how large, where their front is, and whose they are.

    Models that did not change since the last run are not read again. What cannot be used is listed.
    """
    from echousd.assets.index import index as make
    from echousd.cli.progress import progress_bar

    if table is not None and not table.is_file():
        raise ValueError(f"{table}: no such file, allowed: a table that `echousd assets review` wrote")
    with progress_bar() as listen:
        done = make(
            folders, output, workers=workers or os.cpu_count() or 1, table=table or output.with_suffix(".csv"),
            descriptors=descriptors, progress=partial(listen, "models"),
        )  # fmt: skip
    counts = {"models": done.models, "usable": done.usable, "read": done.read}
    lines = [f"left out {fault}" for fault in done.faults[:SHOWN]]
    if len(done.faults) > SHOWN:
        lines.append(f"left out {len(done.faults) - SHOWN} more: echousd assets review {output}")
    lines.append(f"index    {output}: {done.models} models, {done.usable} usable, {done.read} read")
    far = (folder for folder in folders if not folder.resolve().is_relative_to(output.resolve().parent))
    lines += [f"note     {folder} is not below the index: generate asks for --allow-outside {folder}" for folder in far]
    say_done(json, [output], lines, {**counts, "left_out": list(map(str, done.faults))})


@documented_command(assets_app, "assets review")
def review(library: Path, output: Path | None = None, json: AsJson = False) -> None:
    """Write what there is to look at and to correct: a page with a picture of every model, and the table.

    The table lies beside the index; what it says counts when the library is indexed again.
    """
    from echousd.assets.index import by_reason, read_corrections, write_page, write_table
    from echousd.assets.table import read_library

    records = list(read_library(library).records.values())
    page, table = output or library.with_suffix(".html"), library.with_suffix(".csv")
    page.parent.mkdir(parents=True, exist_ok=True)
    write_page(page, records)
    write_table(table, records, read_corrections(table) if table.exists() else None)
    reasons = {reason: len(members) for reason, members in by_reason(records).items()}
    lines = [
        *(f"left out {count}: {reason}" for reason, count in reasons.items()),
        f"page     {page}",
        f"table    {table}: correct it and run echousd assets index again",
    ]
    say_done(json, [page, table], lines, {"models": len(records), "left_out": reasons})


@documented_command(assets_app, "assets pack")
def pack(
    room: Path, output: Path, asset: list[str] | None = None, author: str = "EchoUSD", force: bool = False,
    json: AsJson = False,
) -> None:  # fmt: skip
    """Write a room's furniture as packages for SimReady hosts: Z up, payload folder, picture, provenance.

    Needs the extra render.
    """
    from echousd.folder.found import room_at
    from echousd.layers.simready import pack as write

    layers, left, hangs = write(room_at(room), output, names=asset or (), author=author, force=force)
    lines = [f"left out {sentence}" for sentence in left]
    lines += [f"package  {path}" for path in layers]
    lines += [f"note     {sentence}" for sentence in hangs]
    say_done(json, layers, lines, {"left_out": left, "hangs": hangs})


store_app = typer.Typer(no_args_is_help=True)
app.add_typer(store_app, name="store", help="A folder where many rooms keep their assets and images once.")


@documented_command(store_app, "store verify")
def verify(folder: Path, json: AsJson = False) -> None:
    """Compare every asset with the hash that it lies under. Exit code 1 where one is not what it was."""
    from echousd.store import Store

    store = Store.open(folder)
    wrong = [store.folder(key) for key in store.wrong()]
    count = len(list(store.keys()))
    lines = [f"changed  {place}" for place in wrong] or [f"ok       {count} assets and images as they were stored"]
    say_found(json, {"ok": not wrong, "count": count, "changed": list(map(str, wrong))}, lines, ok=not wrong)


@documented_command(store_app, "store gc")
def gc(
    folder: Path, rooms: list[Path] | None = None, dry_run: bool = False, older: float = 60.0, json: AsJson = False,
) -> None:  # fmt: skip
    """Remove assets and images that no room below the given folders names."""
    from echousd.store import Store

    store = Store.open(folder)
    places = list(rooms or []) or [folder.resolve().parent]
    for place in places:
        if not place.is_dir():
            raise ValueError(f"{place}: no such folder; allowed: folders with the rooms that use the store")
    before = len(list(store.keys()))
    gone = store.collect(places, grace=older * 60, dry=dry_run)
    line = f"{'unused' if dry_run else 'removed':<8} {len(gone)} of {before} assets and images"
    say_found(json, {"ok": True, "count": before, "gone": list(map(str, gone)), "dry_run": dry_run}, [line])
