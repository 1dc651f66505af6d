import hashlib
import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from pxr import Sdf, Usd
from small_room import BARE, StandIn, saved_room, small_graph, small_room

import echousd
from echomodel.graph import GraphEdit
from echomodel.openings import Opening, segment
from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
from echousd.make import furnishing, layouts
from echousd.make.edit import edit, graph_edit, restyled, touched
from echousd.make.reading import read_room
from echousd.options import RoomOptions
from echousd.place.living import living_faults
from echousd.shapes.looks import palette_of_room
from echousd.shapes.sources.retrieval import retrieved


@pytest.fixture
def root(tmp_path):
    return saved_room(tmp_path / "bedroom", seed=5, faces=600)


def hashes(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_room_reads_back(root):
    room = small_room(seed=5, faces=600)
    saved = read_room(root)
    assert saved.graph == room.graph
    assert saved.assets == room.assets
    for name in ("size", "position", "yaw"):
        torch.testing.assert_close(getattr(saved.boxes, name), getattr(room.boxes, name), atol=2e-4, rtol=0)
    (part,), (before,) = saved.geometry["bed"].parts, room.geometry["bed"].parts
    assert list(part.slots) == ["blanket", "linen", "wood"]
    for slot, faces in before.slots.items():
        np.testing.assert_array_equal(part.slots[slot], faces)


def test_edit_without_change_keeps_every_byte_of_the_assets_and_looks(root):
    before = hashes(root.parent)
    edit(root, small_graph(), model=StandIn()).save(root.parent, preview=False)
    after = hashes(root.parent)
    different = {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)}
    assert different <= {"layers/layout.usda", "bedroom.usda", "bedroom.json", "layers/physics.usda"}


def test_new_object_leaves_all_others_alone(root):
    old = read_room(root)
    before = hashes(root.parent)
    graph = small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    room = edit(root, graph, model=StandIn(), seed=9)
    room.save(root.parent, preview=False)
    after = hashes(root.parent)
    assert {path: after[path] for path in before if path.startswith("assets/")} == {
        path: value for path, value in before.items() if path.startswith("assets/")
    }
    assert "assets/chair/chair_geo.usdc" in after
    torch.testing.assert_close(room.boxes.position[:6], old.boxes.position, atol=2e-3, rtol=0)
    stage = Usd.Stage.Open(str(root))
    stage.Reload()
    assert stage.GetCompositionErrors() == []
    assert echousd.read_graph(stage) == graph.replaced(room=old.graph.room)


def test_an_edit_leaves_small_things_alone(tmp_path):
    options = RoomOptions(walls=True, dress="full")
    room = echousd.generate(
        small_graph(), seed=1, model=StandIn(), shapes="boxes", options=options
    )  # none where the chair goes
    root = room.save(tmp_path / "bedroom", preview=False)

    def things() -> dict[str, str]:
        layer = Sdf.Layer.OpenAsAnonymous(str(root.parent / "layers/dressing.usda"))
        return {prim.name: prim.GetAsText() for prim in layer.GetPrimAtPath("/Room/Dressing").nameChildren}

    before, small = hashes(root.parent), things()
    assert len(small) > 20
    edit(root, small_graph(), model=StandIn()).save(root.parent, preview=False)
    assert hashes(root.parent) == before
    graph = small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    edit(root, graph, model=StandIn(), seed=9).save(root.parent, preview=False)
    after = hashes(root.parent)
    kept = [path for path in before if path.startswith("assets/small_")]
    assert kept
    assert all(after.get(path) == before[path] for path in kept)
    assert {name: text for name, text in things().items() if name in small} == small


def test_all_layouts_of_a_room_are_kept(tmp_path):
    room = echousd.generate(small_graph(), seed=5, model=StandIn(0.4), faces=600, layouts=3, **BARE)
    root = room.save(tmp_path / "bedroom", preview=False)
    saved = read_room(root)
    assert len(saved.layouts) == 3
    for ours, theirs in zip(saved.layouts, room.layouts, strict=True):
        torch.testing.assert_close(ours.position, theirs.position, atol=2e-4, rtol=0)
    graph = small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    edited = edit(root, graph, model=StandIn(0.4), seed=9)
    edited.save(root.parent, preview=False)
    assert len(edited.layouts) == 3
    for before, after in zip(room.layouts, edited.layouts, strict=True):
        torch.testing.assert_close(after.position[:6], before.position, atol=2e-3, rtol=0)
        torch.testing.assert_close(after.size, edited.boxes.size)
    stage = Usd.Stage.Open(str(root))
    stage.Reload()
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    assert variants.GetVariantNames() == ["layout_0", "layout_1", "layout_2"]
    assert variants.GetVariantSelection() == "layout_0"
    smaller = edit(root, graph.remove_node("chair"), model=StandIn(0.4))
    assert len(smaller.layouts) == 3


def test_model_is_told_what_was_edited(root):
    model = StandIn()
    graph = small_graph().unrelate("wardrobe", "taller_than", "bed").update_node("pendant", category="table_lamp")
    graph = graph.add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    edit(root, graph, model=model)
    assert len(model.edits) == 2  # the layout branch and the shape branch
    for told in model.edits:
        assert [name for name, new in zip(graph.names, told.added.tolist(), strict=True) if new] == ["pendant", "chair"]
        bed, wardrobe = graph.names.index("bed"), graph.names.index("wardrobe")
        pairs = {(s, o) for s, _, o in told.before.tolist()}
        assert (wardrobe, bed) in pairs  # as it was before
        assert graph.names.index("chair") not in {end for pair in pairs for end in pair}


def test_an_edit_draws_several_layouts_and_keeps_the_best(root, monkeypatch):
    old, model = read_room(root), StandIn(0.4)
    graph = small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    seen = []

    def wishes(graph, found, *_):
        seen.append(found[0])
        return (0, 0, 1 if len(seen) == 3 else 1 + len(seen))  # no two end alike

    monkeypatch.setattr("echousd.make.layouts._wishes", wishes)
    monkeypatch.setattr("echousd.make.furnishing.most_drafts", layouts.most_drafts)
    room = edit(root, graph, model=model, seed=9, shapes="boxes")
    assert len(seen) == 16  # none was perfect: eight drafts are searched in passing, then each of them in earnest
    np.testing.assert_array_equal(room.boxes.position, seen[2].position)
    sizes = [len(told.added) // len(graph.nodes) for told in model.edits if told is not None]
    assert sizes[:3] == [1, 2, 5]
    for boxes in seen:  # whatever is drawn, what the edit does not touch stays
        np.testing.assert_allclose(boxes.position[:6], old.boxes.position, atol=1e-6)
    seen.clear()
    edit(root, graph, model=model, seed=9, shapes="boxes", drafts=1)
    assert not seen
    with pytest.raises(ValueError, match="drafts is 65, allowed: 1 to 64"):
        edit(root, graph, model=model, drafts=65)


def test_an_edit_is_told_once_for_every_copy_of_the_graph():
    change = GraphEdit(torch.tensor([[0, 1, 2], [2, 7, 1]]), torch.tensor([False, False, True]))
    twice = change.repeated(2)
    assert twice.before.tolist() == [[0, 1, 2], [2, 7, 1], [3, 1, 5], [5, 7, 4]]
    assert twice.added.tolist() == [False, False, True, False, False, True]


def test_owner_of_a_shared_asset_may_go(root):
    graph = small_graph().unrelate("lamp", "standing_on", "nightstand_left")
    graph = graph.remove_node("nightstand_left")
    room = edit(root, graph, model=StandIn())
    room.save(root.parent, preview=False)
    assert room.assets["nightstand_right"] == "nightstand"
    stage = Usd.Stage.Open(str(root))
    stage.Reload()
    assert stage.GetPrimAtPath("/Room/Objects/nightstand_right/geo/nightstand_mesh")
    assert not stage.GetPrimAtPath("/Room/Objects/nightstand_left")
    again = graph.add_node("nightstand", "wardrobe")
    assert edit(root, again, model=StandIn()).assets["nightstand"] == "nightstand_2"


def test_another_category_gets_another_shape(root):
    before = hashes(root.parent)
    edit(root, small_graph().update_node("wardrobe", category="double_bed"), model=StandIn(), place=False).save(
        root.parent, preview=False
    )
    after = hashes(root.parent)
    path = "assets/{0}/{0}_geo.usdc"
    assert after[path.format("wardrobe")] != before[path.format("wardrobe")]
    assert after[path.format("bed")] == before[path.format("bed")]


def test_what_an_edit_touches():
    graph = small_graph()
    assert touched(graph, graph) == (set(), set())
    assert touched(graph, graph.relate("nightstand_left", "left", "bed")) == (set(), {"nightstand_left", "lamp"})
    assert touched(graph, graph.lock("lamp").relate("nightstand_left", "left", "bed"))[1] == {"nightstand_left"}
    assert touched(graph, graph.remove_node("pendant")) == (set(), set())
    assert touched(graph, graph.update_node("bed", position=(0.5, 0.0, 0.0))) == (set(), {"bed"})
    assert touched(graph, graph.update_node("wardrobe", place="in_corner")) == (set(), {"wardrobe"})
    assert touched(graph, graph.update_node("nightstand_left", size=(0.4, 0.4, 0.4))) == ({"nightstand_left"}, {"lamp"})


def test_the_model_is_told_of_relations_between_what_stays():
    graph = small_graph()
    told = graph_edit(graph, graph.update_node("nightstand_right", category="wardrobe").remove_node("lamp"))
    names = [name for name in graph.names if name != "lamp"]
    pairs = {(names[subject], names[object_]) for subject, _, object_ in told.before.tolist()}
    assert {("nightstand_left", "bed"), ("wardrobe", "bed")} <= pairs
    assert not any("nightstand_right" in pair for pair in pairs)


def test_models_are_chosen_for_what_is_new_in_the_colours_of_the_room(root, monkeypatch):
    asked = []

    def chosen(request, shapes, wishes, palette):
        asked.append((set(request.wanted), palette))
        return retrieved(request, shapes, wishes, palette)

    monkeypatch.setattr(furnishing, "names_models", lambda graph, shapes, among: bool(among))
    monkeypatch.setattr(furnishing, "retrieved", chosen)
    graph = small_graph()
    edit(root, graph.relate("wardrobe", "left", "bed"), model=StandIn(), shapes="boxes", place=False)
    assert not asked  # nothing is new
    graph = graph.add_node("chair", "nightstand")
    edit(root, graph, model=StandIn(), shapes="boxes", place=False)
    assert asked == [({"chair"}, palette_of_room(5, graph.room.style))]


def test_furniture_of_ours_that_is_told_another_style_is_shaped_anew():
    forms = {name: SimpleNamespace(description=told) for name, told in {"bed": (0.5,), "wardrobe": ()}.items()}
    saved = SimpleNamespace(graph=small_graph(), geometry=forms)
    after = small_graph().update_node("bed", style="art_deco").update_node("wardrobe", style="art_deco")
    assert restyled(saved, small_graph(), ()) == set()
    assert restyled(saved, after, ()) == {"bed"}  # the other is somebody else's model
    assert restyled(saved, after, {"bed"}) == restyled(saved, after.lock("bed"), ()) == set()


@pytest.mark.parametrize(
    ("made", "assets", "shapes"),
    [("library", "mine.parquet", "library"), ("guided", "mine.parquet", "guided"), ("library", None, "sdf"),
     ("boxes", "mine.parquet", "boxes"), ("parts", None, "parts")],
)  # fmt: skip
def test_what_is_new_is_made_as_the_room_was_where_its_library_is_at_hand(root, monkeypatch, made, assets, shapes):
    asked = []
    monkeypatch.setattr(furnishing, "check_sources", lambda words, model: asked.extend(words))
    monkeypatch.setattr(furnishing, "LayoutSearch", lambda *given, **more: 1 / 0)  # no further
    manifest = root.with_suffix(".json")
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "shapes": made}))
    with pytest.raises(ZeroDivisionError):
        edit(root, small_graph().add_node("chair", "nightstand"), model=StandIn(), assets=assets)
    assert asked == [shapes]


def test_only_rooms_of_ours_can_be_edited(tmp_path):
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    with pytest.raises(ValueError, match=r"graph.usda: not a room made by `echousd generate`"):
        read_room(tmp_path / "graph.usda")


def test_command(root, echousd_command, monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))
    words = ("--add", "chair:nightstand", "--relate", "chair close by wardrobe", "--remove", "pendant")
    done = echousd_command("edit", root, *words)
    assert done.code == 0, done.err
    assert "+ object chair (nightstand)" in done.out
    graph = echousd.read_graph(root)
    assert Relation("chair", "close_by", "wardrobe") in graph.relations
    assert "pendant" not in graph.names
    done = echousd_command("edit", root)
    assert done.code == 2
    assert "nothing to change; use --add, --remove" in done.err
    done = echousd_command("edit", root, "--remove", "sofa")
    assert done.code == 2
    assert "sofa" in done.err


def test_an_edit_tells_what_is_stated_oddly(root):
    graph = small_graph().update_node("wardrobe", position=(-5.0, 0.0, 0.6), size=(0.2, 2.2, 0.6))
    assert edit(root, small_graph(), model=StandIn()).notes == ()
    room = edit(root, graph, model=StandIn())
    usual, beside = room.notes
    assert usual.startswith("wardrobe is 0.2 m wide as stated; such furniture: ")
    assert beside == "wardrobe is stated to stand at (-5.00, 0.60) m, beside the floor"
    room.save(root.parent, preview=False)
    assert edit(root, graph.remove_node("lamp"), model=StandIn()).notes == ()  # it was told


def test_an_edit_adds_no_more_than_the_floor_holds(root):
    graph = small_graph().update_node("wardrobe", size=(6.0, 2.2, 0.6))
    with pytest.raises(GraphError, match=r"bedroom.usda: .* too small for 'wardrobe', which is 6.00 m long"):
        edit(root, graph, model=StandIn())


def test_weights_that_did_not_make_the_room_are_told(root, echousd_command, monkeypatch):
    from echomodel.echo import EchoModel

    newer = StandIn()
    newer.hash = "newer"
    graph = small_graph().add_node("chair", "nightstand")
    with pytest.warns(UserWarning, match=r"bedroom.usda: made with weights standin, edited with weights newer; what"):
        room = edit(root, graph, model=newer)
    assert room.provenance.model == "newer"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        edit(root, graph, model=StandIn())

    manifest = json.loads((root.parent / "bedroom.json").read_text())
    (root.parent / "bedroom.json").write_text(json.dumps({**manifest, "preset": "released"}))
    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))
    before = hashes(root.parent)
    done = echousd_command("edit", root, "--add", "chair:nightstand")
    assert done.code == 2
    assert "made with weights of the preset 'released' (hash standin), which do not ship; name their file" in done.err
    assert hashes(root.parent) == before


def test_new_meshes_keep_the_face_budget_of_the_room(root):
    graph = small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")
    room = edit(root, graph, model=StandIn())
    assert 300 < room.geometry["chair"].faces <= 600
    assert edit(root, graph, model=StandIn(), faces=300).geometry["chair"].faces <= 300
    saved = room.save(root.parent, preview=False).with_suffix(".json")
    assert json.loads(saved.read_text())["faces"] == 600


@pytest.mark.parametrize("deep", [0.002, 0.007, 0.009, 0.012, 0.03])
def test_what_a_check_passes_fails_no_edit(tmp_path, deep):
    fixed = {"yaw": 0.0, "locked": True}
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.0, 4.0), height=2.6),
        (Node("desk", "desk", size=(1.0, 0.75, 0.6), position=(-1.5 + deep, 0.0, 0.0), **fixed),
         Node("chest", "cabinet", size=(1.0, 0.8, 0.5), position=(-0.5, 0.0, 0.0), **fixed), Node("stool", "stool")),
    )  # fmt: skip
    root = echousd.generate(graph, seed=1, shapes="boxes", walls=False, dress="none").save(
        tmp_path / "r", preview=False
    )
    after = echousd.edit(root, echousd.read_graph(root).relate("stool", "close_by", "chest"))
    found = echousd.check(after.save(tmp_path / "r", preview=False)).collisions
    assert bool(after.faults) == bool(found) == (deep > 0.01)


@pytest.mark.parametrize("nearest", [True, False])
def test_who_is_in_the_way_of_a_new_door_makes_way_and_no_other(tmp_path, nearest):
    nodes = (Node("bed", "double_bed"), Node("wardrobe", "wardrobe"), Node("desk", "desk"), Node("chair", "chair"))
    graph = SceneGraph(RoomSpec("bedroom", size=(4.6, 4.4), height=2.6), nodes)
    room = echousd.generate(graph, seed=1, shapes="boxes", walls=False, dress="none")
    root, wardrobe = room.save(tmp_path / "r", preview=False), room.boxes.position[1, ::2]

    def away(door):
        return float(np.linalg.norm(np.mean(segment(graph.room.corners, door), 0) - wardrobe))

    doors = [
        Opening("new", "door", wall, at, 0.9, 2.0) for wall in range(4) for at in np.arange(0.1, 3.4, 0.1).round(2)
    ]
    door = min(doors, key=away) if nearest else max(doors, key=away)
    after = echousd.edit(root, echousd.read_graph(root).with_room(openings=(door,)))
    moved = np.abs(after.boxes.position - room.boxes.position).max(1) > 0.01
    assert moved[1] == nearest
    assert not moved.all()
    reached = [
        fault.says for fault in living_faults(after.graph, after.boxes, after.floor) if fault.rule == "door_free"
    ]
    assert reached == []


def test_a_room_on_another_floor_gets_a_door_and_windows_again(tmp_path):
    nodes = (Node("bed", "double_bed"), Node("wardrobe", "wardrobe"))
    room = echousd.generate(
        SceneGraph(RoomSpec("bedroom", size=(4.0, 3.6)), nodes), seed=1, shapes="boxes", dress="none"
    )
    root = room.save(tmp_path / "r", preview=False)
    graph = echousd.read_graph(root)
    after = echousd.edit(root, graph.with_room(size=(4.6, 4.0), openings=()))
    assert {opening.kind for opening in after.graph.room.openings} == {"door", "window"}
    again = echousd.edit(root, graph.with_room(openings=()))
    assert again.graph.room.openings == graph.room.openings
