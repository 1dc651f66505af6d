"""What may be wrong with a room, one thing at a time: a table of small changes, and what `check` must say of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

ROOM, OBJ, D, S, G = "/Room", "/Room/Objects", "/Room/Dressing", "/Room/Shell", "/Room/SceneGraph"
LOOK, SURFACE = "/Room/Looks/floor", "/Room/Looks/room_paper/surface"
BED = f"{OBJ}/bed"
MESH = f"{BED}/geo/bed_mattress"
LEAF, HINGE = f"{S}/Wall_1/Wall_1_door", f"{S}/Wall_1/Wall_1_door/Wall_1_door_hinge_joint"
LABELS = "semantics:labels:category"
CONTACT = f"{BED}/mtl/contact"
EDGE = f"{G}/tv__standing_on__tv_stand"
T = Sdf.ValueTypeNames
Change = Callable[[Usd.Stage], Any]


@dataclass(frozen=True)
class Sabotage:
    """A change of a stage, and what a report must name: a rule or a problem, and a prim (or an object's name)."""

    name: str
    change: Change
    rule: str
    prim: str


def put(path: str, value: Any, kind: Any = None) -> Change:
    """Set an attribute; `kind` of one that may not be there yet."""

    def change(stage: Usd.Stage) -> None:
        at = Sdf.Path(path)
        prim = stage.GetPrimAtPath(at.GetPrimPath())
        assert prim, path
        attribute = prim.GetAttribute(at.name)
        (attribute or prim.CreateAttribute(at.name, kind)).Set(value)

    return change


def off(path: str) -> Change:
    """Deactivate a prim."""
    return lambda stage: stage.GetPrimAtPath(path).SetActive(False)


def hidden(path: str) -> Change:
    """Make a prim invisible."""
    return lambda stage: UsdGeom.Imageable(stage.GetPrimAtPath(path)).MakeInvisible()


def kind(path: str, word: str) -> Change:
    """Set the kind of a prim."""
    return lambda stage: stage.GetPrimAtPath(path).SetMetadata("kind", word)


def move(path: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Change:
    """Move a piece in the room, metres."""

    def change(stage: Usd.Stage) -> None:
        attribute = stage.GetPrimAtPath(path).GetAttribute("xformOp:translate")
        attribute.Set(Gf.Vec3d(attribute.Get()) + Gf.Vec3d(x, y, z))

    return change


def turn(path: str, degrees: float) -> Change:
    """Turn a piece further about its vertical."""

    def change(stage: Usd.Stage) -> None:
        attribute = stage.GetPrimAtPath(path).GetAttribute("xformOp:rotateY")
        attribute.Set(attribute.Get() + degrees)

    return change


def op(path: str, name: str, value: Any, type_name: Any) -> Change:
    """Add a transform op behind the others."""

    def change(stage: Usd.Stage) -> None:
        prim = stage.GetPrimAtPath(path)
        prim.CreateAttribute(f"xformOp:{name}", type_name).Set(value)
        order = prim.GetAttribute("xformOpOrder")
        order.Set([*(order.Get() or ()), f"xformOp:{name}"])

    return change


def scale(path: str, *factors: float) -> Change:
    """Scale a piece."""
    return op(path, "scale", Gf.Vec3f(*factors), T.Float3)


def api(path: str, *names: str, gone: bool = False) -> Change:
    """Add applied schemas, or take them away."""

    def change(stage: Usd.Stage) -> None:
        for name in names:
            prim = stage.GetPrimAtPath(path)
            (prim.RemoveAppliedSchema if gone else prim.AddAppliedSchema)(name)

    return change


def copied(path: str, to: str) -> Change:
    """A second prim with the references of one, in the same place."""

    def change(stage: Usd.Stage) -> None:
        stage.DefinePrim(to, "Xform").GetReferences().AddInternalReference(path)

    return change


def linked(path: str, source: str | None) -> Change:
    """Connect an attribute to something else, None = to nothing."""

    def change(stage: Usd.Stage) -> None:
        stage.GetAttributeAtPath(path).SetConnections([] if source is None else [source])

    return change


def aimed(path: str, *targets: str, variant: str = "") -> Change:
    """Set the targets of a relationship."""
    at = Sdf.Path(path)

    def change(stage: Usd.Stage) -> None:
        if variant:
            chosen(LEAF, variant)(stage)
        prim = stage.GetPrimAtPath(at.GetPrimPath())
        prim.CreateRelationship(at.name).SetTargets(list(targets))

    return change


def chosen(path: str, name: str, word: str = "articulation") -> Change:
    """Choose a variant."""
    return lambda stage: stage.GetPrimAtPath(path).GetVariantSet(word).SetVariantSelection(name)


def articulated(*changes: Change) -> Change:
    """Changes of a door that can be opened."""
    return both(chosen(LEAF, "articulated"), *changes)


def both(*changes: Change) -> Change:
    """Several changes."""

    def change(stage: Usd.Stage) -> None:
        for each in changes:
            each(stage)

    return change


def numbers(path: str, edit: Callable[[list], Any]) -> Change:
    """Change a list of numbers of a mesh."""

    def change(stage: Usd.Stage) -> None:
        attribute = stage.GetAttributeAtPath(path)
        attribute.Set(type(attribute.Get())(edit(list(attribute.Get()))))

    return change


def no_lights(stage: Usd.Stage) -> None:
    """Every light at intensity 0."""
    for prim in stage.GetPrimAtPath(f"{ROOM}/Lights").GetChildren():
        prim.GetAttribute("inputs:intensity").Set(0.0)


def layer_says(name: str, key: str, value: Any) -> Change:
    """A layer of the room that says another unit or up axis."""

    def change(stage: Usd.Stage) -> None:
        (layer,) = [layer for layer in stage.GetUsedLayers() if layer.GetDisplayName() == name]
        layer.pseudoRoot.SetInfo(key, value)

    return change


def twin_graph(stage: Usd.Stage) -> None:
    """A second graph of one room."""
    stage.DefinePrim(f"{ROOM}/Other", "EchoSceneGraph").CreateRelationship("echo:room").SetTargets([ROOM])


def edge(name: str, subject: str, predicate: str, object_: str, above: str = G) -> Change:
    """A relation more."""

    def change(stage: Usd.Stage) -> None:
        prim = stage.DefinePrim(f"{above}/{name}", "EchoRelation")
        prim.CreateRelationship("echo:subject").SetTargets([f"{OBJ}/{subject}"])
        prim.CreateRelationship("echo:object").SetTargets([f"{OBJ}/{object_}"])
        prim.CreateAttribute("echo:predicate", T.Token).Set(predicate)

    return change


def unbound(stage: Usd.Stage) -> None:
    """A mesh whose material nobody knows."""
    for prim in Usd.PrimRange(stage.GetPrimAtPath(f"{S}/Floor")):
        if prim.HasRelationship("material:binding"):
            prim.GetRelationship("material:binding").SetTargets([])


def flat(points: list) -> list:
    """All points in one."""
    return [points[0]] * len(points)


def nan(points: list) -> list:
    """One point that is none."""
    return [Gf.Vec3f(float("nan"), 0, 0), *points[1:]]


def joint(name: str, value: Any, type_name: Any = None) -> Change:
    """An attribute of the hinge of the door."""
    return articulated(put(f"{HINGE}.{name}", value, type_name))


P, M, L, C = "echo:PhysicsValues", "echo:MaterialValues", "echo:LightValues", "echo:CameraValues"
CAM, LAMP, CEIL = f"{ROOM}/Cameras/perspective", f"{ROOM}/Lights/lamp_lamp", f"{ROOM}/Lights/ceiling"
SCENE = f"{ROOM}/PhysicsScene"
FLOOR = f"{S}/Floor/Floor_mesh"


def rows(rule: str, prim: str, *values: tuple[Any, ...]) -> tuple[Sabotage, ...]:
    """Attributes of one prim with values that its rule does not allow: (attribute, value[, type])."""
    return tuple(
        Sabotage(f"{name} {value}", put(f"{prim}.{name}", value, *type_name), rule, f"{prim}.{name}")
        for name, value, *type_name in values
    )


SABOTAGES: tuple[Sabotage, ...] = (
    # The dressing.
    Sabotage("cushion in the air", move(f"{D}/bed_cushion", y=0.7), "floating", "bed_cushion"),
    Sabotage("picture outside", move(f"{D}/bed_picture", x=5.0), "outside", "bed_picture"),
    Sabotage("picture off its wall", move(f"{D}/bed_picture", z=1.0), "off its wall", "bed_picture"),
    Sabotage("flowers sunk in their table", move(f"{D}/nightstand_flowers", y=-0.15), "floating", "nightstand_flowers"),
    Sabotage("cushion below the floor", move(f"{D}/bed_cushion", y=-1.5), "sunk", "bed_cushion"),
    Sabotage("curtain off its window", move(f"{D}/curtain_3", z=0.85), "off its window", "curtain_3"),
    Sabotage("curtain in the middle of the room", move(f"{D}/curtain", x=-1.5), "off its wall", "curtain"),
    Sabotage("rug in the air", move(f"{D}/bed_rug", y=0.3), "collision", "bed_rug"),
    Sabotage("rug through a wall", move(f"{D}/bed_rug", x=2.0), "outside", "bed_rug"),
    Sabotage("flowers beside their table", move(f"{D}/nightstand_flowers", x=0.5), "floating", "nightstand_flowers"),
    Sabotage("cushion through a wall", move(f"{D}/bed_cushion", z=-1.2), "outside", "bed_cushion"),
    Sabotage("cushion five times as large", scale(f"{D}/bed_cushion", 5, 5, 5), "too large", "bed_cushion"),
    Sabotage("cushion as a thimble", scale(f"{D}/bed_cushion", 0.05, 0.05, 0.05), "too small", "bed_cushion"),
    Sabotage("cushion in flowers", lambda stage: together(stage, f"{D}/bed_cushion", f"{D}/nightstand_flowers"), "collision", "bed_cushion"),
    Sabotage("flowers hidden", hidden(f"{D}/nightstand_flowers"), "empty", "nightstand_flowers"),
    Sabotage("flowers upside down", op(f"{D}/nightstand_flowers", "rotateX", 180.0, T.Float), "echo:Upright", f"{D}/nightstand_flowers"),
    # Furniture.
    Sabotage("television to the wall", turn(f"{OBJ}/tv", 180), "turned", "tv"),
    Sabotage("television across its stand", turn(f"{OBJ}/tv", 90), "turned", "tv"),
    Sabotage("television in the air", move(f"{OBJ}/tv", y=0.3), "broken", "tv"),
    Sabotage("bed in the air", move(BED, y=0.3), "floating", "bed"),
    Sabotage("bed sunk", move(BED, y=-0.3), "sunk", "bed"),
    Sabotage("bed outside", move(BED, x=-4.0), "outside", "bed"),
    Sabotage("bed in its wall", move(BED, z=-0.04), "collision", "bed"),
    Sabotage("wardrobe in the bed", move(f"{OBJ}/wardrobe", z=-1.5), "collision", "wardrobe"),
    Sabotage("pendant below its ceiling", move(f"{OBJ}/pendant", y=-0.5), "floating", "pendant"),
    Sabotage("bed on its head", op(BED, "rotateX", 180.0, T.Float), "echo:Upright", BED),
    Sabotage("bed on its side", op(BED, "rotateZ", 90.0, T.Float), "echo:Upright", BED),
    Sabotage("bed hidden", hidden(BED), "echo:Hidden", BED),
    Sabotage("bed for tools alone", put(f"{BED}.purpose", "guide", T.Token), "echo:Hidden", BED),
    Sabotage("bed deactivated", off(f"{OBJ}/tv_stand"), "echo:EdgeTargets", EDGE),
    Sabotage("second bed in the bed", copied(BED, f"{OBJ}/bed_again"), "collision", "bed_again"),
    Sabotage("second bed elsewhere", lambda stage: stranger(stage), "echo:Strangers", f"{ROOM}/Extra/bed"),
    Sabotage("second bed in the same place", lambda stage: stranger(stage), "collision", "bed"),
    Sabotage("bed stretched", scale(BED, 1, 2, 1), "echo:Scale", BED),
    Sabotage("bed mirrored", scale(BED, -1, 1, 1), "echo:Mirrored", BED),
    Sabotage("bed without an extent", scale(BED, 0, 1, 1), "echo:Scale", BED),
    Sabotage("tv_stand leaves its television", move(f"{OBJ}/tv_stand", x=-1.6), "broken", "tv"),
    # The shell.
    Sabotage("floor deactivated", off(f"{S}/Floor"), "echo:Floor", f"{S}/Floor"),
    Sabotage("wall deactivated", off(f"{S}/Wall_3"), "echo:Floor", f"{S}/Wall_3"),
    Sabotage("wall upside down", op(f"{S}/Wall_3", "rotateX", 180.0, T.Float), "echo:Upright", f"{S}/Wall_3"),
    Sabotage("wall in the room", move(f"{S}/Wall_3/Wall_3_mesh", z=-0.5), "collision", "Wall_3"),
    # Labels and kinds.
    Sabotage("no label", put(f"{BED}.{LABELS}", Vt.TokenArray([])), "echo:SomeLabel", BED),
    Sabotage("no label of a wall", put(f"{S}/Wall_3.{LABELS}", Vt.TokenArray([])), "echo:SomeLabel", f"{S}/Wall_3"),
    Sabotage("no label of a material", put(f"{LOOK}.semantics:labels:material", Vt.TokenArray([])), "echo:SomeLabel", LOOK),
    Sabotage("two labels", put(f"{BED}.{LABELS}", Vt.TokenArray(["bed", "sofa"])), "echo:OneLabel", BED),
    Sabotage("another label", put(f"{BED}.{LABELS}", Vt.TokenArray(["wardrobe"])), "echo:OneLabel", BED),
    Sabotage("wall as a floor", put(f"{S}/Wall_3.{LABELS}", Vt.TokenArray(["floor"])), "echo:LabelsAgree", f"{S}/Wall_3"),
    Sabotage("another class", put(f"{BED}.semantics:labels:ade20k", Vt.TokenArray(["sky"])), "echo:LabelsAgree", BED),
    Sabotage("labels gone", api(f"{S}/Wall_3", "SemanticsLabelsAPI:category", "SemanticsLabelsAPI:ade20k", gone=True), "echo:Semantics", f"{S}/Wall_3"),
    Sabotage("kind group", kind(BED, "group"), "echo:Kinds", BED),
    Sabotage("kind assembly", kind(BED, "assembly"), "echo:Kinds", BED),
    Sabotage("kind of nobody", kind(BED, "furniture"), "echo:Kinds", BED),
    Sabotage("no kind", kind(BED, ""), "echo:Kinds", BED),
    Sabotage("component in a component", kind(f"{BED}/geo", "component"), "echo:Kinds", f"{BED}/geo"),
    Sabotage("components below no group", kind(OBJ, ""), "echo:Kinds", BED),
    Sabotage("small thing without a kind", kind(f"{D}/nightstand_flowers", ""), "echo:Kinds", f"{D}/nightstand_flowers"),
    # Bodies.
    Sabotage("bed without a body", api(BED, "PhysicsRigidBodyAPI", gone=True), "echo:FixedFurniture", BED),
    Sabotage("body switched off", put(f"{BED}.physics:rigidBodyEnabled", False, T.Bool), "echo:FixedFurniture", BED),
    Sabotage("body that never moves", put(f"{BED}.physics:kinematicEnabled", True, T.Bool), "echo:FixedFurniture", BED),
    Sabotage("body in a body", api(f"{BED}/geo", "PhysicsRigidBodyAPI"), "echo:NestedBodies", f"{BED}/geo"),
    *rows(P, BED, ("physics:mass", 1e6), ("physics:mass", -1.0), ("physics:density", -5.0, T.Float),
          ("physics:diagonalInertia", Gf.Vec3f(-1, 1, 1)), ("physics:velocity", Gf.Vec3f(0, 3, 0), T.Vector3f),
          ("physics:angularVelocity", Gf.Vec3f(0, 90, 0), T.Vector3f)),
    Sabotage("mass of lead", put(f"{OBJ}/lamp.physics:mass", 900.0), "echo:Masses", f"{OBJ}/lamp"),
    Sabotage("centre of mass far away", put(f"{BED}.physics:centerOfMass", Gf.Vec3f(9, 0, 0)), "echo:Masses", BED),
    Sabotage("inertia of nothing", put(f"{BED}.physics:diagonalInertia", Gf.Vec3f(1, 1, 50)), "echo:Masses", BED),
    Sabotage("axes that are none", put(f"{BED}.physics:principalAxes", Gf.Quatf(3, 0, 0, 0)), "echo:Masses", BED),
    *rows(P, CONTACT, ("physics:staticFriction", -1.0), ("physics:dynamicFriction", 80.0),
          ("physics:restitution", 2.0), ("physics:density", -1.0)),
    *rows(P, SCENE, ("physics:gravityMagnitude", 0.0), ("physics:gravityMagnitude", 981.0)),
    Sabotage("gravity up", put(f"{SCENE}.physics:gravityDirection", Gf.Vec3f(0, 1, 0)), "echo:Gravity", SCENE),
    Sabotage("gravity sideways", put(f"{SCENE}.physics:gravityDirection", Gf.Vec3f(1, 0, 0)), "echo:Gravity", SCENE),
    Sabotage("inactive scene", off(SCENE), "echo:PhysicsScene", SCENE),
    Sabotage("no collider", lambda stage: bare(stage, f"{OBJ}/lamp"), "echo:Colliders", f"{OBJ}/lamp"),
    Sabotage("colliders off", lambda stage: bare(stage, f"{OBJ}/lamp", switch=True), "echo:Colliders", f"{OBJ}/lamp"),
    Sabotage("floor without a collider", put(f"{FLOOR}.physics:collisionEnabled", False, T.Bool), "echo:Colliders", f"{S}/Floor"),
    Sabotage("triangles on a body", put(f"{BED}/geo/bed_collider.physics:approximation", "none"), "echo:DynamicColliders", f"{BED}/geo/bed_collider"),
    Sabotage("collider of nobody", put(f"{BED}/geo/bed_collider.physics:approximation", "banana"), "echo:ValueTypes", f"{BED}/geo/bed_collider.physics:approximation"),
    Sabotage("collider elsewhere", op(f"{BED}/geo/bed_collider", "translate:far", Gf.Vec3d(0, 0, 3), T.Double3), "echo:Colliders", BED),
    # Joints.
    Sabotage("swapped limits", joint("physics:lowerLimit", 120.0), "echo:Joints", HINGE),
    Sabotage("joint to itself", articulated(aimed(f"{HINGE}.physics:body0", f"{LEAF}/Wall_1_door_hinge")), "echo:Joints", HINGE),
    Sabotage("joint to nothing", articulated(aimed(f"{HINGE}.physics:body1", f"{LEAF}/gone")), "echo:Joints", HINGE),
    Sabotage("joint of nobody", articulated(aimed(f"{HINGE}.physics:body0"), aimed(f"{HINGE}.physics:body1")), "echo:Joints", HINGE),
    Sabotage("anchors apart", joint("physics:localPos0", Gf.Vec3f(0, 0, 9)), "echo:Joints", HINGE),
    Sabotage("axis of nobody", joint("physics:axis", "W"), "echo:ValueTypes", f"{HINGE}.physics:axis"),
    Sabotage("spring that pushes", joint("drive:angular:physics:stiffness", -4.0), P, f"{HINGE}.drive:angular:physics:stiffness"),
    Sabotage("damper that drives", joint("drive:angular:physics:damping", -4.0), P, f"{HINGE}.drive:angular:physics:damping"),
    Sabotage("joint that breaks", joint("physics:breakForce", 0.0, T.Float), P, f"{HINGE}.physics:breakForce"),
    Sabotage("swapped limits of the other variant", lambda stage: other_variant(stage), "echo:Joints", HINGE),
    # Materials.
    *rows(M, SURFACE, ("inputs:roughness", 7.0), ("inputs:roughness", -1.0), ("inputs:metallic", 3.0),
          ("inputs:diffuseColor", Gf.Vec3f(-1, 0, 0)), ("inputs:diffuseColor", Gf.Vec3f(5, 5, 5)),
          ("inputs:opacity", 0.0, T.Float), ("inputs:opacity", 1.5, T.Float), ("inputs:ior", 0.0, T.Float),
          ("inputs:clearcoat", -1.0, T.Float), ("inputs:emissiveColor", Gf.Vec3f(-1, 0, 0), T.Color3f),
          ("inputs:occlusion", 4.0, T.Float), ("inputs:opacityThreshold", 2.0, T.Float)),
    *rows(M, FLOOR, ("primvars:displayOpacity", Vt.FloatArray([0.0]), T.FloatArray),
          ("primvars:displayColor", Vt.Vec3fArray([(9, 0, 0)]), T.Color3fArray)),
    Sabotage("no surface", linked(f"{LOOK}.outputs:surface", None), "echo:Materials", LOOK),
    Sabotage("colour not connected", linked(f"{LOOK}/surface.inputs:diffuseColor", None), "echo:Materials", f"{LOOK}/image"),
    Sabotage("connected to nothing", linked(f"{LOOK}/surface.inputs:diffuseColor", f"{LOOK}/gone.outputs:rgb"), "echo:Materials", f"{LOOK}/surface.inputs:diffuseColor"),
    Sabotage("connected to no output", linked(f"{LOOK}/surface.inputs:diffuseColor", f"{LOOK}/image.outputs:blue_"), "echo:Materials", f"{LOOK}/surface.inputs:diffuseColor"),
    Sabotage("no image", put(f"{LOOK}/image.inputs:file", Sdf.AssetPath("")), "echo:Materials", f"{LOOK}/image"),
    Sabotage("image gone", put(f"{LOOK}/image.inputs:file", Sdf.AssetPath("textures/gone.jpg")), "echo:Images", f"{LOOK}/image"),
    Sabotage("unknown colour space", put(f"{LOOK}/image.inputs:sourceColorSpace", "magic"), "echo:ValueTypes", f"{LOOK}/image.inputs:sourceColorSpace"),
    Sabotage("coordinates of nobody", put(f"{LOOK}/st.inputs:varname", "uv9"), "echo:Materials", f"{LOOK}/st"),
    Sabotage("unknown shader", put(f"{SURFACE}.info:id", "UsdMagic"), "usdShadeValidators:ShaderSdrCompliance.MissingShaderIdInRegistry", f"{SURFACE}.info:id"),
    Sabotage("bound to nothing", aimed(f"{FLOOR}.material:binding", f"{ROOM}/Looks/gone"), "echo:Bindings", FLOOR),
    Sabotage("material deactivated", off(LOOK), "echo:Bindings", FLOOR),
    Sabotage("bound to no material", unbound, "echo:Bindings", FLOOR),
    Sabotage("material outside", lambda stage: outside_look(stage), "echo:MaterialsInside", FLOOR),
    # Lights and cameras.
    *rows(L, CEIL, ("inputs:intensity", -5.0), ("inputs:exposure", 60.0, T.Float), ("inputs:width", 0.0),
          ("inputs:height", -2.0), ("inputs:colorTemperature", 0.0), ("inputs:diffuse", -1.0, T.Float),
          ("inputs:color", Gf.Vec3f(-1, 1, 1), T.Color3f)),
    *rows(L, LAMP, ("inputs:radius", 0.0), ("inputs:specular", -1.0, T.Float)),
    Sabotage("no light", no_lights, "echo:Lights", CEIL),
    Sabotage("lights deactivated", off(f"{ROOM}/Lights"), "echo:Lights", f"{ROOM}/Lights"),
    Sabotage("lamp below the floor", put(f"{LAMP}.xformOp:translate", Gf.Vec3d(0, -2, 0)), "echo:Viewpoints", LAMP),
    *rows(C, CAM, ("focalLength", 0.0), ("horizontalAperture", 0.0), ("verticalAperture", -1.0), ("fStop", -1.0),
          ("clippingRange", Gf.Vec2f(-1, 10)), ("focusDistance", -1.0)),
    Sabotage("swapped clipping", put(f"{CAM}.clippingRange", Gf.Vec2f(50, 1)), "echo:Viewpoints", CAM),
    Sabotage("camera below the floor", put(f"{CAM}.xformOp:transform", Gf.Matrix4d().SetTranslate((0, -1, 0))), "echo:Viewpoints", CAM),
    Sabotage("camera in the bed", put(f"{CAM}.xformOp:transform", Gf.Matrix4d().SetTranslate((0, 0.35, -0.6))), "echo:Viewpoints", CAM),
    # Meshes.
    Sabotage("faces without area", numbers(f"{MESH}.points", flat), "echo:Degenerate", MESH),
    Sabotage("corners twice", numbers(f"{MESH}.faceVertexIndices", lambda v: [v[0], v[0], *v[2:]]), "echo:Degenerate", MESH),
    Sabotage("smoothed", put(f"{MESH}.subdivisionScheme", "catmullClark"), "echo:Subdivision", MESH),
    Sabotage("scheme of nobody", put(f"{MESH}.subdivisionScheme", "round"), "echo:ValueTypes", f"{MESH}.subdivisionScheme"),
    Sabotage("index beyond the points", numbers(f"{MESH}.faceVertexIndices", lambda v: [999_999, *v[1:]]), "echo:MeshIndices", MESH),
    Sabotage("index below 0", numbers(f"{MESH}.faceVertexIndices", lambda v: [-1, *v[1:]]), "echo:MeshIndices", MESH),
    Sabotage("corners too few", numbers(f"{MESH}.faceVertexCounts", lambda v: [4, *v[1:]]), "echo:MeshIndices", MESH),
    Sabotage("faces of two corners", numbers(f"{MESH}.faceVertexCounts", lambda v: [2, 4, *v[2:]]), "echo:MeshIndices", MESH),
    Sabotage("no faces", both(put(f"{MESH}.faceVertexCounts", Vt.IntArray()), put(f"{MESH}.faceVertexIndices", Vt.IntArray())), "echo:EmptyMeshes", MESH),
    Sabotage("long normals", numbers(f"{MESH}.primvars:normals", lambda v: [3 * n for n in v]), "echo:Normals", MESH),
    Sabotage("normals of others", put(f"{MESH}.primvars:normals:indices", Vt.IntArray([0, 0])), "echo:Normals", MESH),
    Sabotage("normals beyond", numbers(f"{MESH}.primvars:normals:indices", lambda v: [99_999, *v[1:]]), "echo:Normals", MESH),
    Sabotage("wrong extent", put(f"{MESH}.extent", Vt.Vec3fArray([(0, 0, 0), (9, 9, 9)])), "echo:Extents", MESH),
    Sabotage("wrong hint", put(f"{BED}.extentsHint", Vt.Vec3fArray([(0, 0, 0), (9, 9, 9)])), "echo:Extents", BED),
    Sabotage("inside out", put(f"{MESH}.orientation", "leftHanded", T.Token), "echo:Winding", MESH),
    Sabotage("no number", numbers(f"{MESH}.points", nan), "echo:FiniteValues", f"{MESH}.points"),
    Sabotage("no coordinates", lambda stage: stage.GetAttributeAtPath(f"{MESH}.primvars:st").Block(), "echo:TextureCoordinates", MESH),
    Sabotage("coordinates beyond", numbers(f"{MESH}.primvars:st:indices", lambda v: [99_999, *v[1:]]), "echo:TextureCoordinates", MESH),
    Sabotage("points that move", lambda stage: moving(stage), "echo:AtRest", f"{BED}.xformOp:translate"),
    Sabotage("op that is not there", put(f"{BED}.xformOpOrder", Vt.TokenArray(["xformOp:translate:gone"])), "echo:TransformOps", BED),
    Sabotage("variant that is not there", chosen(BED, "enormous", "LOD"), "echo:Variants", BED),
    # Units.
    Sabotage("asset in centimetres", layer_says("bed.usda", "metersPerUnit", 0.01), "echo:Arcs", BED),
    Sabotage("asset with z up", layer_says("bed.usda", "upAxis", "Z"), "echo:Arcs", BED),
    Sabotage("asset in grams", layer_says("bed.usda", "kilogramsPerUnit", 0.001), "echo:Arcs", "/"),
    Sabotage("room in centimetres", layer_says("bedroom.usda", "metersPerUnit", 0.01), "echo:Units", "/"),
    Sabotage("room with z up", layer_says("bedroom.usda", "upAxis", "Z"), "echo:Units", "/"),
    # The graph.
    Sabotage("edge to nothing", aimed(f"{EDGE}.echo:object", f"{OBJ}/gone"), "echo:EdgeTargets", EDGE),
    Sabotage("edge to two", aimed(f"{EDGE}.echo:object", BED, f"{OBJ}/tv_stand"), "echo:EdgeTargets", EDGE),
    Sabotage("edge without an end", aimed(f"{EDGE}.echo:subject"), "echo:EdgeTargets", EDGE),
    Sabotage("predicate of nobody", put(f"{EDGE}.echo:predicate", "wibbles"), "echo:EdgeTargets", EDGE),
    Sabotage("edge outside its graph", edge("lost", "bed", "close_by", "tv", above=ROOM), "echo:EdgeTargets", f"{ROOM}/lost"),
    Sabotage("edge said twice", edge("again", "tv", "standing_on", "tv_stand"), "echo:ConsistentGraph", G),
    Sabotage("contradiction", edge("against", "tv_stand", "standing_on", "tv"), "echo:ConsistentGraph", G),
    Sabotage("edge that is broken", edge("untrue", "wardrobe", "shorter_than", "nightstand"), "broken", "wardrobe"),
    Sabotage("two graphs", twin_graph, "echo:EdgeTargets", "/"),
    Sabotage("category of nobody", put(f"{BED}.echo:category", "spaceship"), "echo:ConsistentGraph", G),
    Sabotage("no room", put(f"{G}.echo:floorSize", Gf.Vec2d(-1, 2)), "echo:ConsistentGraph", G),
    Sabotage("another size", put(f"{BED}.echo:size", Gf.Vec3d(1, 1, 1), T.Double3), "echo:StatedBoxes", BED),
    Sabotage("another turn", put(f"{BED}.echo:yaw", 2.0, T.Double), "echo:StatedBoxes", BED),
    Sabotage("type of nobody", lambda stage: stage.GetPrimAtPath(f"{BED}/geo").SetTypeName("Xfrom"), "echo:KnownTypes", f"{BED}/geo"),
    Sabotage("schema of nobody", api(BED, "MagicAPI"), "echo:KnownTypes", BED),
)  # fmt: skip


def together(stage: Usd.Stage, path: str, other: str) -> None:
    """Two things in one place."""
    there = stage.GetPrimAtPath(other).GetAttribute("xformOp:translate").Get()
    stage.GetPrimAtPath(path).GetAttribute("xformOp:translate").Set(there)


def stranger(stage: Usd.Stage) -> None:
    """A bed that is no node, in the place of the bed."""
    UsdGeom.Xform.Define(stage, f"{ROOM}/Extra").GetPrim().SetMetadata("kind", "group")
    prim = UsdGeom.Xform.Define(stage, f"{ROOM}/Extra/bed").GetPrim()
    assets = [layer for layer in stage.GetUsedLayers() if layer.GetDisplayName() == "bed.usda"]
    prim.GetReferences().AddReference(assets[0].realPath)
    UsdGeom.Xformable(prim).AddTranslateOp().Set(stage.GetPrimAtPath(BED).GetAttribute("xformOp:translate").Get())
    UsdGeom.Xformable(prim).AddRotateYOp().Set(stage.GetPrimAtPath(BED).GetAttribute("xformOp:rotateY").Get())


def bare(stage: Usd.Stage, path: str, *, switch: bool = False) -> None:
    """A piece whose colliders are taken away, or switched off."""
    for prim in Usd.PrimRange(stage.GetPrimAtPath(path)):
        if prim.HasAPI(UsdPhysics.CollisionAPI):
            if switch:
                UsdPhysics.CollisionAPI(prim).CreateCollisionEnabledAttr(False)
            else:
                prim.RemoveAppliedSchema("PhysicsCollisionAPI")


def outside_look(stage: Usd.Stage) -> None:
    """A material beside the room."""
    UsdShade.Material.Define(stage, "/Looks/wood")
    stage.GetPrimAtPath(FLOOR).CreateRelationship("material:binding").SetTargets(["/Looks/wood"])


def moving(stage: Usd.Stage) -> None:
    """A bed that walks."""
    attribute = stage.GetPrimAtPath(BED).GetAttribute("xformOp:translate")
    attribute.Set(Gf.Vec3d(0, 0, 0), 1.0)
    attribute.Set(Gf.Vec3d(1, 0, 0), 2.0)


def other_variant(stage: Usd.Stage) -> None:
    """Limits that are wrong in the variant that is not shown."""
    chosen(LEAF, "articulated")(stage)
    stage.GetPrimAtPath(HINGE).GetAttribute("physics:lowerLimit").Set(120.0)
    chosen(LEAF, "static")(stage)
