"""`echousd generate`: from a graph to a room on disk."""

import time
from pathlib import Path
from typing import Any

import typer

from echomodel.late import Late
from echousd.cli.options import Force, Made, Outside, Wait, add_room_command
from echousd.cli.output import report, telling_faults

app = typer.Typer()
room_at = Late("echousd.folder.found:room_at")


def generate(
    graph: Path, output: Path, room: str | None = None, flat: bool = False, json: Made = False,
    store: Path | None = None, force: Force = False, wait: Wait = False, outside: Outside = None, **values: Any,
) -> None:  # fmt: skip
    """Generate a room from a scene graph, as layers of USD; of a home, its plan, its rooms and what composes them.

    Of a graph's numbers, lengths are metres in the room's frame (+Y up, the floor at 0), yaw is `90 deg` or radians
    about +Y: at 0 a front looks along +Z.
    """
    from echousd.cli.progress import progress_bar
    from echousd.folder.folder import check_output, writing
    from echousd.options import RoomOptions

    started = time.perf_counter()
    options, graph = RoomOptions(**values), room_at(graph) if graph.is_dir() else graph
    check_output(output, flat=flat, force=force)
    if flat and store:
        raise ValueError(f"--store is {store}, which a file of --flat does not use; leave one of them out")
    from echousd.home.files import load_home

    home = load_home(graph) if graph.is_file() and not (room or flat) else None
    if home is not None:
        from echousd.cli.plan import generate_home

        generate_home(graph, home, output, options, outside or (), force=force, json=json, wait=wait)
        return
    with writing(output, flat=flat, force=force, wait=wait), telling_faults(), progress_bar() as listen:
        from echomodel.progress import StageTimer
        from echousd.make.finished import write_room
        from echousd.make.pipeline import generate as make

        spent = {"imports": time.perf_counter() - started}
        earlier = None if flat else output
        made = make(graph, room=room, options=options, outside=outside or (), earlier=earlier, progress=listen)
        timer = StageTimer(listen)
        written = write_room(made, output, timer, flat=flat, force=force, store=store)
    for stage, seconds in (*timer.seconds.items(), *made.timings.items()):
        spent[stage] = spent.get(stage, 0.0) + seconds
    total = time.perf_counter() - started
    spent |= {"other": total - sum(spent.values()), "total": total}
    more = {"timings": {stage: round(seconds, 3) for stage, seconds in spent.items()}}
    report([written], json=json, more=more)


add_room_command(app, "generate", generate)
