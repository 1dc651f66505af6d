"""A room, or all rooms of a house, on disk with their pictures, as the command line makes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from echousd.folder.output import writing
from echousd.make.finished import Room
from echousd.make.save import save_layers, write_preview, write_sheet
from echousd.progress import StageTimer

if TYPE_CHECKING:
    from echousd.layers.house import Place


@dataclass(frozen=True, eq=False)
class Written:
    """A room and where it lies.

    Arguments:
        room: what was made. root: its root layer, or the flat file. preview: the picture to look at, None = there is
            none.
    """

    room: Room
    root: Path
    preview: Path | None = None


def write_room(
    room: Room, output: Path, timer: StageTimer, *, flat: bool = False, force: bool = False, store: Path | None = None
) -> Written:
    """Write a room as layers with pictures, or as one flat file without; raises ValueError, see `Room.save`."""
    with timer.stage("write"):
        if flat:
            from echousd.make.flat import save_flat

            return Written(room, save_flat(room, output, force=force))
        root = save_layers(room, output, force=force, store=store)
    if not room.options.preview:
        return Written(room, root)
    with timer.stage("preview"):
        preview = write_preview(root)
        preview = write_sheet(root) or preview
    return Written(room, root, preview)


def write_rooms(
    output: Path, house: Sequence[Place], make: Callable[[str, Path], Written], *, force: bool, wait: bool
) -> tuple[Path, list[Written]]:
    """Every room of a house in a folder of its own, and the layer that composes them.

    Arguments:
        output: folder of the house.
        make: makes and writes the room at a prim path into a folder, which is locked meanwhile.
        force, wait: as for `Room.save`.

    Returns: the house's layer, and the rooms.
    """
    from echousd.layers.house import check_house, write_house

    root = output / f"{output.name}.usda"
    check_house(root, force=force)
    made = []
    for place in house:
        with writing(output / place.name, flat=False, force=force, wait=wait):
            made.append(make(place.path, output / place.name))
    write_house(root, house, {place.name: each.root for place, each in zip(house, made, strict=True)}, force=force)
    return root, made
