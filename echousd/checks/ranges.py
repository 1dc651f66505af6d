"""Numbers that one attribute may hold, whatever stands elsewhere: a table, read in one walk over the prims."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from pxr import Tf, Usd

from echousd.checks.findings import RULES, Finding, Rule, applied
from echousd.checks.reading import Reading

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


MASS, MATTER, BODY = ("PhysicsMassAPI",), ("PhysicsMaterialAPI",), ("PhysicsRigidBodyAPI",)
SURFACE, DRIVE = ("UsdPreviewSurface",), ("PhysicsDriveAPI",)
JOINTS = ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint", "PhysicsFixedJoint", "PhysicsSphericalJoint", "PhysicsJoint")
PHYSICS, LOOK, LIGHT, CAMERA = "echo:PhysicsValues", "echo:MaterialValues", "echo:LightValues", "echo:CameraValues"
UNIT = "shares lie between 0 and 1"
TABLE = (
    Row(PHYSICS, MASS, "physics:mass", 0, 2000, "kilograms; 0 = by volume"),
    Row(PHYSICS, (*MASS, *MATTER), "physics:density", 0, 25_000, "kg/m³ and osmium is the heaviest; 0 = not told"),
    Row(PHYSICS, MASS, "physics:diagonalInertia", 0, UNLIMITED, "inertia is never negative"),
    Row(PHYSICS, MATTER, "physics:staticFriction", 0, 5, "friction pushes nothing on"),
    Row(PHYSICS, MATTER, "physics:dynamicFriction", 0, 5, "friction pushes nothing on"),
    Row(PHYSICS, MATTER, "physics:restitution", 0, 1, "nothing bounces higher than it fell"),
    Row(PHYSICS, BODY, "physics:velocity", 0, 0, "a room is at rest"),
    Row(PHYSICS, BODY, "physics:angularVelocity", 0, 0, "a room is at rest"),
    Row(PHYSICS, ("PhysicsScene",), "physics:gravityMagnitude", 0, 50, "m/s²", beyond=True, metres=True),
    Row(PHYSICS, DRIVE, "drive:*:physics:stiffness", 0, UNLIMITED, "springs pull back"),
    Row(PHYSICS, DRIVE, "drive:*:physics:damping", 0, UNLIMITED, "dampers slow down"),
    Row(PHYSICS, DRIVE, "drive:*:physics:maxForce", 0, UNLIMITED, "a limit"),
    Row(PHYSICS, JOINTS, "physics:breakForce", 0, UNLIMITED, "at 0 a joint holds nothing", beyond=True),
    Row(PHYSICS, JOINTS, "physics:breakTorque", 0, UNLIMITED, "at 0 a joint holds nothing", beyond=True),
    Row(LOOK, SURFACE, "inputs:diffuseColor", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:specularColor", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:emissiveColor", 0, 1e6, "light is never negative"),
    Row(LOOK, SURFACE, "inputs:roughness", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:metallic", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:clearcoat", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:clearcoatRoughness", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:occlusion", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:opacityThreshold", 0, 1, UNIT),
    Row(LOOK, SURFACE, "inputs:opacity", 0, 1, "at 0 nobody sees it", beyond=True),
    Row(LOOK, SURFACE, "inputs:ior", 1, 5, "light is nowhere faster than in vacuum"),
    Row(LOOK, ("",), "primvars:displayOpacity", 0, 1, "at 0 nobody sees it", beyond=True),
    Row(LOOK, ("",), "primvars:displayColor", 0, 1, UNIT),
    Row(LIGHT, LIGHTS, "inputs:intensity", 0, 1e6, "light is never negative"),
    Row(LIGHT, LIGHTS, "inputs:exposure", -30, 30, "each step doubles the light"),
    Row(LIGHT, LIGHTS, "inputs:color", 0, UNLIMITED, "light is never negative"),
    Row(LIGHT, LIGHTS, "inputs:colorTemperature", 1000, 40_000, "kelvin"),
    Row(LIGHT, LIGHTS, "inputs:diffuse", 0, UNLIMITED, "light is never negative"),
    Row(LIGHT, LIGHTS, "inputs:specular", 0, UNLIMITED, "light is never negative"),
    Row(LIGHT, LIGHTS, "inputs:radius", 0, 100, "what has no size shines nowhere", beyond=True, metres=True),
    Row(LIGHT, LIGHTS, "inputs:width", 0, 100, "what has no size shines nowhere", beyond=True, metres=True),
    Row(LIGHT, LIGHTS, "inputs:height", 0, 100, "what has no size shines nowhere", beyond=True, metres=True),
    Row(LIGHT, LIGHTS, "inputs:length", 0, 100, "what has no size shines nowhere", beyond=True, metres=True),
    Row(LIGHT, LIGHTS, "inputs:angle", 0, 360, "degrees"),
    Row(CAMERA, ("Camera",), "focalLength", 0, UNLIMITED, "a lens without length shows nothing", beyond=True),
    Row(CAMERA, ("Camera",), "horizontalAperture", 0, UNLIMITED, "a film without width shows nothing", beyond=True),
    Row(CAMERA, ("Camera",), "verticalAperture", 0, UNLIMITED, "a film without height shows nothing", beyond=True),
    Row(CAMERA, ("Camera",), "clippingRange", 0, UNLIMITED, "what is behind a camera is not shown", beyond=True),
    Row(CAMERA, ("Camera",), "fStop", 0, UNLIMITED, "0 = all is sharp"),
    Row(CAMERA, ("Camera",), "focusDistance", 0, UNLIMITED, "what is behind a camera is not shown"),
)
BY_OWNER = {at: [row for row in TABLE if at in row.at] for row in TABLE for at in row.at}


def out_of_range(reading: Reading, rule: str) -> Iterator[Finding]:
    """What the rows of a rule do not allow."""
    return (
        finding
        for name, finding in reading.once("ranges", reading.stage.GetPseudoRoot(), lambda: _findings(reading))
        if name == rule
    )


def _findings(reading: Reading) -> list[tuple[str, Finding]]:
    """The findings of all rows, each with its rule's name."""
    found = []
    for prim in reading.distinct:
        for owner, instance in _owners(prim):
            for row in BY_OWNER.get(owner, ()):
                attribute = prim.GetAttribute(row.attribute.replace("*", instance))
                values = _numbers(attribute) if attribute and attribute.HasAuthoredValue() else np.zeros(0)
                values = values[values > -UNLIMITED]  # physics: as the engine likes
                if not row.allows(values, reading.metres):
                    shown = ", ".join(f"{value:g}" for value in values[:4])
                    told = f"is {shown}, allowed: {row.allowed} ({row.why})"
                    found.append((row.rule, Finding(attribute.GetPath(), told)))
    return found


def _owners(prim: Usd.Prim) -> Iterator[tuple[str, str]]:
    """What rows may be about in a prim: all prims, its type, its schemas and the id of a shader, with instances."""
    yield "", ""
    yield str(prim.GetTypeName()), ""
    for schema in applied(prim):
        yield Usd.SchemaRegistry.GetTypeNameAndInstance(schema)
    if prim.GetTypeName() == "Shader":
        yield str(prim.GetAttribute("info:id").Get() or ""), ""


def _numbers(attribute: Usd.Attribute) -> np.ndarray:
    """(n,) float of any number or list, none where it holds others or NaN, which the rules on values report."""
    try:
        found = np.asarray(attribute.Get(), float).ravel()
    except (Tf.ErrorException, TypeError, ValueError):
        return np.zeros(0)
    return np.zeros(0) if np.isnan(found).any() else found


for _name, _doc in (
    (PHYSICS, "Masses, frictions, gravity, drives are ones that can be."),
    (LOOK, "Colours, roughness and opacity are ones that can be seen."),
    (LIGHT, "Lights have an intensity, a colour and a size."),
    (CAMERA, "Cameras have a lens, a film and something before them."),
):
    RULES.append(Rule(_name, _doc, partial(out_of_range, rule=_name)))
