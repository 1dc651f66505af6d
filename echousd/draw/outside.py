"""Where a camera stands outside of what it shows: above, at a corner, or all around."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from echousd.draw.scenery import Scenery
from echousd.draw.sight import Furniture
from echousd.draw.views import APERTURE, FOCAL_LENGTH, MARGIN, View, view_matrix

RISE = 0.62  # of a camera outside over the room's middle, for a metre that it is away
WIDE = 7.0  # metres of a scene from which on it is seen from higher up: over the walls of several rooms
FRONTS = 0.5  # hidden objects that seeing the furniture's fronts rather than their sides is worth


def without_near_walls(scenery: Scenery, eye: np.ndarray) -> Scenery:
    """The scene without the walls between the middle of the room and an eye outside, as in a doll's house."""
    lower, upper = scenery.bounds
    middle = (lower + upper) / 2
    keep, seen = np.ones(len(scenery.triangles), bool), np.ones(len(scenery.panes), bool)
    for number in range(int(scenery.wall.max(initial=-1)) + 1):
        faces = scenery.wall == number
        corners = scenery.triangles[faces].reshape(-1, 3)
        away = (corners.min(0) + corners.max(0)) / 2 - middle
        if (away * (eye - middle))[[0, 2]].sum() > 0:
            keep &= ~faces
            seen &= scenery.pane_wall != number
    if keep.all() or not keep.any():
        return scenery
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "thin", "st", "texture", "wall")
    fewer = {name: getattr(scenery, name)[keep] for name in names}
    return replace(scenery, panes=scenery.panes[seen], pane_wall=scenery.pane_wall[seen], **fewer)


def perspective_views(points: np.ndarray, furniture: Furniture) -> list[np.ndarray]:
    """(4, 4) float camera to world of the views from the four corners, least hidden first, fronts preferred.

    `points`: (n, 3) float, metres, what must be in the picture. `furniture`: what shall be seen.
    """
    corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])
    facing = corners @ (furniture.facing + np.array([1e-3, 2e-3]))
    rise = RISE * max(1.0, np.ptp(points[:, ::2], axis=0).max() / WIDE)
    views = [framed(points, np.array([0.55 * x, rise, 0.85 * z])) for x, z in corners]
    hidden = [furniture.hidden(view[:3, 3]).sum() for view in views]
    return [views[corner] for corner in np.argsort(np.array(hidden) - FRONTS * facing, kind="stable")]


def framed(points: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(4, 4) float camera to world: the nearest in a direction (3,) that has all points (n, 3) in its picture."""
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


def top_view(scenery: Scenery) -> View:
    """Straight down on the whole scene, the front (+X) up, as on plans and drawn graphs."""
    lower, upper = scenery.bounds
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = (0, 0, 1), (1, 0, 0), (0, 1, 0)
    centre = (lower + upper) / 2
    matrix[:3, 3] = (centre[0], upper[1] + 1.0, centre[2])
    return View(matrix, float((upper - lower)[[0, 2]].max()) / 2 * 1.06, True)


def corner_views(scenery: Scenery) -> Iterator[tuple[View, Scenery]]:
    """From above each corner, the view where least is hidden first, and what it shows: near walls are left out."""
    for matrix in perspective_views(_outermost(scenery), scenery.furniture()):
        shown = without_near_walls(scenery, matrix[:3, 3])
        if shown is not scenery:
            matrix = framed(_outermost(shown), matrix[:3, 2])
        yield View(matrix, APERTURE / 2 / FOCAL_LENGTH, False), shown


def turning_views(scenery: Scenery, count: int) -> list[View]:
    """`count` views around the whole scene, all from as far away, each as far on as the last from the one before."""
    points, (lower, upper) = _outermost(scenery), scenery.bounds
    middle, turn = (lower + upper) / 2, np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    reach = float(np.linalg.norm((points - middle)[:, [0, 2]], axis=1).max())
    x, z = middle[0] + reach * np.cos(turn), middle[2] + reach * np.sin(turn)
    drum = np.concatenate([np.stack([x, np.full(48, y), z], 1) for y in (lower[1], upper[1])])
    nearest = framed(drum, np.array([1.0, RISE, 0.0]))
    away, eye = float(nearest[0, 3] - middle[0]), float(nearest[1, 3])
    target = np.array([middle[0], eye - away * RISE, middle[2]])
    spots = (away * np.array([np.cos(t), RISE, np.sin(t)]) for t in 2 * np.pi * np.arange(count) / count)
    return [View(view_matrix(target + spot, target), APERTURE / 2 / FOCAL_LENGTH, False) for spot in spots]


def _outermost(scenery: Scenery) -> np.ndarray:
    """(n, 3) float corners of the scene; nothing else reaches the border of a picture of all of it."""
    from scipy.spatial import ConvexHull  # a fifth of a second that a picture from inside does without

    points = scenery.triangles.reshape(-1, 3).astype(float)
    return np.asarray(points[ConvexHull(points, qhull_options="QJ").vertices])
