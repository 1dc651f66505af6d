"""The viewpoints of a picture: a stage's own cameras, or one from above, from a corner or from inside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from pxr import UsdGeom

from echousd.draw.scenery import Scenery
from echousd.draw.sight import ASPECT
from echousd.draw.views import APERTURE, FOCAL_LENGTH, framed, inside_view, perspective_views, turning_matrices
from echousd.naming import free_name
from echousd.stage.units import metres_per_unit, up_axis

if TYPE_CHECKING:
    from pxr import Usd


WIDEST = 4.0  # width of a picture over its height, and the other way round


@dataclass(frozen=True)
class View:
    """A camera: (4, 4) camera to world, sheared where its lens is shifted, and half the picture's width, in metres
    (top) or as a tangent (perspective); its width over its height; whether it is inside a closed room."""

    matrix: np.ndarray
    half: float
    orthographic: bool
    aspect: float = 1.0
    inside: bool = False


def stage_views(stage: Usd.Stage) -> dict[str, View]:
    """What every camera of a stage sees, by its name, in a y-up world in metres."""
    unit, turn = metres_per_unit(stage), np.eye(4)
    if up_axis(stage) == "Z":
        turn[1:3, 1:3] = ((0, 1), (-1, 0))
    views: dict[str, View] = {}
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Camera):
            continue
        camera = UsdGeom.Camera(prim).GetCamera(0)
        matrix = turn @ np.array(camera.transform).T
        matrix[:3, 3] *= unit
        matrix[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
        flat = camera.projection == camera.Orthographic
        wide = camera.horizontalAperture
        of_film = camera.APERTURE_UNIT * unit if flat else 1 / max(camera.focalLength, 1e-6)
        shift = matrix[:3, :2] @ (camera.horizontalApertureOffset * of_film, camera.verticalApertureOffset * of_film)
        matrix[:3, 3 if flat else 2] += shift if flat else -shift
        half = wide / 2 * of_film
        aspect = float(np.clip(wide / max(camera.verticalAperture, 1e-6), 1 / WIDEST, WIDEST))
        views[free_name(prim.GetName(), views)] = View(matrix, float(half), flat, aspect)
    return views


def top_view(scenery: Scenery) -> View:
    """Straight down on the whole scene."""
    lower, upper = scenery.bounds
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = (1, 0, 0), (0, 0, -1), (0, 1, 0)
    centre = (lower + upper) / 2
    matrix[:3, 3] = (centre[0], upper[1] + 1.0, centre[2])
    return View(matrix, float((upper - lower)[[0, 2]].max()) / 2 * 1.06, True)


def hero_view(stage: Usd.Stage, scenery: Scenery) -> View:
    """Into a room from inside: through the stage's first camera that stands between its walls, else from a corner
    where least is hidden, at the height of a standing person's eyes."""
    lower, upper = scenery.bounds
    for view in stage_views(stage).values() if scenery.closed else ():
        if not view.orthographic and (lower < view.matrix[:3, 3]).all() and (view.matrix[:3, 3] < upper).all():
            return replace(view, aspect=ASPECT, inside=True)
    x, z = (lower[0] + 0.15, upper[0] - 0.15), (lower[2] + 0.15, upper[2] - 0.15)  # inside the walls
    floor = np.array([(x[0], z[0]), (x[0], z[1]), (x[1], z[1]), (x[1], z[0])])
    matrix, lens = inside_view(floor, scenery.furniture, float(upper[1] - lower[1]), scenery.hung)
    return View(matrix, APERTURE / 2 / lens, False, ASPECT, scenery.closed)


def corner_views(scenery: Scenery) -> Iterator[tuple[View, Scenery]]:
    """From above each corner, the view where least is hidden first, and what it shows: near walls are left out."""
    for matrix in perspective_views(_outermost(scenery), scenery.furniture):
        shown = scenery.without_near_walls(matrix[:3, 3])
        if shown is not scenery:
            matrix = framed(_outermost(shown), matrix[:3, 2])
        yield View(matrix, APERTURE / 2 / FOCAL_LENGTH, False), shown


def turning_views(scenery: Scenery, count: int) -> list[View]:
    """`count` views around the whole scene, all from as far away, each as far on as the last from the one before."""
    matrices = turning_matrices(_outermost(scenery), count)
    return [View(matrix, APERTURE / 2 / FOCAL_LENGTH, False) for matrix in matrices]


def _outermost(scenery: Scenery) -> np.ndarray:
    """(n, 3) float corners of the scene; nothing else reaches the border of a picture of all of it."""
    from scipy.spatial import ConvexHull  # a fifth of a second that a picture from inside does without

    points = scenery.triangles.reshape(-1, 3).astype(float)
    return np.asarray(points[ConvexHull(points, qhull_options="QJ").vertices])
