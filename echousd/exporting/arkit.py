"""A flat layer as Apple's viewers take it: Y up, no lights (they light it themselves), nothing of our own schemas."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdPhysics

from echousd.exporting.strip_physics import strip

OURS = "Echo"  # what the names of our types and schemas begin with
PROPERTIES = "echo:"


def for_arkit(layer: Sdf.Layer) -> None:
    """Turn a flat layer to +Y up, and take lights and the scene graph out of it: Apple's checker knows no such types.

    Labels, cameras and materials stay.
    """
    stage = Usd.Stage.Open(layer)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        _turn(stage)
    for prim in list(stage.TraverseAll()):
        if prim.IsValid() and (prim.GetTypeName().startswith(OURS) or _is_light(prim)):
            stage.RemovePrim(prim.GetPath())
    for prim in reversed(list(stage.TraverseAll())):  # what a scope holds before the scope
        if _is_empty_scope(prim):
            stage.RemovePrim(prim.GetPath())
    strip(layer, PROPERTIES, OURS)


def _is_light(prim: Usd.Prim) -> bool:
    return prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdLux.LightFilter)


def _is_empty_scope(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() == "Scope" and not prim.GetAllChildren())


def _turn(stage: Usd.Stage) -> None:
    """Z up to Y up by a matrix on every prim that has a place and none above it that counts; gravity turns along."""
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), -90.0))
    for placed in list(_outermost(stage.GetPseudoRoot())):
        matrix, alone = placed.GetLocalTransformation() * turn, placed.GetResetXformStack()
        placed.ClearXformOpOrder()
        for attribute in placed.GetPrim().GetAttributes():
            if attribute.GetName().startswith("xformOp:"):
                placed.GetPrim().RemoveProperty(attribute.GetName())
        if not Gf.IsClose(matrix, Gf.Matrix4d(1.0), 1e-9):
            placed.AddTransformOp().Set(matrix)
        if alone:
            placed.SetResetXformStack(True)
    for prim in stage.Traverse():
        scene = UsdPhysics.Scene(prim)
        if scene and scene.GetGravityDirectionAttr().HasAuthoredValue():
            scene.GetGravityDirectionAttr().Set(Gf.Vec3f(turn.TransformDir(scene.GetGravityDirectionAttr().Get())))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)


def _outermost(top: Usd.Prim, turned: bool = False) -> Iterator[UsdGeom.Xformable]:
    """The first prims with a place on every branch below `top`, and all that ignore what is above them."""
    for prim in top.GetChildren():
        placed = UsdGeom.Xformable(prim)
        if placed and (not turned or placed.GetResetXformStack()):
            yield placed
        yield from _outermost(prim, turned or bool(placed))
