"""Where a camera stands to see a room: from a corner outside, or inside between the walls."""

from __future__ import annotations

import numpy as np
import shapely

from echomodel.openings import inward_normal
from echomodel.triangles import cross
from echousd.sight import Furniture

APERTURE = 36.0  # mm, width of the picture in the camera
FOCAL_LENGTH = 30.0  # mm: 62 degrees across
WIDE = 21.0  # mm, for a camera inside: 81 degrees across
EYES = 0.62  # of the height of the walls: where a camera inside is
STEEPEST = 0.3  # metres that a camera inside looks down for a metre ahead
BEFORE, WALLED = 2.0, 0.9  # metres: what is nearer to the eye fills the picture, and which walls do
FILLED = 250.0  # metres of depth that a picture full of what is near is worth
SHOWN, FAR = 20.0, 5.0  # and a picture full of furniture; metres of depth from which on more is no gain
PANS = (0.0, -0.3, 0.3)  # radians that a camera inside may turn aside from the middle
TOUCHED = 0.86  # nearness of what the eye must not be at: a quarter of a metre
STEPS = (0.3, 0.5, 0.8, 1.6, 2.6, 3.8)  # metres from a corner that a camera inside may stand
APART = 3.0  # metres from the middle that it keeps where it stands further from its corner
ALONG, OFF = (0.2, 0.35, 0.5, 0.65, 0.8), 0.25  # or along a wall, as shares of its length, and metres from it
MARGIN = 1.06
RISE = 0.62  # of a camera outside over the room's middle, for a metre that it is away
FRONTS = 0.5  # hidden objects that seeing the furniture's fronts rather than their sides is worth


def view_matrix(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(4, 4) float camera to world, column vectors; the camera looks along its -Z with +Y up."""
    back = eye - target
    back = back / np.linalg.norm(back)
    right = cross(np.array([0.0, 1.0, 0.0]), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, cross(back, right), back, eye
    return matrix


def perspective_view(points: np.ndarray, furniture: Furniture) -> np.ndarray:
    """(4, 4) float camera to world: the first of `perspective_views`."""
    return perspective_views(points, furniture)[0]


def perspective_views(points: np.ndarray, furniture: Furniture) -> list[np.ndarray]:
    """(4, 4) float camera to world of the views from the four corners, least hidden first, fronts preferred.

    Arguments:
        points: (n, 3) float, metres, what must be in the picture.
        furniture: what shall be seen.
    """
    corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])
    facing = corners @ (furniture.facing + np.array([1e-3, 2e-3]))
    views = [framed(points, np.array([0.55 * x, RISE, 0.85 * z])) for x, z in corners]
    hidden = [furniture.hidden(view[:3, 3]) for view in views]
    return [views[corner] for corner in np.argsort(np.array(hidden) - FRONTS * facing, kind="stable")]


def turning_matrices(points: np.ndarray, count: int) -> list[np.ndarray]:
    """(4, 4) float camera to world of `count` views around the points (n, 3), metres, all from as far away."""
    middle = (points.min(0) + points.max(0)) / 2
    reach = float(np.linalg.norm((points - middle)[:, [0, 2]], axis=1).max())
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    x, z = middle[0] + reach * np.cos(turn), middle[2] + reach * np.sin(turn)
    drum = np.concatenate([np.stack([x, np.full(48, y), z], 1) for y in (points[:, 1].min(), points[:, 1].max())])
    nearest = framed(drum, np.array([1.0, RISE, 0.0]))
    away, eye = float(nearest[0, 3] - middle[0]), float(nearest[1, 3])
    target = np.array([middle[0], eye - away * RISE, middle[2]])
    spots = [(away * np.cos(t), away * RISE, away * np.sin(t)) for t in 2 * np.pi * np.arange(count) / count]
    return [view_matrix(target + np.array(spot), target) for spot in spots]


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


def inside_view(floor: np.ndarray, furniture: Furniture, height: float, hung: Furniture | None = None) -> np.ndarray:
    """(4, 4) float camera to world of a view from a corner inside a room with walls, where little is hidden.

    Arguments:
        floor: (k, 2) float, x and z of the corners, metres.
        furniture: what shall be seen, its fronts rather than its backs.
        height: of the walls, metres.
        hung: what hangs or stands at the walls: none of it shall be right before the eye.
    """
    room = shapely.Polygon(floor)
    middle = np.asarray(room.representative_point().coords[0])
    aim = 0.5 * middle + 0.5 * furniture.centre if len(furniture.size) else middle
    things = [some for some in (furniture, hung) if some is not None and len(some.size)]
    near = [*((some, BEFORE) for some in things), (_walls(np.asarray(floor, float), height), WALLED)]
    best, most = _level_view(middle + 0.1, aim, height), -np.inf
    for spot in _spots(np.asarray(floor, float), middle):
        if not room.contains(shapely.LineString([spot, middle])):
            continue
        eye = np.array([spot[0], EYES * height, spot[1]])
        points, blocked = furniture.blocked(eye)
        touched = sum(bool((some.nearness(eye, BEFORE) > TOUCHED).any()) for some in things)
        fixed = (spot - middle) @ furniture.facing
        for pan in PANS:
            way = np.array([[np.cos(pan), -np.sin(pan)], [np.sin(pan), np.cos(pan)]]) @ (aim - spot)
            view = _level_view(spot, spot + way, height)
            merit = fixed + min(_depth(room, spot, way), FAR)
            if len(points):
                merit -= (blocked | ~_framed_points(points, view)).mean(1).sum()
                merit += SHOWN * np.isfinite(furniture.away(view, APERTURE / 2 / WIDE)).mean()
            for some, reach in near:
                merit -= FILLED * some.filled(view, APERTURE / 2 / WIDE, reach)
            merit -= FILLED * touched
            if merit > most:
                best, most = view, merit
    return best


def _framed_points(points: np.ndarray, view: np.ndarray) -> np.ndarray:
    """(...) bool: which points (..., 3) are in the picture of a camera inside."""
    x, y, z = np.moveaxis((points - view[:3, 3]) @ view[:3, :3], -1, 0)
    return np.asarray((z < 0) & (np.maximum(np.abs(x), np.abs(y)) < -z * (APERTURE / 2 / WIDE)))


def _walls(floor: np.ndarray, height: float) -> Furniture:
    """The walls as thin boxes that stand outside of a floor (k, 2)."""
    way = np.roll(floor, -1, 0) - floor
    outwards = -np.array([inward_normal(floor, edge) for edge in range(len(floor))])
    middle = floor + way / 2 + 0.05 * outwards
    size = np.stack([np.linalg.norm(way, axis=1), np.full(len(floor), height), np.full(len(floor), 0.1)], 1)
    return Furniture(size, np.insert(middle, 1, 0.0, axis=1), np.arctan2(outwards[:, 0], outwards[:, 1]))


def _spots(floor: np.ndarray, middle: np.ndarray) -> list[np.ndarray]:
    """Where a camera inside may stand, (2,) x and z each, metres: in the corners, then along the walls."""
    spots = []
    for corner in floor:
        away = max(float(np.linalg.norm(middle - corner)), 1e-9)
        spots += [corner + step / away * (middle - corner) for step in STEPS if step < max(away - APART, 0.9)]
    for edge in range(len(floor)):
        start, end = floor[edge], floor[(edge + 1) % len(floor)]
        spots += [start + share * (end - start) + OFF * inward_normal(floor, edge) for share in ALONG]
    return spots


def _level_view(spot: np.ndarray, aim: np.ndarray, height: float) -> np.ndarray:
    """(4, 4) float camera to world from eye height over `spot` to a little lower over `aim`, x and z each."""
    eye = np.array([spot[0], EYES * height, spot[1]])
    lower = max(0.3 * height, eye[1] - STEEPEST * float(np.linalg.norm(aim - spot)))
    return view_matrix(eye, np.array([aim[0], lower, aim[1]]))


def _depth(room: shapely.Polygon, spot: np.ndarray, way: np.ndarray) -> float:
    """Metres that one sees from a spot in the mean of a wide picture, up to the walls."""
    turn = np.arctan2(way[1], way[0]) + np.linspace(-0.7, 0.7, 15)
    ends = spot + 50.0 * np.stack([np.cos(turn), np.sin(turn)], 1)
    lines = shapely.linestrings([[spot, end] for end in ends])
    return float(shapely.distance(shapely.Point(spot), shapely.intersection(lines, room.boundary)).mean())
