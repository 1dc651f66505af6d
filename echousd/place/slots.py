"""Slots: where things stand around what they attend, in its frame, as (lateral, forward, turn, cost).

Each is asked with the metres that are kept between the two, negative under a table, and those that what stands beside
something is before the middle of that (`distances.kept_apart`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from echomodel.late import Late
from echomodel.vocabulary import Category

Size = np.ndarray
Slot = tuple[float, float, float, float]
Slots = Callable[[Size, Size, Category, int, float, float], list[Slot]]
HALF_PI = math.pi / 2
LONG = 1.3  # times as long as deep
INNER = 0.25  # metres that a coffee table reaches into the corner of a sofa
NIGHTSTAND = 0.55  # metres that a nightstand takes beside a bed


def head(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Nightstands: at both sides of the bed, their backs level with its head."""
    out = []
    for side in (-1.0, 1.0):
        for gap, more in ((apart, 0.0), (apart + 0.09, 0.2), (apart + 0.22, 0.5)):
            lateral = side * (anchor[0] / 2 + own[0] / 2 + gap)
            out.append((lateral, -anchor[2] / 2 + own[2] / 2, 0.0, more))
    return out


def beside(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Side tables and floor lamps: at the ends of a sofa, beside an armchair, at the head of a bed."""
    out = []
    if kind.role == "bed":  # before its middle one gets in
        for lateral, forward, turn, more in head(own, anchor, kind, count, min(apart, 0.1), 0.0):
            further = lateral + math.copysign(NIGHTSTAND, lateral)
            out += [(lateral, forward, turn, more), (further, forward, turn, more + 0.3)]
    for side in (-1.0, 1.0):
        for gap, more in ((apart, 0.0), (apart + 0.08, 0.1), (apart + 0.21, 0.3)):
            lateral = side * (anchor[0] / 2 + own[0] / 2 + gap)
            back = -anchor[2] / 2 + own[2] / 2
            if kind.role == "bed":
                more += 0.8
            out += [
                (lateral, max(ahead, min(back, 0.0)), 0.0, more),
                (lateral, back, 0.0, more + 0.02),
                (lateral, back / 2, 0.0, more + 0.05),
            ]
    return out


def foot(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Benches and ottomans: at the foot of a bed, before a sofa or armchair: half of 28 real ones leave 0.59 m."""
    out = []
    bed = kind.role == "bed"
    askew = 1.5 if max(own[0], own[2]) > LONG * min(own[0], own[2]) else 0.3  # a bench lies along the foot
    for gap, more in ((0.04 if bed else 0.5, 0.0), (0.1 if bed else 0.6, 0.1), (0.2 if bed else 0.35, 0.3)):
        for lateral in (0.0, -0.15, 0.15) if bed else (0.0, -0.5, 0.5, -0.9, 0.9, -1.3, 1.3):
            for turn in (0.0, HALF_PI):
                depth = own[2] if turn == 0.0 else own[0]
                wide = 0.0 if (own[0] >= own[2]) == (turn == 0.0) else askew
                out.append((lateral, anchor[2] / 2 + depth / 2 + gap, turn, more + wide + 0.2 * abs(lateral)))
    if not bed:  # at the sides of the group
        for side in (-1.0, 1.0):
            out.append((side * (anchor[0] / 2 + own[2] / 2 + 0.3), anchor[2] / 2 + 0.6, -side * HALF_PI, 0.4))
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


SEATS = "echousd.place.seats"
STANDS: dict[str, Slots] = {
    "head": head, "beside": beside, "foot": foot, "on_top": on_top, "over": over, "with": Late(f"{SEATS}:joined"),
    **{name: Late(f"{SEATS}:{name}") for name in ("around", "at_front", "before", "company")},
}  # fmt: skip
