"""Untidy rooms: generated ones shaken, so that a model also meets crowded, odd and rearranged rooms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.roomboxes import RoomBoxes

SHIFT = 0.25  # metres, largest standard deviation of a shift on the floor
STRETCH = 0.2  # largest standard deviation of the logarithm of a size
SWAPS = 0.3  # share of the untidy rooms in which two pieces of furniture change places
ON_THE_FLOOR = 0.02  # metres


def untidied(room: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """The room with its furniture shifted, resized and now and then exchanged; relations have to be labelled anew.

    Real rooms hold furniture that overlaps, sticks through walls or is far from its usual size, and edited graphs ask
    for arrangements that no tidy room shows. How untidy a room gets is drawn anew for each, mostly little.

    Arguments:
        room: n objects. Equal models stay of equal size; what stands on or hangs above the floor only moves in plan.
        rng: source of every draw.
    """
    n, amount = len(room), rng.random() ** 2
    _, kind = np.unique(room.models or np.arange(n).astype(str), return_inverse=True)
    stretch = np.exp(rng.normal(0.0, STRETCH * amount, (n, 3)))[kind]
    position = room.position.copy()
    position[:, [0, 2]] += rng.normal(0.0, SHIFT * amount, (n, 2))
    standing = np.flatnonzero(position[:, 1] < ON_THE_FLOOR)
    if len(standing) > 1 and rng.random() < SWAPS:
        pair = rng.choice(standing, 2, replace=False)
        position[pair] = position[pair[::-1]]
    return replace(room, size=room.size * stretch.clip(0.6, 1.6), position=position, relations=None)
