"""`echousd store`: a folder where many rooms keep their assets and images once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import AsJson
from echousd.cli.output import say, say_json

store_app = typer.Typer(no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the topic."""
    app.add_typer(store_app, name="store", help="A folder where many rooms keep their assets and images once.")


@store_app.command("verify", epilog="Example: echousd store verify out/night/store")
def verify(
    folder: Annotated[Path, typer.Argument(help="Folder of the store.", show_default=False)], json: AsJson = False
) -> None:
    """Compare every asset with the hash that it lies under. Exit code 1 where one is not what it was."""
    from echousd.store import Store

    store = Store.open(folder)
    wrong = [store.folder(key) for key in store.wrong()]
    count = len(list(store.keys()))
    if json:
        say_json({"ok": not wrong, "count": count, "changed": list(map(str, wrong))}, indent=2)
    else:
        for changed in wrong:
            say(f"changed  {changed}")
    if wrong:
        raise typer.Exit(1)
    if not json:
        say(f"ok       {count} assets and images as they were stored")


@store_app.command("gc", epilog="Example: echousd store gc out/night/store out/night --dry-run")
def gc(
    folder: Annotated[Path, typer.Argument(help="Folder of the store.", show_default=False)],
    rooms: Annotated[
        list[Path] | None, typer.Argument(help="Folders with all rooms that use it; default: where the store lies.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would go.")] = False,
    older: Annotated[float, typer.Option(help="Minutes since its last use for which an asset stays.", min=0)] = 60.0,
    json: AsJson = False,
) -> None:
    """Remove assets and images that no room below the given folders names."""
    from echousd.store import Store

    store = Store.open(folder)
    places = list(rooms or []) or [folder.resolve().parent]
    for place in places:
        if not place.is_dir():
            raise ValueError(f"{place}: no such folder; allowed: folders with the rooms that use the store")
    before = len(list(store.keys()))
    gone = store.collect(places, grace=older * 60, dry=dry_run)
    if json:
        say_json({"ok": True, "count": before, "gone": list(map(str, gone)), "dry_run": dry_run}, indent=2)
        return
    say(f"{'unused' if dry_run else 'removed':<8} {len(gone)} of {before} assets and images")
