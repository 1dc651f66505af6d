"""Mirrors that stand on dressing tables: round ones, framed panels, and panels with wings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import box
from echomodel.furniture.choices import Choices
from echomodel.furniture.solids import Block, Solid, Turned, rotation
from echomodel.furniture.style import Style

WING = 0.35  # radians that wings are turned towards the middle


def mirror_of(w: float, low: float, high: float, d: float, style: Style, choices: Choices) -> list[Solid]:
    """A mirror at the rear of a table top at `low`, up to `high`; w and d are the table's, metres."""
    tall, z = high - low, -d / 2 + 0.03
    kind = choices.pick("form", ["round", "panel", "wings"])
    if kind == "round":
        return [box((-0.06, low, z - 0.02), (0.06, low + tall * 0.15, z + 0.02)), *_disc(w, high, tall, z)]
    half = w * choices.between("spread", 0.28, 0.42)
    foot = box((-0.7 * half, low, z - 0.03), (0.7 * half, low + 0.02, z + 0.03))
    if kind == "panel":
        return [foot, *_framed(0.0, low + 0.01, high, half, z, 0.0, style)]
    wing = min(0.22, w / 2 - half * 0.6)
    half *= 0.6
    wings = []
    for s in (-1, 1):
        x = s * (half + wing * 0.47)
        wings += _framed(x, low + 0.02, high - 0.03, wing / 2, z + wing * 0.16, -s * WING, style)
    return [foot, *_framed(0.0, low + 0.01, high, half, z, 0.0, style), *wings]


def _disc(w: float, high: float, tall: float, z: float) -> list[Solid]:
    """A round mirror in a ring of wood."""
    half, up = min(w * 0.4, tall * 0.46), tall * 0.46
    ring = Turned(
        centre=np.array([0, high - up, z - 0.015]),
        low=(half, up),
        high=(half, up),
        height=0.024,
        turn=rotation(x=np.pi / 2),
    )
    inner = (half - 0.014, up - 0.014)
    face = replace(ring, centre=ring.centre + np.array([0, 0, 0.02]), low=inner, high=inner, height=0.008)
    return [ring, replace(face, material="mirror")]


def _framed(x: float, low: float, high: float, half: float, z: float, turn: float, style: Style) -> list[Solid]:
    """A pane about (x, z) on a board that shows as its frame, turned by `turn` about the vertical."""
    edge = min(0.012 + 0.012 * style.contrast, 0.3 * half)
    middle, upright, about = np.array([x, (low + high) / 2, z]), (high - low) / 2, rotation(y=turn)
    board = Block(centre=middle, half=np.array([half, upright, 0.011]), radius=0.003, turn=about)
    pane = Block(
        centre=middle + about @ np.array([0, 0, 0.01]),
        half=np.array([half - edge, upright - edge, 0.003]),
        turn=about,
        material="mirror",
    )
    return [board, pane]
