"""Which pieces of a room do not rest, and why: convex pieces as plain data, simulated in MuJoCo for a while."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from pxr import Tf, Usd, UsdGeom, UsdPhysics, UsdShade

from echomodel.files import raising
from echomodel.late import extra
from echousd.layers.physics import GRAVITY
from echousd.shapes.geometry import Mass
from echousd.shapes.matter import read_mass
from echousd.stage.contents import triangulated
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.showing import each_layout
from echousd.stage.units import metres_per_unit, upwards
from echousd.stage.values import NOW, array, lineage, matrix, moves

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
        solids: its pieces, at least one. mass: in the prim's frame, metres, None = by volume.
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
    cache = UsdGeom.XformCache(NOW)
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
            mass = read_mass(root)
            bodies.append(Body(root.GetName(), path, place, tuple(owned[path]), mass and mass.seen(metres * np.eye(3))))
    return World(tuple(bodies), tuple(fixed), _gravity(stage, metres))


def body_root(prim: Usd.Prim) -> Usd.Prim | None:
    """The prim that a collider moves with: the outermost enabled body or articulation above it, None = it is fixed."""
    bodies = [above for above in lineage(prim) if above.HasAPI(UsdPhysics.ArticulationRootAPI) or moves(above)]
    return bodies[-1] if bodies else None


def _solids(prim: Usd.Prim, cache: UsdGeom.XformCache, metres: float, *, moves: bool) -> Iterator[Solid]:
    with raising(f"<{prim.GetPath()}>: its collider cannot be read", Tf.ErrorException, kind=StageError):
        points, faces = triangulated(prim)
        world = matrix(cache.GetLocalToWorldTransform(prim), prim)
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
    authored = UsdPhysics.MaterialAPI(material).GetDynamicFrictionAttr().Get() if material else None
    return FRICTION if authored is None else float(authored)


def _gravity(stage: Usd.Stage, metres: float) -> np.ndarray:
    down = -upwards(stage)
    for prim in stage.Traverse():
        if prim.GetTypeName() == "PhysicsScene":
            authored = prim.GetAttribute("physics:gravityDirection")
            direction = array(authored) if authored.HasAuthoredValue() else down
            length = float(np.linalg.norm(direction))
            strength = prim.GetAttribute("physics:gravityMagnitude").Get()
            strength = GRAVITY if strength is None or not 0 <= strength < np.inf else float(strength) * metres
            return strength * (direction / length if length > 0 else down)
    return GRAVITY * down


SECONDS = 2.0
SHIFT, TURN = 0.01, 1.0  # metres and degrees that a piece may move
FALL, TOPPLE = 0.01, 20.0  # metres and degrees from which we say that it fell
DEEP = 0.002  # metres that pieces may overlap at the start
Overlap = tuple[str, str, float]  # paths of two colliders, and metres that they are in each other


@dataclass(frozen=True, eq=False)
class Motion:
    """How a piece moved.

    Arguments:
        name, path: of its prim. shift: metres. turn: degrees. place: (4, 4) float, prim to world at the end, metres.
        why: a few words, empty for what rests.
    """

    name: str
    path: str
    shift: float
    turn: float
    place: np.ndarray
    why: str = ""

    @property
    def rests(self) -> bool:
        """Whether it moved less than a person would see."""
        return self.shift <= SHIFT and self.turn <= TURN

    def to_json(self) -> dict[str, Any]:
        """The entry of a report."""
        return {
            "object": self.name, "prim": self.path, "shift": round(self.shift, 4), "turn": round(self.turn, 2),
            "why": self.why,
        }  # fmt: skip


@dataclass(frozen=True)
class SettleReport:
    """How every body of a stage moved within some seconds; `layout` is "" where there is only one."""

    source: str
    seconds: float
    motions: tuple[Motion, ...]
    layout: str = ""

    @property
    def restless(self) -> tuple[Motion, ...]:
        """The pieces that do not rest, the one that moved furthest first."""
        moved = [motion for motion in self.motions if not motion.rests]
        return tuple(sorted(moved, key=lambda motion: -motion.shift))

    @property
    def ok(self) -> bool:
        """Whether everything rests."""
        return not self.restless

    @property
    def sentences(self) -> tuple[str, ...]:
        """One for every piece that does not rest."""
        which = f"{self.layout}: " if self.layout else ""
        return tuple(f"{which}{motion.name} does not rest: it {motion.why}" for motion in self.restless)

    def to_json(self) -> dict[str, Any]:
        """The entry of `echousd check --settle --json`."""
        return {
            "layout": self.layout, "seconds": self.seconds, "pieces": len(self.motions),
            "restless": [motion.to_json() for motion in self.restless],
        }  # fmt: skip


def settle_layouts(stage: Usd.Stage | str | os.PathLike[str], *, layout: int | None = None) -> tuple[SettleReport, ...]:
    """`settle` for every layout of a room, or for one; raises what it raises, and ValueError for no such layout."""
    stage = opened(stage)
    return tuple(replace(settle(stage), layout=name) for name in each_layout(stage, layout))


def settle(stage: Usd.Stage | str | os.PathLike[str]) -> SettleReport:
    """Simulate the physics of a stage, open or a file, for `SECONDS`.

    Raises:
        ValueError: the file cannot be opened, or there is nothing that could move.
        SettleUnavailable: MuJoCo is not installed (extra `sim`).
    """
    stage = opened(stage)
    world = read_world(stage)
    if not world.bodies:
        raise StageError(f"{source(stage)}: no rigid body with a collider, nothing to simulate")
    try:
        places, overlaps = simulate(world, SECONDS)
    except SettleUnavailable:
        raise
    except ValueError as error:
        raise StageError(f"{source(stage)}: cannot be simulated ({error})") from None
    motions = []
    for body, place in zip(world.bodies, places, strict=True):
        shift = float(np.linalg.norm(place[:3, 3] - body.place[:3, 3]))
        cosine = (np.trace(place[:3, :3] @ body.place[:3, :3].T) - 1) / 2
        turn = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        motion = Motion(body.name, body.path, shift, turn, place)
        motions.append(motion if motion.rests else replace(motion, why=_why(stage, world, overlaps, body, place)))
    return SettleReport(source(stage), SECONDS, tuple(motions))


def _why(stage: Usd.Stage, world: World, overlaps: Sequence[Overlap], body: Body, place: np.ndarray) -> str:
    """What was wrong at the start, else what it did."""
    up = -world.gravity / max(float(np.linalg.norm(world.gravity)), 1e-9)
    deepest: dict[str, float] = {}
    for first, second, depth in overlaps:
        for one, other in ((first, second), (second, first)):
            if _owner(stage, one) == body.path and depth > DEEP:
                name = _owner(stage, other).rpartition("/")[2]
                deepest[name] = max(depth, deepest.get(name, 0.0))
    if deepest:
        other = max(deepest, key=lambda name: deepest[name])
        return f"stands {1000 * deepest[other]:.0f} mm deep in {other}"
    drop = float((body.place[:3, 3] - place[:3, 3]) @ up)
    tilt = float(np.degrees(np.arccos(np.clip((place[:3, :3] @ body.place[:3, :3].T @ up) @ up, -1, 1))))
    if tilt > TOPPLE:
        return f"topples by {tilt:.0f} degrees"
    if drop > FALL:
        return f"falls {drop:.2f} m"
    return f"tilts by {tilt:.1f} degrees: it does not stand flat" if tilt > TURN else "is pushed or slides"


def _owner(stage: Usd.Stage, collider: str) -> str:
    root = body_root(stage.GetPrimAtPath(collider))
    if root is not None:
        return str(root.GetPath())
    above = collider.split("/")
    return "/".join(above[:4])  # /Room/Shell/Floor, /Room/Objects/picture


STEP = 0.004  # seconds
DENSITY = 200.0  # kg/m³ of a body whose mass nobody tells


class SettleUnavailable(ValueError):
    """MuJoCo is not installed."""


def require_engine() -> Any:
    """The module of MuJoCo; raises SettleUnavailable without the extra `sim`."""
    return extra("mujoco", "MuJoCo is not installed", "sim", SettleUnavailable)


def simulate(world: World, seconds: float) -> tuple[np.ndarray, Sequence[Overlap]]:
    """Let a world fall for some seconds; raises SettleUnavailable without the extra `sim`.

    Returns (n, 4, 4) float, body to world in the end, and the colliders of different bodies that overlap at the start.
    """
    mujoco = require_engine()
    spec = mujoco.MjSpec()
    spec.option.timestep = STEP
    spec.option.gravity = world.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # the pyramid lets things creep
    spec.option.impratio = 10
    paths: list[str] = []
    _add(mujoco, spec, spec.worldbody, world.fixed, np.eye(4), paths)
    for number, body in enumerate(world.bodies):
        made = spec.worldbody.add_body(name=f"body{number}", pos=body.place[:3, 3], quat=_quaternion(body.place))
        made.add_freejoint()
        _add(mujoco, spec, made, body.solids, body.place, paths)
        _weigh(made, body)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    overlaps = [(paths[met.geom1], paths[met.geom2], -float(met.dist)) for met in data.contact if met.dist < 0]
    for _ in range(round(seconds / STEP)):
        mujoco.mj_step(model, data)
    numbers = [model.body(f"body{number}").id for number in range(len(world.bodies))]
    places = np.tile(np.eye(4), (len(numbers), 1, 1))
    places[:, :3, :3] = data.xmat[numbers].reshape(-1, 3, 3)
    places[:, :3, 3] = data.xpos[numbers]
    return places, overlaps


def _add(mujoco: Any, spec: Any, body: Any, solids: Sequence[Solid], place: np.ndarray, paths: list[str]) -> None:
    """Add the hulls of some solids to a body whose place is known; `paths` follows the numbers of the geoms."""
    for solid in solids:
        local = (solid.points - place[:3, 3]) @ place[:3, :3]
        name = f"mesh{len(paths)}"
        mesh = spec.add_mesh(name=name, uservert=local.ravel())
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, friction=[solid.friction, 0.005, 0.0001], density=DENSITY
        )
        paths.append(solid.collider)


def _weigh(made: Any, body: Body) -> None:
    if body.mass is None:
        return
    made.explicitinertial = True
    made.mass = body.mass.mass
    made.ipos = body.mass.centre
    made.inertia = body.mass.inertia
    axes = np.eye(4)
    axes[:3, :3] = body.mass.axes if np.linalg.det(body.mass.axes) > 0 else body.mass.axes * [-1.0, 1.0, 1.0]
    made.iquat = _quaternion(axes)


def _quaternion(place: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(place[:3, :3]).as_quat(), 1)  # real part first
