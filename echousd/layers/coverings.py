"""What covers the floor and the walls of a room: wood, carpet or stone, and what one wall has; the seed chooses."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np

from echomodel.openings import direction, edge_lengths, inward_normal
from echomodel.vocabulary import Category, vocabulary
from echousd.room import RoomData
from echousd.shapes.walls import wall_name

THIRD = 3  # one room in so many has the flooring of its type, or of the others blocks instead of boards
FLOORS = {"tiles": ("tiles", "terrazzo")}  # floorings that come in several kinds, equally often
# What one wall may have behind its bed or sofa, and of how many parts of all rooms; the rest has plain walls.
COVERS = {"wallpaper": 2, "paint": 2, "boarding": 1, "brick": 1, "": 6}
NEAR = 0.45  # metres between a wall and the back of what stands at it
HOSTS = ("bed", "sofa")  # roles of what stands before such a wall


def floor_slot(room: RoomData) -> str:
    """The material slot of the room's floor."""
    row = vocabulary().room_type(room.graph.room.type)
    if row.flooring and (row.use or _drawn(room, "floor", THIRD) == 0):
        kinds = FLOORS.get(row.flooring, (row.flooring,))
        return kinds[_drawn(room, "kind of floor", len(kinds))]
    return "floor" if _drawn(room, "blocks", THIRD) else "herringbone"


def covered_walls(room: RoomData) -> dict[str, str]:
    """Name of a wall -> the slot of what covers it, for walls that are not plain: tiles where it is wet, `COVERS`."""
    wet = vocabulary().room_type(room.graph.room.type).use == "wet" and room.options.walls
    if wet and not _behind(room, lambda row: row.task == "cook"):
        return {wall_name(edge): "wall_tiles" for edge in range(len(_corners(room)))}
    if wet:
        return dict.fromkeys(_behind(room, lambda row: row.stands == "row"), "wall_tiles")
    row = vocabulary().known_style(room.graph.room.style)
    words = row.covers if row else [word for word, often in COVERS.items() for _ in range(often)]
    cover = words[_drawn(room, "cover", len(words))] if room.options.walls else ""
    behind = _behind(room, lambda row: row.role in HOSTS)[:1] if cover else []
    return dict.fromkeys(behind, cover)


def _corners(room: RoomData) -> np.ndarray:
    return np.asarray(room.floor if room.graph.room.corners is None else room.graph.room.corners, float)


def _behind(room: RoomData, asked: Callable[[Category], bool]) -> list[str]:
    """Names of the walls behind objects whose rows answer a question with yes, in the order of the graph."""
    corners, out = _corners(room), list[str]()
    size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    for number, node in enumerate(room.graph.nodes):
        if not asked(vocabulary().category(node.category)):
            continue
        front = np.array([np.sin(yaw[number]), np.cos(yaw[number])])
        back = position[number, [0, 2]] - front * size[number, 2] / 2
        for edge, length in enumerate(edge_lengths(corners)):
            inside, off = inward_normal(corners, edge), back - corners[edge]
            before = 0 <= float(off @ direction(corners, edge)) <= length  # not beside it, before another wall in line
            if length > 1.0 and front @ inside > 0.97 and before and abs(float(off @ inside)) < NEAR:
                out.append(wall_name(edge))
                break
    return out


def _drawn(room: RoomData, what: str, among: int) -> int:
    """A number below `among` that the seed draws for a room."""
    key = f"{room.provenance.seed} {what} {room.graph.room.type}".encode()
    return int.from_bytes(hashlib.blake2b(key, digest_size=4).digest(), "big") % among
