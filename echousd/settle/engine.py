"""A world of convex pieces in MuJoCo: what touches at first, and where everything is after a while."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from echousd.settle.solids import Body, Solid, World

STEP = 0.004  # seconds
DENSITY = 200.0  # kg/m³ of a body whose mass nobody tells


class SettleUnavailable(ValueError):
    """MuJoCo is not installed."""


@dataclass(frozen=True, eq=False)
class Course:
    """What became of n bodies.

    Arguments:
        places: (n, 4, 4) float, body to world, at the end.
        overlaps: (path, path, depth in metres) of colliders of different bodies that overlap at the start.
    """

    places: np.ndarray
    overlaps: tuple[tuple[str, str, float], ...]


def require_engine() -> Any:
    """The module of MuJoCo; raises SettleUnavailable without the extra `sim`."""
    try:
        import mujoco
    except ImportError:
        raise SettleUnavailable("MuJoCo is not installed; pip install 'echousd[sim]'") from None
    return mujoco


def simulate(world: World, seconds: float) -> Course:
    """Let a world fall for some seconds; raises SettleUnavailable without the extra `sim`."""
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
    overlaps = tuple(
        (paths[contact.geom1], paths[contact.geom2], -float(contact.dist))
        for contact in data.contact
        if contact.dist < 0
    )
    for _ in range(round(seconds / STEP)):
        mujoco.mj_step(model, data)
    numbers = [model.body(f"body{number}").id for number in range(len(world.bodies))]
    places = np.tile(np.eye(4), (len(numbers), 1, 1))
    places[:, :3, :3] = data.xmat[numbers].reshape(-1, 3, 3)
    places[:, :3, 3] = data.xpos[numbers]
    return Course(places, overlaps)


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
