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
    strip(layer, PROPERTIES, (PHYSICS, "Physx"))


def strip(layer: Sdf.Layer, properties: str | tuple[str, ...], schemas: str | tuple[str, ...]) -> None:
    """Take the properties and applied schemas whose names begin so out of every prim of a layer."""
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    with Sdf.ChangeBlock():
        for spec in filter(None, (layer.GetPrimAtPath(path) for path in paths if path.IsPrimPath())):
            _strip(spec, properties, schemas)


def _is_guide(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetPurposeAttr().Get() == UsdGeom.Tokens.guide


def _strip(spec: Sdf.PrimSpec, properties: str | tuple[str, ...], schemas: str | tuple[str, ...]) -> None:
    for name in [found.name for found in spec.properties if found.name.startswith(properties)]:
        spec.RemoveProperty(spec.properties[name])
    if not spec.HasInfo("apiSchemas"):
        return
    applied = spec.GetInfo("apiSchemas").GetAddedOrExplicitItems()
    kept = [name for name in applied if not name.startswith(schemas)]
    if not kept:
        spec.ClearInfo("apiSchemas")
    elif len(kept) < len(applied):
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=kept))
