"""Arrangements of given furniture in a given room, by the generator's own groups: drafts for the layout denoiser."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from echomodel.rooms.builder import Builder, Item
from echomodel.rooms.floor import Floor
from echomodel.rooms.generator import STYLES
from echomodel.rooms.recipes import furnish
from echomodel.rooms.statistics import room_requests


def arranged(
    categories: Sequence[str], room_type: str, floor: Floor, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """One arrangement of some furniture, as a person would furnish the room before hearing any wishes.

    Arguments:
        categories: n canonical words. room_type: word of the vocabulary. floor: where (`outline.floor_of`).
        rng: source of every draw.

    Returns:
        size (n, 3), position (n, 3) float, metres, yaw (n,) float, radians, in the frame of the floor, and (n,) bool,
        what found a place; the others lie anywhere on the floor.
    """
    builder = Builder(floor, rng, STYLES, room_requests()["size"])
    builder.wanted = dict(Counter(categories))
    furnish(builder, room_type)
    asked = Counter(categories)
    placed: dict[str, list[Item]] = {word: [] for word in asked}
    for item in builder.items:
        if item.category in placed:
            placed[item.category].append(item)
    size, position, yaw = np.zeros((len(categories), 3)), np.zeros((len(categories), 3)), np.zeros(len(categories))
    found = np.zeros(len(categories), bool)
    for number, word in enumerate(categories):
        found[number] = bool(placed[word])
        item = placed[word].pop(0) if placed[word] else _anywhere(builder, word)
        size[number], position[number], yaw[number] = item.size, (item.x, item.y, item.z), item.yaw
    return size, position, (yaw + np.pi) % (2 * np.pi) - np.pi, found


def _anywhere(room: Builder, category: str) -> Item:
    """A piece that the groups had no place for: at a wall or on open floor where one is free, else in the way."""
    item = room.against_wall(category) or room.somewhere(category, clearance=0.0)
    if item is not None:
        return item
    wall = room.floor.walls[int(room.rng.integers(len(room.floor.walls)))]
    size = room.size(category)
    x, z = wall.point(wall.length * room.rng.random(), size[2] / 2)
    return Item(category, size, x, 0.0, z, wall.yaw)
