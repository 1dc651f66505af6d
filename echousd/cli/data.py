"""`echousd data`: make data sets, look at rooms, compare them with real ones, convert them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echousd.cli.output import say_json

if TYPE_CHECKING:
    from echomodel.metrics.report import Row

data_app = typer.Typer(help="Rooms and furniture to learn from.", no_args_is_help=True)

Seed = Annotated[int, typer.Option(help="Seed of the world; equal seeds give equal bytes.")]
Rooms = Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")]


def register(app: typer.Typer) -> None:
    """Add the topic."""
    app.add_typer(data_app, name="data")


@data_app.command("build")
def build(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the data set.")],
    recipe: Annotated[str, typer.Option(help="smoke (seconds), packed (at most 40 MB) or full.")] = "smoke",
    seed: Seed = 0,
) -> None:
    """Make rooms and shapes to train on; run again to continue a build that was stopped.

    Example: echousd data build --recipe packed --seed 1 -o data/packed
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from echomodel.data.build import build_data
    from echousd.cli.terminal import Terminal

    console = Terminal(stderr=True)
    columns = (TextColumn("{task.description:8}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    told: dict[str, int] = {}
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        tasks: dict = {}

        def report(part: str, done: int, total: int) -> None:
            if part not in tasks:
                tasks[part] = bar.add_task(part, total=total)
            bar.update(tasks[part], completed=done, total=total)
            if not console.is_terminal and done * 10 // total > told.get(part, 0):
                told[part] = done * 10 // total
                console.print(f"{part} {done}/{total}")

        rooms, shapes = build_data(out, recipe, seed, report)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) / 1e6
    console.print(f"{out}: {len(rooms)} rooms, {len(shapes)} shapes, {size:.1f} MB")


@data_app.command("rooms")
def rooms_command(
    out: Annotated[Path, typer.Option("--out", "-o", help="Rooms file (JSON).")],
    count: Annotated[int, typer.Option(help="Number of rooms.")] = 100,
    seed: Seed = 0,
    room: Annotated[str | None, typer.Option(help="Room type; default a mixture.")] = None,
) -> None:
    """Generate rooms into a rooms file.

    Example: echousd data rooms --count 50 --room bedroom -o bedrooms.json
    """
    from echomodel.roomboxes import write_rooms
    from echomodel.rooms import generate_rooms
    from echomodel.vocabulary import vocabulary

    kind = None if room is None else vocabulary().room_type(room).name
    write_rooms(out, generate_rooms(count, seed, room_type=kind))


@data_app.command("plot")
def plot(
    rooms: Rooms,
    out: Annotated[Path, typer.Option("--out", "-o", help="Picture file.")],
    limit: Annotated[int, typer.Option(help="Number of rooms.")] = 50,
    columns: Annotated[int, typer.Option(help="Rooms in a row.", min=1, max=1000)] = 10,
    room: Annotated[str | None, typer.Option(help="Only rooms of this type.")] = None,
    labels: Annotated[bool, typer.Option(help="Write the categories.")] = True,
) -> None:
    """Draw rooms from above: rectangles coloured per class, a red line to each front.

    Example: echousd data plot rooms.json -o rooms.png --limit 20 --room bedroom
    """
    from echomodel.data.roomset import load_rooms, rooms_of_type
    from echomodel.data.sheet import plot_rooms

    found = load_rooms(rooms)
    if room is not None:
        found = rooms_of_type(found, room, rooms)
    plot_rooms(found[:limit], out, columns=columns, labels=labels)


@data_app.command("report")
def report(
    rooms: Annotated[Path | None, typer.Argument(help="Rooms file or folder; default: newly generated rooms.")] = None,
    real: Annotated[Path | None, typer.Option(help="Rooms to compare with; default: 896 real ones.")] = None,
    count: Annotated[int, typer.Option(help="Number of rooms to generate.")] = 2000,
    seed: Seed = 0,
    worst: Annotated[int, typer.Option(help="Rows to show, the most distant first; 0 = all.")] = 40,
    section: Annotated[str | None, typer.Option(help="Only sections that begin so, such as pair.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare rooms with real ones, figure by figure, the most distant first.

    The distance of shares is their difference, that of lengths the difference over the real range.

    Example: echousd data report --count 2000 --worst 20
    """
    from echomodel.data.roomset import load_rooms
    from echomodel.metrics.report import compare, left_out, section_means
    from echomodel.rooms import generate_rooms

    drawn = generate_rooms(count, seed) if rooms is None else load_rooms(rooms)
    others = None if real is None else load_rooms(real)
    rows = compare(drawn, others)
    chosen = sorted((r for r in rows if r.section.startswith(section or "")), key=lambda row: -row.distance)
    _print_rows(rows, chosen[: worst or None], section_means(rows), left_out(drawn, others), json_out)


def _print_rows(rows: list[Row], shown: list[Row], means: dict[str, float], silent: list[str], as_json: bool) -> None:
    if as_json:
        from dataclasses import asdict

        say_json({"mean_distance": means, "left_out": silent, "rows": [asdict(row) for row in rows]})
        return
    from rich.table import Table

    from echousd.cli.terminal import Terminal

    console = Terminal(width=None if Terminal().is_terminal else 150)
    table = Table("section", "figure", "here", "real", "distance", box=None)
    for row in shown:
        ours, theirs = (" ".join(f"{v:.2f}" for v in values) for values in (row.ours, row.real))
        table.add_row(row.section, row.name, ours, theirs, f"{row.distance:.3f}")
    console.print(table)
    for line in silent:
        console.print(f"left out   {line}")
    console.print("mean distance: " + ", ".join(f"{name} {value:.3f}" for name, value in means.items()))
