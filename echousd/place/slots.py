"""Slots: where things stand around what they attend, in its frame, as (lateral, forward, turn, cost).

Each is asked with the metres that are kept between the two, negative under a table, and those that what stands beside
something is before the middle of that (`distances.kept_apart`).
"""

import math

import numpy as np

from echomodel.vocabulary import Category

Size = np.ndarray
Slot = tuple[float, float, float, float]
Row = tuple[float, float, float, float]  # x, z, yaw, and how much others are preferred
HALF_PI = math.pi / 2
INNER = 0.25  # metres that a coffee table reaches into the corner of a sofa


def head(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Nightstands: at both sides of the bed, their backs level with its head."""
    out = []
    for side in (-1.0, 1.0):
        for gap, more in ((apart, 0.0), (apart + 0.09, 0.2), (apart + 0.22, 0.5)):
            lateral = side * (anchor[0] / 2 + own[0] / 2 + gap)
            out.append((lateral, -anchor[2] / 2 + own[2] / 2, 0.0, more))
    return out


def on_top(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Lamps and televisions: on the top of what carries them, towards its back."""
    room_x, room_z = max(anchor[0] - own[0], 0.0) / 2, max(anchor[2] - own[2], 0.0) / 2
    out = []
    for share, more in ((0.0, 0.0), (0.5, 0.05), (-0.5, 0.05), (0.85, 0.15), (-0.85, 0.15)):
        for deep, away in ((0.0, 0.0), (-0.6, 0.02)):
            out.append((share * room_x, deep * room_z, 0.0, more + away))
    return out


def over(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Mirrors and hoods: over the middle, at the same wall."""
    return [(0.0, (own[2] - anchor[2]) / 2, 0.0, 0.0)]
