"""Rules on what a room looks like: materials that are connected and bound, lights that shine, cameras in the room."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from echousd.checks.collisions import inside_solid
from echousd.checks.findings import UNREADABLE, Finding, rule
from echousd.checks.geometry_rules import of_others
from echousd.checks.ranges import LIGHTS
from echousd.checks.reading import Reading, below
from echousd.stage.contents import room_frame
from echousd.stage.values import asset

UNDER = 0.02  # metres below its floor that a camera or a lamp is not


@rule("echo:Materials", "distinct", UsdShade.Material)
def materials(reading: Reading, prim: Usd.Prim) -> Iterator[Finding | str]:
    """A material has a surface, every node of it is used, images have files, and inputs are connected to outputs."""
    nodes = [node for node in below(prim) if node.IsA(UsdShade.Shader)]
    outputs = [out for out in UsdShade.Material(prim).GetOutputs() if out.HasConnectedSource()]
    if not outputs and (nodes or not prim.HasAPI(UsdPhysics.MaterialAPI)):
        yield "a material without a surface: nothing is connected to its outputs"
        return
    used = _used(prim, outputs)
    for node in nodes:
        if node.GetPath() not in used:
            yield Finding(node.GetPath(), "reaches no output of its material", warning=of_others(prim))
    for node in (prim, *nodes):
        yield from _loose_ends(node)
    for node in nodes:
        yield from _unread(node, reading.primvars)


def _used(material: Usd.Prim, outputs: list[UsdShade.Output]) -> set[Sdf.Path]:
    """Paths of the prims that some outputs are made from."""
    stage, used = material.GetStage(), set()
    queue = [path for out in outputs for path in out.GetAttr().GetConnections()]
    while queue:
        path = queue.pop().GetPrimPath()
        prim = stage.GetPrimAtPath(path)
        if path not in used and prim:
            used.add(path)
            queue += [source for attribute in prim.GetAuthoredAttributes() for source in attribute.GetConnections()]
    return used


def _loose_ends(node: Usd.Prim) -> Iterator[Finding]:
    """Connections of a node to what is not there."""
    for attribute in node.GetAuthoredAttributes():
        for source in attribute.GetConnections():
            other = node.GetStage().GetPrimAtPath(source.GetPrimPath())
            if not other or not (other.HasAttribute(source.name) or UsdShade.Shader(other).GetOutput(source.name[8:])):
                yield Finding(attribute.GetPath(), f"connected to <{source}>, where nothing is")


def _unread(node: Usd.Prim, primvars: set[str]) -> Iterator[Finding]:
    """A texture without an image, and a reader of a primvar that no prim has."""
    kind = node.GetAttribute("info:id").Get()
    try:
        if kind == "UsdUVTexture" and not UsdShade.Shader(node).GetInput("file").HasConnectedSource():
            file = asset(node.GetAttribute("inputs:file")) if node.HasAttribute("inputs:file") else None
            if not file or not file.path:
                yield Finding(node.GetPath(), "a texture without an image, allowed: inputs:file with a path")
        elif str(kind).startswith("UsdPrimvarReader"):
            name = node.GetAttribute("inputs:varname").Get()
            if name is not None and str(name) not in primvars:
                yield Finding(node.GetPath(), f"reads primvars:{name}, which no prim has")
    except UNREADABLE:
        return


@rule("echo:Bindings")
def bindings(reading: Reading) -> Iterator[Finding]:
    """What is seen has a material that is there, where a stage has materials at all; a warning where it has none."""
    if not any(prim.IsA(UsdShade.Material) for prim in reading.distinct):
        return
    seen = [prim for prim in reading.distinct if prim.IsA(UsdGeom.Gprim) and not reading.is_guide(prim)]
    bound, _ = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(seen)
    for prim, material in zip(seen, bound, strict=True):
        relationship = prim.GetRelationship("material:binding")
        for target in relationship.GetTargets() if relationship else ():
            found = reading.stage.GetPrimAtPath(target)
            if not found or not found.IsActive():
                yield Finding(prim.GetPath(), f"bound to <{target}>, where no active material is")
        if material or prim.GetAttribute("primvars:displayColor").HasAuthoredValue():
            continue
        parts = [each for each in prim.GetChildren() if each.IsA(UsdGeom.Subset)]
        if not any(each.GetRelationship("material:binding").HasAuthoredTargets() for each in parts):
            yield Finding(prim.GetPath(), "no material is bound: it is shown grey", warning=True)


@rule("echo:Lights")
def lights(reading: Reading) -> Iterator[Finding]:
    """Where a stage has lights or cameras, some light shines."""
    off = [prim for prim in reading.inactive if prim.GetTypeName() in LIGHTS or prim.GetName() == "Lights"]
    there = [prim for prim in reading.prims if prim.GetTypeName() in LIGHTS]
    if any(map(_shines, there)):
        return
    if off or there:
        yield Finding((off or there)[0].GetPath(), "no light shines: all are deactivated, invisible or of intensity 0")
    elif any(prim.IsA(UsdGeom.Camera) for prim in reading.prims):
        yield Finding(Sdf.Path.absoluteRootPath, "cameras and no light", warning=True)


def _shines(light: Usd.Prim) -> bool:
    visible = UsdGeom.Imageable(light).ComputeVisibility() != UsdGeom.Tokens.invisible
    intensity = light.GetAttribute("inputs:intensity").Get()
    return visible and (not isinstance(intensity, float) or intensity > 0)


@rule("echo:Viewpoints")
def viewpoints(reading: Reading) -> Iterator[Finding]:
    """Cameras and lamps are above the floor; cameras stand in no piece of furniture and show something."""
    placed = [prim for prim in reading.prims if prim.IsA(UsdGeom.Camera) or prim.GetTypeName() in LIGHTS]
    for prim in placed:
        if prim.IsA(UsdGeom.Camera):
            near, far = prim.GetAttribute("clippingRange").Get() or (0, 1)
            if near >= far:
                yield Finding(prim.GetPath(), f"clippingRange is {near:g} to {far:g}, allowed: far beyond near")
    for room in reading.rooms:
        solids = None
        for prim in placed:
            if prim.GetTypeName() in ("DomeLight", "DistantLight") or not prim.GetPath().HasPrefix(room.room.GetPath()):
                continue
            try:
                at = (room_frame(room.room, reading.cache) @ reading.world(prim))[:3, 3]
            except UNREADABLE:
                continue
            if at[1] < -UNDER:
                yield Finding(prim.GetPath(), f"{-at[1]:.2g} m below the floor of its room, allowed: above it")
            elif prim.IsA(UsdGeom.Camera):
                solids = reading.contents(room).objects if solids is None else solids
                within = [one.name for one in solids if len(one.faces) and inside_solid(at[None], one)[0]]
                if within:
                    yield Finding(prim.GetPath(), f"stands inside {within[0]}, allowed: in the open")
