import struct
import zipfile

import numpy as np
import pytest
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from small_room import OBJECTS, small_room

import echousd
from echousd.exporting.formats import export


@pytest.fixture(scope="module")
def room():
    return small_room(shapes="boxes", place=False)


@pytest.fixture(scope="module")
def root(room, tmp_path_factory):
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


def world_bounds(stage, path="/Room"):
    return UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(stage.GetPrimAtPath(path)).ComputeAlignedRange()


@pytest.mark.parametrize("arkit", [False, True])
def test_usdz_knows_no_clock(root, tmp_path, arkit):
    first = export(root, tmp_path / "room.usdz", arkit=arkit)
    with zipfile.ZipFile(first) as package:
        assert {file.date_time for file in package.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert package.testzip() is None
        for file in package.infolist():  # the files' own headers say the same
            time, date = struct.unpack_from("<HH", first.read_bytes(), file.header_offset + 10)
            assert (time, date) == (0, 33)
    assert Usd.Stage.Open(str(first)).GetPrimAtPath("/Room/Objects")
    (tmp_path / "later").mkdir()
    assert export(root, tmp_path / "later/other.usdz", arkit=arkit).read_bytes() == first.read_bytes()


def test_usdz_for_the_web_is_one_flat_text_layer(root, tmp_path):
    path = export(root, tmp_path / "room.usdz")
    with zipfile.ZipFile(path) as package:
        assert package.namelist()[0] == "bedroom.usda"
        assert all(name.startswith("textures/") and name.endswith(".jpg") for name in package.namelist()[1:])
        text = package.read("bedroom.usda").decode()
    assert "double3 xformOp" not in text
    assert str(root.parent) not in text
    assert "/tmp" not in text
    stage = Usd.Stage.Open(str(path))
    assert stage.GetCompositionErrors() == []
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert len(meshes) == len(OBJECTS) + 1  # no colliders
    materials = [str(prim.GetPath()) for prim in stage.Traverse() if prim.IsA(UsdShade.Material)]
    assert materials
    assert all(path.startswith("/Room/Looks/") for path in materials)
    box, wanted = world_bounds(stage), world_bounds(Usd.Stage.Open(str(root)))
    np.testing.assert_allclose([box.GetMin(), box.GetMax()], [wanted.GetMin(), wanted.GetMax()], atol=1e-4)


def test_usdz_for_arkit_has_one_crate_without_whole_number_doubles(root, tmp_path):
    path = export(root, tmp_path / "room.usdz", arkit=True)
    with zipfile.ZipFile(path) as package:
        names = package.namelist()
    assert names[0].endswith(".usdc")
    assert sum(name.endswith((".usd", ".usda", ".usdc")) for name in names) == 1
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        for attribute in prim.GetAttributes():
            if attribute.GetName().startswith("xformOp:translate"):
                assert attribute.GetTypeName() == "float3"


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("physics", [None, True])
def test_usdz_for_arkit_is_y_up_and_holds_nothing_of_ours_nor_lights(up_axis, physics, tmp_path):
    room = small_room(shapes="boxes", place=False, up_axis=up_axis)
    root = room.save(tmp_path / "bedroom", preview=False)
    stage = Usd.Stage.Open(str(export(root, tmp_path / "room.usdz", arkit=True, physics=physics)))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    prims = list(stage.TraverseAll())
    types = {str(prim.GetTypeName()) for prim in prims} | {a for prim in prims for a in prim.GetAppliedSchemas()}
    assert not [name for name in types if name.startswith("Echo") or "Light" in name]
    top = [op.GetOpName() for op in UsdGeom.Xformable(stage.GetDefaultPrim()).GetOrderedXformOps()]
    assert top == ([] if up_axis == "Y" else ["xformOp:transform"])  # three.js knows no suffix
    assert not [name for prim in prims for name in prim.GetPropertyNames() if name.startswith("echo:")]
    assert {"Mesh", "Material", "Camera", "SemanticsLabelsAPI:category"} <= types
    straight = small_room(shapes="boxes", place=False)
    wanted = world_bounds(Usd.Stage.Open(str(straight.save(tmp_path / "straight", preview=False))))
    box = world_bounds(stage)
    np.testing.assert_allclose([box.GetMin(), box.GetMax()], [wanted.GetMin(), wanted.GetMax()], atol=1e-4)
    scenes = [UsdPhysics.Scene(prim) for prim in prims if prim.IsA(UsdPhysics.Scene)]
    assert len(scenes) == (physics is True)
    for scene in scenes:
        assert scene.GetGravityDirectionAttr().Get() == Gf.Vec3f(0, 0, 0)  # down by the stage's up axis


def test_usdz_for_arkit_turns_all_of_a_foreign_stage(tmp_path):
    """Roots without a place of their own (untyped, Scope), prims below them, and prims that ignore what is above."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "foreign.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    stage.SetDefaultPrim(stage.DefinePrim("/World"))
    stage.DefinePrim("/World/Deep", "Scope")
    stage.DefinePrim("/Scope", "Scope")
    UsdGeom.Xform.Define(stage, "/Placed").AddTranslateOp().Set((0, 0, 5))
    free = UsdGeom.Xform.Define(stage, "/Placed/Free")
    free.AddTranslateOp().Set((0, 7, 0))
    free.SetResetXformStack(True)
    for number, above in enumerate(("/World", "/World/Deep", "/Scope", "", "/Placed", "/Placed/Free")):
        box = UsdGeom.Mesh.Define(stage, f"{above}/box")
        shape = trimesh.creation.box((1, 2, 3))
        box.CreatePointsAttr(shape.vertices)
        box.CreateFaceVertexIndicesAttr(shape.faces.ravel())
        box.CreateFaceVertexCountsAttr([3] * len(shape.faces))
        box.AddTranslateOp().Set((number, 10 * number, 2))
    UsdPhysics.Scene.Define(stage, "/World/physics").CreateGravityDirectionAttr(Gf.Vec3f(0, 0, -1))
    stage.Save()
    turned = Usd.Stage.Open(str(export(tmp_path / "foreign.usda", tmp_path / "out.usdz", arkit=True, physics=True)))
    down = UsdPhysics.Scene(turned.GetPrimAtPath("/World/physics")).GetGravityDirectionAttr().Get()
    np.testing.assert_allclose(down, (0, -1, 0), atol=1e-6)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            was, box = world_bounds(stage, prim.GetPath()), world_bounds(turned, prim.GetPath())
            (x, y, z), (x2, y2, z2) = was.GetMin(), was.GetMax()
            np.testing.assert_allclose([*box.GetMin()], [x, z, -y2], atol=1e-4, err_msg=str(prim.GetPath()))
            np.testing.assert_allclose([*box.GetMax()], [x2, z2, -y], atol=1e-4, err_msg=str(prim.GetPath()))
    assert UsdGeom.Xformable(turned.GetPrimAtPath("/Placed/Free")).GetResetXformStack()


@pytest.mark.parametrize(("name", "arkit"), [("out.usda", False), ("out.usdz", True)])
def test_what_moves_in_a_foreign_stage_moves_on(tmp_path, name, arkit):
    stage = Usd.Stage.CreateNew(str(tmp_path / "foreign.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    fan = UsdGeom.Cube.Define(stage, "/Fan")
    place = fan.AddTranslateOp()
    for time, height in ((Usd.TimeCode.Default(), 0), (1, 2), (24, 3)):
        place.Set(Gf.Vec3d(1, 0, height), time)
    stage.Save()
    made = Usd.Stage.Open(str(export(tmp_path / "foreign.usda", tmp_path / name, arkit=arkit)))
    fan = UsdGeom.Xformable(made.GetPrimAtPath("/Fan"))
    middles = [fan.ComputeLocalToWorldTransform(time).ExtractTranslation() for time in (Usd.TimeCode.Default(), 1, 24)]
    for middle, height in zip(middles, (0, 2, 3), strict=True):
        assert Gf.IsClose(middle, Gf.Vec3d(1, height, 0) if arkit else Gf.Vec3d(1, 0, height), 1e-6)


def test_usdz_for_arkit_has_no_empty_scopes(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "foreign.usda"))
    stage.SetDefaultPrim(stage.DefinePrim("/World", "Xform"))
    UsdGeom.Cube.Define(stage, "/World/Things/box")
    for path in ("/World/Lights/Inner", "/World/Things"):
        UsdGeom.Scope.Define(stage, path)
    UsdGeom.Scope.Define(stage, "/World/Lights")
    stage.DefinePrim("/World/Lights/Inner/sun", "DistantLight")
    stage.Save()
    made = Usd.Stage.Open(str(export(tmp_path / "foreign.usda", tmp_path / "out.usdz", arkit=True)))
    assert [str(prim.GetPath()) for prim in made.TraverseAll()] == ["/World", "/World/Things", "/World/Things/box"]


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_flat_usd_keeps_the_graph_and_its_images(root, room, tmp_path, ending):
    path = export(root, tmp_path / "out" / f"room{ending}")
    stage = Usd.Stage.Open(str(path))
    assert [layer for layer in stage.GetUsedLayers() if not layer.anonymous] == [stage.GetRootLayer()]
    assert echousd.read_graph(stage) == room.graph
    floor = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/Room/Shell/Floor/Floor_mesh")).ComputeBoundMaterial()[0]
    assert floor.ComputeSurfaceSource()[0].GetInput("diffuseColor").HasConnectedSource()
    named = [a.Get() for p in stage.Traverse() for a in p.GetAttributes() if a.GetTypeName() == "asset" and a.Get()]
    assert named
    assert all(asset.path.startswith("./room_textures/") and asset.resolvedPath for asset in named)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"room{ending}", "room_textures"}


@pytest.mark.parametrize("ending", [".usdz", ".usdc"])
def test_flat_usd_of_a_room_with_a_piece_switched_off_has_the_graph_that_is_left(room, tmp_path, ending):
    root = room.save(tmp_path / "bedroom", preview=False)
    layer = Sdf.Layer.CreateNew(str(root.with_name("mine.usda")))
    layer.subLayerPaths = [f"./{root.name}"]
    stage = Usd.Stage.Open(layer)
    stage.GetPrimAtPath("/Room/Objects/bed").SetActive(False)
    layer.Save()
    graph = echousd.read_graph(layer.realPath)
    assert 0 < len(graph.relations) < len(room.graph.relations)
    assert echousd.read_graph(export(layer.realPath, tmp_path / f"flat{ending}")) == graph


def physics_of(stage):
    """How much physics of each sort a stage holds."""
    prims = list(stage.TraverseAll())
    return {
        "bodies": sum(prim.HasAPI(UsdPhysics.RigidBodyAPI) for prim in prims),
        "colliders": sum(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in prims),
        "scenes": sum(prim.IsA(UsdPhysics.Scene) for prim in prims),
        "contacts": sum(prim.HasAPI(UsdPhysics.MaterialAPI) for prim in prims),
        "properties": sum(name.startswith("physics:") for prim in prims for name in prim.GetPropertyNames()),
    }


@pytest.mark.parametrize("ending", [".usdz", ".usda", ".usdc"])
def test_physics_is_exported_whole_or_not_at_all(root, tmp_path, ending):
    whole = physics_of(Usd.Stage.Open(str(root)))
    assert min(whole.values()) > 0
    for physics in (True, False, None):
        stage = Usd.Stage.Open(str(export(root, tmp_path / f"room_{physics}{ending}", physics=physics)))
        found = physics_of(stage)
        if physics or (physics is None and ending != ".usdz"):
            assert found == whole
        else:
            assert not any(found.values()), found
        assert stage.GetPrimAtPath("/Room/Objects/bed").GetAttribute("semantics:labels:category").Get()
    with pytest.raises(ValueError, match=r"--physics says nothing to a .glb, allowed: .usdz, .usda, .usdc"):
        export(root, tmp_path / "room.glb", physics=True)


def test_z_up_rooms_come_out_y_up_where_the_format_says_so(tmp_path):
    room = small_room(shapes="boxes", place=False, up_axis="Z")
    root = room.save(tmp_path / "bedroom", preview=False)
    scene = trimesh.load(export(root, tmp_path / "room.glb"))
    assert scene.bounds[1][1] == pytest.approx(2.8, abs=1e-3)
    stage = Usd.Stage.Open(str(export(root, tmp_path / "room.usdz")))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert world_bounds(stage).GetMax()[2] == pytest.approx(2.8, abs=1e-3)


@pytest.mark.parametrize("ending", [".usdz", ".glb", ".usdc"])
def test_an_export_loads_what_it_needs(root, tmp_path, ending, loaded_by):
    """Half of its time went into modules that it never called."""
    code = "import sys\nfrom echousd.cli.main import run\nassert run(['export', *sys.argv[1:]]) == 0"
    loaded = loaded_by(code, root, "-o", tmp_path / f"room{ending}")
    assert not {"torch", "trimesh", "scipy", "networkx", "shapely"} & loaded


def test_refusals(root, tmp_path):
    with pytest.raises(ValueError, match=r"cannot export to '.fbx', allowed: .usdz, .glb, .usda, .usdc"):
        export(root, tmp_path / "room.fbx")
    with pytest.raises(ValueError, match=r"--arkit says nothing to a .glb, allowed: .usdz$"):
        export(root, tmp_path / "room.glb", arkit=True)
    with pytest.raises(ValueError, match=r"--no-pictures says nothing to a .glb, allowed: .usdz, .usda, .usdc$"):
        export(root, tmp_path / "room.glb", pictures=False)
    (tmp_path / "room.glb").write_text("mine")
    with pytest.raises(ValueError, match="exists; choose another place or use --force"):
        export(root, tmp_path / "room.glb")
    assert export(root, tmp_path / "room.glb", force=True).read_bytes()[:4] == b"glTF"
    empty = tmp_path / "empty.usda"
    Sdf.Layer.CreateNew(str(empty)).Save()
    with pytest.raises(ValueError, match="nothing to export, found no visible mesh"):
        export(empty, tmp_path / "other.glb")
    with pytest.raises(ValueError, match=r"nowhere\.usda"):
        export(tmp_path / "nowhere.usda", tmp_path / "other.glb")
    assert not (tmp_path / "other.glb").exists()


@pytest.mark.parametrize("layer", ["bedroom.usda", "layers/graph.usda"])
def test_a_room_is_never_written_over_what_it_is_read_from(root, layer):
    before = (root.parent / layer).read_bytes()
    with pytest.raises(ValueError, match=f"{layer}: the room is read from it"):
        export(root, root.parent / layer, force=True)
    assert (root.parent / layer).read_bytes() == before


def test_folders_for_readers_replace_nothing_unless_forced_and_know_their_options(root, tmp_path):
    opened = export(root, tmp_path, reader="sceneeval")
    assert opened == tmp_path / "input/EchoUSD/scene_0.json"
    opened.write_text("mine")
    with pytest.raises(ValueError, match=r"scene_0\.json: exists; choose another place or use --force"):
        export(root, tmp_path, reader="sceneeval")
    assert opened.read_text() == "mine"
    export(root, tmp_path, reader="sceneeval", force=True)
    assert opened.read_text() != "mine"
    with pytest.raises(ValueError, match=r"--arkit says nothing to a habitat, allowed: \.usdz"):
        export(root, tmp_path / "other", reader="habitat", arkit=True)
    with pytest.raises(ValueError, match="no layout 4"):
        export(root, tmp_path / "other", reader="habitat", layout=4)
