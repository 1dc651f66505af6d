"""Data recipes: the rooms and shapes that training reads, made from a seed alone."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from echomodel.data.roomset import RoomSet, build_rooms
from echomodel.data.shapeset import ShapeSet, build_shapes
from echomodel.files import write_json
from echomodel.progress import StageListener, StepListener
from echomodel.rooms.generator import STYLES


@dataclass(frozen=True)
class DataRecipe:
    """What a data set holds: `rooms` labelled rooms, a share of them `halls`; all categories in `styles`
    styles."""

    name: str
    rooms: int
    styles: int
    halls: float = 0.0


RECIPES = {
    recipe.name: recipe
    for recipe in (
        DataRecipe("smoke", 64, 2),
        DataRecipe("packed", 12_000, 160),
        DataRecipe("full", 30_000, STYLES, halls=0.12),
    )
}


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
    chosen, folder = RECIPES[recipe], Path(directory)

    def report(part: str) -> StepListener | None:
        return None if progress is None else lambda done, total: progress(part, done, total)

    rooms = build_rooms(folder / "rooms", chosen.rooms, seed, chosen.styles, report("rooms"), halls=chosen.halls)
    shapes = build_shapes(folder / "shapes", chosen.styles, seed, report("shapes"))
    note = {"recipe": chosen.name, "seed": seed, "rooms": len(rooms), "shapes": len(shapes), "styles": chosen.styles}
    write_json(folder / "data.json", note)
    return rooms, shapes
