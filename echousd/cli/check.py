"""`echousd check`: relations kept, collisions, placement and USD validity of a room."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.output import plain_json, safe


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(
        epilog="Example: echousd check out/bedroom/bedroom.usda  (exit code 0: good, 1: faults, 2: not a room)"
    )
    def check(
        room: Annotated[Path, typer.Argument(help="Room to check (.usda, .usdc, .usd, .usdz).", show_default=False)],
        json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
        rules: Annotated[str, typer.Option("--rules", help="Rules of the relations: strict or sgfront.")] = "strict",
    ) -> None:
        """Check a room: relations kept, collisions, placement, and whether its USD is sound."""
        from echousd.check import check_room

        report = check_room(room, rules=rules)
        if json:
            import json as text

            typer.echo(text.dumps(plain_json(report.to_json()), indent=2, allow_nan=False))
        else:
            _show(report)
        if not report.ok:
            raise typer.Exit(1)


def _show(report) -> None:  # type: ignore[no-untyped-def]
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(soft_wrap=True)
    table = Table("", "check", "found", box=None, header_style="bold", pad_edge=False)

    def row(good: bool, check: str, found: str) -> None:
        table.add_row("[green]ok[/]" if good else "[red]no[/]", check, escape(safe(found)))

    unmeasured = sum(judged.margin is None for judged in report.relations)
    measured = len(report.relations) - unmeasured
    row(
        not report.broken,
        "relations",
        f"{report.kept} of {measured} kept" + (f", {unmeasured} not measured" * bool(unmeasured)),
    )
    row(not report.collisions, "collisions", f"{len(report.collisions)} pairs")
    row(not report.placement, "placement", f"{len(report.placement)} misplaced")
    row(not report.errors, "USD", f"{len(report.errors)} errors, {len(report.warnings)} warnings")
    console.print(table)
    for judged in report.broken:
        console.print(
            f"  [red]broken[/]    {escape(safe(str(judged.relation)))} (margin {judged.margin:+.3f})", highlight=False
        )
    for hit in report.collisions:
        console.print(
            f"  [red]collision[/] {escape(safe(f'{hit.first} and {hit.second}'))}, {hit.depth:.3f} m deep",
            highlight=False,
        )
    for wrong in report.placement:
        far = "" if wrong.distance is None else f" by {wrong.distance:.3f} m"
        console.print(f"  [red]placement[/] {escape(safe(wrong.object))} is {wrong.problem}{far}", highlight=False)
    for color, name, faults in (("red", "error", report.errors), ("yellow", "warning", report.warnings)):
        for fault in faults:
            console.print(
                f"  [{color}]{name}[/] {escape(safe(f'{fault.rule} <{fault.prim}>: {fault.message}'))}", highlight=False
            )
