"""Boxes in plan: points (x, z) to and from frames that are turned by a yaw about +Y; of numpy and torch alike.

Yaws are in radians; a yaw of shape (...) belongs to points or half extents (..., 2).
"""

import numpy as np

from echomodel.arrays import Array, cast, kit

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # of a footprint, those of the back first


def axes(yaw: Array) -> tuple[Array, Array]:
    """(..., 2) each: unit vectors to the side and to the front of what is turned by `yaw`."""
    xp = kit(yaw)
    cos, sin = xp.cos(yaw), xp.sin(yaw)
    return xp.stack([cos, -sin], -1), xp.stack([sin, cos], -1)


def to_frame(x: Array, z: Array, cos: Array, sin: Array) -> tuple[Array, Array]:
    """How far x and z lie to the side and ahead of what is turned by an angle of that cosine and sine."""
    return cos * x - sin * z, sin * x + cos * z


def reach(width: Array, depth: Array, cos: Array, sin: Array) -> tuple[Array, Array]:
    """Half extents along x and z of what has half a width and a depth, turned by an angle of these, both >= 0."""
    return cos * width + sin * depth, sin * width + cos * depth


def turned(points: Array, yaw: Array) -> Array:
    """Points (..., 2) of a frame, seen from outside of it: x' = cos x + sin z, z' = cos z - sin x."""
    xp = kit(points)
    cos, sin, x, z = xp.cos(yaw), xp.sin(yaw), points[..., 0], points[..., 1]
    return xp.stack([cos * x + sin * z, cos * z - sin * x], -1)


def seen(points: Array, yaw: Array) -> Array:
    """Points (..., 2) in the frame: how far to its side and how far ahead of it they lie; the inverse of `turned`."""
    xp = kit(points)
    return xp.stack(to_frame(points[..., 0], points[..., 1], xp.cos(yaw), xp.sin(yaw)), -1)


def upright(yaw: Array) -> np.ndarray:
    """(..., 3, 3) float: what turns points of a frame, as columns, into the room's."""
    turn = np.zeros((*np.shape(yaw), 3, 3))
    turn[..., 0, 0] = turn[..., 2, 2] = np.cos(yaw)
    turn[..., 0, 2], turn[..., 2, 0], turn[..., 1, 1] = np.sin(yaw), -np.sin(yaw), 1.0
    return turn


def outline(half: Array, yaw: Array, places: Array = CORNERS) -> Array:
    """(..., k, 2) points on rectangles about the origin, their corners, by half extents (..., 2)."""
    return turned(half[..., None, :] * cast(places, half), yaw[..., None])


def footprints(size: Array, position: Array, yaw: Array) -> Array:
    """(n, 4, 2): x and z of the corners of boxes in plan, in order around each; size, position (n, 3), metres."""
    return outline(size[:, ::2] / 2, yaw) + position[:, None, ::2]


def hull(half: Array, yaw: Array) -> Array:
    """(..., 2) half extents along x and z of what has half extents (..., 2) in its own frame."""
    xp = kit(half)
    return xp.stack(reach(half[..., 0], half[..., 1], abs(xp.cos(yaw)), abs(xp.sin(yaw))), -1)


def along_sides(away: Array, half: Array, yaw: Array, other_half: Array, other_yaw: Array) -> tuple[Array, Array]:
    """(..., 4) each: `away` (..., 2) along the sides of a rectangle and along those of another, and what both reach.

    The two are apart, along the side that parts them best, by the largest of |first| - second.
    """
    xp = kit(away)
    along = xp.concat([seen(away, yaw), seen(away, other_yaw)], -1)
    turn = yaw - other_yaw
    return along, xp.concat([half + hull(other_half, turn), hull(half, turn) + other_half], -1)
