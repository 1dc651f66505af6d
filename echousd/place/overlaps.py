"""How deep a box at many poses runs into others, and how far it leaves the floor (numpy, all poses at once)."""

from __future__ import annotations

import numpy as np

from echomodel.roomboxes import footprints
from echousd.place.geometry import Floor, axes, depth_inside


def depths(
    size: np.ndarray, at: np.ndarray, turn: np.ndarray, others: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> np.ndarray:
    """(K, m) float: how deep a box runs into m others, negative = the gap, metres.

    Arguments:
        size: (3,) float of the box; at: (K, 3) and turn: (K,) float, its poses.
        others, position: (m, 3) float, sizes and places of the others; yaw: (m,) float.
    """
    if not len(others):
        return np.full((len(at), 0), -9.0)
    cos, sin, c, s = np.cos(turn)[:, None], np.sin(turn)[:, None], np.cos(yaw), np.sin(yaw)
    x = position[:, 0] - at[:, 0, None]
    z = position[:, 2] - at[:, 2, None]
    like, across = np.abs(cos * c + sin * s), np.abs(sin * c - cos * s)  # of the axes of both
    width, deep, reach, length = size[0] / 2, size[2] / 2, others[:, 0] / 2, others[:, 2] / 2
    gap = np.abs(cos * x - sin * z) - (width + like * reach + across * length)
    np.maximum(gap, np.abs(sin * x + cos * z) - (deep + across * reach + like * length), out=gap)
    np.maximum(gap, np.abs(c * x - s * z) - (reach + like * width + across * deep), out=gap)
    np.maximum(gap, np.abs(s * x + c * z) - (length + across * width + like * deep), out=gap)
    bottom = at[:, 1, None]
    np.maximum(gap, position[:, 1] - (bottom + size[1]), out=gap)
    np.maximum(gap, bottom - (position[:, 1] + others[:, 1]), out=gap)
    return -gap


def beyond(floor: Floor, size: np.ndarray, at: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(K,) float: how far a box (3,), or each of K, leaves the floor at (K, 3) and turn (K,), metres."""
    size = np.broadcast_to(size, at.shape)
    corner = footprints(size, at, turn)
    out: np.ndarray = -depth_inside(floor, corner.reshape(-1, 2)).reshape(-1, 4).min(1)
    if len(floor.reflex):
        offset = floor.reflex[None] - at[:, None, [0, 2]]
        local = np.abs(np.einsum("kad,kmd->kma", axes(turn), offset)) - size[:, None, [0, 2]] / 2
        out = np.maximum(out, -local.max(2).min(1))
    return out
