"""Drawers and doors of an asset: bodies, joints with limits and masses, in a variant set that is `static` at first."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from echomodel.data.furniture.solids import Joint
from echousd.room.geometry import FRAME, Geometry, Mass
from echousd.room.paths import piece_name, piece_of

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
            prim = stage.OverridePrim(f"/{asset}/{piece_name(asset, body)}")
            UsdPhysics.RigidBodyAPI.Apply(prim)
            write_mass(prim, mass)
        UsdGeom.Scope.Define(stage, f"/{asset}/{piece_name(asset, 'joints')}")
        for joint in geometry.joints:
            _joint(stage, asset, joint)
    variants.SetVariantSelection(STATIC)


def _joint(stage: Usd.Stage, asset: str, joint: Joint) -> None:
    path = f"/{asset}/{piece_name(asset, 'joints')}/{piece_name(asset, joint.body)}_joint"
    slides = joint.kind == "prismatic"
    made = (UsdPhysics.PrismaticJoint if slides else UsdPhysics.RevoluteJoint).Define(stage, path)
    made.CreateBody0Rel().SetTargets([Sdf.Path(f"/{asset}/{piece_name(asset, FRAME)}")])
    made.CreateBody1Rel().SetTargets([Sdf.Path(f"/{asset}/{piece_name(asset, joint.body)}")])
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


def write_mass(prim: Usd.Prim, mass: Mass) -> None:
    """Author mass, centre of mass and moments of inertia."""
    api = UsdPhysics.MassAPI.Apply(prim)
    api.CreateMassAttr(round(mass.mass, 3))
    api.CreateCenterOfMassAttr(Gf.Vec3f(*(round(float(v), 4) for v in mass.centre)))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(float(f"{v:.4g}") for v in mass.inertia)))
    turn = Gf.Matrix3d(*np.asarray(mass.axes, float).T.ravel().tolist()).ExtractRotation().GetQuat()
    api.CreatePrincipalAxesAttr(Gf.Quatf(turn.GetReal(), Gf.Vec3f(turn.GetImaginary())))


def read_mass(prim: Usd.Prim) -> Mass | None:
    """The mass that `write_mass` wrote, None where there is none or only an estimate."""
    api = UsdPhysics.MassAPI(prim)
    inertia = api.GetDiagonalInertiaAttr().Get() if prim.HasAPI(UsdPhysics.MassAPI) else None
    if not inertia or not any(inertia):
        return None
    turn = Gf.Matrix3d(Gf.Rotation(Gf.Quatd(api.GetPrincipalAxesAttr().Get())))
    axes = np.array(turn).T
    return Mass(api.GetMassAttr().Get(), np.array(api.GetCenterOfMassAttr().Get()), np.array(inertia), axes)


def read_joints(root: Usd.Prim, asset: str) -> tuple[Joint, ...]:
    """Names of the bodies of an asset that move, as joints without places: its files are carried on as they are."""
    bodies = [piece_of(asset, prim.GetName()) for prim in root.GetChildren() if prim.GetTypeName() == "Xform"]
    moving = [body for body in bodies if body and body != FRAME]
    return tuple(Joint(body, "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0) for body in sorted(moving))
