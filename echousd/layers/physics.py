"""Physics of a room: bodies and colliders in every asset, the scene and what never moves in a layer of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext

from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade

from echomodel.dressing import SMALL
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.shapes.geometry import Geometry, Mass
from echousd.shapes.joints import STATIC
from echousd.shapes.matter import hull_volume, mass_of, write_mass
from echousd.stage.layouts import ARTICULATED, ARTICULATION, authoring
from echousd.stage.paths import MTL, SHELL, piece_path

GRAVITY = 9.81  # m/s²
SCENE = "/Room/PhysicsScene"
# Static and dynamic friction of a material slot, and how much of its speed a thing keeps when it bounces.
CONTACT: Mapping[str, tuple[float, float, float]] = {
    "fabric": (0.8, 0.7, 0.0), "cushion": (0.8, 0.7, 0.0), "linen": (0.8, 0.7, 0.0), "blanket": (0.8, 0.7, 0.0),
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


def write_asset_physics(stage: Usd.Stage, asset: str, category: str, geometry: Geometry, slots: Iterable[str]) -> None:
    """Author colliders, mass and contact material of one asset as overs on its prims.

    `stage`: of the component layer; its default prim is `/<asset>`, where `joints` has already written. `category`: of
    the piece; what hangs gets colliders alone. `geometry`: whose colliders and mass are told. `slots`: its material
    slots, the one that most of it is made of first.
    """
    root = f"/{asset}"
    cloth = category in SMALL and (SMALL[category].lies or SMALL[category].yields)  # stops nothing
    for collider in () if cloth or geometry.theirs_collides else geometry.colliders:
        guide = stage.OverridePrim(piece_path(root, asset, collider.name, collider.body))
        UsdPhysics.CollisionAPI.Apply(guide)
        UsdPhysics.MeshCollisionAPI.Apply(guide).CreateApproximationAttr(collider.approximation)
    mass = mass_of(geometry, category)
    volume = sum(max(hull_volume(collider.mesh.vertices), 1e-6) for collider in geometry.colliders)
    slot = next(iter(slots), "wood")
    UsdGeom.Scope.Define(stage, f"{root}/{MTL}")
    bind_contact(stage, root, f"{root}/{MTL}/contact", CONTACT.get(slot, WOODEN), mass.mass / volume)
    theirs = geometry.original is not None and geometry.original.bodies
    if movable(category) and not theirs:
        _make_body(stage.GetPrimAtPath(root), mass, articulated=bool(geometry.joints))


def _make_body(root: Usd.Prim, mass: Mass, *, articulated: bool) -> None:
    """One rigid body; a piece with joints is one only in its variant `static`."""
    both = (ARTICULATED, STATIC)  # articulated, its bodies are those of its joints
    with authoring(root, ARTICULATION, both, STATIC, STATIC) if articulated else nullcontext():
        UsdPhysics.RigidBodyAPI.Apply(root)
        write_mass(root, mass)


def bind_contact(
    stage: Usd.Stage, path: str, material: str, contact: tuple[float, float, float], density: float | None = None
) -> None:
    """Author a physics material and bind it on a prim for purpose `physics`.

    `path`: of the prim that gets it. `material`: path of the material. `contact`: static friction, dynamic friction,
    restitution. `density`: kg/m³.
    """
    made = UsdShade.Material.Define(stage, material)
    UsdSemantics.LabelsAPI.Apply(made.GetPrim(), "material").CreateLabelsAttr(["contact"])
    api = UsdPhysics.MaterialAPI.Apply(made.GetPrim())
    api.CreateStaticFrictionAttr(contact[0])
    api.CreateDynamicFrictionAttr(contact[1])
    api.CreateRestitutionAttr(contact[2])
    if density is not None:
        api.CreateDensityAttr(round(density, 2))
    binding = UsdShade.MaterialBindingAPI.Apply(stage.OverridePrim(path))
    binding.Bind(made, UsdShade.Tokens.weakerThanDescendants, "physics")


def write_physics(stage: Usd.Stage, shell: Mapping[str, str]) -> None:
    """Author the physics scene, and the colliders of the shell as overs.

    `stage`: receives the opinions; its units are metres and kilograms, its up axis is Y below `/Room`. `shell`: path of
    a solid mesh -> how it collides, a token of `physics:approximation`.
    """
    scene = UsdPhysics.Scene.Define(stage, SCENE)
    scene.CreateGravityMagnitudeAttr(GRAVITY)
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0, -1, 0))
    for path, form in shell.items():
        prim = stage.OverridePrim(path)
        UsdPhysics.CollisionAPI.Apply(prim)
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(form)
    bind_contact(stage, SHELL, f"{SHELL}/contact", WOODEN)
