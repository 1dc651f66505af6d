"""Where a camera stands to see a room: from a corner outside, or inside between the walls."""

from __future__ import annotations

import numpy as np
import shapely

from echousd.sight import Furniture

APERTURE = 36.0  # mm, width of the picture in the camera
FOCAL_LENGTH = 30.0  # mm: 62 degrees across
WIDE = 21.0  # mm, for a camera inside: 81 degrees across
EYES = 0.62  # of the height of the walls: where a camera inside is
BEFORE = 1.6  # metres: what is nearer to the eye fills the picture
MARGIN = 1.06
FRONTS = 0.5  # hidden objects that seeing the furniture's fronts rather than their sides is worth


def view_matrix(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(4, 4) float camera to world, column vectors; the camera looks along its -Z with +Y up."""
    back = eye - target
    back = back / np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, eye
    return matrix


def perspective_view(points: np.ndarray, furniture: Furniture) -> np.ndarray:
    """(4, 4) float camera to world of a view from the corner where least furniture is hidden, fronts preferred.

    Arguments:
        points: (n, 3) float, metres, what must be in the picture.
        furniture: what shall be seen.
    """
    corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])
    facing = corners @ (furniture.facing + np.array([1e-3, 2e-3]))
    views = [_framed(points, np.array([0.55 * x, 0.62, 0.85 * z])) for x, z in corners]
    hidden = [furniture.hidden(view[:3, 3]) for view in views]
    return views[int(np.argmin(np.array(hidden) - FRONTS * facing))]


def _framed(points: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(4, 4) float camera to world of the nearest camera in that direction that has all points in its picture."""
    direction = direction / np.linalg.norm(direction)
    target = (points.min(0) + points.max(0)) / 2
    half = APERTURE / 2 / FOCAL_LENGTH / MARGIN
    for _ in range(4):  # the middle of the picture moves a little with the distance
        axes = view_matrix(target + direction, target)[:3, :3]
        local = (points - target) @ axes
        distance = max(float((np.abs(local[:, :2]).max(1) / half + local[:, 2]).max()), 1.0)
        seen = local[:, :2] / (distance - local[:, 2:])
        target = target + axes[:, :2] @ (seen.max(0) + seen.min(0)) / 2 * distance
    return view_matrix(target + direction * distance, target)


def inside_view(floor: np.ndarray, furniture: Furniture, height: float) -> np.ndarray:
    """(4, 4) float camera to world of a view from a corner inside a room with walls, where little is hidden.

    Arguments:
        floor: (k, 2) float, x and z of the corners, metres.
        furniture: what shall be seen, its fronts rather than its backs.
        height: of the walls, metres.
    """
    room = shapely.Polygon(floor)
    middle = np.asarray(room.representative_point().coords[0])
    step = middle - floor
    step = floor + 0.3 * step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9)
    seen = [room.contains(shapely.LineString([corner, middle])) for corner in step]
    eyes = np.insert(step, 1, EYES * height, axis=1)
    reach = np.linalg.norm(floor - middle, axis=1) + (floor - middle) @ furniture.facing
    reach = reach - [furniture.hidden(eye) + furniture.crowding(eye, BEFORE) for eye in eyes]
    corner = step[int(np.argmax(np.where(seen, reach, -np.inf)))] if any(seen) else middle + 0.1
    aim = 0.5 * middle + 0.5 * furniture.centre if len(furniture.size) else middle
    return view_matrix(np.array([corner[0], EYES * height, corner[1]]), np.array([aim[0], 0.3 * height, aim[1]]))
