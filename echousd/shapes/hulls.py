"""Convex hulls: exact ones, those of what stands and is stood on; moves in plan by which such solids would meet."""

from collections.abc import Sequence

import fast_simplification
import numpy as np
import shapely
from manifold3d import Manifold
from shapely.geometry.base import BaseGeometry

from echomodel.triangles import Mesh, box
from echousd.shapes.geometry import Collider

FACES = 120  # of the hull of what stands
DIGITS = 4  # of metres, corners of a hull
FLAT = 0.012  # metres: what is as near to the top or the bottom belongs to it
APART = 0.015  # metres, a quarter of its extent at most, between corners of a base: engines take four of all of them
THIN = 1e-4  # metres, least extent of the box of points in one plane
FINE = 1e-6  # metres: a corner that is nearer than that to a line or plane between others is none
EXACT = 9  # digits of metres: among corners that rounding alone keeps apart, a hull comes out with a dent
PLANE = 1e-9  # share of the cube of their extent that the hull of points in one plane may have by rounding


def hull_of(points: np.ndarray) -> Mesh | None:
    """The convex hull of points (n, 3) with exact corners, facing outwards; None of points in one plane."""
    if (hull := _hull(points)) is None:
        return None
    mesh = hull.simplify(FINE).to_mesh64()
    return Mesh(np.array(mesh.vert_properties), mesh.tri_verts.astype(int))  # views would be leaks in the end


def _hull(points: np.ndarray) -> Manifold | None:
    hull = Manifold.hull_points(points.round(EXACT))
    return None if hull.volume() <= PLANE * np.ptp(points, axis=0).max() ** 3 else hull


def convex_hull(points: np.ndarray) -> Mesh:
    """As `hull_of`; of points in one plane their box, a tenth of a mm thick."""
    return hull_of(points) or box_around(points, THIN)


def box_around(points: np.ndarray, least: float) -> Mesh:
    """The box of points (n, 3), metres, no extent below `least`."""
    low, high = points.min(0), points.max(0)
    thick = np.maximum(least - (high - low), 0) / 2
    return box(low - thick, high + thick)


def hull_volume(points: np.ndarray) -> float:
    """Volume of the convex hull of points (n, 3), m³; 0 of points in one plane."""
    hull = _hull(points)
    return 0.0 if hull is None else hull.volume()


def rounded_hull(points: np.ndarray) -> Mesh:
    """The convex hull of points (n, 3), metres, that stay apart when they are written."""
    # corners nearer to one another than what is written would be one corner there, with faces that have two
    return convex_hull(np.unique(points.round(DIGITS), axis=0))


def standing_hull(mesh: Mesh, gives: float = 0.0) -> Collider:
    """One hull of a mesh (metres) that stands on a plane, however its base is rounded.

    `gives`: metres that a soft base gives way where it stands.
    """
    hull = convex_hull(mesh.vertices)
    corners = hull.vertices
    if len(hull.faces) > FACES:
        points, faces = corners.astype(np.float32), hull.faces.astype(np.int32)
        points, faces = fast_simplification.simplify(points, faces, target_count=FACES, agg=5)
        corners = points[np.unique(faces)].astype(float)
    corners, (low, high) = flush(corners, mesh.bounds), mesh.bounds[:, 1]
    between = corners[(corners[:, 1] > low) & (corners[:, 1] < high)]
    outlines = sole(mesh, low, max(FLAT, gives)), sole(mesh, high, FLAT)
    return Collider("collider", rounded_hull(np.concatenate([between, *outlines])), "convexHull")


def flush(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Points of a collider (n, 3) stretched to a box, the lowest and the highest on two planes: it is stood on.

    `bounds`: (2, 3) float, metres, what they must end with.
    """
    low, high = points.min(0), points.max(0)
    share = (points - low) / np.maximum(high - low, 1e-9)
    return snapped(bounds[0] + share * (bounds[1] - bounds[0]), bounds)


def snapped(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(n, 3) float: points with those near the lowest or the highest plane of `bounds` (2, 3) on it."""
    bottom, top = bounds[0][1], bounds[1][1]
    reach = min(FLAT, 0.1 * (top - bottom))
    height = points[:, 1]
    height = np.where(height < bottom + reach, bottom, np.where(height > top - reach, top, height))
    return np.column_stack([points[:, 0], height, points[:, 2]])


def sole(mesh: Mesh, level: float, reach: float) -> np.ndarray:
    """(k, 3) float: the outline of what of a mesh is within `reach` metres of a height `level`, in the plane there."""
    near = np.abs(mesh.vertices[:, 1] - level) <= min(reach, 0.1 * float(np.ptp(mesh.bounds[:, 1])))
    plan = mesh.vertices[near][:, [0, 2]]
    outline = shapely.convex_hull(shapely.multipoints(plan))
    outline = shapely.remove_repeated_points(outline, min(APART, outline.length / 16, np.ptp(plan, axis=0).min() / 2))
    return np.insert(shapely.get_coordinates(outline), 1, level, axis=1)


FLUSH = 0.002  # metres: what reaches less far into another from above or below stands on it
Solids = Sequence[np.ndarray]


def forbidden(moving: np.ndarray, fixed: np.ndarray) -> BaseGeometry | None:
    """Moves (x, z) in plan by which one convex solid would run into another; None where it never does.

    `moving`, `fixed`: (n, 3) float, corners in the room, metres, +Y up.

    The moves are the Minkowski difference of the two at height 0, a convex polygon.
    """
    low = max(moving[:, 1].min(), fixed[:, 1].min())
    if min(moving[:, 1].max(), fixed[:, 1].max()) - low <= FLUSH:
        return None
    hull = _hull((fixed[:, None] - moving[None]).reshape(-1, 3)[:, [0, 2, 1]])  # cut across its third axis
    return None if hull is None else shapely.Polygon(hull.slice(0.0).to_polygons()[0])  # None: parallel sheets


def forbidden_moves(moving: Solids, fixed: Solids, reach: float) -> BaseGeometry:
    """Moves by which any solid of one thing would run into any solid of another, none longer than about `reach`."""
    found = []
    boxes = [(solid.min(0) - reach, solid.max(0) + reach) for solid in fixed]
    for one in moving:
        low, high = one.min(0), one.max(0)
        for other, (below, above) in zip(fixed, boxes, strict=True):
            if (low[[0, 2]] < above[[0, 2]]).all() and (high[[0, 2]] > below[[0, 2]]).all():
                polygon = forbidden(one, other)
                if polygon is not None:
                    found.append(polygon)
    return shapely.union_all(found)


def depth(moves: BaseGeometry, at: np.ndarray) -> float:
    """Shortest way out of the forbidden moves from a move (2,) that was made, metres; 0 outside of them."""
    point = shapely.Point(at)
    return float(point.distance(moves.boundary)) if not moves.is_empty and moves.contains(point) else 0.0
