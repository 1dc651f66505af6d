"""Faults that are put into a finished room one by one: in meshes, objects, nodes, and the room as a whole."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

Sabotage = Callable[[Usd.Stage], object]


def prims(stage: Usd.Stage, below: str) -> list[Usd.Prim]:
    """All prims below a path, with those of prototypes."""
    return list(Usd.PrimRange(stage.GetPrimAtPath(below), Usd.TraverseInstanceProxies()))


def mesh(stage: Usd.Stage, below: str) -> UsdGeom.Mesh:
    """The largest visible mesh below a path."""
    found = [UsdGeom.Mesh(prim) for prim in prims(stage, below) if prim.IsA(UsdGeom.Mesh) and not collides(prim, below)]
    return max(found, key=lambda one: len(one.GetPointsAttr().Get()))


def collides(prim: Usd.Prim, below: str) -> bool:
    """Whether a mesh of an object is there for physics alone."""
    return not below.startswith("/Room/Shell") and prim.HasAPI(UsdPhysics.CollisionAPI)


def colliders(stage: Usd.Stage, below: str) -> list[Usd.Prim]:
    """All colliders below a path."""
    return [prim for prim in prims(stage, below) if prim.HasAPI(UsdPhysics.CollisionAPI)]


def changed(attribute: Usd.Attribute, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Set an array to something else of its type."""
    value = attribute.Get()
    attribute.Set(type(value).FromNumpy(np.ascontiguousarray(change(np.array(value).copy()), np.array(value).dtype)))


def first(value: float) -> Callable[[np.ndarray], np.ndarray]:
    """The first number of an array is this."""

    def change(old: np.ndarray) -> np.ndarray:
        old.reshape(-1)[0] = value
        return old

    return change


def of_mesh(below: str) -> dict[str, Sabotage]:
    """Faults of the mesh of something."""

    def at(change: Callable[[UsdGeom.Mesh], object]) -> Sabotage:
        return lambda stage: change(mesh(stage, below))

    def normals(one: UsdGeom.Mesh) -> Usd.Attribute:
        primvar = UsdGeom.PrimvarsAPI(one).GetPrimvar("normals")
        return primvar.GetAttr() if primvar and primvar.HasValue() else one.GetNormalsAttr()

    def st(one: UsdGeom.Mesh) -> Usd.Attribute:
        return UsdGeom.PrimvarsAPI(one).GetPrimvar("st").GetAttr()

    def wound(one: UsdGeom.Mesh) -> None:
        counts, start, out = np.array(one.GetFaceVertexCountsAttr().Get()), 0, []
        indices = np.array(one.GetFaceVertexIndicesAttr().Get())
        for count in counts:
            out.extend(indices[start : start + count][::-1])
            start += count
        one.GetFaceVertexIndicesAttr().Set(Vt.IntArray([int(i) for i in out]))

    faults = {
        "a point of NaN": at(lambda m: changed(m.GetPointsAttr(), first(math.nan))),
        "a point far away": at(lambda m: changed(m.GetPointsAttr(), first(1e12))),
        "a point 50 m away": at(lambda m: changed(m.GetPointsAttr(), first(50.0))),
        "no points": at(lambda m: m.GetPointsAttr().Set(Vt.Vec3fArray())),
        "points of text": at(
            lambda m: retyped(m.GetPointsAttr(), Sdf.ValueTypeNames.StringArray, Vt.StringArray(["a"]))
        ),
        "a normal of NaN": at(lambda m: changed(normals(m), first(math.nan))),
        "a normal of length 5": at(lambda m: changed(normals(m), first(5.0))),
        "too few normals": at(lambda m: changed(normals(m), lambda old: old[:-1])),
        "an index below 0": at(lambda m: changed(m.GetFaceVertexIndicesAttr(), first(-1))),
        "an index beyond the points": at(lambda m: changed(m.GetFaceVertexIndicesAttr(), first(10**6))),
        "too few indices": at(lambda m: changed(m.GetFaceVertexIndicesAttr(), lambda old: old[:-1])),
        "a face of two corners": at(lambda m: changed(m.GetFaceVertexCountsAttr(), first(2))),
        "another extent": at(lambda m: m.GetExtentAttr().Set(Vt.Vec3fArray([Gf.Vec3f(0), Gf.Vec3f(9)]))),
        "faces wound the other way": at(wound),
        "coordinates of NaN": at(lambda m: changed(st(m), first(math.nan))),
        "too few coordinates": at(lambda m: changed(st(m), lambda old: old[:1])),
        "no coordinates": at(lambda m: st(m).Block()),
    }
    return faults


def retyped(attribute: Usd.Attribute, kind: Sdf.ValueTypeName, value: object) -> None:
    """An attribute of another type."""
    layer = attribute.GetStage().GetRootLayer()
    prim = Sdf.CreatePrimInLayer(layer, attribute.GetPrim().GetPath())
    Sdf.AttributeSpec(prim, attribute.GetName(), kind).default = value


def of_object(below: str) -> dict[str, Sabotage]:
    """Faults of a whole thing: place, labels, colliders, variants."""

    def at(change: Callable[[Usd.Prim], object]) -> Sabotage:
        return lambda stage: change(stage.GetPrimAtPath(below))

    def op(prim: Usd.Prim, kind: str, value: object) -> None:
        getattr(UsdGeom.Xformable(prim), f"Add{kind}Op")(opSuffix="more").Set(value)

    def moved(prim: Usd.Prim, way: tuple[float, float, float]) -> None:
        place = prim.GetAttribute("xformOp:translate")
        place.Set(place.Get() + Gf.Vec3d(*way))

    def labels(words: list[str]) -> Sabotage:
        return at(lambda prim: prim.GetAttribute("semantics:labels:category").Set(Vt.TokenArray(words)))

    def far(stage: Usd.Stage) -> None:
        for prim in colliders(stage, below):
            UsdGeom.Xformable(prim).AddTranslateOp(opSuffix="more").Set(Gf.Vec3d(3, 0, 0))

    faults = {
        "mirrored": at(lambda prim: op(prim, "Scale", Gf.Vec3f(-1, 1, 1))),
        "scaled to nothing": at(lambda prim: op(prim, "Scale", Gf.Vec3f(0, 1, 1))),
        "twice as high": at(lambda prim: op(prim, "Scale", Gf.Vec3f(1, 2, 1))),
        "upside down": at(lambda prim: op(prim, "RotateX", 180.0)),
        "a metre up": at(lambda prim: moved(prim, (0, 1, 0))),
        "half a metre down": at(lambda prim: moved(prim, (0, -0.5, 0))),
        "20 m away": at(lambda prim: moved(prim, (20, 0, 0))),
        "at no place": at(lambda prim: prim.GetAttribute("xformOp:translate").Set(Gf.Vec3d(math.nan))),
        "an op that is not there": at(
            lambda prim: prim.GetAttribute("xformOpOrder").Set(Vt.TokenArray(["xformOp:gone"]))
        ),
        "moves": at(lambda prim: prim.GetAttribute("xformOp:translate").Set(Gf.Vec3d(1, 0, 1), 24.0)),
        "two labels": labels(["bed", "sofa"]),
        "no label": labels([]),
        "another extentsHint": at(
            lambda prim: UsdGeom.ModelAPI(prim).SetExtentsHint(Vt.Vec3fArray([Gf.Vec3f(0), Gf.Vec3f(30)]))
        ),
        "no colliders": lambda stage: [prim.SetActive(False) for prim in colliders(stage, below)],
        "colliders switched off": lambda stage: [
            UsdPhysics.CollisionAPI(prim).CreateCollisionEnabledAttr(False) for prim in colliders(stage, below)
        ],
        "colliders 3 m away": far,
        "a variant that is not there": at(lambda prim: prim.GetVariantSets().SetSelection("LOD", "none")),
        "a binding outside": at(bound_outside),
    }
    return faults


def bound_outside(prim: Usd.Prim) -> None:
    """A material beside the room."""
    material = UsdShade.Material.Define(prim.GetStage(), "/Elsewhere/paint")
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def of_node(below: str) -> dict[str, Sabotage]:
    """Faults of an object of the graph alone."""

    def body(stage: Usd.Stage) -> Usd.Prim:
        return next(prim for prim in prims(stage, below) if prim.HasAPI(UsdPhysics.RigidBodyAPI))

    def meshes_collide(stage: Usd.Stage) -> None:
        UsdPhysics.MeshCollisionAPI(colliders(stage, below)[0]).GetApproximationAttr().Set("none")

    def node(name: str, kind: Sdf.ValueTypeName, value: object) -> Sabotage:
        return lambda stage: stage.GetPrimAtPath(below).CreateAttribute(name, kind).Set(value)

    types = Sdf.ValueTypeNames
    faults = {
        "another label": lambda stage: (
            stage.GetPrimAtPath(below).GetAttribute("semantics:labels:category").Set(Vt.TokenArray(["sofa"]))
        ),
        "another size": node("echo:size", types.Double3, Gf.Vec3d(0.2, 0.2, 0.2)),
        "another heading": node("echo:yaw", types.Double, 1.0),
        "a body in a body": lambda stage: UsdPhysics.RigidBodyAPI.Apply(mesh(stage, below).GetPrim()),
        "a triangle mesh as collider": meshes_collide,
        "a mass of NaN": lambda stage: UsdPhysics.MassAPI(body(stage)).CreateMassAttr(math.nan),
        "a mass below 0": lambda stage: UsdPhysics.MassAPI(body(stage)).CreateMassAttr(-5.0),
        "not active": lambda stage: stage.GetPrimAtPath(below).SetActive(False),
        "not visible": lambda stage: UsdGeom.Imageable(stage.GetPrimAtPath(below)).MakeInvisible(),
    }
    return faults


def of_room() -> dict[str, Sabotage]:
    """Faults of the room, its graph and its files."""

    def shader(stage: Usd.Stage) -> Usd.Attribute:
        found = (prim for prim in prims(stage, "/Room/Looks") if prim.GetName() == "image")
        return next(prim.GetAttribute("inputs:file") for prim in found if prim.GetAttribute("inputs:file").Get())

    def image(content: bytes | None) -> Sabotage:
        def change(stage: Usd.Stage) -> None:
            path = Path(stage.GetRootLayer().realPath).with_name("bad.png")
            if content is not None:
                path.write_bytes(content)
            shader(stage).Set(Sdf.AssetPath("./bad.png"))

        return change

    def relation(stage: Usd.Stage) -> Usd.Prim:
        below = stage.GetPrimAtPath("/Room/SceneGraph").GetChildren()
        return next(prim for prim in below if prim.GetTypeName() == "EchoRelation")

    def scene(stage: Usd.Stage) -> UsdPhysics.Scene:
        return next(UsdPhysics.Scene(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Scene))

    def no_floor(stage: Usd.Stage) -> None:
        stage.GetPrimAtPath("/Room/Shell/Floor").SetActive(False)
        for name in ("echo:floorSize", "echo:floorPolygon"):
            if stage.GetPrimAtPath("/Room/SceneGraph").HasAttribute(name):
                stage.GetPrimAtPath("/Room/SceneGraph").GetAttribute(name).Block()

    def arc(path: str) -> Sabotage:
        return lambda stage: stage.GetPrimAtPath("/Room/Objects/bed").GetReferences().AddReference(path)

    return {
        "an image outside": lambda stage: shader(stage).Set(Sdf.AssetPath("../../elsewhere.png")),
        "an image with an absolute path": lambda stage: shader(stage).Set(Sdf.AssetPath("/etc/hostname")),
        "an image that is none": image(b"\x89PNG\r\n\x1a\n nothing"),
        "an empty image": image(b""),
        "an image that is gone": image(None),
        "an image of another type": lambda stage: retyped(shader(stage), Sdf.ValueTypeNames.Float, 1.0),
        "a palette that is not there": lambda stage: (
            stage.GetPrimAtPath("/Room").GetVariantSets().SetSelection("palette", "none")
        ),
        "a relation to nothing": lambda stage: (
            relation(stage).GetRelationship("echo:object").SetTargets([Sdf.Path("/Room/Objects/nothing")])
        ),
        "a relation to two": lambda stage: (
            relation(stage).GetRelationship("echo:object").AddTarget("/Room/Objects/bed/geo")
        ),
        "a predicate that nobody knows": lambda stage: relation(stage).GetAttribute("echo:predicate").Set("likes"),
        "gravity upwards": lambda stage: scene(stage).CreateGravityDirectionAttr(Gf.Vec3f(0, 1, 0)),
        "no floor": no_floor,
        "a reference to nothing": arc("./gone.usda"),
        "a reference outside": arc("../../elsewhere/bed.usda"),
        "a schema that nobody knows": lambda stage: stage.GetPrimAtPath("/Room/Objects/bed").SetTypeName("EchoBedd"),
        "other units": lambda stage: UsdGeom.SetStageMetersPerUnit(stage, 0.01),
        "the other axis": lambda stage: UsdGeom.SetStageUpAxis(stage, "Z"),
        "a light of NaN": lambda stage: (
            stage.GetPrimAtPath("/Room/Lights/sun").GetAttribute("inputs:intensity").Set(math.nan)
        ),
        "a sublayer that is gone": lambda stage: stage.GetRootLayer().subLayerPaths.append("./layers/gone.usda"),
    }


def sabotages(stage: Usd.Stage) -> dict[str, dict[str, Sabotage]]:
    """Name of a thing ("" for the room) -> its faults, by their names."""
    dressing = [str(prim.GetPath()) for prim in stage.GetPrimAtPath("/Room/Dressing").GetChildren() if prim.IsModel()]
    small = next(path for path in dressing if colliders(stage, path))
    node, wall = "/Room/Objects/wardrobe", "/Room/Shell/Wall_1"
    return {
        "": of_room(),
        "wardrobe": of_mesh(node) | of_object(node) | of_node(node),
        small.rpartition("/")[2]: of_mesh(small) | of_object(small),
        "Wall_1": of_mesh(wall),
    }
