"""Colliders of furniture that is one mesh: a hull, or convex pieces that follow the shape."""

from __future__ import annotations

from importlib.util import find_spec

import fast_simplification
import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary
from echousd.shapes.geometry import Collider
from echousd.shapes.meshing import decimate

FACES, HULL_FACES, PIECES_FACES = 400, 120, 1200
PIECES, CORNERS = 16, 32  # convex pieces of a shape at most, corners of each
COARSE = 0.08  # CoACD's concavity: what is left of a shape's hollows, of its size
SEARCH = {"mcts_iterations": 20, "mcts_nodes": 10, "resolution": 500}  # a second a piece rather than ten
LEAST_VOLUME = 1e-7  # m³ of a piece that is one
DIGITS = 4  # of metres, corners of a hull
FLAT = 0.012  # metres: what is as near to the top or the bottom belongs to it


def approximation(category: str) -> str:
    """The UsdPhysics approximation of a category's collider, `convexHull` or `convexDecomposition`."""
    return "convexHull" if vocabulary().category(category).solid else "convexDecomposition"


def colliders_of(mesh: trimesh.Trimesh, category: str) -> tuple[Collider, ...]:
    """What a piece of furniture collides with: one hull of what is solid or convex, else convex pieces.

    `mesh`: in the object's frame, metres. `category`: its word.
    """
    if approximation(category) == "convexHull" or mesh.is_convex:
        return (standing_hull(mesh),)
    if not find_spec("coacd"):  # no wheel for this machine
        return (collider(mesh, category),)
    pieces = convex_pieces(mesh)
    low, high = np.min([p.bounds[0] for p in pieces], axis=0), np.max([p.bounds[1] for p in pieces], axis=0)
    out = []
    for number, piece in enumerate(pieces):
        share = (np.asarray(piece.vertices) - low) / np.maximum(high - low, 1e-9)
        points = mesh.bounds[0] + share * np.ptp(mesh.bounds, axis=0)
        level = snapped(points, mesh.bounds)
        if np.ptp(level[:, 1]) > 0:  # a thin top lies all in what would be one plane
            points = level
        hull = _hull(points)
        out.append(Collider("collider" if len(pieces) == 1 else f"collider_{number + 1}", hull, "convexHull"))
    return tuple(out)


def convex_pieces(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """Hulls that follow a shape together (CoACD, Wei et al. 2022), the same ones each time; its hull where it is flat.

    `mesh`: any; one that is not closed is closed by voxels.
    """
    import coacd

    coacd.set_log_level("error")
    closed = mesh.copy()
    closed.merge_vertices(merge_tex=True, merge_norm=True)
    light = decimate(closed, PIECES_FACES)
    way = "off" if light.is_watertight else "on"
    found = coacd.run_coacd(
        coacd.Mesh(np.asarray(light.vertices, float), np.asarray(light.faces, np.int32)), threshold=COARSE,
        max_convex_hull=PIECES, preprocess_mode=way, decimate=True, max_ch_vertex=CORNERS, seed=0, **SEARCH,
    )  # fmt: skip
    hulls = [trimesh.Trimesh(points, faces).convex_hull for points, faces in found]
    return [hull for hull in hulls if hull.volume > LEAST_VOLUME] or [mesh.convex_hull]


def collider(mesh: trimesh.Trimesh, category: str) -> Collider:
    """A light mesh for collisions: a hull where the approximation is one, else the shape with few faces."""
    kind = approximation(category)
    if kind == "convexHull":
        return standing_hull(mesh)
    return Collider("collider", flush(_reduced(mesh, FACES), mesh.bounds), kind)


def standing_hull(mesh: trimesh.Trimesh) -> Collider:
    """One hull of a mesh (metres) that stands on a plane, however its base is rounded."""
    light = flush(_reduced(mesh.convex_hull, HULL_FACES), mesh.bounds)
    return Collider("collider", _hull(np.concatenate([light.vertices, soles(mesh)])), "convexHull")


def flush(mesh: trimesh.Trimesh, bounds: np.ndarray) -> trimesh.Trimesh:
    """The mesh stretched to a box, its lowest and highest points on two planes: it stands, and is stood on.

    `mesh`: a collider, metres. `bounds`: (2, 3) float, what it must end with.
    """
    low, high = mesh.bounds
    share = (np.asarray(mesh.vertices) - low) / np.maximum(high - low, 1e-9)
    points = snapped(bounds[0] + share * (bounds[1] - bounds[0]), bounds)
    return trimesh.Trimesh(points, mesh.faces, process=False)


def snapped(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(n, 3) float: points with those near the lowest or the highest plane of `bounds` (2, 3) on it."""
    bottom, top = bounds[0][1], bounds[1][1]
    reach = min(FLAT, 0.1 * (top - bottom))
    height = points[:, 1]
    height = np.where(height < bottom + reach, bottom, np.where(height > top - reach, top, height))
    return np.column_stack([points[:, 0], height, points[:, 2]])


def soles(mesh: trimesh.Trimesh) -> np.ndarray:
    """(32, 3) float: outlines of what a mesh stands on and of its top, each in one plane."""
    points, (low, high) = np.asarray(mesh.vertices), mesh.bounds[:, 1]
    reach = min(FLAT, 0.1 * (high - low))
    angle = np.arange(16) * np.pi / 8
    rays = np.stack([np.cos(angle), np.sin(angle)])
    found = []
    for level in (low, high):
        near = points[np.abs(points[:, 1] - level) <= reach]
        outline = near[(near[:, [0, 2]] @ rays).argmax(0)]
        outline[:, 1] = level
        found.append(outline)
    return np.concatenate(found)


def _hull(points: np.ndarray) -> trimesh.Trimesh:
    # corners nearer to one another than what is written would be one corner there, with faces that have two
    return trimesh.convex.convex_hull(np.unique(points.round(DIGITS), axis=0))


def _reduced(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """The mesh with at most about `faces` triangles, used vertices only."""
    if len(mesh.faces) > faces:
        points, triangles = fast_simplification.simplify(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), target_count=faces, agg=5
        )
        mesh = trimesh.Trimesh(points, triangles, process=True)
    out = mesh.copy()
    out.update_faces(out.nondegenerate_faces())
    out.remove_unreferenced_vertices()
    return out


def hull_of(mesh: trimesh.Trimesh, category: str) -> Collider:
    """What an object collides with, whatever its mesh is like."""
    try:
        return collider(mesh, category)
    except Exception:  # qhull and the simplifier fail on flat and broken meshes in their own ways
        low, high = mesh.bounds
        box = trimesh.creation.box(np.maximum(high - low, 1e-3))
        box.apply_translation((low + high) / 2)
        return Collider("collider", box, "convexHull")
