"""Folds, weaves and grooves that only images of normals tell: how they turn surfaces, and the light that falls then."""

import numpy as np

from echomodel.triangles import along, unit
from echousd.draw.indoors import LUMA
from echousd.draw.scenery import RELIEF, Scenery

NORMAL = np.arange(256, dtype=np.float32) / 127.5 - 1  # of a byte of an image of normals
STEEPEST = np.float32(0.2)  # the least cosine that counts of light that comes aslant, and of what is turned
SHARE = 0.6, 1.35  # least and most of a surface's light that its folds have: they light each other


def slanted(light: np.ndarray, way: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(6, n) light (3, n) that comes from `way` (3, n) to surfaces, and how its brightness grows as they turn.

    A surface whose normal is turned by d has the product of d and the last three more, as cosines grow with it.
    """
    return np.concatenate([light, way * (LUMA @ light / np.maximum(along(way, normal), STEEPEST))])


def turned(
    scenery: Scenery, normal: np.ndarray, face: np.ndarray, bary: np.ndarray, breadth: np.ndarray,
    atlas: tuple[np.ndarray, ...],
) -> np.ndarray:  # fmt: skip
    """(3, n) by how much images turn normals (3, n) on faces; of what as in `Scenery.told`."""
    drawn, (right, up, ahead), _ = scenery.told(RELIEF, face, bary, breadth, atlas, NORMAL)
    corners, st, own = scenery.triangles[face[drawn]], scenery.st[face[drawn]], normal.take(drawn, 1)
    (one, two), ((a, c), (b, d)) = np.diff(corners, axis=1).transpose(1, 2, 0), np.diff(st, axis=1).transpose(2, 1, 0)
    ways = (np.sign(a * d - b * c) * way for way in (d * one - b * two, a * two - c * one))  # of the image on the face
    across, upwards = map(unit, ways)
    out = np.zeros_like(normal)
    out[:, drawn] = unit(right * across + up * upwards + np.maximum(ahead, STEEPEST) * own) - own
    return out


def tilted(soft: np.ndarray, rise: np.ndarray, sun: np.ndarray, normal: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(2, n) how much more soft light and sun fall on surfaces whose normals (3, n) are turned by `turn` (3, n).

    `soft`: (3, n) light on what is not turned. `rise`: (3, n) see `slanted`. `sun`: (3, 1) where it is.
    """
    more = along(rise, turn) / np.maximum(LUMA @ soft, np.float32(1e-6))
    steep = along(sun, turn) / np.maximum(along(sun, normal), STEEPEST)
    return np.clip([1 + more, 1 + steep], *SHARE)
