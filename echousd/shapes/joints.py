"""Drawers and doors of an asset: bodies, joints with limits and masses, in a variant set that is `static` at first."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd

from echomodel.furniture.solids import Joint
from echousd.shapes.geometry import FRAME, Geometry, Mass
from echousd.shapes.matter import write_mass
from echousd.stage.layouts import ARTICULATED, ARTICULATION
from echousd.stage.paths import GEO, piece_name, piece_of, piece_path
from echousd.stage.pen import Pen

STATIC = "static"
FRICTION_API, FRICTION = "NewtonJointAPI", "newton:friction"  # of a schema that MuJoCo and Newton bring with them
Point = tuple[float, float, float]
BRAKE = 20.0  # 1/s: what drifts on a runner or hinge stops in a twentieth of a second
SLOPE, GRAVITY = 0.03, 9.81  # what rubs there holds it on a slope of 3 %; m/s²


def write_joints(pen: Pen, asset: str, geometry: Geometry) -> None:
    """Author the variant set `articulation` on the root of an asset: nothing in `static`, bodies and joints else.

    `pen`: whose root prim is `/<asset>`. `geometry`: with joints.
    """
    pen = pen.variants(f"/{asset}", ARTICULATION, (STATIC, ARTICULATED), STATIC)[ARTICULATED]
    for body, mass in geometry.masses.items():
        write_mass(pen, piece_path(f"/{asset}", asset, body), mass)
    # on the frame, not on the asset's root: importers take whatever bears it for a body
    pen.over(piece_path(f"/{asset}", asset, FRAME), apis=["PhysicsArticulationRootAPI"])
    above = f"/{asset}/{piece_name(asset, 'joints')}"
    pen.define(above, "Scope")
    for joint in geometry.joints:
        still, moving = (piece_path(f"/{asset}", asset, body) for body in (FRAME, joint.body))
        places, mass = (joint.anchor, joint.anchor), geometry.masses[joint.body]
        _joint(pen, f"{above}/{piece_name(asset, joint.body)}_joint", still, moving, joint, places, mass)


def write_hinge(pen: Pen, leaf: str, joint: Joint, mass: Mass) -> None:
    """Author the variant set `articulation` on a door of the shell: nothing in `static`, its leaf on a hinge else.

    `leaf`: prim path of what turns, whose origin is on the axis, below the door's prim. `joint`: its anchor in the
    door's frame. `mass`: of the leaf.
    """
    door = leaf.rpartition("/")[0]
    pen = pen.variants(door, ARTICULATION, (STATIC, ARTICULATED), STATIC)[ARTICULATED]
    write_mass(pen, leaf, mass)
    # against the door's prim, which is no body and stays where it is, wherever the room is put
    _joint(pen, f"{leaf}_joint", door, leaf, joint, (joint.anchor, (0.0, 0.0, 0.0)), mass)


def _joint(pen: Pen, path: str, still: str, moving: str, joint: Joint, places: tuple[Point, Point], mass: Mass) -> None:
    """A joint between two prims, with friction; `places`: its anchor in the frame of each, `mass`: of what moves."""
    slides = joint.kind == "prismatic"
    turn = Gf.Rotation(Gf.Vec3d(1, 0, 0), Gf.Vec3d(*joint.axis)).GetQuat()
    turned = Gf.Quatf(turn.GetReal(), Gf.Vec3f(turn.GetImaginary()))
    # without friction no door stays shut that leans; USD's own physics has no word for it but a brake with a limit
    lever = 1.0 if slides else float(np.linalg.norm(np.cross(joint.axis, mass.centre - places[1])))
    inertia = mass.mass if slides else np.radians(4 / 3 * mass.mass * lever**2)  # angular drives count in degrees
    friction, drive = round(SLOPE * GRAVITY * mass.mass * lever, 4), f"drive:{'linear' if slides else 'angular'}"
    values = {
        "rel physics:body0": still, "rel physics:body1": moving, "uniform token physics:axis": "X",
        "point3f physics:localPos0": places[0], "point3f physics:localPos1": places[1],
        "quatf physics:localRot0": turned, "quatf physics:localRot1": turned, "float physics:lowerLimit": 0.0,
        "float physics:upperLimit": round(joint.reach if slides else float(np.degrees(joint.reach)), 5),
        f"float {drive}:physics:damping": round(float(BRAKE * inertia), 6),
        f"float {drive}:physics:maxForce": friction, f"float {drive}:physics:stiffness": 0.0,
        f"float {FRICTION}": friction,
    }  # fmt: skip
    apis = [f"PhysicsDriveAPI:{drive.partition(':')[2]}", FRICTION_API]
    pen.define(path, "PhysicsPrismaticJoint" if slides else "PhysicsRevoluteJoint", values, apis)


def read_joints(root: Usd.Prim, asset: str) -> tuple[Joint, ...]:
    """Names of the bodies of an asset that move, as joints without places: its files are carried on as they are."""
    geo = root.GetChild(GEO)
    below = geo.GetChildren() if geo else ()
    bodies = [piece_of(asset, prim.GetName()) for prim in below if prim.GetTypeName() == "Xform"]
    moving = [body for body in bodies if body and body != FRAME]
    return tuple(Joint(body, "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0) for body in sorted(moving))
