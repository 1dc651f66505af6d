"""Rules on what a room looks like (materials, lights, cameras), and the numbers that single attributes may hold."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import resources

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade

from echousd.checks.mesh_rules import of_others
from echousd.checks.reading import RULES, Finding, Reading, StageRule, applied, below, rule
from echousd.make.collisions import inside_solid
from echousd.stage.contents import room_frame
from echousd.stage.values import NOW, UNREADABLE, asset

UNDER = 0.02  # metres below its floor that a camera or a lamp is not


@rule("echo:Materials", "distinct", UsdShade.Material)
def materials(reading: Reading, prim: Usd.Prim) -> Iterator[Finding | str]:
    """A material has a surface, every node of it is used, images have files, and inputs are connected to outputs."""
    nodes = [node for node in below(prim) if node.IsA(UsdShade.Shader)]
    outputs = [out for out in UsdShade.Material(prim).GetOutputs() if out.HasConnectedSource()]
    if not outputs and (nodes or not prim.HasAPI(UsdPhysics.MaterialAPI)):
        yield "a material without a surface: nothing is connected to its outputs"
        return
    used = _used(reading, outputs)
    for node in nodes:
        if node.GetPath() not in used:
            yield Finding(node.GetPath(), "reaches no output of its material", warning=of_others(prim))
    for attribute, sources in (one for node in (prim, *nodes) for one in reading.connected(node)):
        for source in sources:
            other = reading.stage.GetPrimAtPath(source.GetPrimPath())
            if not other or not (other.HasAttribute(source.name) or UsdShade.Shader(other).GetOutput(source.name[8:])):
                yield Finding(attribute.GetPath(), f"connected to <{source}>, where nothing is")
    for node in nodes:
        yield from _unread(node, reading.primvars if prim.GetPath() in reading.bound else None)


def _used(reading: Reading, outputs: list[UsdShade.Output]) -> set[Sdf.Path]:
    """Paths of the prims that some outputs are made from."""
    used = set()
    queue = [path for out in outputs for path in out.GetAttr().GetConnections()]
    while queue:
        path = queue.pop().GetPrimPath()
        prim = reading.stage.GetPrimAtPath(path)
        if path not in used and prim:
            used.add(path)
            queue += [source for _, sources in reading.connected(prim) for source in sources]
    return used


def _unread(node: Usd.Prim, primvars: set[str] | None) -> Iterator[Finding]:
    """A texture without an image, and a reader of a primvar that no prim has; None = of a material that none shows."""
    kind = node.GetAttribute("info:id").Get()
    try:
        if kind == "UsdUVTexture" and not UsdShade.Shader(node).GetInput("file").HasConnectedSource():
            file = asset(node.GetAttribute("inputs:file")) if node.HasAttribute("inputs:file") else None
            if not file or not file.path:
                yield Finding(node.GetPath(), "a texture without an image, allowed: inputs:file with a path")
        elif primvars is not None and str(kind).startswith("UsdPrimvarReader"):
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
    visible = UsdGeom.Imageable(light).ComputeVisibility(NOW) != UsdGeom.Tokens.invisible
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
                within = [one.name for one in solids if len(one.faces) and inside_solid(at[None], one)[0][0]]
                if within:
                    yield Finding(prim.GetPath(), f"stands inside {within[0]}, allowed: in the open")


UNLIMITED = float("inf")
LIGHTS = ("DomeLight", "RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "PortalLight")


@dataclass(frozen=True)
class Row:
    """What an attribute may hold.

    Arguments:
        rule: whose finding it is.
        at: types of prims, applied API schemas or ids of shaders that the attribute belongs to; "" = any prim.
        attribute: its name; `*` stands for the instance of a schema that is applied several times.
        low, high: bounds of each of its numbers.
        beyond: whether `low` itself is too low already.
        metres: the bounds are metres, not the stage's units. why: what goes wrong otherwise.
    """

    rule: str
    at: tuple[str, ...]
    attribute: str
    low: float
    high: float
    why: str
    beyond: bool = False
    metres: bool = False

    def allows(self, values: np.ndarray, metres: float) -> bool:
        """Whether all of some numbers, in a stage's units, are within the bounds."""
        values = values * (metres if self.metres else 1.0)
        above = values > self.low if self.beyond else values >= self.low
        return bool((above & (values <= self.high)).all())

    @property
    def allowed(self) -> str:
        """The bounds in words."""
        low = f"above {self.low:g}" if self.beyond else f"{self.low:g}"
        if self.low == self.high:
            return low
        high = "" if self.high == UNLIMITED else f" to {self.high:g}"
        return f"{low}{high or ('' if self.beyond else ' or more')}{' m' * self.metres}"


JOINTS = ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint", "PhysicsFixedJoint", "PhysicsSphericalJoint", "PhysicsJoint")
GROUPS = {"light": LIGHTS, "joint": JOINTS, "*": ("",)}  # what `at` may say in place of types


def ranges() -> Iterator[Row]:
    """The rows of ranges.tsv; a `>` before the lower bound leaves the bound itself out."""
    text = resources.files("echousd.checks").joinpath("ranges.tsv").read_text("utf-8")
    for row in csv.DictReader(text.splitlines(), delimiter="\t"):
        at = GROUPS.get(row["at"], tuple(row["at"].split()))
        low, beyond = float(row["low"].removeprefix(">")), row["low"].startswith(">")
        high, metres = float(row["high"]), row["unit"] == "m"
        yield Row(f"echo:{row['rule']}", at, row["attribute"], low, high, row["why"], beyond, metres)


TABLE = tuple(ranges())
named_schema = Usd.SchemaRegistry.GetTypeNameAndInstance
BY_OWNER = {at: [row for row in TABLE if at in row.at] for row in TABLE for at in row.at}


def out_of_range(reading: Reading, rule: str) -> Iterator[Finding]:
    """What the rows of a rule do not allow."""
    every = reading.once("ranges", reading.stage.GetPseudoRoot(), lambda: _findings(reading))
    return (finding for name, finding in every if name == rule)


def _findings(reading: Reading) -> list[tuple[str, Finding]]:
    """The findings of all rows, each with its rule's name."""
    found = []
    for prim in reading.distinct:
        kind, there = str(prim.GetTypeName()), {*prim.GetAuthoredPropertyNames()}
        shader = str(prim.GetAttribute("info:id").Get() or "") if kind == "Shader" else ""
        for row, name in _rows_for(kind, shader, *applied(prim)):
            attribute = prim.GetAttribute(name) if name in there else None
            if not attribute or not attribute.HasAuthoredValue():
                continue
            values = (numbers := _numbers(attribute))[numbers > -UNLIMITED]  # physics: as the engine likes
            if not row.allows(values, reading.metres):
                shown = ", ".join(f"{value:g}" for value in values[:4])
                message = f"is {shown}, allowed: {row.allowed} ({row.why})"
                found.append((row.rule, Finding(attribute.GetPath(), message)))
    return found


@lru_cache(maxsize=4096)  # a stage has few kinds of prims
def _rows_for(kind: str, shader: str, *schemas: str) -> list[tuple[Row, str]]:
    """What rows are about a prim of a type with the id of a shader and some schemas, and the attribute of each."""
    owners = [("", ""), (kind, ""), *map(named_schema, schemas), *([(shader, "")] if kind == "Shader" else [])]
    return [(row, row.attribute.replace("*", of)) for owner, of in owners for row in BY_OWNER.get(owner, ())]


def _numbers(attribute: Usd.Attribute) -> np.ndarray:
    """(n,) float of any number or list, none where it holds others or NaN, which the rules on values report."""
    try:
        found = np.asarray(attribute.Get(), float).ravel()
    except (Tf.ErrorException, TypeError, ValueError):
        return np.zeros(0)
    return np.zeros(0) if np.isnan(found).any() else found


for _name in ("echo:PhysicsValues", "echo:MaterialValues", "echo:LightValues", "echo:CameraValues"):
    RULES.append(StageRule(_name, partial(out_of_range, rule=_name)))
