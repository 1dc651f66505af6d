"""Blinds before windows: let down from a roller, drawn up in folds."""

import numpy as np

from echomodel.dressing.textiles import drape
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import Solid


def blind(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A roller blind let down: cloth from the roller at its top to the bar at its foot."""
    (w, h, d), cloth = size, drape(rng)
    roller, bar = min(0.03, 0.2 * h), min(0.02, 0.1 * h)
    return [
        box((-w / 2, h - roller, -d / 2), (w / 2, h, d / 2), "frame", 0.3 * d),
        box((-0.49 * w, bar, -0.001), (0.49 * w, h - roller, 0.001), cloth),
        box((-0.49 * w, 0, -0.3 * d), (0.49 * w, bar, 0.3 * d), "frame", 0.1 * d),
    ]


def roman_blind(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A blind drawn up: cloth that falls flat from its head, and below in folds one before the other."""
    (w, h, d), cloth = size, drape(rng)
    stack = min(0.16, 0.5 * h)
    x, shares, back = 0.495 * w, (0.0, 0.2, 0.4), -d / 2
    head = box((-w / 2, h - 0.03, back), (w / 2, h, d / 2), cloth, 0.2 * d)
    flat = box((-x, 0.8 * stack, -0.002), (x, h - 0.03, 0.002), cloth)
    folded = (((x, (s + 0.5) * stack, d * (0.5 - s)), s * stack) for s in shares)
    return [head, flat, *(box((-x, low, back), high, cloth, 0.3 * d) for high, low in folded)]
