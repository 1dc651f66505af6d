"""Colliders of furniture that is one mesh: a hull, or convex pieces that follow the shape."""

from importlib.util import find_spec

import numpy as np

from echomodel.triangles import Mesh
from echomodel.vocabulary import vocabulary
from echousd.shapes.geometry import Collider
from echousd.shapes.hulls import box_around, convex_hull, flush, hull_volume, rounded_hull, snapped, standing_hull

FACES, PIECES_FACES = 400, 1200
PIECES, CORNERS = 16, 32  # convex pieces of a shape at most, corners of each
COARSE = 0.08  # CoACD's concavity: what is left of a shape's hollows, of its size
SEARCH = {"mcts_iterations": 20, "mcts_nodes": 10, "resolution": 500}  # a second a piece rather than ten
LEAST_VOLUME = 1e-7  # m³ of a piece that is one


def approximation(category: str) -> str:
    """The UsdPhysics approximation of a category's collider, `convexHull` or `convexDecomposition`."""
    return "convexHull" if vocabulary().category(category).solid else "convexDecomposition"


def colliders_of(mesh: Mesh, category: str) -> tuple[Collider, ...]:
    """What a piece of furniture collides with: one hull of what is solid or convex, else convex pieces.

    `mesh`: in the object's frame, metres. `category`: its word.
    """
    if approximation(category) == "convexHull" or mesh.trimesh.is_convex:
        return (standing_hull(mesh),)
    if not find_spec("coacd"):  # no wheel for this machine
        return (collider(mesh, category),)
    pieces = convex_pieces(mesh)
    low, high = np.min([p.bounds[0] for p in pieces], axis=0), np.max([p.bounds[1] for p in pieces], axis=0)
    out = []
    for number, piece in enumerate(pieces):
        share = (piece.vertices - low) / np.maximum(high - low, 1e-9)
        points = mesh.bounds[0] + share * np.ptp(mesh.bounds, axis=0)
        level = snapped(points, mesh.bounds)
        if np.ptp(level[:, 1]) > 0:  # a thin top lies all in what would be one plane
            points = level
        name = "collider" if len(pieces) == 1 else f"collider_{number + 1}"
        out.append(Collider(name, rounded_hull(points), "convexHull"))
    return tuple(out)


def convex_pieces(mesh: Mesh) -> list[Mesh]:
    """Hulls that follow a shape together (CoACD, Wei et al. 2022), the same ones each time; its hull where it is flat.

    `mesh`: any; one that is not closed is closed by voxels.
    """
    import coacd

    from echousd.shapes.meshing import decimate

    coacd.set_log_level("error")
    closed = mesh.trimesh
    closed.merge_vertices(merge_tex=True, merge_norm=True)
    light = decimate(closed, PIECES_FACES)
    way = "off" if light.is_watertight else "on"
    found = coacd.run_coacd(
        coacd.Mesh(np.asarray(light.vertices, float), np.asarray(light.faces, np.int32)), threshold=COARSE,
        max_convex_hull=PIECES, preprocess_mode=way, decimate=True, max_ch_vertex=CORNERS, seed=0, **SEARCH,
    )  # fmt: skip
    solids = [points for points, _ in found if hull_volume(points) > LEAST_VOLUME]
    return [convex_hull(points) for points in solids or [mesh.vertices]]


def collider(mesh: Mesh, category: str) -> Collider:
    """A light mesh for collisions: a hull where the approximation is one, else the shape with few faces."""
    kind = approximation(category)
    if kind == "convexHull":
        return standing_hull(mesh)
    from echousd.shapes.meshing import quadric

    light = quadric(mesh.trimesh, FACES)
    if light.is_watertight and light.volume < 0:  # of somebody's mirrored model
        light.invert()
    return Collider("collider", Mesh(flush(np.asarray(light.vertices), mesh.bounds), light.faces), kind)


def collider_of(mesh: Mesh, category: str) -> Collider:
    """What an object collides with, whatever its mesh is like."""
    try:
        return collider(mesh, category)
    except Exception:  # qhull and the simplifier fail on flat and broken meshes in their own ways
        return Collider("collider", box_around(mesh.bounds, 1e-3), "convexHull")
