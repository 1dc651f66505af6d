"""What covers the floor and the walls of a room: boards, carpet or tiles, and paper on one wall; the seed chooses."""

from __future__ import annotations

import hashlib

import numpy as np

from echomodel.openings import direction, edge_lengths, inward_normal
from echomodel.vocabulary import vocabulary
from echousd.room import RoomData
from echousd.shapes.walls import wall_name

THIRD = 3  # one room in so many has the flooring of its type, or a papered wall
NEAR = 0.45  # metres between a wall and the back of what stands at it
HOSTS = ("bed", "sofa")  # roles of what a papered wall stands behind


def floor_slot(room: RoomData) -> str:
    """The material slot of the room's floor."""
    other = vocabulary().room_type(room.graph.room.type).flooring
    return other if other and _drawn(room, "floor") else "floor"


def papered_wall(room: RoomData) -> str:
    """Name of the wall that has paper, behind the bed or the sofa, "" = none has."""
    if not (room.options.walls and _drawn(room, "paper")):
        return ""
    corners = np.asarray(room.floor if room.graph.room.corners is None else room.graph.room.corners, float)
    size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    for number, node in enumerate(room.graph.nodes):
        if vocabulary().category(node.category).role not in HOSTS:
            continue
        front = np.array([np.sin(yaw[number]), np.cos(yaw[number])])
        back = position[number, [0, 2]] - front * size[number, 2] / 2
        for edge, length in enumerate(edge_lengths(corners)):
            inside, off = inward_normal(corners, edge), back - corners[edge]
            before = 0 <= float(off @ direction(corners, edge)) <= length  # not beside it, before another wall in line
            if length > 1.0 and front @ inside > 0.97 and before and abs(float(off @ inside)) < NEAR:
                return wall_name(edge)
    return ""


def _drawn(room: RoomData, what: str) -> bool:
    key = f"{room.provenance.seed} {what} {room.graph.room.type}".encode()
    return int.from_bytes(hashlib.blake2b(key, digest_size=4).digest(), "big") % THIRD == 0
