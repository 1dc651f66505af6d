"""Light that few rays found, smoothed over the flat piece of surface that it lies on."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from echomodel.triangles import along

BAND = 64  # rows of a picture at a time, which bounds the memory and stays in the cache
RINGS = (1, 2, 4, 8)  # places between neighbours, pass by pass
CLOSE, EVEN = 2, 0.4  # from which ring on it matters how bright neighbours are, and the share that they may differ by
ALIKE, FLAT = 0.97, 0.02  # cosine and metres within which two points lie on one flat piece of surface


def smooth_light(light: np.ndarray, normal: np.ndarray, point: np.ndarray, reach: Sequence[Any]) -> np.ndarray:
    """Mean of the light (c, h, w) over neighbours on the same flat piece of surface (joint bilateral filter).

    Far passes leave out what is much lighter or darker, so that shadows keep their edges. `normal`, `point`: (3, h, w)
    of the surface. `reach`: layers of the light, a slice of them, `RINGS` that these are smoothed over, and (h, w) what
    must be equal there if anything: what steel mirrors is nothing that the pane in it does, and has no other edges.
    """
    height, width = light.shape[1:]
    for apart in sorted({ring for _, rings, *_ in reach for ring in rings}):
        # passes with ever wider holes reach far with few neighbours ("a trous")
        parts = [(layers, light[layers], *alike) for layers, rings, *alike in reach if apart in rings]
        of = ((layers, own, np.abs(own).mean(0), *alike) for layers, own, *alike in parts)
        sums = [(layers, own, bright, own.copy(), np.ones_like(bright), *alike) for layers, own, bright, *alike in of]
        # what two share they give each other: half of all eight are met
        for down, across in ((0, apart), (apart, -apart), (apart, 0), (apart, apart)):
            for top in range(0, height - down, BAND):
                bottom, left, right = min(top + BAND, height - down), max(-across, 0), width - max(across, 0)
                here = np.s_[..., top:bottom, left:right]
                there = np.s_[..., top + down : bottom + down, left + across : right + across]
                share = np.maximum(along(normal[here], normal[there]), 0)
                for _ in range(5):  # to the power of 32
                    share *= share
                share *= np.abs(along(normal[here], point[there] - point[here])) < FLAT
                for (_, own, bright, total, weight, *alike), (one, other) in product(
                    sums, ((here, there), (there, here))
                ):
                    part = share * (alike[0][one] == alike[0][other]) if alike else share
                    if apart > CLOSE and not alike:
                        part = part / (1 + np.square((bright[other] - bright[one]) / (EVEN * bright[one] + 1e-4)) ** 2)
                    total[one] += part * own[other]
                    weight[one] += part
        for layers, _, _, total, weight, *_ in sums:
            light[layers] = total / weight
    return light


def same_surface(
    normal: np.ndarray, point: np.ndarray, other_normal: np.ndarray, other_point: np.ndarray
) -> np.ndarray:
    """Whether points lie on one flat piece of surface, (...) bool of (3, ...)."""
    return (along(normal, other_normal) > ALIKE) & (np.abs(along(normal, point - other_point)) < FLAT)
