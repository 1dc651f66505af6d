"""Everything that a stage composes to, in one layer that needs no other file but its images."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from echousd.draw.drawables import rgb
from echousd.exporting.packing import Package, take_assets
from echousd.stage.files import source
from echousd.stage.units import set_units
from echousd.stage.values import check_types, given, targets


def flat_layer(stage: Usd.Stage, *, package: Package | None = None, physics: bool = True) -> Sdf.Layer:
    """Everything that a stage composes to, in one layer without references, variants or paths of this machine.

    Arguments:
        package: receives the images; without it textured materials get their plain colour.
        physics: keep bodies, colliders (and other guides), joints and the scene; all of it goes, or none.
    """
    with _without_instances(stage):
        layer = stage.Flatten(False)
    set_units(layer, stage)
    check_types(layer, source(stage))
    if not physics:
        without_physics(layer)
    stage = Usd.Stage.Open(layer)
    for prim in stage.TraverseAll():
        prim.ClearMetadata("instanceable")
        prim.ClearMetadata("assetInfo")  # it holds the absolute path of a file that is no longer needed
        for attribute in prim.GetAttributes():
            if attribute.GetTypeName() == Sdf.ValueTypeNames.Double3 and attribute.GetName().startswith("xformOp:"):
                _as_float(attribute)  # some web loaders cannot read doubles of whole numbers from a crate file
    _bind_directly(stage)
    _drop_unused_materials(stage)
    if package is None:
        _drop_materialx(stage)
    images = [prim for prim in stage.TraverseAll() if _is_image(prim)]
    take_assets(layer, package)
    for image in images:
        file = image.GetAttribute("inputs:file").Get()
        if not getattr(file, "path", ""):
            _paint_plain(image)
    return layer


@contextmanager
def _without_instances(stage: Usd.Stage) -> Iterator[None]:
    """Inside the block nothing on the stage is an instance: flat, the prototypes would be prims of their own."""
    session = stage.GetSessionLayer()
    before = Sdf.Layer.CreateAnonymous(".usda")
    before.TransferContent(session)
    try:
        with Usd.EditContext(stage, session):
            while found := [prim for prim in stage.TraverseAll() if prim.IsInstance()]:
                for prim in found:
                    prim.SetInstanceable(False)
        yield
    finally:
        session.TransferContent(before)


def _as_float(attribute: Usd.Attribute) -> None:
    value, prim, name = given(attribute), attribute.GetPrim(), attribute.GetName()
    if not isinstance(value, Gf.Vec3d):
        return
    prim.RemoveProperty(name)
    prim.CreateAttribute(name, Sdf.ValueTypeNames.Float3, False).Set(tuple(float(v) for v in value))


def _is_image(prim: Usd.Prim) -> bool:
    """Whether a prim is a shader that reads an image."""
    file = prim.GetAttribute("inputs:file")
    return prim.GetTypeName() == "Shader" and bool(file) and file.HasAuthoredValue()


def _drop_materialx(stage: Usd.Stage) -> None:
    """Networks of MaterialX that stand beside others: their images have no plain colour to fall back to."""
    for material in [UsdShade.Material(prim) for prim in stage.TraverseAll() if prim.IsA(UsdShade.Material)]:
        if material.GetSurfaceOutput("mtlx") and material.GetSurfaceOutput():
            material.GetPrim().RemoveProperty("outputs:mtlx:surface")
            for child in material.GetPrim().GetChildren():
                if str(UsdShade.Shader(child).GetShaderId() or "").startswith("ND_"):
                    stage.RemovePrim(child.GetPath())


def _paint_plain(image: Usd.Prim) -> None:
    """Give the materials that an image without a file coloured (or roughened) its fallback instead, and take it out."""
    fallback = image.GetAttribute("inputs:fallback")
    color = rgb(fallback.Get() if fallback else None, (0.5, 0.5, 0.5))
    for shader in image.GetParent().GetChildren():
        for attribute in shader.GetAttributes():
            if not any(c.GetPrimPath() == image.GetPath() for c in attribute.GetConnections()):
                continue
            attribute.ClearConnections()
            if attribute.GetTypeName() == Sdf.ValueTypeNames.Color3f:
                attribute.Set(color)
            elif attribute.GetTypeName() == Sdf.ValueTypeNames.Float:
                attribute.Set(color[0])
            else:
                shader.RemoveProperty(attribute.GetName())
    image.GetStage().RemovePrim(image.GetPath())


def _bind_directly(stage: Usd.Stage) -> None:
    """Bind every surface to the material that it shows, where a collection binds it: web viewers ask the prim alone."""
    owners = [p for p in stage.TraverseAll() if UsdShade.MaterialBindingAPI(p).GetCollectionBindingRels()]
    shown = [p for p in stage.TraverseAll() if p.IsA(UsdGeom.Gprim) or p.IsA(UsdGeom.Subset)] if owners else []
    found = [(prim, UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]) for prim in shown]
    for prim in owners:
        for bound in UsdShade.MaterialBindingAPI(prim).GetCollectionBindingRels():
            name = bound.GetName().rpartition(":")[2]
            prim.RemoveProperty(bound.GetName())
            for part in ("includes", "excludes", "expansionRule", "includeRoot"):
                prim.RemoveProperty(f"collection:{name}:{part}")
            prim.RemoveAPI(Usd.CollectionAPI, name)
        if not UsdShade.MaterialBindingAPI(prim).GetDirectBindingRel().HasAuthoredTargets():
            prim.RemoveAPI(UsdShade.MaterialBindingAPI)
    for prim, material in found:
        if material and UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath() != material.GetPath():
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def _drop_unused_materials(stage: Usd.Stage) -> None:
    """Looks of assets that the room's own looks replace."""
    bindings = ("material:binding", "material:binding:physics")
    bound = {target for prim in stage.TraverseAll() for name in bindings for target in targets(prim, name)}
    unused = [p for p in stage.TraverseAll() if p.IsA(UsdShade.Material) and p.GetPath() not in bound]
    scopes = {prim.GetParent().GetPath() for prim in unused}
    for path in [prim.GetPath() for prim in unused]:
        stage.RemovePrim(path)
    for path in scopes:
        if not stage.GetPrimAtPath(path).GetAllChildren():
            stage.RemovePrim(path)


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
