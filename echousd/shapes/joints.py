"""Drawers and doors of an asset: bodies, joints with limits and masses, in a variant set that is `static` at first."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from echomodel.furniture.solids import Joint
from echousd.shapes.geometry import FRAME, Geometry, Mass
from echousd.shapes.matter import write_mass
from echousd.stage.layouts import ARTICULATED, ARTICULATION, authoring
from echousd.stage.paths import GEO, piece_name, piece_of, piece_path

STATIC = "static"
FRICTION_API, FRICTION = "NewtonJointAPI", "newton:friction"  # of a schema that MuJoCo and Newton bring with them
Point = tuple[float, float, float]
BRAKE = 20.0  # 1/s: what drifts on a runner or hinge stops in a twentieth of a second
SLOPE, GRAVITY = 0.03, 9.81  # what rubs there holds it on a slope of 3 %; m/s²


def write_joints(stage: Usd.Stage, asset: str, geometry: Geometry) -> None:
    """Author the variant set `articulation` on the root of an asset: nothing in `static`, bodies and joints else.

    `stage`: receives the opinions; its root prim is `/<asset>`. `geometry`: with joints.
    """
    root = stage.GetPrimAtPath(f"/{asset}")
    with authoring(root, ARTICULATION, (STATIC, ARTICULATED), ARTICULATED, STATIC):
        for body, mass in geometry.masses.items():
            prim = stage.OverridePrim(piece_path(f"/{asset}", asset, body))
            UsdPhysics.RigidBodyAPI.Apply(prim)
            write_mass(prim, mass)
        # on the frame, not on the asset's root: importers take whatever bears it for a body
        frame = stage.OverridePrim(piece_path(f"/{asset}", asset, FRAME))
        UsdPhysics.ArticulationRootAPI.Apply(frame)
        UsdGeom.Scope.Define(stage, f"/{asset}/{piece_name(asset, 'joints')}")
        for joint in geometry.joints:
            path = f"/{asset}/{piece_name(asset, 'joints')}/{piece_name(asset, joint.body)}_joint"
            still, moving = (piece_path(f"/{asset}", asset, body) for body in (FRAME, joint.body))
            _joint(stage, path, still, moving, joint, (joint.anchor, joint.anchor), geometry.masses[joint.body])


def write_hinge(stage: Usd.Stage, leaf: str, joint: Joint, mass: Mass) -> None:
    """Author the variant set `articulation` on a door of the shell: nothing in `static`, its leaf on a hinge else.

    `leaf`: prim path of what turns, whose origin is on the axis, below the door's prim. `joint`: its anchor in the
    door's frame. `mass`: of the leaf.
    """
    door = leaf.rpartition("/")[0]
    with authoring(stage.OverridePrim(door), ARTICULATION, (STATIC, ARTICULATED), ARTICULATED, STATIC):
        body = stage.OverridePrim(leaf)
        UsdPhysics.RigidBodyAPI.Apply(body)
        write_mass(body, mass)
        # against the door's prim, which is no body and stays where it is, wherever the room is put
        _joint(stage, f"{leaf}_joint", door, leaf, joint, (joint.anchor, (0.0, 0.0, 0.0)), mass)


def _joint(
    stage: Usd.Stage, path: str, still: str, moving: str, joint: Joint, places: tuple[Point, Point], mass: Mass
) -> None:
    """A joint between two prims, with friction; `places`: its anchor in the frame of each, `mass`: of what moves."""
    slides = joint.kind == "prismatic"
    made = (UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint).Define(stage, path)
    made.CreateBody0Rel().SetTargets([Sdf.Path(still)])
    made.CreateBody1Rel().SetTargets([Sdf.Path(moving)])
    made.CreateAxisAttr(UsdPhysics.Tokens.x)
    turn = Gf.Rotation(Gf.Vec3d(1, 0, 0), Gf.Vec3d(*joint.axis)).GetQuat()
    turned = Gf.Quatf(turn.GetReal(), Gf.Vec3f(turn.GetImaginary()))
    for create, place in zip((made.CreateLocalPos0Attr, made.CreateLocalPos1Attr), places, strict=True):
        create(Gf.Vec3f(*place))
    for create in (made.CreateLocalRot0Attr, made.CreateLocalRot1Attr):
        create(turned)
    made.CreateLowerLimitAttr(0.0)
    made.CreateUpperLimitAttr(round(joint.reach if slides else float(np.degrees(joint.reach)), 5))
    drive = UsdPhysics.DriveAPI.Apply(made.GetPrim(), "linear" if slides else "angular")
    # without friction no door stays shut that leans; USD's own physics has no word for it but a brake with a limit
    lever = 1.0 if slides else float(np.linalg.norm(np.cross(joint.axis, mass.centre - places[1])))
    inertia = mass.mass if slides else np.radians(4 / 3 * mass.mass * lever**2)  # angular drives count in degrees
    friction = round(SLOPE * GRAVITY * mass.mass * lever, 4)
    drive.CreateDampingAttr(round(BRAKE * inertia, 6))
    drive.CreateMaxForceAttr(friction)
    drive.CreateStiffnessAttr(0.0)
    made.GetPrim().AddAppliedSchema(FRICTION_API)
    made.GetPrim().CreateAttribute(FRICTION, Sdf.ValueTypeNames.Float, custom=False).Set(friction)


def read_joints(root: Usd.Prim, asset: str) -> tuple[Joint, ...]:
    """Names of the bodies of an asset that move, as joints without places: its files are carried on as they are."""
    geo = root.GetChild(GEO)
    below = geo.GetChildren() if geo else ()
    bodies = [piece_of(asset, prim.GetName()) for prim in below if prim.GetTypeName() == "Xform"]
    moving = [body for body in bodies if body and body != FRAME]
    return tuple(Joint(body, "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0) for body in sorted(moving))
