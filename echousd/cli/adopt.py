"""`echousd adopt`: a half-furnished stage of somebody's is completed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import Assets, Licenses, Outside, Stretch, Wait


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd adopt loft.usd -o out/loft --room living_room")(adopt)


def adopt(
    stage: Annotated[Path, typer.Argument(help="Stage with labels and bounds.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the room.", show_default=False)],
    room: Annotated[str | None, typer.Option(help="Room type; default: as the stage looks.")] = None,
    add: Annotated[
        list[str] | None,
        typer.Option(help="Object to add, name:category; default: what such a room usually holds and this one lacks."),
    ] = None,
    relate: Annotated[list[str] | None, typer.Option(help='Relation to keep: "lamp close by sofa".')] = None,
    seed: Annotated[int, typer.Option(help="Seed of all randomness, 0 to 2^63 - 1.")] = 0,
    shapes: Annotated[
        str | None, typer.Option(help="Of new objects: parts, sdf, library, guided, boxes; default: parts.")
    ] = None,
    assets: Assets = None,
    stretch: Stretch = 1.15,
    licenses: Licenses = None,
    outside: Outside = None,
    text: Annotated[str, typer.Option(help="What models shall be like, such as 'mid-century oak' (extra: text).")] = "",
    collect: Annotated[
        bool, typer.Option("--collect", help="Take the stage's pieces and models along instead of referring to them.")
    ] = False,
    walls: Annotated[bool, typer.Option("--walls/--no-walls", help="Walls around the floor.")] = False,
    dress: Annotated[str, typer.Option(help="Small things, rugs, curtains: none, some or full.")] = "none",
    force: Annotated[bool, typer.Option("--force", help="Write into a folder that is not ours.")] = False,
    wait: Wait = False,
    json: Annotated[bool, typer.Option("--json", help="Print what was made, faults and seconds as JSON.")] = False,
) -> None:
    """Complete a stage that others began: its furniture stays where and as it is, new pieces stand around it.

    The stage is not written; the room refers to the pieces in it, with --collect to copies. What a person would point
    at in their arrangement is told and left as it is.
    """
    from echousd.cli.generate import progress_bar
    from echousd.cli.output import say
    from echousd.cli.report import report, telling_faults
    from echousd.room.output import check_output, writing

    started = time.perf_counter()
    check_output(output, flat=False, force=force)
    with writing(output, flat=False, force=force, wait=wait), telling_faults(), progress_bar() as listen:
        from echousd.assets.choose import asked_of
        from echousd.room.adopting import adopted, seen_in_theirs
        from echousd.room.pipeline import generate
        from echousd.room.progress import StageTimer
        from echousd.room.room import RoomOptions
        from echousd.room.written import write_room
        from echousd.stage.apart import check_apart

        check_apart(stage)
        wishes = asked_of(assets, stretch=stretch, licences=licenses, collect=collect, text=text, outside=outside or ())
        graph = adopted(stage, room=room, add=add, relate=relate or ())
        made = generate(
            graph, seed=seed, shapes=shapes, assets=wishes, options=RoomOptions(walls=walls, dress=dress),
            progress=listen,
        )  # fmt: skip
        written = write_room(made, output, StageTimer(listen), force=force)
    kept = sum(node.asset is not None for node in graph.nodes)
    seen = seen_in_theirs(made)
    if not json:
        say(f"adopted  {kept} objects of {stage.name}, {len(graph.nodes) - kept} new")
        for one in seen:
            say(f"theirs   {one}")
    more = {"adopted": kept, "new": len(graph.nodes) - kept, "theirs": seen}
    report([written], since=started, json=json, more=more)
