"""Which things run into each other, and how deep: by what is seen of them, which boxes and colliders are not."""

from collections.abc import Mapping, Sequence
from itertools import starmap

import numpy as np

from echomodel.boxes import Boxes
from echomodel.boxes2d import axes, upright
from echomodel.triangles import Mesh, along, area_normals, bounds_of, cross, joined, spans_of, spread
from echousd.graph import SceneGraph
from echousd.make.scene import Scene
from echousd.place.geometry import IN_WALL, SOLID, TOUCH, Collision, separation
from echousd.shapes.geometry import Geometry
from echousd.stage.contents import Shape, upright_box

NEAR = 0.05  # metres between two boxes that are one
SAMPLES = 600  # points per surface and pair
PAIRS = 20_000  # of points and triangles that are compared in one go, which stay in the cache


def shape_at(mesh: Mesh, position: np.ndarray, yaw: float) -> Shape:
    """A thing that stands at a position (3,), metres, with a yaw in radians; `mesh`: in its own frame."""
    turn = upright(yaw)
    points = mesh.vertices @ turn.T + position
    return Shape(points, mesh.faces, *upright_box(points, turn))


def told(
    scene: Scene, graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], met: Sequence[tuple[int, int]],
    at_walls: Sequence[tuple[int, int]],
) -> tuple[Collision, ...]:  # fmt: skip
    """Of pairs of things that meet, and of things and numbers of walls, those that `check` names, by its measure,
    deepest first."""
    # in the order of stages, body by body: samples of a surface are then the same
    pieces = [sorted(geometry[name].parts, key=lambda one: one.body) for name in graph.names]
    meshes = [joined([part.mesh for part in parts]) for parts in pieces]
    placed = zip(meshes, np.asarray(boxes.position, float), boxes.yaw.tolist(), strict=True)
    shapes = list(zip(graph.names, starmap(shape_at, placed), strict=True))
    walls = ((wall.name, joined([piece.mesh for piece in wall.everything])) for wall in scene.walls)
    shapes += [(name, shape_at(mesh, np.zeros(3), 0.0)) for name, mesh in walls]
    found = hits(shapes, np.array(met), SOLID, boxes=True)
    found += hits(shapes, np.array([(one, len(meshes) + wall) for one, wall in at_walls]), IN_WALL, boxes=False)
    return tuple(sorted(found, key=lambda hit: -hit.depth))


def hits(things: Sequence[tuple[str, Shape]], pairs: np.ndarray, deep: float, *, boxes: bool) -> list[Collision]:
    """Those of some pairs (p, 2) of things that reach further than `deep` metres into each other.

    `boxes`: whether the box of what has no surface counts.
    """
    if not len(pairs):
        return []
    size, position = np.array([one.size for _, one in things]), np.array([one.position for _, one in things])
    overlap = -separation(size, position, np.array([one.yaw for _, one in things]), pairs)
    found = []
    for (i, j), depth in zip(pairs[overlap > TOUCH].tolist(), overlap[overlap > TOUCH], strict=True):
        one, other = things[i][1], things[j][1]
        if len(one.faces) and len(other.faces):
            reach = max(mesh_depth(one, other, deep), depth if _one_place(one, other) else 0.0)
        else:
            reach = depth if boxes else 0.0
        if reach > deep:
            found.append(Collision(things[i][0], things[j][0], float(reach)))
    return found


def _one_place(one: Shape, other: Shape) -> bool:
    """Whether two things fill one box: surfaces that are the same reach nowhere into one another."""
    near = np.abs(one.position - other.position).max() < NEAR
    return bool(near and np.abs(one.size - other.size).max() < NEAR)


def mesh_depth(first: Shape, second: Shape, deep: float) -> float:
    """How deep one surface reaches into the other solid in metres, no more than `deep` where that is not deeper."""
    return max(_reach(first, second, deep), _reach(second, first, deep))


def distances(point: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(f,) from a point (3,), or of each its own (f, 1, 3), to the triangles (f, 3, 3)."""
    corner, side = triangles - point, np.roll(triangles, -1, axis=1) - triangles
    share = -(corner * side).sum(2) / np.maximum((side**2).sum(2), 1e-30)
    out = np.linalg.norm(corner + np.clip(share, 0, 1)[..., None] * side, axis=2).min(1)  # to their edges
    normal = area_normals(triangles)
    length = np.linalg.norm(normal, axis=1)
    over = (length > 0) & ((cross(corner, side) * normal[:, None]).sum(2) >= 0).all(1)
    return np.where(over, np.abs((corner[:, 0] * normal).sum(1)) / np.maximum(length, 1e-30), out)


def _reach(surface: Shape, solid: Shape, deep: float) -> float:
    points = surface_points(surface, solid)
    within, at_most = inside_solid(points, solid, deep)
    points, at_most = points[within & (at_most > deep)], at_most[within & (at_most > deep)]
    if not len(points):
        return 0.0
    triangles, (low, high) = solid.triangles, solid.spans.transpose(0, 2, 1)[:, :, None]
    skin = np.concatenate((solid.points, _scatter(solid.points, solid.faces, 4000))).T
    deepest = 0.0
    # A sample of the skin is further away than the skin itself: deepest first, until no point can be deeper.
    ways = (skin - point[:, None] for point in points)
    at_most = np.minimum(at_most, np.sqrt([along(way, way).min() for way in ways]))
    order, step = np.argsort(-at_most), max(1, PAIRS // len(triangles))
    for some in (order[start : start + step] for start in range(0, len(order), step)):
        if at_most[some[0]] <= max(deepest, deep):
            break
        point, away = points[some].T[..., None], at_most[some]
        way = np.maximum(np.maximum(low - point, point - high), 0.0)  # to the boxes around the triangles
        number, face = np.nonzero(along(way, way) <= (away[:, None] + 1e-9) ** 2)
        np.minimum.at(away, number, distances(points[some[number], None], triangles[face]))
        deepest = max(deepest, float(away.max()))
    return deepest


def surface_points(surface: Shape, solid: Shape) -> np.ndarray:
    """(s, 3) float: vertices and scattered points of a surface that lie in the other object's box."""
    near = surface.faces[_touches(surface.triangles, solid)]
    if not len(near):
        return np.zeros((0, 3))
    points = np.concatenate((surface.points[near].reshape(-1, 3), _scatter(surface.points, near, 4 * SAMPLES)))
    points = points[(np.abs(_local(points, solid)) <= solid.size / 2).all(-1)]
    if len(points) <= SAMPLES:
        return points
    return points[np.random.default_rng(0).choice(len(points), SAMPLES, replace=False)]


def _scatter(points: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """(count, 3) points of the triangles, as many everywhere; none of what has no area."""
    triangles = points[faces]
    return spread(triangles, count)[0] if area_normals(triangles).any() else np.zeros((0, 3))


def _local(points: np.ndarray, solid: Shape) -> np.ndarray:
    u = np.stack(axes(solid.yaw))
    offset = points - solid.position
    plan = offset[..., [0, 2]] @ u.T
    return np.stack((plan[..., 0], offset[..., 1] - solid.size[1] / 2, plan[..., 1]), -1)


def _touches(triangles: np.ndarray, solid: Shape) -> np.ndarray:
    low, high = spans_of(_local(triangles, solid))
    return np.asarray(((low <= solid.size / 2) & (high >= -solid.size / 2)).all(-1))


def inside_solid(points: np.ndarray, solid: Shape, deep: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """(s,) bool: whether points (s, 3) are inside a solid, of those that may be deeper; (s,) float: how deep at most.

    Around its closed pieces nothing turns but within their boxes, so that most points are compared with few triangles;
    from within a piece the way out of its box meets its surface.
    """
    low, high = bounds_of(solid.points)
    at_most = np.full(len(points), np.inf)
    inside = ((points >= low) & (points <= high)).all(1)
    if not inside.any():
        return inside, at_most
    loose, closed = solid.pieces
    turns = winding_number(points, loose) if len(loose) else np.zeros(len(points))
    (low, high), planes = solid.closed_spans.transpose(0, 2, 1)[..., None], points.T[:, None].copy()
    out = np.minimum(planes - low, high - planes).min(0)  # (k, s) of the boxes around the pieces
    for number in np.flatnonzero((out >= deep).any(1)).tolist():
        some = np.flatnonzero(out[number] >= deep)
        turn = winding_number(points[some], closed[number])
        turns[some] += turn
        at_most[some] = np.minimum(at_most[some], np.where(turn > 0.5, out[number, some], np.inf))
    return turns > 0.5, at_most


def winding_number(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(s,) float: generalised winding number of a soup of triangles (f, 3, 3) around points (s, 3), 1 inside, 0
    outside (Jacobson 2013)."""
    out = np.zeros(len(points))
    step = max(1, PAIRS // max(len(triangles), 1))
    corners, places = (np.moveaxis(values.astype(np.float32), 0, -1).copy() for values in (triangles, points))
    for start in range(0, len(points), step):  # each number of all pairs lies in one plane
        some = slice(start, start + step)
        a, b, c = corners[:, :, None] - places[:, some, None]
        la, lb, lc = (np.sqrt(along(v, v)) for v in (a, b, c))
        triple = along(a, (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]))
        below = la * lb * lc + along(a, b) * lc + along(b, c) * la + along(c, a) * lb
        out[some] = np.arctan2(triple, below).sum(-1) / (2 * np.pi)
    return out
