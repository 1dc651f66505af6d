"""How deep a box at many poses runs into others, and how far it leaves the floor (numpy, all poses at once)."""

from __future__ import annotations

import numpy as np

from echomodel.roomboxes import footprints
from echousd.repair.arrange.setting import Poses, Setting
from echousd.repair.geometry import depth_inside


def depths(size: np.ndarray, poses: Poses, others: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(K, m) float: how deep a box (3,) at each pose runs into m other boxes (m, 3), negative = the gap, metres."""
    if not len(others):
        return np.full((len(poses), 0), -9.0)
    (cos, sin), c, s = poses.turns, np.cos(yaw), np.sin(yaw)
    x = position[:, 0] - poses.position[:, 0, None]
    z = position[:, 2] - poses.position[:, 2, None]
    like, across = np.abs(cos * c + sin * s), np.abs(sin * c - cos * s)  # of the axes of both
    width, deep, reach, length = size[0] / 2, size[2] / 2, others[:, 0] / 2, others[:, 2] / 2
    gap = np.abs(cos * x - sin * z) - (width + like * reach + across * length)
    np.maximum(gap, np.abs(sin * x + cos * z) - (deep + across * reach + like * length), out=gap)
    np.maximum(gap, np.abs(c * x - s * z) - (reach + like * width + across * deep), out=gap)
    np.maximum(gap, np.abs(s * x + c * z) - (length + across * width + like * deep), out=gap)
    bottom = poses.position[:, 1, None]
    np.maximum(gap, position[:, 1] - (bottom + size[1]), out=gap)
    np.maximum(gap, bottom - (position[:, 1] + others[:, 1]), out=gap)
    return -gap


def beyond(setting: Setting, size: np.ndarray, poses: Poses) -> np.ndarray:
    """(K,) float: how far a box at each pose leaves the floor, metres."""
    if setting.floor.rectangle is not None:
        cos, sin = (np.abs(turn[:, 0]) for turn in poses.turns)
        middle, half = setting.floor.rectangle
        x = np.abs(poses.position[:, 0] - middle[0]) + (cos * size[0] + sin * size[2]) / 2 - half[0]
        z = np.abs(poses.position[:, 2] - middle[1]) + (sin * size[0] + cos * size[2]) / 2 - half[1]
        return np.maximum(x, z)
    corners = footprints(size[None], poses.position, poses.yaw).reshape(-1, 2)
    out = -depth_inside(setting.floor, corners).reshape(len(poses), 4).min(1)
    if len(setting.floor.reflex):
        offset = setting.floor.reflex[None] - poses.position[:, None, [0, 2]]
        local = np.abs(np.einsum("kad,kmd->kma", poses.axes, offset)) - size[[0, 2]] / 2
        out = np.maximum(out, -local.max(2).min(1))
    return out
