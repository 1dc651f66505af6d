"""`echousd adopt`: a half-furnished stage of somebody's is completed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from echousd.cli.options import Force, Made, Outside, Wait, add_room_command


def register(app: typer.Typer) -> None:
    """Add the command."""
    add_room_command(app, adopt, "echousd adopt loft.usd -o out/loft --room living_room")


def adopt(
    stage: Annotated[Path, typer.Argument(help="Stage with labels and bounds.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the room.", show_default=False)],
    room: Annotated[str | None, typer.Option(help="Room type; default: as the stage looks.")] = None,
    add: Annotated[
        list[str] | None,
        typer.Option(help="Object to add, name:category; default: what such a room usually holds and this one lacks."),
    ] = None,
    relate: Annotated[list[str] | None, typer.Option(help='Relation to keep: "lamp close by sofa".')] = None,
    names: Annotated[bool, typer.Option("--names", help="Names of prims count where labels are missing.")] = False,
    force: Force = False,
    wait: Wait = False,
    outside: Outside = None,
    json: Made = False,
    **given: Any,
) -> None:
    """Complete a stage that others began: its furniture stays where and as it is, new pieces stand around it.

    The stage is not written; the room refers to the pieces in it, with --collect to copies. What a person would point
    at in their arrangement is told and left as it is.
    """
    from echousd.cli.generate import progress_bar
    from echousd.cli.output import say
    from echousd.cli.report import report, telling_faults
    from echousd.folder.output import check_output, writing
    from echousd.options import RoomOptions

    started = time.perf_counter()
    options = RoomOptions(**given)
    check_output(output, flat=False, force=force)
    with writing(output, flat=False, force=force, wait=wait), telling_faults(), progress_bar() as listen:
        from echousd.make.adopting import adopted, seen_in_theirs
        from echousd.make.pipeline import generate
        from echousd.make.written import write_room
        from echousd.progress import StageTimer
        from echousd.stage.apart import check_apart

        check_apart(stage)
        graph = adopted(stage, room=room, add=add, relate=relate or (), names=names)
        made = generate(graph, options=options, outside=outside or (), progress=listen)
        written = write_room(made, output, StageTimer(listen), force=force)
    kept = sum(node.asset is not None for node in graph.nodes)
    seen = seen_in_theirs(made)
    if not json:
        say(f"adopted  {kept} objects of {stage.name}, {len(graph.nodes) - kept} new")
        for one in seen:
            say(f"theirs   {one}")
    more = {"adopted": kept, "new": len(graph.nodes) - kept, "theirs": seen}
    report([written], since=started, json=json, more=more)
