"""Physics of a room: bodies and colliders in every asset, the scene and what never moves in a layer of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from echomodel.dressing import SMALL
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.shapes.geometry import Geometry
from echousd.shapes.hulls import hull_volume
from echousd.shapes.joints import GRAVITY, STATIC
from echousd.shapes.matter import mass_of, write_mass
from echousd.stage.layouts import ARTICULATED, ARTICULATION
from echousd.stage.paths import MTL, SHELL, piece_path
from echousd.stage.pen import Pen

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


def write_asset_physics(pen: Pen, asset: str, category: str, geometry: Geometry, slots: Iterable[str]) -> None:
    """Author colliders, mass and contact material of one asset as overs on its prims.

    `pen`: of the component layer, whose default prim is `/<asset>`. `category`: of the piece; what hangs gets colliders
    alone. `geometry`: whose colliders and mass are told. `slots`: its material slots, the one that most of it is made
    of first.
    """
    root = f"/{asset}"
    cloth = category in SMALL and (SMALL[category].lies or SMALL[category].yields)  # stops nothing
    for collider in () if cloth or geometry.theirs_collides else geometry.colliders:
        collides(pen, piece_path(root, asset, collider.name, collider.body), collider.approximation)
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
    values = {"uniform token physics:approximation": approximation}
    pen.over(path, values, ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])


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
