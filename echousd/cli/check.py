"""`echousd check`: relations kept, collisions, placement, living rules and USD validity of a room."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from echousd.cli.options import documented_command
from echousd.cli.output import counted, one_line, safe, say, say_json

if TYPE_CHECKING:
    from echousd.checks import CheckReport
    from echousd.home.check import HomeReport

app = typer.Typer()


@documented_command(app, "check")
def check(
    room: list[Path], json: bool = False, rules: str = "strict", layout: int | None = None, strict: bool = False,
    settle: bool = False,
) -> None:  # fmt: skip
    """Check rooms: relations, collisions, placement, living rules in all their layouts, and their USD.

    Of several rooms each gets a line, with --json an entry of one list, those that cannot be read as well.
    """
    from echomodel.rules import rule_set
    from echousd.folder.found import rooms_at

    rule_set(rules)  # known, before each room tells that it is not
    found = [path for place in room for path in rooms_at(place)]
    reports = [_one(path, json, rules, layout, strict, settle, alone=len(found) == 1) for path in found]
    unread = sum("error" in report for _, report in reports)
    if json:
        say_json(
            reports[0][1]
            if len(found) == 1
            else [{"room": str(p), **report} for p, (_, report) in zip(found, reports, strict=True)],
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
    from echousd.stage.files import open_stage
    from echousd.stage.read import is_home

    try:
        stage = open_stage(room)
        if is_home(stage):  # what a single room does not need is not loaded to see that it is one
            from echousd.home.check import check_home

            home = check_home(room, rules=rules, layout=layout, settle=settle)
            if home is not None:
                if not json:
                    _show(*_of_home(home, strict))
                return home.good(strict=strict), home.to_json()
        report = checked(stage, rules=rules, layout=layout, settle=settle)
    except (ValueError, OSError) as error:
        if alone:
            raise
        why = str(error).removeprefix(f"{room}: ")
        if not json:
            say(f"no  {room}  {one_line(why)}")
        return False, {"ok": False, "error": why}
    good = report.good(strict=strict)
    if not json and alone:
        _show(*_of_room(report, strict))
    elif not json:
        say(f"{'ok' if good else 'no'}  {room}{_seen(report)}")
    return good, report.to_json()


def _seen(report: CheckReport) -> str:
    """What is wrong in a room, in a few words."""
    seen = [counted(len(report.errors), "USD error")] * bool(report.errors)
    for each in report.layouts:
        counts = {"broken": each.broken, "colliding": each.collisions, "misplaced": each.placement}
        seen += [f"{each.name} {len(what)} {word}".strip() for word, what in counts.items() if what]
    seen += [f"{rest.layout} {len(rest.restless)} restless".strip() for rest in report.settled or () if not rest.ok]
    return f"  {', '.join(seen)}" if seen else ""


Row = tuple[str, str, str]  # ok, no or !!; what was looked at; what was found
Fault = tuple[str, str, str]  # kind, what is wrong, and the colour that says how bad that is


def _of_home(home: HomeReport, strict: bool) -> tuple[list[Row], list[Fault]]:
    """The home as a whole and each of its rooms, and what is wrong between them."""
    kinds = [kind for kind, _ in home.faults]
    broken, walls, ways = (kinds.count(kind) for kind in ("broken", "walls", "ways"))
    rows = [
        (_mark(not broken), "plan", f"{home.relations - broken} of {home.relations} relations of rooms kept"),
        (_mark(not walls), "walls", f"{walls} faults where rooms meet"),
        (_mark(not ways), "ways", f"{len(home.reached) - ways} of {len(home.reached)} rooms reached from the entrance"),
    ]
    rows += [(_mark(r.good(strict=strict)), "room", f"{name}{_seen(r)}") for name, r in home.rooms.items()]
    return rows, [(kind, says, "red") for kind, says in home.faults]


def _of_room(report: CheckReport, strict: bool) -> tuple[list[Row], list[Fault]]:
    """What was looked at in a room, and what is wrong there."""
    rows: list[Row] = []
    faults: list[Fault] = []
    doubt = ("no", "red") if strict else ("!!", "yellow")
    for layout in report.layouts:
        which, where = (f"{layout.name} ", f"{layout.name}: ") if layout.name else ("", "")
        unmeasured = sum(found.state == "unmeasured" for found in layout.relations)
        kept = f"{layout.kept} of {len(layout.relations) - unmeasured} kept"
        living = f"{counted(len(layout.living), 'thing')} that a person would point at"
        rows += [
            (_mark(not layout.broken), f"{which}relations", kept + f", {unmeasured} not measured" * bool(unmeasured)),
            (_mark(not layout.collisions), f"{which}collisions", counted(len(layout.collisions), "pair")),
            (_mark(not layout.placement), f"{which}placement", f"{len(layout.placement)} misplaced"),
            (doubt[0] if layout.living else "ok", f"{which}living", living),
        ]
        lines = [("broken", f"{one.sentence} (margin {one.margin:+.3f})") for one in layout.broken]
        lines += [("collision", f"{hit.first} and {hit.second}, {hit.depth:.3f} m deep") for hit in layout.collisions]
        for wrong in layout.placement:
            far = "" if wrong.distance is None else f" by {wrong.distance:.3f} m"
            lines.append(("placement", f"{wrong.object} is {wrong.problem}{far}"))
        faults += [(kind, where + text, "red") for kind, text in lines]
        faults += [("living", f"{where}{seen.says} ({seen.rule})", doubt[1]) for seen in layout.living]
    usd = f"{counted(len(report.errors), 'error')}, {counted(len(report.warnings), 'warning')}"
    rows.append((_mark(not report.errors), "USD", usd))
    for kind, colour, found in (("error", "red", report.errors), ("warning", "yellow", report.warnings)):
        faults += [(kind, f"{fault.rule} <{fault.prim}>: {fault.message}", colour) for fault in found]
    for rest in report.settled or ():
        still = len(rest.motions) - len(rest.restless)
        message = f"{still} of {len(rest.motions)} pieces rest for {rest.seconds:g} s"
        rows.append((_mark(rest.ok), f"{rest.layout} settle".strip(), message))
        for motion in rest.restless:
            message = f"{motion.name} moves {motion.shift:.3f} m and {motion.turn:.1f} degrees: {motion.why}"
            faults.append(("restless", message, "red"))
    return rows, faults


def _mark(good: bool) -> str:
    return "ok" if good else "no"


def _show(rows: Sequence[Row], faults: Sequence[Fault]) -> None:
    from rich.table import Table
    from rich.text import Text

    from echousd.cli.terminal import Terminal

    console = Terminal(soft_wrap=True)
    table = Table("", "check", "found", box=None, header_style="bold", pad_edge=False)
    for mark, what, found in rows:
        table.add_row(Text(mark, {"ok": "green", "no": "red", "!!": "yellow"}[mark]), what, found)
    console.print(table)
    for kind, text, colour in faults:
        console.print(Text.assemble("  ", (f"{kind:<9}", colour), f" {safe(text)}"))
