"""Cameras for a painter: a sphere of views from free space in the room, and which texels they see."""

from collections.abc import Sequence

import numpy as np
import shapely

from echomodel.triangles import area_normals
from echousd.draw.rays import RenderUnavailable, embree, free, way_to
from echousd.draw.surfaces import Painted, Surfaces
from echousd.draw.views import view_matrix
from echousd.texturing.atlas import Unwrapped, texel_faces
from echousd.texturing.job import JobCamera

HEIGHT = 1.4  # metres, of the point that cameras look through
SPHERE = 0.5  # metres from it
LEVELS = (-20.0, 0.0, 20.0)  # elevations of the job's cameras, degrees
ELEVATIONS, AZIMUTHS = (-30.0, 30.0), (-180.0, 180.0)  # degrees
FIELDS = (45.0, 75.0)  # of view, degrees
SEEN_FROM = 48  # cameras that texels are counted with
SAMPLES = 1500  # points of an object


def free_point(surfaces: Surfaces) -> tuple[np.ndarray, float]:
    """(3,) float, the point at `HEIGHT` that is furthest from everything, and how far that is in plan, metres."""
    clouds = [(thing.category, thing.kind, thing.triangles.reshape(-1, 3)) for thing in surfaces.objects]
    things = [points for _, kind, points in clouds if kind != "stuff"]
    floor = [points for category, _, points in clouds if category == "floor"]
    shape = shapely.MultiPoint(np.concatenate(floor or things or [each[2] for each in clouds])[:, [0, 2]]).convex_hull
    corners = surfaces.graph.room.corners
    if corners is not None and shapely.Polygon(corners).is_valid:
        shape = shapely.Polygon(corners)
    tall = (points for points in things if points[:, 1].min() < HEIGHT + 0.5 and points[:, 1].max() > HEIGHT - 0.5)
    empty = shape.difference(shapely.union_all([shapely.MultiPoint(points[:, [0, 2]]).convex_hull for points in tall]))
    low_x, low_z, high_x, high_z = shape.bounds
    grid = np.stack(np.meshgrid(np.linspace(low_x, high_x, 33), np.linspace(low_z, high_z, 33)), -1).reshape(-1, 2)
    apart = shapely.distance(shapely.points(grid), empty.boundary)
    apart[~shapely.contains_xy(empty, grid)] = -1.0
    best = int(apart.argmax())
    return np.array([grid[best, 0], HEIGHT, grid[best, 1]]).round(4), float(max(apart[best], 0.05))


def sphere_cameras(at: np.ndarray, distance: float) -> list[JobCamera]:
    """Cameras on a sphere around `at` that look through it, elevation by elevation; azimuth 0 stands at +Z."""
    found: list[JobCamera] = []
    for up in LEVELS:
        for around in np.linspace(*AZIMUTHS, SEEN_FROM // len(LEVELS), endpoint=False):
            e, a = np.radians(up), np.radians(around)
            eye = at + distance * np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
            rows = tuple(tuple(round(float(v), 6) + 0.0 for v in row) for row in view_matrix(eye, at))
            camera = {"name": f"view_{len(found):03d}", "matrix": rows, "fov": FIELDS[1]}
            found.append(JobCamera.model_validate(camera))
    return found


def visible_shares(
    objects: Sequence[Painted], laid: Sequence[Unwrapped], cameras: Sequence[JobCamera]
) -> list[float] | None:
    """For every object the share of its texels that a camera sees past all others; None where Embree is missing."""
    try:
        tree = embree(np.concatenate([t.triangles for t in objects]))
    except RenderUnavailable:
        return None
    shares = []
    for thing, mesh in zip(objects, laid, strict=True):
        points, normals = _samples(thing.triangles, mesh.corners)
        seen = np.zeros(len(points), bool)
        for camera in cameras:
            matrix = np.array(camera.matrix)
            local = (points - matrix[:3, 3]) @ matrix[:3, :3]
            half = np.tan(np.radians(camera.fov) / 2) * -local[:, 2]
            ask = np.flatnonzero(~seen & (local[:, 2] < -0.01) & (np.abs(local[:, :2]) < half[:, None]).all(1))
            if not len(ask):
                continue
            way, away = way_to(points[ask].T, matrix[:3, 3:])
            side = np.where((way * normals[ask].T).sum(0) < 0, -1.0, 1.0)
            seen[ask] = free(tree, points[ask].T + 1e-3 * side * normals[ask].T, way, away, away > 0) > 0
        shares.append(float(seen.mean()) if len(seen) else 0.0)
    return shares


def _samples(triangles: np.ndarray, st: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points at texels of an object, evenly in its picture, and the normals there, (n, 3) float each."""
    low, high = st.reshape(-1, 2).min(0), st.reshape(-1, 2).max(0)
    extent = max(float((high - low).max()), 1e-9)
    face, bary, _ = texel_faces((st - low) / extent, int(np.sqrt(3 * SAMPLES)))
    points = np.einsum("nc,ncx->nx", bary, triangles[face])
    normals = area_normals(triangles)[face]
    return points, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
