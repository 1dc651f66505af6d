"""How far a room reaches: the points that a picture of it must show, and the box around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echomodel.roomboxes import footprints
from echousd.room import RoomData
from echousd.shapes import shell, walls


@dataclass(frozen=True)
class Volume:
    """What the cameras must see, in the frame of `/Room`: (3,) float lower and upper corners, metres."""

    lower: np.ndarray
    upper: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Middle of the volume."""
        return (self.lower + self.upper) / 2


def room_points(room: RoomData) -> np.ndarray:
    """(n, 3) float, metres: corners of the floor (and the walls) and of all boxes, in the frame of `/Room`."""
    size, position = np.asarray(room.boxes.size, float), np.asarray(room.boxes.position, float)
    plan = footprints(size, position, np.asarray(room.boxes.yaw, float)).reshape(-1, 2)
    low, high = np.repeat(position[:, 1], 4), np.repeat(position[:, 1] + size[:, 1], 4)
    points = [np.insert(plan, 1, low, axis=1), np.insert(plan, 1, high, axis=1)]
    points += [np.insert(room.floor, 1, height, axis=1) for height in (-shell.THICKNESS, 0.0)]
    if room.options.walls:
        points += [
            np.insert(walls.outline(room.floor), 1, height, axis=1) for height in (-shell.THICKNESS, room.height)
        ]
    if room.options.ceiling:
        points.append(np.insert(room.floor, 1, room.height + shell.THICKNESS, axis=1))
    return np.concatenate(points)


def room_volume(room: RoomData) -> Volume:
    """Box around the floor and all furniture, metres."""
    points = room_points(room)
    return Volume(points.min(0), points.max(0))
