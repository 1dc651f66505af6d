"""How deep a box at many poses runs into others, and how far it leaves the floor (numpy, all poses at once)."""

from __future__ import annotations

import numpy as np

from echomodel.roomboxes import footprints
from echousd.repair.arrange.setting import Poses, Setting
from echousd.repair.geometry import axes, depth_inside


def depths(size: np.ndarray, poses: Poses, others: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(K, m) float: how deep a box (3,) at each pose runs into m other boxes (m, 3), negative = the gap, metres."""
    if not len(others):
        return np.full((len(poses), 0), -9.0)
    u, v = poses.axes, axes(yaw)
    away = position[None, :, [0, 2]] - poses.position[:, None, [0, 2]]
    turn = np.abs(u[:, None] @ v.transpose(0, 2, 1)[None])
    half, reach = size[[0, 2]] / 2, others[:, [0, 2]] / 2
    own = np.abs((u[:, None] @ away[..., None])[..., 0]) - half - (turn @ reach[None, :, :, None])[..., 0]
    other = np.abs((v[None] @ away[..., None])[..., 0]) - reach - (half @ turn)
    bottom = poses.position[:, 1]
    over, under = position[:, 1] - (bottom + size[1])[:, None], bottom[:, None] - (position[:, 1] + others[:, 1])
    rise = np.maximum(over, under)
    return -np.maximum(np.maximum(own.max(2), other.max(2)), rise)


def beyond(setting: Setting, size: np.ndarray, poses: Poses) -> np.ndarray:
    """(K,) float: how far a box at each pose leaves the floor, metres."""
    corners = footprints(size[None], poses.position, poses.yaw).reshape(-1, 2)
    out = -depth_inside(setting.floor, corners).reshape(len(poses), 4).min(1)
    if len(setting.floor.reflex):
        offset = setting.floor.reflex[None] - poses.position[:, None, [0, 2]]
        local = np.abs(np.einsum("kad,kmd->kma", poses.axes, offset)) - size[[0, 2]] / 2
        out = np.maximum(out, -local.max(2).min(1))
    return out
