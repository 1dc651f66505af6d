"""A table that is set for those who sit around it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echomodel.dressing import usual
from echousd.dressing.setting import EDGE, Setting, Standing

if TYPE_CHECKING:
    from echousd.dressing.tabletops import Surface

COVER = {"plate": (0.0, 0.17), "napkin": (-0.225, 0.15), "glass": (0.2, 0.28)}  # metres to the right, and from the edge


def laid(setting: Setting, host: Standing, surface: Surface) -> None:
    """A plate before every seat at a table, a napkin with a knife and a fork at its left, a glass behind it."""
    rng = setting.rng(host.name, "laid")
    forms = [usual(kind, rng) for kind in COVER]
    middle, half = surface.span
    for seat in setting.of("seat"):
        local = host.in_plan(seat.position) - middle
        beyond = np.abs(local) - half
        if np.max(beyond) > 0.6 or np.min(beyond) > 0:
            continue
        side, out = int(np.argmax(beyond)), np.zeros(2)
        out[side] = np.sign(local[side])
        right = np.array([out[1], -out[0]])  # of who sits there
        edge = np.where(out == 0.0, np.clip(local, 0.29 - half, half - 0.29), out * half)
        turn = float(np.arctan2(-out[0], -out[1]))
        for (kind, (aside, ahead)), (size, variant) in zip(COVER.items(), forms, strict=True):
            room = half - np.roll(size[[0, 2]], 1 - side) / 2 - EDGE
            share = (edge + aside * right - ahead * out) / np.maximum(room, 1e-6)
            surface.put(setting, kind, [tuple(share)], size=size, turn=turn, variant=variant, word=seat.name)
