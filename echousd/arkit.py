"""A flat layer as Apple's viewers take it: Y up, no lights (they light it themselves), nothing of our own schemas."""

from __future__ import annotations

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdPhysics

from echousd.bare import strip

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
    for path in [prim.GetPath() for prim in stage.TraverseAll() if _is_empty_scope(prim)]:
        stage.RemovePrim(path)
    strip(layer, PROPERTIES, OURS)


def _is_light(prim: Usd.Prim) -> bool:
    return prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdLux.LightFilter)


def _is_empty_scope(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() == "Scope" and not prim.GetAllChildren())


def _turn(stage: Usd.Stage) -> None:
    """Z up to Y up by a matrix on every root prim that has a place; gravity turns along."""
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), -90.0))
    for prim in stage.GetPseudoRoot().GetChildren():
        placed = UsdGeom.Xformable(prim)
        if not placed:
            continue
        matrix = placed.GetLocalTransformation() * turn
        placed.ClearXformOpOrder()
        for attribute in prim.GetAttributes():
            if attribute.GetName().startswith("xformOp:"):
                prim.RemoveProperty(attribute.GetName())
        if not Gf.IsClose(matrix, Gf.Matrix4d(1.0), 1e-9):
            placed.AddTransformOp().Set(matrix)
    for prim in stage.Traverse():
        scene = UsdPhysics.Scene(prim)
        if scene and scene.GetGravityDirectionAttr().HasAuthoredValue():
            scene.GetGravityDirectionAttr().Set(Gf.Vec3f(turn.TransformDir(scene.GetGravityDirectionAttr().Get())))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
