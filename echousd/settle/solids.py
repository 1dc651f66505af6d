"""The physics of a stage as plain data: convex pieces in their places, what they belong to and what it weighs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from pxr import Tf, Usd, UsdGeom, UsdPhysics, UsdShade

from echousd.shapes.geometry import Mass
from echousd.shapes.masses import read_mass
from echousd.stage.contents import triangulated
from echousd.stage.encoding import StageError
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import array, matrix

GRAVITY = 9.81  # m/s², where the stage tells none
FRICTION = 0.5  # where no physics material is bound
SKIN = 0.05  # metres: how thick a triangle of a static concave mesh is made, inwards
LEAST_DEPTH = 0.002  # metres, of a mesh that is a sheet
LEAST_AREA = 1e-5  # m² of a triangle that is taken at all
HULLS = ("convexHull", "boundingCube", "boundingSphere")


@dataclass(frozen=True, eq=False)
class Solid:
    """One convex piece: the corners (n, 3) of its hull in the world, metres, its friction and its collider's path."""

    points: np.ndarray
    friction: float
    collider: str


@dataclass(frozen=True, eq=False)
class Body:
    """What moves as one.

    Arguments:
        name, path: of the prim. place: (4, 4) float, prim to world without scale, column vectors, metres.
        solids: its pieces, at least one. mass: in the prim's frame, None = by volume.
    """

    name: str
    path: str
    place: np.ndarray
    solids: tuple[Solid, ...]
    mass: Mass | None


@dataclass(frozen=True, eq=False)
class World:
    """All that can touch: bodies, what never moves, and gravity (3,) in m/s²."""

    bodies: tuple[Body, ...]
    fixed: tuple[Solid, ...]
    gravity: np.ndarray


def read_world(stage: Usd.Stage) -> World:
    """Bodies and colliders of a stage as engines find them; raises StageError naming a prim that cannot be read.

    A piece with joints counts as one body, its drawers and doors closed.
    """
    metres = metres_per_unit(stage)
    cache = UsdGeom.XformCache()
    owned: dict[str, list[Solid]] = {}
    roots: dict[str, Usd.Prim] = {}
    fixed: list[Solid] = []
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if not prim.HasAPI(UsdPhysics.CollisionAPI) or not prim.IsA(UsdGeom.Gprim):
            continue
        if UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get() is False:
            continue
        root = body_root(prim)
        solids = list(_solids(prim, cache, metres, moves=root is not None))
        if root is None:
            fixed += solids
        else:
            roots[str(root.GetPath())] = root
            owned.setdefault(str(root.GetPath()), []).extend(solids)
    bodies = []
    for path, root in roots.items():
        place = matrix(cache.GetLocalToWorldTransform(root), root)
        place[:3, :3] /= np.linalg.norm(place[:3, :3], axis=0)
        place[:3, 3] *= metres
        if owned[path]:
            bodies.append(Body(root.GetName(), path, place, tuple(owned[path]), read_mass(root)))
    return World(tuple(bodies), tuple(fixed), _gravity(stage, metres))


def body_root(prim: Usd.Prim) -> Usd.Prim | None:
    """The prim that a collider moves with: the outermost enabled body or articulation above it, None = it is fixed."""
    found = None
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(UsdPhysics.ArticulationRootAPI) or (
            prim.HasAPI(UsdPhysics.RigidBodyAPI)
            and UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get() is not False
            and not UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr().Get()
        ):
            found = prim
        prim = prim.GetParent()
    return found


def _solids(prim: Usd.Prim, cache: UsdGeom.XformCache, metres: float, *, moves: bool) -> Iterator[Solid]:
    try:
        points, faces = triangulated(prim)
        world = matrix(cache.GetLocalToWorldTransform(prim), prim)
    except Tf.ErrorException as error:
        raise StageError(f"<{prim.GetPath()}>: its collider cannot be read ({error})") from None
    points = (points @ world[:3, :3].T + world[:3, 3]) * metres
    if not len(faces):
        return
    friction, path = _friction(prim), str(prim.GetPath())
    kind = prim.GetAttribute("physics:approximation").Get() or "none"
    if moves or kind in HULLS:
        yield Solid(points, friction, path)
        return
    for part in trimesh.Trimesh(points, faces).split(only_watertight=False):
        for corners in convex_parts(part):
            yield Solid(corners, friction, path)


def convex_parts(mesh: trimesh.Trimesh) -> Iterator[np.ndarray]:
    """Corners of convex pieces that have the surface of a connected mesh: itself, or a thin prism below each triangle.

    No prism is thicker than the mesh, so that none comes out on the other side of a board.
    """
    if mesh.is_watertight and mesh.is_convex:
        yield np.asarray(mesh.vertices)
        return
    depth = min(SKIN, 2 * abs(float(mesh.volume)) / max(float(mesh.area), 1e-9)) if mesh.is_watertight else SKIN
    corners = np.asarray(mesh.triangles)
    for triangle, normal, area in zip(corners, mesh.face_normals, mesh.area_faces, strict=True):
        if area > LEAST_AREA:
            yield np.concatenate([triangle, triangle - max(depth, LEAST_DEPTH) * normal])


def _friction(prim: Usd.Prim) -> float:
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
    told = UsdPhysics.MaterialAPI(material).GetDynamicFrictionAttr().Get() if material else None
    return FRICTION if told is None else float(told)


def _gravity(stage: Usd.Stage, metres: float) -> np.ndarray:
    down = np.array([0.0, 0, -1] if up_axis(stage) == "Z" else [0.0, -1, 0])
    for prim in stage.Traverse():
        if prim.GetTypeName() == "PhysicsScene":
            told = prim.GetAttribute("physics:gravityDirection")
            direction = array(told) if told.HasAuthoredValue() else down
            length = float(np.linalg.norm(direction))
            strength = prim.GetAttribute("physics:gravityMagnitude").Get()
            strength = GRAVITY if strength is None or not 0 <= strength < np.inf else float(strength) * metres
            return strength * (direction / length if length > 0 else down)
    return GRAVITY * down
