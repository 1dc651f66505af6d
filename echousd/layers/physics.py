"""Physics of a room: bodies, colliders and joints in every asset; the scene and what never moves in its own layer."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from pxr import Gf

from echomodel.dressing import SMALL
from echomodel.furniture.solids import Joint
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.shapes.geometry import FRAME, Geometry, Mass
from echousd.shapes.hulls import hull_volume
from echousd.shapes.matter import mass_of, write_mass
from echousd.stage.paths import MTL, SHELL, piece_name, piece_path
from echousd.stage.pen import ARTICULATED, ARTICULATION, Pen

SCENE = "/Room/PhysicsScene"
# Static and dynamic friction of a material slot, and how much of its speed a thing keeps when it bounces.
CONTACT: Mapping[str, tuple[float, float, float]] = {
    "fabric": (0.8, 0.7, 0.0), "cushion": (0.8, 0.7, 0.0), "linen": (0.8, 0.7, 0.0), "blanket": (0.8, 0.7, 0.0),
    "blanket_striped": (0.8, 0.7, 0.0), "blanket_checked": (0.8, 0.7, 0.0), "linen_striped": (0.8, 0.7, 0.0),
    "metal": (0.5, 0.4, 0.1), "glass": (0.5, 0.4, 0.1), "ceramic": (0.5, 0.4, 0.1), "enamel": (0.5, 0.4, 0.1),
    "steel": (0.5, 0.4, 0.1), "worktop": (0.5, 0.4, 0.1), "mirror": (0.5, 0.4, 0.1),
}  # fmt: skip
WOODEN = (0.6, 0.5, 0.05)  # of every other slot


def movable(category: str) -> bool:
    """Whether an object of this category is a rigid body; what hangs on a wall or a ceiling and obstacles are not."""
    if category == OBSTACLE:
        return False
    if category in SMALL:
        return not SMALL[category].fixed
    return vocabulary().category(category).support in ("floor", "table")


def stops(category: str) -> bool:
    """Whether a thing of this category stops others: small cloths do not."""
    return category not in SMALL or not (SMALL[category].lies or SMALL[category].yields)


def write_asset_physics(pen: Pen, asset: str, category: str, geometry: Geometry, slots: Iterable[str]) -> None:
    """Author mass and contact material of one asset as overs on its prims.

    `pen`: of the component layer, whose default prim is `/<asset>`. `category`: of the piece; what hangs is no body.
    `geometry`: whose mass is told. `slots`: its material slots, the one that most of it is made of first.
    """
    root = f"/{asset}"
    mass = mass_of(geometry, category)
    volume = sum(max(hull_volume(collider.mesh.vertices), 1e-6) for collider in geometry.colliders)
    slot = next(iter(slots), "wood")
    pen.define(f"{root}/{MTL}", "Scope")
    bind_contact(pen, root, f"{root}/{MTL}/contact", CONTACT.get(slot, WOODEN), mass.mass / volume)
    if movable(category) and not (geometry.original is not None and geometry.original.bodies):
        both = (ARTICULATED, STATIC)  # articulated, its bodies are those of its joints
        write_mass(pen.variants(root, ARTICULATION, both, STATIC)[STATIC] if geometry.joints else pen, root, mass)


def collides(pen: Pen, path: str, approximation: str) -> None:
    """Have a mesh stop things; `approximation`: how, a token of `physics:approximation`."""
    values: dict[str, Any] = {"uniform token physics:approximation": approximation}
    apis = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"]
    if approximation == "convexHull":  # else Newton drops corners beyond the 64th, and a bed's top with them
        values[f"uniform int {CORNERS}"], apis = -1, [*apis, CORNERS_API]
    pen.over(path, values, apis)


def bind_contact(
    pen: Pen, path: str, material: str, contact: tuple[float, float, float], density: float | None = None
) -> None:
    """Author a physics material and bind it on a prim for purpose `physics`.

    `path`: of the prim that gets it. `material`: path of the material. `contact`: static friction, dynamic friction,
    restitution. `density`: kg/m³.
    """
    names = ("staticFriction", "dynamicFriction", "restitution")
    values = {f"float physics:{name}": value for name, value in zip(names, contact, strict=True)}
    if density is not None:
        values["float physics:density"] = round(density, 2)
    pen.define(material, "Material")
    pen.label(material, material="contact")
    pen.over(material, values, ["PhysicsMaterialAPI"])
    bound = pen.over(path, {"rel material:binding:physics": material}, ["MaterialBindingAPI"])
    bound.relationships["material:binding:physics"].SetInfo("bindMaterialAs", "weakerThanDescendants")


def write_physics(pen: Pen, shell: Mapping[str, str]) -> None:
    """Author the physics scene, and the colliders of the shell as overs.

    `pen`: of a layer in metres and kilograms, whose up axis is Y below `/Room`. `shell`: path of a solid mesh -> how it
    collides.
    """
    pen.define(SCENE, "PhysicsScene", {"float physics:gravityMagnitude": GRAVITY})  # down by the stage, whoever's it is
    for path, form in shell.items():
        collides(pen, path, form)
    bind_contact(pen, SHELL, f"{SHELL}/contact", WOODEN)


STATIC = "static"
# Of a schema that MuJoCo and Newton bring with them.
FRICTION_API, FRICTION = "NewtonJointAPI", "newton:friction"
CORNERS_API, CORNERS = "NewtonMeshCollisionAPI", "newton:maxHullVertices"  # of which -1 is as many as there are
Point = tuple[float, float, float]
BRAKE = 20.0  # 1/s: what drifts on a runner or hinge stops in a twentieth of a second
SLOPE, GRAVITY = 0.03, 9.81  # what rubs there holds it on a slope of 3 %; m/s²


def write_joints(pen: Pen, asset: str, geometry: Geometry) -> None:
    """Author the variant set `articulation` on the root of an asset: nothing in `static`, bodies and joints else.

    `pen`: whose root prim is `/<asset>`. `geometry`: with joints.
    """
    pen = pen.variants(f"/{asset}", ARTICULATION, (STATIC, ARTICULATED), STATIC)[ARTICULATED]
    for body, mass in geometry.masses.items():
        write_mass(pen, piece_path(f"/{asset}", asset, body), mass)
    # on the frame, not on the asset's root: importers take whatever bears it for a body
    pen.over(piece_path(f"/{asset}", asset, FRAME), apis=["PhysicsArticulationRootAPI"])
    above = f"/{asset}/{piece_name(asset, 'joints')}"
    pen.define(above, "Scope")
    for joint in geometry.joints:
        still, moving = (piece_path(f"/{asset}", asset, body) for body in (FRAME, joint.body))
        places, mass = (joint.anchor, joint.anchor), geometry.masses[joint.body]
        _joint(pen, f"{above}/{piece_name(asset, joint.body)}_joint", still, moving, joint, places, mass)


def write_hinge(pen: Pen, leaf: str, joint: Joint, mass: Mass) -> None:
    """Author the variant set `articulation` on a door of the shell: nothing in `static`, its leaf on a hinge else.

    `leaf`: prim path of what turns, whose origin is on the axis, below the door's prim. `joint`: its anchor in the
    door's frame. `mass`: of the leaf.
    """
    door = leaf.rpartition("/")[0]
    pen = pen.variants(door, ARTICULATION, (STATIC, ARTICULATED), STATIC)[ARTICULATED]
    write_mass(pen, leaf, mass)
    # against the door's prim, which is no body and stays where it is, wherever the room is put
    _joint(pen, f"{leaf}_joint", door, leaf, joint, (joint.anchor, (0.0, 0.0, 0.0)), mass)


def _joint(pen: Pen, path: str, still: str, moving: str, joint: Joint, places: tuple[Point, Point], mass: Mass) -> None:
    """A joint between two prims, with friction; `places`: its anchor in the frame of each, `mass`: of what moves."""
    slides = joint.kind == "prismatic"
    turn = Gf.Rotation(Gf.Vec3d(1, 0, 0), Gf.Vec3d(*joint.axis)).GetQuat()
    turned = Gf.Quatf(turn.GetReal(), Gf.Vec3f(turn.GetImaginary()))
    # without friction no door stays shut that leans; USD's own physics has no word for it but a brake with a limit
    lever = 1.0 if slides else float(np.linalg.norm(np.cross(joint.axis, mass.centre - places[1])))
    inertia = mass.mass if slides else np.radians(4 / 3 * mass.mass * lever**2)  # angular drives count in degrees
    friction, drive = round(SLOPE * GRAVITY * mass.mass * lever, 4), f"drive:{'linear' if slides else 'angular'}"
    values = {
        "rel physics:body0": still, "rel physics:body1": moving, "uniform token physics:axis": "X",
        "point3f physics:localPos0": places[0], "point3f physics:localPos1": places[1],
        "quatf physics:localRot0": turned, "quatf physics:localRot1": turned, "float physics:lowerLimit": 0.0,
        "float physics:upperLimit": round(joint.reach if slides else float(np.degrees(joint.reach)), 5),
        f"float {drive}:physics:damping": round(float(BRAKE * inertia), 6),
        f"float {drive}:physics:maxForce": friction, f"float {drive}:physics:stiffness": 0.0,
        f"float {FRICTION}": friction,
    }  # fmt: skip
    apis = [f"PhysicsDriveAPI:{drive.partition(':')[2]}", FRICTION_API]
    pen.define(path, "PhysicsPrismaticJoint" if slides else "PhysicsRevoluteJoint", values, apis)
