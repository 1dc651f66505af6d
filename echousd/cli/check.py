"""`echousd check`: relations kept, collisions, placement, living rules and USD validity of a room."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.output import one_line, safe, say, say_json

if TYPE_CHECKING:
    from rich.console import Console

    from echousd.checks import CheckReport
    from echousd.checks.report import LayoutReport
    from echousd.home.check import HomeReport
    from echousd.settle import SettleReport

app = typer.Typer()


@app.command(epilog="Example: echousd check out/bedroom/bedroom.usda  (exit code 0: good, 1: faults, 2: not a room)")
def check(
    room: Annotated[
        list[Path],
        typer.Argument(help="Rooms (.usda, .usdc, .usd, .usdz), their folders, folders of these.", show_default=False),
    ],
    json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    rules: Annotated[str, typer.Option("--rules", help="Rules of the relations: strict or sgfront.")] = "strict",
    layout: Annotated[int | None, typer.Option(help="Only this layout; default: all.", min=0)] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Broken living rules fail the check, too.")] = False,
    settle: Annotated[
        bool, typer.Option("--settle", help="Simulate two seconds as well: everything must rest (extra: sim).")
    ] = False,
) -> None:
    """Check rooms: relations, collisions, placement, living rules in all their layouts, and their USD.

    Of several rooms each gets a line, with --json an entry of one list, those that cannot be read as well.
    """
    from echomodel.rules import rule_set
    from echousd.folder.found import rooms_at

    rule_set(rules)  # known, before each room tells that it is not
    found = [path for place in room for path in rooms_at(place)]
    reports = [_one(path, json, rules, layout, strict, settle, alone=len(found) == 1) for path in found]
    unread = sum("error" in told for _, told in reports)
    if json:
        say_json(
            reports[0][1]
            if len(found) == 1
            else [{"room": str(p), **told} for p, (_, told) in zip(found, reports, strict=True)],
            indent=2,
        )
    elif len(found) > 1:
        good = sum(ok for ok, _ in reports)
        say(f"{good} of {len(found)} rooms are good" + f", {unread} cannot be read" * bool(unread))
    if unread:
        raise typer.Exit(2)
    if not all(ok for ok, _ in reports):
        raise typer.Exit(1)


def _one(
    room: Path, json: bool, rules: str, layout: int | None, strict: bool, settle: bool, *, alone: bool
) -> tuple[bool, dict[str, Any]]:
    """Check one room and show what was found, in a line unless it is alone: whether it is good, and the report.

    Raises ValueError for one that cannot be read if it is alone; of several, that is its report.
    """
    from echousd.checks import check as checked
    from echousd.home.check import check_home, is_home

    try:
        if is_home(room):
            home = check_home(room, rules=rules, layout=layout, settle=settle)
            if not json:
                _show_home(home, strict)
            return home.good(strict=strict), home.to_json()
        report = checked(room, rules=rules, layout=layout, settle=settle)
    except (ValueError, OSError) as error:
        if alone:
            raise
        why = str(error).removeprefix(f"{room}: ")
        if not json:
            say(f"no  {room}  {one_line(why)}")
        return False, {"ok": False, "error": why}
    good = report.good(strict=strict)
    if not json and alone:
        _show(report, strict)
        _show_settled(report.settled or ())
    elif not json:
        say(f"{'ok' if good else 'no'}  {room}{_seen(report)}")
    return good, report.to_json()


def _show_home(home: HomeReport, strict: bool) -> None:
    """The home as a whole, then a line for each of its rooms."""
    kinds = [kind for kind, _ in home.faults]
    broken, ways = kinds.count("broken"), kinds.count("ways")
    for good, what in (
        (not broken, f"plan     {home.relations - broken} of {home.relations} relations of rooms kept"),
        ("walls" not in kinds, f"walls    {kinds.count('walls')} faults where rooms meet"),
        (not ways, f"ways     {len(home.reached) - ways} of {len(home.reached)} rooms reached from the entrance"),
    ):
        say(f"{'ok' if good else 'no'}  {what}")
    for kind, says in home.faults:
        say(f"    {kind:<8} {says}")
    for name, report in home.rooms.items():
        say(f"{'ok' if report.good(strict=strict) else 'no'}  room     {name}{_seen(report)}")


def _seen(report: CheckReport) -> str:
    """What is wrong in a room, in a few words."""
    seen = [f"{len(report.errors)} USD errors"] * bool(report.errors)
    for each in report.layouts:
        counts = {"broken": each.broken, "colliding": each.collisions, "misplaced": each.placement}
        seen += [f"{each.name} {len(what)} {word}".strip() for word, what in counts.items() if what]
    seen += [f"{rest.layout} {len(rest.restless)} restless".strip() for rest in report.settled or () if not rest.ok]
    return f"  {', '.join(seen)}" if seen else ""


def _show(report: CheckReport, strict: bool) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(soft_wrap=True)
    table = Table("", "check", "found", box=None, header_style="bold", pad_edge=False)

    def row(good: bool, check: str, found: str, bad: str = "[red]no[/]") -> None:
        table.add_row("[green]ok[/]" if good else bad, check, escape(safe(found)))

    for layout in report.layouts:
        which = f"{layout.name} " if layout.name else ""
        unmeasured = sum(found.state == "unmeasured" for found in layout.relations)
        measured = len(layout.relations) - unmeasured
        silent = f", {unmeasured} not measured" * bool(unmeasured)
        row(not layout.broken, f"{which}relations", f"{layout.kept} of {measured} kept{silent}")
        row(not layout.collisions, f"{which}collisions", f"{len(layout.collisions)} pairs")
        row(not layout.placement, f"{which}placement", f"{len(layout.placement)} misplaced")
        seen = f"{len(layout.living)} things that a person would point at"
        row(not layout.living, f"{which}living", seen, "[red]no[/]" if strict else "[yellow]!![/]")
    row(not report.errors, "USD", f"{len(report.errors)} errors, {len(report.warnings)} warnings")
    console.print(table)
    for layout in report.layouts:
        _show_faults(console, layout, strict)
    for color, name, faults in (("red", "error", report.errors), ("yellow", "warning", report.warnings)):
        for fault in faults:
            console.print(
                f"  [{color}]{name}[/] {escape(safe(f'{fault.rule} <{fault.prim}>: {fault.message}'))}", highlight=False
            )


def _show_settled(reports: Sequence[SettleReport]) -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(soft_wrap=True)
    for report in reports:
        which = f"{report.layout} " if report.layout else ""
        mark = "[green]ok[/]" if report.ok else "[red]no[/]"
        rest = len(report.motions) - len(report.restless)
        found = f"{rest} of {len(report.motions)} pieces rest for {report.seconds:g} s"
        console.print(f"{mark}  {which}settle  {found}", highlight=False)
        for motion in report.restless:
            told = f"{motion.name} moves {motion.shift:.3f} m and {motion.turn:.1f} degrees: {motion.why}"
            console.print(f"  [red]restless[/]  {escape(safe(told))}", highlight=False)


def _show_faults(console: Console, layout: LayoutReport, strict: bool) -> None:
    """What is wrong in one layout, a line each."""
    from rich.markup import escape

    def line(kind: str, text: str, colour: str = "red") -> None:
        which = f"{layout.name}: " if layout.name else ""
        console.print(f"  [{colour}]{kind:<9}[/] {escape(safe(which + text))}", highlight=False)

    for found in layout.broken:
        line("broken", f"{found.said} (margin {found.margin:+.3f})")
    for hit in layout.collisions:
        line("collision", f"{hit.first} and {hit.second}, {hit.depth:.3f} m deep")
    for wrong in layout.placement:
        far = "" if wrong.distance is None else f" by {wrong.distance:.3f} m"
        line("placement", f"{wrong.object} is {wrong.problem}{far}")
    for seen in layout.living:
        line("living", f"{seen.says} ({seen.rule})", "red" if strict else "yellow")
