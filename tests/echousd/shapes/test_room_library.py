import shutil
import zipfile

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from small_models import chest, picture, seat, small_library, write_obj, write_usd
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.assets.choose import Asked, AssetWishes, choose
from echousd.assets.index import index
from echousd.assets.model_file import ModelFile
from echousd.assets.table import read_library
from echousd.checks import check
from echousd.exporting.formats import export
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.shapes.originals.loading import collected
from echousd.stage.files import open_stage
from echousd.store import Store


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    return index([small_library(folder / "models")], folder / "lib.parquet").file


def boxes_of(stage, name):
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render"])
    found = cache.ComputeRelativeBound(stage.GetPrimAtPath(f"/Room/Objects/{name}"), stage.GetPrimAtPath("/Room"))
    box = found.ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()])


def test_a_room_of_a_library(library, tmp_path):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="library", assets=library, **BARE)
    assert not room.faults
    root = room.save(tmp_path / "bedroom", preview=False)
    stage = open_stage(root)
    assert {name: geometry.origin.asset for name, geometry in room.geometry.items()} == {
        "bed": "beds/double_bed.usda",
        "nightstand_left": "storage/nightstand.glb",
        "nightstand_right": "storage/nightstand.glb",
        "lamp": "lamps/table_lamp.obj",
        "wardrobe": "storage/thing_17.usda",
        "pendant": "lamps/pendant_lamp.obj",
    }
    for number, name in enumerate(room.names):  # nothing is outside of its box
        size = np.asarray(room.boxes.size[number])
        turned = size[[2, 1, 0]] if abs(np.sin(float(room.boxes.yaw[number]))) > 0.5 else size
        np.testing.assert_allclose(np.ptp(boxes_of(stage, name), axis=0), turned, rtol=0.01)
    model = stage.GetPrimAtPath("/Room/Objects/bed/bed_placed/bed_model")
    payload = model.GetPrimStack()[0].payloadList.prependedItems[0]
    assert not payload.assetPath.startswith("/")
    assert payload.assetPath.endswith("models/beds/double_bed.usda")
    assert open_stage(tmp_path / "bedroom/assets/bed/bed.usda").GetPrimAtPath("/bed/bed_placed/bed_model/form")
    said = (tmp_path / "bedroom/ATTRIBUTION.md").read_text()
    assert "| wardrobe | storage/thing_17.usda | CC0-1.0 | A. Joiner |" in said
    told = read_room(root).manifest["meshes"]["bed"]
    assert (told["asset"], told["licence"], len(told["sha256"])) == ("beds/double_bed.usda", "CC0-1.0", 64)
    assert check(root).ok


def test_equal_arguments_give_equal_rooms(library):
    from echousd.layers.compose import room_files

    rooms = [
        echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=library, **BARE) for _ in range(2)
    ]
    assert room_files(rooms[0]) == room_files(rooms[1])


def test_a_piece_of_ones_own_beside_generated_ones(tmp_path):
    write_usd(tmp_path / "mine/dresser.usda", chest(1.0, 2.0, 0.5), centimetres=True, z_up=True)
    graph = small_graph().update_node("wardrobe", asset="mine/dresser.usda")
    text = tmp_path / "bedroom.yaml"
    text.write_text(graph.to_yaml())
    room = echousd.generate(text, model=StandIn(), shapes="boxes", **BARE)
    assert room.boxes.size[room.names.index("wardrobe")].tolist() == pytest.approx([1.0, 2.0, 0.5], abs=1e-3)
    assert {geometry.origin.shapes for geometry in room.geometry.values()} == {"own", "boxes"}
    root = room.save(tmp_path / "out/bedroom", preview=False)
    assert open_stage(root).GetPrimAtPath("/Room/SceneGraph")
    assert read_room(root).graph.node("wardrobe").asset == "../../mine/dresser.usda"
    with pytest.raises(ValueError, match=r"'wardrobe': asset names .*dresser.usda, allowed: files below .*bedroom \("):
        echousd.generate(root, model=StandIn(), shapes="boxes")
    again = echousd.generate(root, model=StandIn(), shapes="boxes", outside=[tmp_path / "mine"], **BARE)
    assert again.geometry["wardrobe"].origin.asset == "dresser.usda"


def test_an_edit_keeps_models_and_their_paths(library, tmp_path):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="library", assets=library, **BARE)
    root = room.save(tmp_path / "bedroom", preview=False)
    before = {path: path.read_bytes() for path in (tmp_path / "bedroom/assets").rglob("*") if path.is_file()}
    graph = read_room(root).graph.add_node("chest", "wardrobe").relate("chest", "close_by", "bed")
    after = edit(root, graph, model=StandIn(), shapes="boxes")
    assert after.geometry["bed"].origin == room.geometry["bed"].origin
    after.save(tmp_path / "bedroom", preview=False)
    assert {path: path.read_bytes() for path in before} == before
    moved = after.save(tmp_path / "deeper/down/bedroom", preview=False)  # the library is further away from here
    assert open_stage(moved).GetPrimAtPath("/Room/Objects/bed/bed_placed/bed_model/form")


def test_faults_name_the_object_and_the_file(library, tmp_path):
    def made(graph, **options):
        return echousd.generate(graph, model=StandIn(), **options, **BARE)

    with pytest.raises(ValueError, match=r"object 'lamp': .*nowhere.glb: no such file"):
        made(small_graph().update_node("lamp", asset="nowhere.glb"), shapes="boxes")
    with pytest.raises(ValueError, match=r"asset 'ball.stl' is of a library, .* allowed: a file that ends in .*\.glb"):
        made(small_graph().update_node("lamp", asset="ball.stl"), shapes="boxes")
    with pytest.raises(ValueError, match=r"object 'lamp': .*lib.parquet: asset 'moon' is not in it"):
        made(small_graph().update_node("lamp", asset="moon"), shapes="boxes", assets=library)
    with pytest.raises(ValueError, match="object 'lamp': shapes is 'own' without an asset"):
        small_graph().update_node("lamp", shapes="own")
    with pytest.raises(ValueError, match="object 'lamp': asset is given, but shapes is 'sdf', allowed: own or library"):
        small_graph().update_node("lamp", shapes="sdf", asset="a.usd")
    with pytest.raises(ValueError, match="found 'lego', allowed: parts, sdf, boxes, library"):
        small_graph().update_node("lamp", shapes="lego")


def test_a_model_that_vanished_or_changed_since_it_was_indexed_is_told(tmp_path):
    folder = small_library(tmp_path / "models")
    file = index([folder], tmp_path / "lib.parquet").file
    (folder / "storage/thing_17.usda").write_text("#usda 1.0\n")
    with pytest.raises(ValueError, match=r"storage/thing_17.usda': .* was changed since; index the folder again"):
        echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file, **BARE)
    (folder / "storage/thing_17.usda").unlink()
    with pytest.raises(ValueError, match=r"thing_17.usda: no such file; index the folder again"):
        echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file, **BARE)


def test_collected_models_make_a_room_that_needs_no_library(tmp_path):
    folder = small_library(tmp_path / "models")
    write_usd(folder / "storage/thing_17.usda", chest(1.6, 2.2, 0.6), label="wardrobe", texture="./oak.png")
    (folder / "storage/oak.png").write_bytes(picture())
    file = index([folder], tmp_path / "lib.parquet").file
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file, collect=True, **BARE)
    root = room.save(tmp_path / "out/bedroom", preview=False)
    shutil.rmtree(folder)
    moved = tmp_path / "elsewhere"
    shutil.move(root.parent, moved)
    stage = open_stage(moved / root.name)
    form = stage.GetPrimAtPath("/Room/Objects/wardrobe/wardrobe_placed/wardrobe_model/form")
    assert UsdGeom.Mesh(form).GetPointsAttr().Get()
    assert list((moved / "assets/wardrobe/original").rglob("*.png"))
    assert check(moved / root.name).ok
    packed = export(moved / root.name, tmp_path / "room.usdz")
    names = zipfile.ZipFile(packed).namelist()
    assert any(name.endswith(".png") for name in names)


def test_a_room_packs_models_of_a_library_where_that_is_allowed(tmp_path):
    folder = small_library(tmp_path / "models")
    file = index([folder], tmp_path / "lib.parquet").file
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file, **BARE)
    root = room.save(tmp_path / "out/bedroom", preview=False)
    with pytest.raises(ValueError, match=r"allowed: files in .* \(--search DIR adds one\)"):
        export(root, tmp_path / "room.usdz")
    assert export(root, tmp_path / "room.usdz", search=[folder]).stat().st_size > 10_000


def test_models_lie_once_in_a_store(library, tmp_path):
    for number in range(3):
        graph = small_graph(size=(4.0 + 0.2 * number, 3.4))
        room = echousd.generate(
            graph, seed=number, model=StandIn(0.05 * number), shapes="library", assets=library, **BARE
        )
        root = room.save(tmp_path / f"room_{number}", preview=False, store=tmp_path / "store")
        assert open_stage(root).GetPrimAtPath("/Room/Objects/lamp/lamp_placed/lamp_model/mesh_0")
        assert check(root).ok
    layers = list((tmp_path / "store").rglob("model.usdc"))
    assert len(layers) == 3  # chair-like lamp, pendant, nightstand: what is no USD is converted once
    store = Store.open(tmp_path / "store")
    assert store.collect([tmp_path / f"room_{number}" for number in range(3)], grace=0) == []
    assert not list(store.wrong())
    graph = read_room(root).graph.add_node("chest", "wardrobe").relate("chest", "close_by", "bed")
    edit(root, graph, model=StandIn(), shapes="boxes").save(root.parent, preview=False)
    assert store.collect([tmp_path / f"room_{number}" for number in range(3)], grace=0, dry=True) == []
    assert open_stage(root).GetPrimAtPath("/Room/Objects/lamp/lamp_placed/lamp_model/mesh_0")


def test_nothing_out_of_the_library_is_taken(tmp_path):
    (tmp_path / "secret.png").write_bytes(picture())
    folder = tmp_path / "models"
    write_obj(folder, "wardrobe", chest(1.6, 2.2, 0.6), texture="../secret.png")
    write_obj(folder, "double_bed", seat(1.8, 1.0, 2.1), texture=str(tmp_path / "secret.png"))
    write_usd(folder / "nightstand.usda", chest(0.5, 0.5, 0.4), texture="../secret.png")
    done = index([folder], tmp_path / "lib.parquet")
    found = read_library(done.file).records
    assert found["wardrobe.obj"].missing == ("../secret.png",)
    assert found["double_bed.obj"].missing == (str(tmp_path / "secret.png"),)
    graph = small_graph()
    room = echousd.generate(graph, model=StandIn(), shapes="library", assets=done.file, **BARE)
    assert not any(path.endswith(".png") for g in room.geometry.values() if g.original for path in g.original.files)
    with pytest.raises(
        ValueError, match=r"nightstand.usda: </.+> depends on .*secret.png, allowed: files below .*models"
    ):
        echousd.generate(graph, model=StandIn(), shapes="library", assets=done.file, collect=True, **BARE)


def test_a_model_with_a_broken_clip_is_told_in_a_line(tmp_path, capfd):
    path = tmp_path / "chest.usda"
    write_usd(path, chest(1.0, 2.0, 0.5))
    stage = Usd.Stage.Open(str(path))
    clips = Usd.ClipsAPI(stage.GetDefaultPrim())
    clips.SetClipAssetPaths(Sdf.AssetPathArray([Sdf.AssetPath("./clip.usda")]))
    clips.SetClipPrimPath(str(stage.GetDefaultPrim().GetPath()))
    stage.Save()
    (tmp_path / "clip.usda").write_text('#usda 1.0\ndef "x" { garbage\n')
    with pytest.raises(ValueError, match=r"^\S+chest.usda: cannot be collected with all.*Expected }") as told:
        collected(ModelFile(path, tmp_path))
    assert "pxrInternal" not in str(told.value)
    assert capfd.readouterr() == ("", "")


def test_variants_payloads_and_materials_of_a_model_are_kept(tmp_path):
    inner = write_usd(tmp_path / "models/parts/body.usda", chest(1.6, 2.2, 0.6))
    stage = Usd.Stage.CreateNew(str(tmp_path / "models/wardrobe.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    root = UsdGeom.Xform.Define(stage, "/wardrobe").GetPrim()
    stage.SetDefaultPrim(root)
    UsdGeom.Xform.Define(stage, "/wardrobe/geo").GetPrim().GetPayloads().AddPayload("./parts/body.usda")
    colours = root.GetVariantSets().AddVariantSet("finish")
    for name in ("oak", "white"):
        colours.AddVariant(name)
    colours.SetVariantSelection("white")
    stage.Save()
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    record = read_library(done.file).records["wardrobe.usda"]
    assert (done.models, record.variants, inner.exists()) == (1, ("finish=white",), True)
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=done.file, **BARE)
    assert room.notes[0].startswith("the library has nothing for bed, nightstand_left, nightstand_right, lamp, pendant")
    saved = open_stage(room.save(tmp_path / "bedroom", preview=False))
    model = saved.GetPrimAtPath("/Room/Objects/wardrobe/wardrobe_placed/wardrobe_model")
    assert model.GetVariantSet("finish").GetVariantNames() == ["oak", "white"]
    form = saved.GetPrimAtPath(f"{model.GetPath()}/geo/form")
    material = UsdShade.MaterialBindingAPI(form).ComputeBoundMaterial()[0]
    assert material.GetPath() == f"{model.GetPath()}/geo/Looks/paint"


def test_models_with_colliders_of_their_own_keep_them_and_are_not_stretched(tmp_path):
    path = write_usd(tmp_path / "models/wardrobe.usda", chest(1.5, 2.1, 0.58))
    stage = Usd.Stage.Open(str(path))
    UsdPhysics.CollisionAPI.Apply(stage.GetPrimAtPath("/piece/form"))
    UsdPhysics.MeshCollisionAPI.Apply(stage.GetPrimAtPath("/piece/form")).CreateApproximationAttr("convexHull")
    stage.Save()
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    assert read_library(done.file).records["wardrobe.usda"].rigid
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=done.file, **BARE)
    assert room.boxes.size[room.names.index("wardrobe")].tolist() == pytest.approx([1.5, 2.1, 0.58], abs=1e-3)
    saved = open_stage(room.save(tmp_path / "bedroom", preview=False))
    assert not saved.GetPrimAtPath("/Room/Objects/wardrobe/wardrobe_collider")
    assert saved.GetPrimAtPath("/Room/Objects/wardrobe").HasAPI(UsdPhysics.RigidBodyAPI)
    assert not check(tmp_path / "bedroom/bedroom.usda").errors


def test_licences_are_filtered(library):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=library, licenses="CC-BY", **BARE)
    assert not any(geometry.origin.asset for geometry in room.geometry.values())  # all of them are CC0
    with pytest.raises(ValueError, match="licenses is '', allowed: licences with commas between"):
        echousd.RoomOptions(assets=library, licenses="")
    with pytest.raises(ValueError, match="stretch is 9, allowed: 1 to 4"):
        echousd.RoomOptions(assets=library, stretch=9)


def test_objects_of_a_set_share_a_model_and_others_do_not_repeat(tmp_path):
    for name in ("a", "b", "c"):
        write_obj(tmp_path / "models", f"armchair_{name}", seat(0.8, 0.9, 0.8))
    library = read_library(index([tmp_path / "models"], tmp_path / "lib.parquet").file)
    wishes = AssetWishes(library)
    alone = [Asked(f"chair_{i}", "armchair", "room", (0.8, 0.9, 0.8)) for i in range(3)]
    assert len({record.id for record in choose(wishes, alone, 1)[0].values()}) == 3
    together = [Asked(f"chair_{i}", "armchair", "oak", (0.8, 0.9, 0.8), "chair_0") for i in range(3)]
    assert len({record.id for record in choose(wishes, together, 1)[0].values()}) == 1
    found = {choose(wishes, alone[:1], seed)[0]["chair_0"].id for seed in range(12)}
    assert len(found) > 1  # the seed decides among equally good ones
    near = {"chair_0": {"armchair_b.obj": 0.0, "armchair_a.obj": 2.0, "armchair_c.obj": 2.0}}
    assert all(choose(wishes, alone[:1], seed, nearness=near)[0]["chair_0"].id == "armchair_b.obj" for seed in range(5))
    assert choose(wishes, [Asked("bed", "double_bed", "room", (1.8, 1, 2))], 0)[1] == ["bed"]
    assert choose(wishes, [Asked("seat", "lounge_chair", "room", (0.8, 0.9, 0.8))], 0)[0]  # kin of an armchair


def test_a_lamp_for_tables_does_not_hang_and_nobody_dines_at_a_coffee_table(tmp_path):
    write_obj(tmp_path / "models", "table_lamp", chest(0.25, 0.5, 0.25))
    write_obj(tmp_path / "models", "coffee_table", chest(2.0, 0.4, 1.5))
    write_obj(tmp_path / "models", "chair", seat(0.45, 0.9, 0.5))
    write_obj(tmp_path / "models", "folding_chair", seat(0.37, 0.4, 0.39))
    wishes = AssetWishes(read_library(index([tmp_path / "models"], tmp_path / "lib.parquet").file))
    asked = [
        Asked("pendant", "pendant_lamp", "room", (0.3, 0.5, 0.3)),
        Asked("board", "dining_table", "room", (1.8, 0.5, 1.2)),
        Asked("seat", "chair", "room", (0.42, 0.6, 0.45)),
    ]
    chosen, missing = choose(wishes, asked, 0)
    assert missing == ["pendant", "board"]  # the project's own programs make them
    assert chosen["seat"].id == "chair.obj"  # though the box is nearer to the folded one


def test_words_say_what_models_shall_be_like(tmp_path, monkeypatch):
    import torch

    def encoder(texts):
        return torch.tensor([[float("oak" in text), float("steel" in text), 0.1] for text in texts])

    monkeypatch.setattr("echomodel.text.ClipTextEncoder", lambda: encoder)

    for name in ("armchair_oak", "armchair_steel"):
        write_obj(tmp_path / "models", name, seat(0.8, 0.9, 0.8))
    library = read_library(index([tmp_path / "models"], tmp_path / "lib.parquet").file)
    asked = [Asked("chair", "armchair", "room", (0.8, 0.9, 0.8))]
    for word in ("oak", "steel"):
        wishes = AssetWishes(library, text=f"mid-century {word}")
        found = {choose(wishes, asked, seed)[0]["chair"].id for seed in range(6)}
        assert found == {f"armchair_{word}.obj"}
