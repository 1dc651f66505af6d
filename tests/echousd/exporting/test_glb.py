"""A room as glTF: everything where USD has it, opened as well; maps, cameras, lights, and what the graph says."""

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from gltf_tree import read_gltf
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade
from small_room import StandIn, small_graph

import echousd
from echomodel.openings import Opening
from echousd.exporting.formats import export
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.options import RoomOptions

DOOR = Opening("door", "door", 3, 0.4, 0.9, 2.0, hinge="right")
WINDOW = Opening("window", "window", 0, 0.8, 1.4, 1.3, 0.9)
TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A room with Z up and drawers."""
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.0, 3.4), openings=(DOOR, WINDOW)),
        (Node("dresser", "dresser"), Node("chair", "chair"), Node("other", "chair"), Node("lamp", "table_lamp")),
        (Relation("lamp", "standing_on", "dresser"), Relation("chair", "same_style_as", "other")),
    )
    options = RoomOptions(up_axis="Z", walls=True, dress="some")
    made = echousd.generate(graph, seed=3, steps=2, place=False, options=options)
    return made.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.fixture(scope="module")
def opened(root):
    """A stronger layer in which the door stands open and so do the drawers."""
    path = root.parent / "opened.usda"
    stage = Usd.Stage.CreateNew(str(path))
    stage.GetRootLayer().TransferContent(Sdf.Layer.FindOrOpen(str(root)))
    moved = 0
    for prim in stage.Traverse():
        if prim.GetName().endswith("_door_hinge"):
            prim.GetAttribute("xformOp:rotateZ" if prim.HasAttribute("xformOp:rotateZ") else "xformOp:rotateY").Set(70)
            moved += 1
        elif "dresser_drawer" in prim.GetName() and prim.GetTypeName() == "Xform":
            UsdGeom.Xformable(prim).AddTranslateOp(opSuffix="pulled").Set(Gf.Vec3d(0, -0.2, 0))
            moved += 1
    assert moved > 2
    stage.Save()
    return path


def seen(top):
    """(n, 3) points in the world of all meshes below a prim that are drawn, Y up, as OpenUSD places them."""
    points = [np.zeros((0, 3))]
    for prim in Usd.PrimRange(top, Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
            world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
            corners = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get()) @ world[:3, :3].T + world[:3, 3]
            points.append(corners @ TO_Y_UP.T)
    return np.concatenate(points)


@pytest.mark.parametrize("state", ["closed", "opened"])
def test_every_component_is_where_usd_has_it(root, opened, state, tmp_path):
    room = root if state == "closed" else opened
    gltf, stage = read_gltf(export(room, tmp_path / "room.glb")), Usd.Stage.Open(str(room))
    components = [prim for prim in stage.Traverse() if Usd.ModelAPI(prim).GetKind() in ("component", "subcomponent")]
    ids, checked = gltf.by_id(), set()
    for prim in components:
        points = seen(prim)
        if len(points) and prim.HasAttribute("semantics:labels:category"):
            there = gltf.triangles(ids[str(prim.GetPath())]).reshape(-1, 3)
            np.testing.assert_allclose(
                [there.min(0), there.max(0)], [points.min(0), points.max(0)], atol=2e-5, err_msg=str(prim.GetPath())
            )
            checked.add(prim.GetName())
    assert {"Floor", "Wall_1", "Wall_4", "Wall_4_door", "dresser", "chair", "lamp"} <= checked


def test_doors_and_drawers_are_nodes_that_turn(root, tmp_path):
    gltf = read_gltf(export(root, tmp_path / "room.glb"))
    names = [node["name"] for node in gltf.tree["nodes"]]
    assert "Wall_4_door_hinge" in names
    assert "dresser_drawer_1" in names
    parents = {child: number for number, node in enumerate(gltf.tree["nodes"]) for child in node.get("children", ())}
    assert names[parents[names.index("Wall_4_door_hinge")]] == "Wall_4_door"
    assert names[parents[names.index("dresser_drawer_1")]] == "dresser"


def test_what_the_graph_says_is_said(root, tmp_path):
    gltf = read_gltf(export(root, tmp_path / "room.glb"))
    said = next(node["extras"] for node in gltf.tree["nodes"] if node["name"] == "Room")
    assert said["roomType"] == "bedroom"
    graph = echousd.read_graph(root)
    assert said["relations"] == [
        {"subject": one.subject, "predicate": one.predicate, "object": one.object} for one in graph.relations
    ]
    nodes = {number: node for node, number in gltf.by_id().items()}
    categories = {path: gltf.tree["nodes"][number]["extras"]["category"] for number, path in nodes.items()}
    for node in graph.nodes:
        assert categories[f"/Room/Objects/{node.name}"] == node.category


def test_maps_are_those_of_the_stage(root, tmp_path):
    gltf = read_gltf(export(root, tmp_path / "room.glb"))
    floor = next(one for one in gltf.tree["materials"] if one["name"] == "floor")
    stage = Usd.Stage.Open(str(root))
    shader = UsdShade.Material(stage.GetPrimAtPath("/Room/Looks/floor")).ComputeSurfaceSource()[0]
    for name, texture in (
        ("diffuseColor", floor["pbrMetallicRoughness"]["baseColorTexture"]),
        ("roughness", floor["pbrMetallicRoughness"]["metallicRoughnessTexture"]),
        ("normal", floor["normalTexture"]),
    ):
        image = UsdShade.Shader(shader.GetInput(name).GetConnectedSources()[0][0].source.GetPrim())
        file = image.GetInput("file").Get().resolvedPath
        assert gltf.image(texture) == Path(file).read_bytes(), name  # the file itself, not encoded again
    gloss = stage.GetAttributeAtPath("/Room/Looks/floor/roughness.inputs:scale").Get()[0]
    assert floor["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(gloss)
    assert gloss < 1
    glass = next(one for one in gltf.tree["materials"] if one["name"] == "glass")
    assert glass["alphaMode"] == "BLEND"
    assert glass["pbrMetallicRoughness"]["baseColorFactor"][3] == pytest.approx(0.06)


def test_nothing_stands_there_twice(root, tmp_path):
    gltf = read_gltf(export(root, tmp_path / "room.glb"))
    views = [gltf.view(number) for number in range(len(gltf.tree["bufferViews"]))]
    assert len(set(views)) == len(views)
    chairs = [gltf.tree["nodes"][gltf.by_id()[f"/Room/Objects/{name}"]] for name in ("chair", "other")]
    assert chairs[0]["mesh"] == chairs[1]["mesh"]
    for part in (part for mesh in gltf.tree["meshes"] for part in mesh["primitives"]):
        rough = gltf.tree["materials"][part["material"]]
        shows = "normalTexture" in rough or any(name.endswith("Texture") for name in rough["pbrMetallicRoughness"])
        assert ("TEXCOORD_0" in part["attributes"]) == shows


def test_cameras_and_lights_look_and_shine_as_on_the_stage(root, tmp_path):
    gltf, stage = read_gltf(export(root, tmp_path / "room.glb")), Usd.Stage.Open(str(root))
    worlds = gltf.worlds()
    nodes = {node["name"]: (number, node) for number, node in enumerate(gltf.tree["nodes"])}
    for name in ("top", "perspective"):
        number, node = nodes[name]
        prim = stage.GetPrimAtPath(f"/Room/Cameras/{name}")
        camera, lens = UsdGeom.Camera(prim).GetCamera(), gltf.tree["cameras"][node["camera"]]["perspective"]
        assert np.degrees(lens["yfov"]) == pytest.approx(camera.GetFieldOfView(Gf.Camera.FOVVertical), abs=1e-4)
        assert (lens["znear"], lens["zfar"]) == (camera.clippingRange.min, camera.clippingRange.max)
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
        if name == "perspective":  # glTF's lenses have no shift: it looks down to the middle of the same picture
            length = camera.focalLength
            ends = [
                np.arctan((shift + np.array([-film, film]) / 2) / length)
                for shift, film in (
                    (camera.horizontalApertureOffset, camera.horizontalAperture),
                    (camera.verticalApertureOffset, camera.verticalAperture),
                )
            ]
            assert ends[1][0] < -ends[1][1] < 0.0
            aside, up = (each.mean() for each in ends)
            back = np.array([-np.sin(aside) * np.cos(up), -np.sin(up), np.cos(aside) * np.cos(up)])
            right = np.array([np.cos(aside), 0, np.sin(aside)])
            world[:3, :3] = world[:3, :3] @ np.stack([right, np.cross(back, right), back], 1)
        np.testing.assert_allclose(worlds[number][:3], TO_Y_UP @ world[:3], atol=1e-6)
    lights = {one["name"]: one for one in gltf.tree["extensions"]["KHR_lights_punctual"]["lights"]}
    kinds = {name: light["type"] for name, light in lights.items()}
    assert kinds == {"ceiling": "spot", "sun": "directional", "lamp_lamp": "point"}
    panel = UsdLux.RectLight(stage.GetPrimAtPath("/Room/Lights/ceiling"))
    area = panel.GetWidthAttr().Get() * panel.GetHeightAttr().Get()
    for name, share in (("sun", 1.0), ("ceiling", area), ("lamp_lamp", 0.25)):
        light = UsdLux.LightAPI(stage.GetPrimAtPath(f"/Room/Lights/{name}"))
        color = light.GetColorAttr().Get()
        wanted = share * light.GetIntensityAttr().Get() * np.array(color)
        np.testing.assert_allclose(np.array(lights[name]["color"]) * lights[name]["intensity"], wanted, atol=1e-5)
    np.testing.assert_allclose(worlds[nodes["ceiling"][0]][:3, 2], (0, 1, 0), atol=1e-6)  # shines along -Z, down
    assert lights["lamp_lamp"]["color"][0] == 1.0 > lights["lamp_lamp"]["color"][2]


def test_a_foreign_stage_in_centimetres_with_mirrors_instances_and_a_metal(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "foreign.usda"))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    box = trimesh.creation.box((10, 20, 30))

    def mesh(path):
        made = UsdGeom.Mesh.Define(stage, path)
        made.CreatePointsAttr(box.vertices)
        made.CreateFaceVertexIndicesAttr(box.faces.ravel())
        made.CreateFaceVertexCountsAttr([3] * len(box.faces))
        made.CreateDoubleSidedAttr(True)
        UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex").Set(
            [(0.25, 0.75)] * len(box.vertices)
        )
        return made

    UsdGeom.Xform.Define(stage, "/World").AddTranslateOp().Set((100, 0, 0))
    mesh("/World/mirrored").AddScaleOp().Set((-2, 1, 1))
    mesh("/alone")
    flat = UsdGeom.Xform.Define(stage, "/World/Flat")
    flat.AddScaleOp().Set((1, 0, 1))
    mesh("/World/Flat/sheet")
    scatter = UsdGeom.PointInstancer.Define(stage, "/World/scatter")
    scatter.CreatePositionsAttr([(0, 0, 0), (0, 500, 0)])
    scatter.CreateProtoIndicesAttr([0, 0])
    mesh("/World/scatter/Prototypes/brick")
    scatter.CreatePrototypesRel().SetTargets(["/World/scatter/Prototypes/brick"])
    Image.fromarray(np.full((4, 4, 3), (10, 90, 200), np.uint8)).save(tmp_path / "packed.png")
    material = UsdShade.Material.Define(stage, "/World/steel")
    shader, image = (UsdShade.Shader.Define(stage, f"/World/steel/{name}") for name in ("surface", "image"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(1.0)
    shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set((4.0, 2.0, 0.0))
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("packed.png")
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).ConnectToSource(
        image.CreateOutput("g", Sdf.ValueTypeNames.Float)
    )
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath("/alone")).Bind(material)
    UsdGeom.Camera.Define(stage, "/World/broken").CreateClippingRangeAttr((5, 1))
    UsdLux.SphereLight.Define(stage, "/World/off").CreateIntensityAttr(0.0)
    stage.Save()
    gltf = read_gltf(export(tmp_path / "foreign.usda", tmp_path / "foreign.glb"))
    names = [node["name"] for node in gltf.tree["nodes"]]
    whole = np.concatenate([gltf.triangles(root) for root in gltf.tree["scenes"][0]["nodes"]])
    np.testing.assert_allclose(
        [whole.min((0, 1)), whole.max((0, 1))], [[-0.05, -0.1, -0.15], [1.1, 5.1, 0.15]], atol=1e-6
    )
    for node in ("World", "alone"):  # a mirror does not turn a box inside out
        for triangle in gltf.triangles(names.index(node)).reshape(-1, 12, 3, 3):
            volume = np.einsum("ti,ti->", triangle[:, 0], np.cross(triangle[:, 1], triangle[:, 2])) / 6
            assert volume >= -1e-9, node
    steel = next(one for one in gltf.tree["materials"] if one["name"] == "steel")
    pixels = np.asarray(Image.open(io.BytesIO(gltf.image(steel["pbrMetallicRoughness"]["metallicRoughnessTexture"]))))
    assert {tuple(pixel) for pixel in pixels.reshape(-1, 3).tolist()} == {(0, 90, 255)}
    assert steel["emissiveFactor"] == [1.0, 0.5, 0.0]
    assert steel["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 4.0}
    assert steel["doubleSided"]
    alone = gltf.tree["meshes"][gltf.tree["nodes"][names.index("alone")]["mesh"]]["primitives"][0]
    np.testing.assert_allclose(np.unique(gltf.array(alone["attributes"]["TEXCOORD_0"]), axis=0), [(0.25, 0.25)])
    assert "cameras" not in gltf.tree
    assert "KHR_lights_punctual" not in gltf.tree.get("extensionsUsed", [])


def test_a_room_says_which_layout_it_is(tmp_path):
    made = echousd.generate(small_graph(), model=StandIn(0.1), shapes="boxes", place=False, layouts=2)
    room = made.save(tmp_path / "bedroom", preview=False)
    said = read_gltf(export(room, tmp_path / "room.glb", layout=1)).tree["nodes"][0]["extras"]
    assert said["layout"] == "layout_1"


def test_a_lamp_of_a_stage_in_centimetres_shines_as_in_metres(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "lamp.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.Cube.Define(stage, "/cube")
    lamp = UsdLux.SphereLight.Define(stage, "/lamp")
    lamp.CreateIntensityAttr(80000.0)  # radiance times a surface in square centimetres
    lamp.CreateNormalizeAttr(True)
    stage.Save()
    gltf = read_gltf(export(tmp_path / "lamp.usda", tmp_path / "lamp.glb"))
    assert [one["intensity"] for one in gltf.tree["extensions"]["KHR_lights_punctual"]["lights"]] == [2.0]
