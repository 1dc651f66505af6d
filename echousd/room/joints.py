"""Drawers and doors of an asset: bodies, joints with limits and masses, in a variant set that is `static` at first."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from echomodel.data.furniture.solids import Joint
from echousd.room.geometry import FRAME, Geometry
from echousd.room.masses import write_mass
from echousd.room.paths import GEO, piece_name, piece_of, piece_path

ARTICULATION, STATIC, ARTICULATED = "articulation", "static", "articulated"
DAMPING = 2.0  # N s/m or N m s: a drawer that is let go stops


def write_joints(stage: Usd.Stage, asset: str, geometry: Geometry) -> None:
    """Author the variant set `articulation` on the root of an asset: nothing in `static`, bodies and joints else.

    Arguments:
        stage: receives the opinions; its root prim is `/<asset>`.
        geometry: with joints.
    """
    root = stage.GetPrimAtPath(f"/{asset}")
    variants = root.GetVariantSets().AddVariantSet(ARTICULATION)
    for name in (STATIC, ARTICULATED):
        variants.AddVariant(name)
    variants.SetVariantSelection(ARTICULATED)
    with variants.GetVariantEditContext():
        for body, mass in geometry.masses.items():
            prim = stage.OverridePrim(piece_path(f"/{asset}", asset, body))
            UsdPhysics.RigidBodyAPI.Apply(prim)
            write_mass(prim, mass)
        # on the frame, not on the asset's root: importers take whatever bears it for a body
        frame = stage.OverridePrim(piece_path(f"/{asset}", asset, FRAME))
        UsdPhysics.ArticulationRootAPI.Apply(frame)
        UsdGeom.Scope.Define(stage, f"/{asset}/{piece_name(asset, 'joints')}")
        for joint in geometry.joints:
            _joint(stage, asset, joint)
    variants.SetVariantSelection(STATIC)


def _joint(stage: Usd.Stage, asset: str, joint: Joint) -> None:
    path = f"/{asset}/{piece_name(asset, 'joints')}/{piece_name(asset, joint.body)}_joint"
    slides = joint.kind == "prismatic"
    made = (UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint).Define(stage, path)
    made.CreateBody0Rel().SetTargets([Sdf.Path(piece_path(f"/{asset}", asset, FRAME))])
    made.CreateBody1Rel().SetTargets([Sdf.Path(piece_path(f"/{asset}", asset, joint.body))])
    made.CreateAxisAttr(UsdPhysics.Tokens.x)
    turn = Gf.Rotation(Gf.Vec3d(1, 0, 0), Gf.Vec3d(*joint.axis)).GetQuat()
    place, turned = Gf.Vec3f(*joint.anchor), Gf.Quatf(turn.GetReal(), Gf.Vec3f(turn.GetImaginary()))
    for create in (made.CreateLocalPos0Attr, made.CreateLocalPos1Attr):
        create(place)
    for create in (made.CreateLocalRot0Attr, made.CreateLocalRot1Attr):
        create(turned)
    made.CreateLowerLimitAttr(0.0)
    made.CreateUpperLimitAttr(round(joint.reach if slides else float(np.degrees(joint.reach)), 5))
    drive = UsdPhysics.DriveAPI.Apply(made.GetPrim(), "linear" if slides else "angular")
    drive.CreateDampingAttr(DAMPING if slides else DAMPING / 60)  # angular drives count in degrees
    drive.CreateStiffnessAttr(0.0)


def read_joints(root: Usd.Prim, asset: str) -> tuple[Joint, ...]:
    """Names of the bodies of an asset that move, as joints without places: its files are carried on as they are."""
    geo = root.GetChild(GEO)
    below = geo.GetChildren() if geo else ()
    bodies = [piece_of(asset, prim.GetName()) for prim in below if prim.GetTypeName() == "Xform"]
    moving = [body for body in bodies if body and body != FRAME]
    return tuple(Joint(body, "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0) for body in sorted(moving))
