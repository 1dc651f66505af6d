"""Boxes in plan: points (x, z) to and from frames that are turned by a yaw about +Y; of numpy and torch alike.

Yaws are in radians; a yaw of shape (...) belongs to points or half extents (..., 2).
"""

from __future__ import annotations

from typing import Any

import numpy as np

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # of a footprint, those of the back first


def _kit(values: Any) -> Any:
    if isinstance(values, np.ndarray | np.generic | float):
        return np
    import torch

    return torch


def axes(yaw: Any) -> tuple[Any, Any]:
    """(..., 2) each: unit vectors to the side and to the front of what is turned by `yaw`."""
    kit = _kit(yaw)
    cos, sin = kit.cos(yaw), kit.sin(yaw)
    return kit.stack([cos, -sin], -1), kit.stack([sin, cos], -1)


def turned(points: Any, yaw: Any) -> Any:
    """Points (..., 2) of a frame, seen from outside of it: x' = cos x + sin z, z' = cos z - sin x."""
    kit = _kit(points)
    cos, sin, x, z = kit.cos(yaw), kit.sin(yaw), points[..., 0], points[..., 1]
    return kit.stack([cos * x + sin * z, cos * z - sin * x], -1)


def seen(points: Any, yaw: Any) -> Any:
    """Points (..., 2) in the frame: how far to its side and how far ahead of it they lie; the inverse of `turned`."""
    kit = _kit(points)
    cos, sin, x, z = kit.cos(yaw), kit.sin(yaw), points[..., 0], points[..., 1]
    return kit.stack([cos * x - sin * z, sin * x + cos * z], -1)


def outline(half: Any, yaw: Any, places: Any = CORNERS) -> Any:
    """(..., k, 2) points on rectangles about the origin, their corners, by half extents (..., 2)."""
    signs = np.asarray(places) if _kit(half) is np else half.new_tensor(places)
    return turned(half[..., None, :] * signs, yaw[..., None])


def hull(half: Any, yaw: Any) -> Any:
    """(..., 2) half extents along x and z of what has half extents (..., 2) in its own frame."""
    kit = _kit(half)
    cos, sin = abs(kit.cos(yaw)), abs(kit.sin(yaw))
    width, depth = half[..., 0], half[..., 1]
    return kit.stack([cos * width + sin * depth, sin * width + cos * depth], -1)


def along_sides(away: Any, half: Any, yaw: Any, other_half: Any, other_yaw: Any) -> tuple[Any, Any]:
    """(..., 4) each: `away` (..., 2) along the sides of a rectangle and along those of another, and what both reach.

    The two are apart, along the side that parts them best, by the largest of |first| - second.
    """
    kit = _kit(away)
    along = kit.concatenate([seen(away, yaw), seen(away, other_yaw)], -1)
    turn = yaw - other_yaw
    return along, kit.concatenate([half + hull(other_half, turn), hull(half, turn) + other_half], -1)
