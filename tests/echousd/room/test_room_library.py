import numpy as np
import pytest
from pxr import Usd, UsdGeom
from small_models import chest, small_library, write_usd
from small_room import StandIn, small_graph

import echousd
from echousd.assets.index import index
from echousd.check import check_room
from echousd.room.edit import edit
from echousd.room.reading import read_room
from echousd.stage import open_stage


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
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="library", assets=library)
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
    assert check_room(root).ok


def test_equal_arguments_give_equal_rooms(library):
    from echousd.room.compose import room_files

    rooms = [echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=library) for _ in range(2)]
    assert room_files(rooms[0]) == room_files(rooms[1])


def test_a_piece_of_ones_own_beside_generated_ones(tmp_path):
    write_usd(tmp_path / "mine/dresser.usda", chest(1.0, 2.0, 0.5), centimetres=True, z_up=True)
    graph = small_graph().update_node("wardrobe", asset="mine/dresser.usda")
    text = tmp_path / "bedroom.yaml"
    text.write_text(graph.to_yaml())
    room = echousd.generate(text, model=StandIn(), shapes="boxes")
    assert room.boxes.size[room.names.index("wardrobe")].tolist() == pytest.approx([1.0, 2.0, 0.5], abs=1e-3)
    assert {geometry.origin.source for geometry in room.geometry.values()} == {"own", "boxes"}
    root = room.save(tmp_path / "out/bedroom", preview=False)
    assert open_stage(root).GetPrimAtPath("/Room/SceneGraph")
    assert read_room(root).graph.node("wardrobe").asset == "../../mine/dresser.usda"
    again = echousd.generate(root, model=StandIn(), shapes="boxes")
    assert again.geometry["wardrobe"].origin.asset == "dresser.usda"


def test_an_edit_keeps_models_and_their_paths(library, tmp_path):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="library", assets=library)
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
        return echousd.generate(graph, model=StandIn(), **options)

    with pytest.raises(ValueError, match=r"object 'lamp': .*nowhere.glb: no such file"):
        made(small_graph().update_node("lamp", asset="nowhere.glb"), shapes="boxes")
    with pytest.raises(ValueError, match=r"object 'lamp': .*lib.parquet: asset 'moon' is not in it"):
        made(small_graph().update_node("lamp", asset="moon"), shapes="boxes", assets=library)
    with pytest.raises(ValueError, match="object 'lamp': source is 'own' without an asset"):
        small_graph().update_node("lamp", source="own")
    with pytest.raises(ValueError, match="object 'lamp': asset is given, but source is 'sdf', allowed: own or library"):
        small_graph().update_node("lamp", source="sdf", asset="a.usd")
    with pytest.raises(ValueError, match="found 'lego', allowed: parts, sdf, boxes, library"):
        small_graph().update_node("lamp", source="lego")


def test_a_model_that_vanished_or_changed_since_it_was_indexed_is_told(tmp_path):
    folder = small_library(tmp_path / "models")
    file = index([folder], tmp_path / "lib.parquet").file
    (folder / "storage/thing_17.usda").write_text("#usda 1.0\n")
    with pytest.raises(ValueError, match=r"storage/thing_17.usda': .* was changed since; index the folder again"):
        echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file)
    (folder / "storage/thing_17.usda").unlink()
    with pytest.raises(ValueError, match=r"thing_17.usda: no such file; index the folder again"):
        echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file)
