"""A room that does not keep its graph says so: warning, manifest, exit code; every layout counts."""

import json
import re
import warnings

import pytest
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.openings import Opening
from echousd.checks import check
from echousd.exporting.formats import export
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.make import save
from echousd.make.verdicts import RoomWarning


class Piled(StandIn):
    """Puts the wardrobe into the bed, but for the first layout if told so."""

    def __init__(self, only_later: bool = False) -> None:
        super().__init__()
        self.only_later, self.drawn = only_later, 0

    def sample_layout(self, graph, **kwargs):
        found = super().sample_layout(graph, **kwargs)
        self.drawn += 1
        position = found.position.clone()
        if self.drawn > 1 or not self.only_later:
            position[4] = position[0]
        return Boxes(found.size, position, found.yaw)


def together():
    """The bed and the wardrobe stand in each other, as the graph says."""
    graph = small_graph().update_node("bed", position=(0.0, 0.0, -0.6), size=(1.8, 1.0, 2.1), yaw=0.0)
    return graph.update_node("wardrobe", position=(0.6, 0.0, -0.6), size=(1.6, 2.2, 0.6), yaw=0.0)


def test_a_collision_that_is_left_is_warned_of_and_in_the_manifest(tmp_path):
    with pytest.warns(RoomWarning, match=r"bed and wardrobe collide by 0\.(49|50)\d m"):
        room = echousd.generate(together(), model=StandIn(), shapes="boxes", drafts=1, **BARE)
    assert any("bed and wardrobe collide" in fault for fault in room.faults)
    root = room.save(tmp_path / "room", preview=False)
    (only,) = json.loads(root.with_suffix(".json").read_text())["layouts"]
    assert only["collisions"][0]["objects"] == ["bed", "wardrobe"]


@pytest.mark.parametrize("place", [True, False])
def test_a_room_an_edit_and_a_check_tell_one_depth(tmp_path, place):
    told = {"shapes": "parts", "walls": False, "dress": "none", "place": place}
    with pytest.warns(RoomWarning, match="bed and wardrobe collide"):
        room = echousd.generate(together(), drafts=1, **told)
    root = room.save(tmp_path / "room", preview=False)
    (hit,) = found = check(root).collisions
    assert [round(one.depth, 3) for one in room.outcomes[0].collisions] == [round(hit.depth, 3)]
    assert hit.depth < 0.5  # of the bed's legs, sides and mattress, not of the boxes
    with pytest.warns(RoomWarning, match="bed and wardrobe collide"):
        after = echousd.edit(root, move=["wardrobe:0.7,-0.6"], place=place)
    (told,), (hit,) = after.outcomes[0].collisions, check(after.save(root.parent, preview=False)).collisions
    assert (told.first, told.second) == (hit.first, hit.second) == (found[0].first, found[0].second)
    assert round(told.depth, 3) == round(hit.depth, 3)


@pytest.mark.parametrize(("seed", "style"), [(7, None), (3, "country")])
@pytest.mark.parametrize("place", [True, False])
def test_what_stands_in_a_wall_is_told_by_one_depth(tmp_path, place, seed, style):
    ward = Node("wardrobe", "wardrobe", size=(1.5, 2.0, 0.6), position=(1.96, 0.0, 0.0), yaw=-1.5708)
    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 3.6), style=style), (ward, Node("bed", "double_bed")), ())
    told = {"shapes": "parts", "dress": "none", "place": place}
    with pytest.warns(RoomWarning, match="wardrobe and Wall_. collide"):
        room = echousd.generate(graph, seed=seed, drafts=1, **told)
    root = room.save(tmp_path / "room", preview=False)
    assert depths(room.outcomes[0].collisions) == depths(check(root).collisions) != {}
    with pytest.warns(RoomWarning, match="wardrobe and Wall_. collide"):
        after = echousd.edit(root, move=["wardrobe:1.8,0"], place=place)
    assert depths(after.outcomes[0].collisions) == depths(check(after.save(root.parent, preview=False)).collisions)


def depths(hits):
    return {(hit.first, hit.second): round(hit.depth, 3) for hit in hits}


def test_a_good_room_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert echousd.generate(small_graph(), model=StandIn(), shapes="boxes", **BARE).faults == ()


def test_exit_code_of_a_room_with_faults(tmp_path, echousd_command, monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))
    echousd.write_graph(together(), tmp_path / "graph.usda")
    quick, bare = ("--shapes", "boxes", "--drafts", 1), ("--no-walls", "--dress", "none")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", *quick, *bare)
    assert done.code == 1
    assert re.search(r"collide  bed and wardrobe by 0\.(49|50)\d m", done.out)
    assert "warning" not in done.err
    assert (tmp_path / "room" / "room.usda").is_file()
    done = echousd_command("edit", tmp_path / "room" / "room.usda", "--remove", "lamp", *quick)
    assert done.code == 1
    done = echousd_command("edit", tmp_path / "room" / "room.usda", "--remove", "wardrobe", *quick)
    assert done.code == 0, done.out


@pytest.fixture(scope="module")
def later(tmp_path_factory):
    """A room whose second layout is bad."""
    with pytest.warns(RoomWarning, match="layout_1: bed and wardrobe collide"):
        room = echousd.generate(small_graph(), model=Piled(True), shapes="boxes", layouts=2, place=False, **BARE)
    assert [len(found.collisions) > 0 for found in room.outcomes] == [False, True]
    return room.save(tmp_path_factory.mktemp("rooms") / "room")


def test_every_layout_is_checked_listed_and_drawn(later, echousd_command):
    from PIL import Image

    report = check(later)
    assert [(layout.name, layout.ok) for layout in report.layouts] == [("layout_0", True), ("layout_1", False)]
    assert check(later, layout=0).ok
    assert not check(later, layout=1).ok
    manifest = json.loads(later.with_suffix(".json").read_text())
    assert [bool(entry["collisions"]) for entry in manifest["layouts"]] == [False, True]
    assert Image.open(later.with_name("room_layouts.png")).size == (2 * save.SHEET, save.SHEET)
    done = echousd_command("check", later)
    assert done.code == 1
    assert "layout_1: bed and wardrobe" in done.out
    assert echousd_command("check", later, "--layout", 0).code == 0
    done = echousd_command("check", later, "--layout", 2)
    assert done.code == 2
    assert "room.usda: no layout 2, allowed: layout_0, layout_1" in done.err


def test_exports_hold_the_layout_that_was_asked_for_and_say_so(later, tmp_path):
    from pxr import Sdf, Usd, UsdGeom

    places = []
    for number in range(2):
        out = export(later, tmp_path / f"{number}.usda", layout=number)
        assert Sdf.Layer.FindOrOpen(str(out)).customLayerData["layout"] == f"layout_{number}"
        stage = Usd.Stage.Open(str(out))
        prim = stage.GetPrimAtPath("/Room/Objects/wardrobe")
        places.append(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0).ExtractTranslation())
    assert places[0] != places[1]
    assert b'"layout_1"' in export(later, tmp_path / "1.glb", layout=1).read_bytes()
    with pytest.raises(ValueError, match="no layout 5, allowed: layout_0, layout_1"):
        export(later, tmp_path / "5.usda", layout=5)


def test_more_layouts_are_drawn_again_where_the_first_try_fails(monkeypatch):
    monkeypatch.setattr("echousd.make.furnishing.most_drafts", lambda model, objects: 4)  # in three rounds

    class Counting(StandIn):
        drawn = 0

        def sample_layout(self, graph, **kwargs):
            self.drawn += 1
            return super().sample_layout(graph, **kwargs)

    window = Opening("window", "window", 2, 1.2, 1.6, 1.3, sill=0.9)  # no door where the stand-in's bed stands

    def lit(graph):
        return graph.replaced(room=graph.room.replaced(openings=(window,)))

    model = Counting()
    room = echousd.generate(lit(small_graph()), model=model, shapes="boxes", layouts=3, **BARE)
    assert [found.faults for found in room.outcomes] == [(), (), ()]
    assert model.drawn == 3  # none was drawn twice
    crowded = Counting()
    with pytest.warns(RoomWarning):
        echousd.generate(lit(together()), model=crowded, shapes="boxes", layouts=2, **BARE)
    assert crowded.drawn == 3 + 3  # crowding is seen in both
