"""A flat layer without its physics: no collider, body, joint, scene or contact material is left."""

from __future__ import annotations

from pxr import Sdf, Usd, UsdGeom

PHYSICS = "Physics"  # what the names of all types and schemas of UsdPhysics begin with
PROPERTIES = ("physics:", "physx", "drive:", "limit:", "material:binding:physics")


def without_physics(layer: Sdf.Layer) -> None:
    """Take the physics and all guides out of a flat layer, so that no engine finds half of it."""
    stage = Usd.Stage.Open(layer)
    for prim in list(stage.TraverseAll()):
        if prim.IsValid() and (prim.GetTypeName().startswith(PHYSICS) or _is_guide(prim)):
            stage.RemovePrim(prim.GetPath())
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    with Sdf.ChangeBlock():
        for path in paths:
            spec = layer.GetPrimAtPath(path) if path.IsPrimPath() else None
            if spec:
                _strip(spec)


def _is_guide(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetPurposeAttr().Get() == UsdGeom.Tokens.guide


def _strip(spec: Sdf.PrimSpec) -> None:
    for name in [found.name for found in spec.properties if found.name.startswith(PROPERTIES)]:
        spec.RemoveProperty(spec.properties[name])
    if not spec.HasInfo("apiSchemas"):
        return
    applied = spec.GetInfo("apiSchemas").GetAddedOrExplicitItems()
    kept = [name for name in applied if not name.startswith((PHYSICS, "Physx"))]
    if len(kept) == len(applied):
        return
    if kept:
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=kept))
    else:
        spec.ClearInfo("apiSchemas")
