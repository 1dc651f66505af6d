"""`echousd data to-usd`, `from-usd`, `to-sgfront`, `from-sgfront`: rooms of any source to other files and back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    import numpy as np

    from echomodel.roomboxes import RoomBoxes


def register(app: typer.Typer) -> None:
    """Add the commands to `echousd data`."""
    from echousd.cli.data import data_app

    data_app.command("to-usd")(to_usd)
    data_app.command("from-usd")(from_usd)
    data_app.command("to-sgfront")(to_sgfront)
    data_app.command("from-sgfront")(from_sgfront)


def to_usd(
    rooms: Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the stages, one per room.")],
    limit: Annotated[int | None, typer.Option(help="Only the first rooms.")] = None,
    rules: Annotated[str, typer.Option(help="Label rooms without relations: strict, sgfront or none.")] = "strict",
    known: Annotated[bool, typer.Option(help="Leave out objects that the vocabulary does not hold.")] = True,
) -> None:
    """Write rooms of any source as USD stages with their scene graphs.

    Example: echousd data to-usd rooms.json -o stages --limit 10
    """
    from echomodel.data.roomset import load_rooms
    from echomodel.metrics.room_figures import with_known_words
    from echousd.stage.boxes import write_stages

    found = load_rooms(rooms, limit)
    given = [room.relations for room in found]
    if known:
        kept = with_known_words(found)
        # Relations speak of places in the list: they stay valid only where nothing was left out.
        found = [
            room if len(room) < len(old) else _with_relations(room, edges)
            for room, old, edges in zip(kept, found, given, strict=True)
        ]
    write_stages(found, out, None if rules == "none" else rules)


def _with_relations(room: RoomBoxes, relations: np.ndarray | None) -> RoomBoxes:
    from dataclasses import replace

    return replace(room, relations=relations)


def from_usd(
    stages: Annotated[list[Path], typer.Argument(help="Stages, or folders of stages.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Rooms file (JSON).")],
) -> None:
    """Read the rooms of USD stages, whose objects all have boxes, into a rooms file.

    Example: echousd data from-usd stages -o rooms.json
    """
    from echomodel.roomboxes import write_rooms
    from echousd.stage.boxes import read_stages

    found = read_stages(stages)
    if not found:
        raise ValueError(f"{', '.join(map(str, stages))}: no room found")
    write_rooms(out, found)


def to_sgfront(
    rooms: Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the files.")],
    split: Annotated[str, typer.Option(help="trainval or test.")] = "trainval",
    drop: Annotated[float, typer.Option(help="Share of the relations that is left out.")] = 0.5,
    seed: Annotated[int, typer.Option(help="Seed of the dropping.")] = 0,
) -> None:
    """Write rooms in the files of SG-FRONT, labelled by its rules.

    Example: echousd data to-sgfront rooms.json -o sgfront
    """
    from echomodel.data.roomset import load_rooms
    from echomodel.data.sgfront_writer import write_sgfront
    from echomodel.metrics.room_figures import with_known_words

    write_sgfront(out, with_known_words(load_rooms(rooms)), split=split, drop=drop, seed=seed)


def from_sgfront(
    folder: Annotated[Path, typer.Argument(help="Folder with the files of SG-FRONT.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Rooms file (JSON).")],
    room: Annotated[str, typer.Option(help="bedroom, livingroom, diningroom, library or all.")] = "all",
    split: Annotated[str, typer.Option(help="trainval or test.")] = "trainval",
) -> None:
    """Read SG-FRONT into a rooms file, with its relations.

    Example: echousd data from-sgfront 3D-FRONT --split test -o test.json
    """
    from echomodel.data.sgfront import SGFront
    from echomodel.roomboxes import write_rooms

    write_rooms(out, SGFront(folder, room, split).rooms())
