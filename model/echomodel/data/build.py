"""Data recipes: the rooms and shapes that training reads, made from a seed alone."""

from __future__ import annotations

import os
from pathlib import Path

from echomodel.data.roomset import RoomSet, build_rooms
from echomodel.data.shapeset import ShapeSet, build_shapes
from echomodel.files import check_ours, write_json
from echomodel.progress import StageListener, StepListener
from echomodel.rooms.generator import STYLES

# labelled rooms, styles in which the set has all categories, and the share of the rooms that are halls
RECIPES = {"smoke": (64, 2, 0.0), "packed": (12_000, 160, 0.0), "full": (30_000, STYLES, 0.12)}


def build_data(
    directory: str | os.PathLike[str], recipe: str, seed: int, progress: StageListener | None = None
) -> tuple[RoomSet, ShapeSet]:
    """Make `directory/rooms` and `directory/shapes`; a build that was stopped continues, a finished one is kept.

    Arguments:
        directory: folder of the data set.
        recipe: `smoke` (seconds, for tests), `packed` (at most 40 MB) or `full`.
        seed: seed of the world: equal seeds give equal bytes.
        progress: called with (part, done, in all).

    Raises ValueError for an unknown recipe, or a folder that was begun with another recipe or seed.
    """
    if recipe not in RECIPES:
        raise ValueError(f"unknown recipe {recipe!r}: allowed are {', '.join(RECIPES)}")
    (count, styles, halls), folder = RECIPES[recipe], Path(directory)

    check_ours(folder, "data set", "data.json", "rooms/plan.json")

    def report(part: str) -> StepListener | None:
        return None if progress is None else lambda done, total: progress(part, done, total)

    rooms = build_rooms(folder / "rooms", count, seed, styles, report("rooms"), halls=halls)
    shapes = build_shapes(folder / "shapes", styles, seed, report("shapes"))
    note = {"recipe": recipe, "seed": seed, "rooms": len(rooms), "shapes": len(shapes), "styles": styles}
    write_json(folder / "data.json", note)
    return rooms, shapes
