"""What `check` is blind to: one fault at a time in finished rooms, furniture of their own, of a library and of a store.

    OMP_NUM_THREADS=1 nice -n 5 python benchmarks/sabotaged_rooms.py

A fault is seen if the report names an error or warning that the sound room does not have, or ends in a message.
"""

from __future__ import annotations

import argparse
import math
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from echousd.checks import check as check_room
from echousd.cli.main import run

GRAPH = Path(__file__).parents[1] / "samples/bedroom.usda"
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


def of_files(folder: Path, kind: str) -> dict[str, Callable[[Path], object]]:
    """Faults of the files that a room refers to, below a folder that holds all of them."""
    places = {"own": "own/assets", "library": "own/assets", "stored": "store"}
    found = [path for path in (folder / places[kind]).rglob("*") if path.suffix in (".usda", ".usdc", ".jpg")]
    chosen = {ending: [path for path in found if path.suffix == ending] for ending in (".usda", ".usdc", ".jpg")}
    out: dict[str, Callable[[Path], object]] = {}
    for ending, paths in chosen.items():
        named = [path for path in paths if "wardrobe" in path.name] or paths
        if named:
            name = str(named[0].relative_to(folder))
            out[f"{ending} gone"] = lambda top, name=name: (top / name).unlink()
            out[f"{ending} empty"] = lambda top, name=name: (top / name).write_bytes(b"")
            out[f"{ending} cut in half"] = lambda top, name=name: halved(top / name)
    return out


def halved(path: Path) -> None:
    """The first half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def seen(root: Path) -> set[str]:
    """What a check tells."""
    try:
        report = check_room(root)
    except ValueError as error:
        return {f"refused: {error}"}
    told = {f"{fault.rule} {fault.prim} {fault.message}" for fault in (*report.errors, *report.warnings)}
    told |= {f"{wrong.problem} {wrong.object}" for wrong in report.placement}
    told |= {f"collision {hit.first} {hit.second}" for hit in report.collisions}
    return told | {f"broken {judged.relation}" for judged in report.broken}


def told_of(thing: str, others: set[str], lines: set[str]) -> bool:
    """Whether a line is about a thing; about the room are those that name no thing."""
    return any(thing in line if thing else not any(other in line for other in others) for line in lines)


def main() -> None:
    """Print the faults that nothing tells, by kind of room, and how many were tried."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="*", default=["own", "library", "stored"])
    parser.add_argument("--keep", type=Path, help="folder for the rooms, used again where they are there")
    parser.add_argument("--share", type=float, default=1.0, help="of the faults that are tried, drawn at random")
    asked = parser.parse_args()
    draw = random.Random(0)
    with tempfile.TemporaryDirectory(prefix="echousd-sabotage-") as scratch:
        rooms = asked.keep or Path(scratch, "rooms")
        made(rooms)
        for kind in asked.kinds:
            tried = blind = 0
            sound = seen(rooms / kind / f"{kind}.usda")
            groups = sabotages(Usd.Stage.Open(str(rooms / kind / f"{kind}.usda")))
            things = {thing for thing in groups if thing}
            for number in range(max(map(len, groups.values()))):  # a fault of each thing at once
                chosen = {
                    thing: list(faults.items())[number] for thing, faults in groups.items() if number < len(faults)
                }
                if draw.random() > asked.share:
                    continue
                tried += len(chosen)
                missed = unsaid(chosen, things, rooms, kind, Path(scratch, f"{kind}{number}"), sound)
                blind += len(missed)
                for thing in missed:
                    print(f"  {kind}: nothing said of: {thing} {chosen[thing][0]}", flush=True)
            for name, sabotage in of_files(rooms, kind).items():
                if draw.random() > asked.share:
                    continue
                top = Path(scratch, f"{kind}_file")
                shutil.copytree(rooms, top)
                sabotage(top)
                tried += 1
                if not {line.replace(str(top), str(rooms)) for line in seen(top / kind / f"{kind}.usda")} - sound:
                    blind += 1
                    print(f"  {kind}: nothing said of: {name}", flush=True)
                shutil.rmtree(top)
            print(f"{kind}: {tried} faults, nothing said of {blind}", flush=True)


def unsaid(
    chosen: dict[str, tuple[str, Sabotage]], things: set[str], rooms: Path, kind: str, top: Path, sound: set[str]
) -> list[str]:
    """The things of whose faults nothing is said; each alone where one of them ends the check with a message."""
    shutil.copytree(rooms, top)
    root = top / kind / f"{kind}.usda"
    stage = Usd.Stage.Open(str(root))
    for _, sabotage in chosen.values():
        sabotage(stage)
    stage.Save()
    del stage
    new = {line.replace(str(top), str(rooms)) for line in seen(root)} - sound
    shutil.rmtree(top)
    if len(chosen) > 1 and any(line.startswith("refused") for line in new):
        each = ({thing: fault} for thing, fault in chosen.items())
        return [thing for one in each for thing in unsaid(one, things, rooms, kind, top, sound)]
    alone = len(chosen) == 1 and bool(new)
    return [thing for thing in chosen if not alone and not told_of(thing, things, new)]


def made(rooms: Path) -> None:
    """A room with furniture of its own, one with that as its library, one in a store."""
    if (rooms / "store").exists():
        return
    rooms.mkdir(parents=True)
    index = str(rooms / "library.parquet")
    for words in (
        ["generate", str(GRAPH), "-o", str(rooms / "own"), "--seed", "7"],
        ["assets", "index", str(rooms / "own/assets"), "-o", index, "--workers", "1"],
        ["generate", str(GRAPH), "-o", str(rooms / "library"), "--seed", "8", "--shapes", "library", "--assets", index],
        ["generate", str(GRAPH), "-o", str(rooms / "stored"), "--seed", "7", "--store", str(rooms / "store")],
    ):
        if run([*words, "--quiet"]):
            raise SystemExit(f"echousd {' '.join(words)} failed")


if __name__ == "__main__":
    main()
