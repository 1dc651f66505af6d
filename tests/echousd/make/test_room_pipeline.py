from pathlib import Path

import numpy as np
import pytest
import torch
from pxr import Sdf, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.openings import Opening
from echomodel.progress import StageTimer
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.graph.arrays import graph_batch
from echousd.make import layouts
from echousd.make.reading import with_locked_places
from echousd.make.verdicts import relation_verdicts
from echousd.place.living import living_faults, severity
from echousd.shapes.styles import asset_names, equal_sizes, shared_assets, style_groups


def chairs(*relations, styles=(None, None, None)):
    nodes = tuple(Node(f"chair_{i}", "dining_chair", style=s) for i, s in enumerate(styles))
    return SceneGraph(room=RoomSpec("dining_room"), nodes=nodes, relations=tuple(Relation(*r) for r in relations))


def test_style_groups_join_relations_and_names():
    graph = chairs(("chair_0", "same_style_as", "chair_1"), styles=(None, "ash", None))
    assert style_groups(graph) == dict.fromkeys(graph.names, "ash")
    graph = chairs(("chair_2", "same_style_as", "chair_1"), styles=("oak", None, None))
    assert style_groups(graph) == {"chair_0": "oak", "chair_1": "set_chair_1", "chair_2": "set_chair_1"}


def test_chairs_of_a_table_are_one_set_unless_two_styles_are_told():
    assert style_groups(chairs()) == dict.fromkeys(("chair_0", "chair_1", "chair_2"), "set_chair_0")
    assert set(style_groups(chairs(styles=(None, "ash", None))).values()) == {"ash"}
    told = style_groups(chairs(styles=("oak", "ash", None)))
    assert told == {"chair_0": "oak", "chair_1": "ash", "chair_2": "room"}
    shelves = SceneGraph(RoomSpec("study"), (Node("a", "bookshelf"), Node("b", "bookshelf")))
    assert set(style_groups(shelves).values()) == {"room"}


def test_assets_are_shared_by_pieces_of_one_style_only():
    names, kind = ["a", "b", "c"], ["stool"] * 3
    size, style = np.ones((3, 3)), dict.fromkeys("abc", "ash")
    assert shared_assets(names, kind, style, size) == {"a": "a", "b": "a", "c": "a"}
    assert shared_assets(names, ["stool", "chair", "stool"], style, size) == {"a": "a", "b": "b", "c": "a"}
    assert shared_assets(names, kind, dict.fromkeys("abc", "room"), size) == {"a": "a", "b": "b", "c": "c"}
    assert shared_assets(names, kind, style, size * [[1], [1.01], [1]]) == {"a": "a", "b": "b", "c": "a"}


def test_shared_assets_are_named_for_what_they_are():
    owners = {"stool": "stool", "a": "a", "b": "a", "c": "c", "d": "c", "e": "e"}
    names = asset_names(owners, dict.fromkeys(owners, "stool"))
    assert names == {"stool": "stool", "a": "stool_2", "b": "stool_2", "c": "stool_3", "d": "stool_3", "e": "e"}


def test_sizes_of_what_is_told_alike_become_equal():
    size = np.array([[1.0, 1, 1], [1.1, 1, 1], [2.0, 1, 1]])
    args, free = (["a", "b", "c"], ["stool"] * 3, dict.fromkeys("abc", "ash")), np.ones(3, bool)
    np.testing.assert_allclose(equal_sizes(*args, size, free), [[1, 1, 1]] * 3)
    # ... unless the graph tells that one is bigger, or its size is given
    np.testing.assert_allclose(equal_sizes(*args, size, free, {(0, 2), (1, 2)}), [[1, 1, 1], [1, 1, 1], [2, 1, 1]])
    np.testing.assert_allclose(equal_sizes(*args, size, np.array([True, True, False])), [[2, 1, 1]] * 3)
    np.testing.assert_allclose(equal_sizes(*args, size, np.zeros(3, bool)), size)
    np.testing.assert_allclose(equal_sizes(*args[:2], dict.fromkeys("abc", "room"), size, free), size)
    tall = np.array([[1.0, 0.4, 1], [0.4, 2, 1]])
    np.testing.assert_allclose(equal_sizes(["a", "b"], ["stool"] * 2, args[2], tall, free[:2]), [tall[0]] * 2)
    long = np.array([[0.4, 0.8, 0.4], [0.42, 1.2, 0.4]])  # two pendants, of which one has to reach further down
    np.testing.assert_allclose(equal_sizes(["a", "b"], ["pendant_lamp"] * 2, args[2], long, free[:2])[:, 1], 1.2)


def test_lamps_in_a_row_and_twin_beds_are_of_one_style():
    kinds = {"table": "table", **dict.fromkeys("abc", "pendant_lamp"), "l": "single_bed", "r": "single_bed"}
    objects = "".join(f"{name}: {kind}, " for name, kind in kinds.items())
    text = f"room: bedroom\nobjects: {{{objects}}}\nrelations: [a above table, b above table, c above l]"
    found = style_groups(SceneGraph.from_yaml(text))
    assert found == {"table": "room", "a": "set_a", "b": "set_a", "c": "room", "l": "set_l", "r": "set_l"}


def test_lamps_in_a_row_do_not_join_two_told_styles():
    objects = "chair: {category: chair, style: oak}, sofa: {category: multi_seat_sofa, style: white}"
    objects += ", table: table, a: pendant_lamp, b: pendant_lamp"
    told = "a above table, b above table, a same_style_as chair, b same_style_as sofa"
    found = style_groups(SceneGraph.from_yaml(f"room: bedroom\nobjects: {{{objects}}}\nrelations: [{told}]"))
    assert found == {"chair": "oak", "sofa": "white", "table": "room", "a": "oak", "b": "white"}


def test_the_models_floor_is_the_stages_about_its_middle(tmp_path):
    corners = ((1.0, 1.0), (5.0, 1.0), (5.0, 4.0), (3.0, 4.0), (3.0, 3.0), (1.0, 3.0))
    nodes = (Node("stool", "stool"),)
    echousd.write_graph(
        SceneGraph(room=RoomSpec("bedroom", floor_polygon=corners), nodes=nodes), tmp_path / "room.usda"
    )
    floor = graph_batch(echousd.read_graph(tmp_path / "room.usda")).floor
    np.testing.assert_allclose(floor[0], np.array(corners) - [3.0, 2.5], atol=1e-6)
    sized = graph_batch(SceneGraph(room=RoomSpec("bedroom", size=(4.0, 3.0)), nodes=nodes)).floor
    assert sized.tolist() == [[[-2, -1.5], [2, -1.5], [2, 1.5], [-2, 1.5]]]
    assert np.isnan(graph_batch(SceneGraph(room=RoomSpec("bedroom"), nodes=nodes)).floor).all()


def test_what_the_graph_fixes_comes_back():
    graph = small_graph().update_node("wardrobe", size=(1.0, 2.0, 0.5), yaw=0.3)
    graph = graph.update_node("bed", size=(1.4, 0.9, 2.0), position=(0.2, 0.0, 0.1), yaw=0.5)
    room = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, **BARE)
    at = room.names.index("wardrobe")
    np.testing.assert_allclose(room.boxes.size[at], (1.0, 2.0, 0.5))
    assert float(room.boxes.yaw[at]) == pytest.approx(0.3)
    assert room.boxes.position[0].tolist() == pytest.approx([0.2, 0.0, 0.1])


def test_floor_away_from_the_origin_takes_the_furniture_along():
    corners = ((8.0, 3.0), (12.0, 3.0), (12.0, 7.0), (8.0, 7.0))
    room = echousd.generate(
        small_graph(size=None, floor_polygon=corners), model=StandIn(), shapes="boxes", place=False, **BARE
    )
    np.testing.assert_allclose(room.boxes.position[0], (10.0, 0.0, 4.4), atol=1e-5)


def test_placing_keeps_the_graph():
    class Heap(StandIn):
        def sample_layout(self, graph, **kwargs):
            found = super().sample_layout(graph, **kwargs)
            return Boxes(found.size, found.position * torch.tensor([0.3, 1.0, 0.3]), found.yaw)

    graph = small_graph().relate("nightstand_left", "front", "bed")
    heap = echousd.generate(graph, model=Heap(), shapes="boxes", place=False, **BARE)
    assert any(v.state == "broken" for v in heap.verdicts)
    room = echousd.generate(graph, model=Heap(), shapes="boxes", **BARE)
    assert [v.state for v in room.verdicts if v.state != "unmeasured"] == ["kept"] * 5
    assert room.notes == ()
    assert room.assets["nightstand_right"] == room.assets["nightstand_left"] == "nightstand"


def test_verdicts_are_those_of_the_rules():
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    by = {(v.subject, v.predicate): v for v in room.verdicts}
    assert by["lamp", "standing_on"].state == "kept"
    assert by["nightstand_left", "same_style_as"].state == "unmeasured"
    assert by["nightstand_left", "same_style_as"].margin is None
    assert by["wardrobe", "taller_than"].margin > 0
    flat = Boxes(room.boxes.size * np.array([1, 0.1, 1]), room.boxes.position, room.boxes.yaw)
    assert {v.predicate: v.state for v in relation_verdicts(room.graph, flat)}["standing_on"] == "broken"
    assert len(graph_batch(room.graph).triplets) == 5


def test_graph_may_be_a_file_and_progress_is_told(tmp_path):
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    told = []
    room = echousd.generate(
        tmp_path / "graph.usda", model=StandIn(), shapes="boxes", progress=lambda *state: told.append(state), **BARE
    )
    assert room.graph.replaced(room=small_graph().room) == small_graph()
    assert {opening.kind for opening in room.graph.room.openings} == {"door", "window"}
    assert room.provenance.source == "graph.usda"
    assert {stage for stage, *_ in told} == {"read", "load", "layout", "place", "meshes"} == set(room.timings)
    assert ("meshes", 6, 6) in told
    assert told[-1] == ("place", 1, 1)  # moved apart by their solids


class NoShapes(StandIn):
    branches = frozenset({"layout"})


class Empty(StandIn):
    def sample_shapes(self, graph, boxes, **kwargs):
        return torch.ones(graph.num_nodes, 64, 64, 64)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"shapes": "cubes"}, "shapes is 'cubes', allowed: parts, sdf, boxes"),
        ({"layouts": 0}, "layouts is 0, allowed: 1 to 1000"),
        ({"seed": -1}, "seed is -1, allowed: 0 to 9223372036854775807"),
        ({"model": NoShapes()}, "no shape branch; use shapes 'boxes'"),
        ({"model": Empty()}, "shape of 'bed': TSDF holds no surface"),
        ({"model": "/nowhere.safetensors"}, "model is '/nowhere.safetensors', allowed: a loaded model; a file goes to"),
        ({"model": None, "weights": "/nowhere.safetensors"}, "/nowhere.safetensors"),
    ],
)
def test_bad_arguments_are_named(arguments, text):
    with pytest.raises(ValueError, match=text):
        echousd.generate(small_graph(), **{"model": StandIn(), **arguments})


def test_more_objects_than_a_room_may_hold_are_refused():
    crowd = SceneGraph("living_room", tuple(Node(f"chair_{i}", "dining_chair") for i in range(201)))
    with pytest.raises(ValueError, match="the graph: 201 objects, allowed in one room: 200"):
        echousd.generate(crowd, model=StandIn(), shapes="boxes", **BARE)


def test_what_is_locked_stays_where_the_last_generation_put_it(tmp_path: Path) -> None:
    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 4.0)), (Node("bed", "double_bed"), Node("wardrobe", "wardrobe")))
    first = echousd.generate(graph, seed=1, shapes="boxes", **BARE)
    first.save(tmp_path / "room", preview=False)
    locked = graph.lock("wardrobe").relate("bed", "left", "wardrobe")
    again = echousd.generate(locked, seed=9, shapes="boxes", earlier=tmp_path / "room", **BARE)
    for field in ("size", "position", "yaw"):
        assert np.allclose(getattr(again.boxes, field)[1], getattr(first.boxes, field)[1], atol=2e-3)
    stage = tmp_path / "room" / "room.usda"
    text = echousd.read_graph(str(stage)).lock("wardrobe")
    assert with_locked_places(text, stage)[0].node("wardrobe").position is not None
    homeless = echousd.generate(locked, seed=9, shapes="boxes", **BARE)
    assert "wardrobe is locked but stands nowhere yet: it gets a place like all others" in homeless.notes
    assert with_locked_places(locked.update_node("wardrobe", position=(0.5, 0.0, 0.5)))[1] == ()


def test_what_is_locked_keeps_its_shape_and_so_does_its_twin(tmp_path: Path) -> None:
    nodes = (Node("bed", "double_bed", locked=True), Node("wardrobe", "wardrobe"))
    nodes += tuple(
        Node(f"stand_{side}", "nightstand", style="pair", locked=side == "left") for side in ("left", "right")
    )
    graph = SceneGraph(RoomSpec("bedroom", size=(4.2, 4.2)), nodes, (Relation("stand_left", "left", "stand_right"),))
    first = echousd.generate(graph, seed=1, **BARE)
    root = first.save(tmp_path / "room", preview=False)

    files = {name: f"assets/{asset}/{asset}_geo.usdc" for name, asset in first.assets.items()}
    made = {name: (root.parent / file).read_bytes() for name, file in files.items()}

    def kept(**options: object) -> list[str]:
        room = echousd.generate(graph, seed=9, earlier=root.parent, **options, **BARE)
        assert room.assets == first.assets
        folder = room.save(tmp_path / "again", preview=False).parent
        return [name for name, file in files.items() if (folder / file).read_bytes() == made[name]]

    assert kept() == ["bed", "stand_left", "stand_right"]
    assert kept(faces=2000) == []


def test_where_every_box_is_given_none_is_drawn() -> None:
    class Silent(StandIn):
        def sample_layout(self, graph, **kwargs):
            raise AssertionError("asked for boxes")

    given = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", **BARE).boxes
    room = echousd.generate(small_graph(), model=Silent(), boxes=given, shapes="boxes", **BARE)
    assert np.array_equal(room.boxes.position, given.position)
    assert np.array_equal(room.boxes.size, given.size)
    with pytest.raises(ValueError, match=r"boxes: found 3, allowed: size, position and yaw of n boxes"):
        echousd.generate(small_graph(), boxes=3)


def test_what_cannot_fit_is_said_or_left_out() -> None:
    nodes = tuple(Node(f"wardrobe_{i}", "wardrobe", size=(1.4, 2.0, 0.5)) for i in range(8))
    nodes += (Node("bed", "double_bed", size=(1.8, 1.0, 2.1)),)
    graph = SceneGraph(RoomSpec("bedroom", size=(2.6, 2.9)), nodes)
    with pytest.raises(ValueError, match="too small for its furniture"):
        echousd.generate(graph, model=StandIn(), shapes="boxes", **BARE)
    room = echousd.generate(graph, model=StandIn(), shapes="boxes", fit="drop", drafts=1, **BARE)
    assert not room.faults
    assert "bed" in room.names
    gone = sorted(set(graph.names) - set(room.names))
    assert gone
    said = sorted(note.split(":")[1].split(",")[0].strip() for note in room.notes if note.startswith("left out"))
    assert said == gone
    with pytest.raises(ValueError, match="fit is 'squeeze', allowed: keep or drop"):
        echousd.generate(graph, model=StandIn(), shapes="boxes", fit="squeeze", **BARE)


def test_stated_sizes_that_no_such_furniture_has_are_kept_and_said():
    nodes = (Node("bed", "double_bed", size=(0.18, 0.9, 2.0)), Node("wardrobe", "wardrobe", size=(0.9, 2.0, 0.6)))
    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 4.0)), nodes, ())
    room = echousd.generate(graph, model=StandIn(), shapes="boxes", **BARE)
    assert room.boxes.size[0].tolist() == pytest.approx([0.18, 0.9, 2.0])
    assert room.notes == ("bed is 0.18 m wide as stated; such furniture: 1.32 to 3.28 m",)


def test_python_and_the_command_make_the_same_room(tmp_path, echousd_command, monkeypatch):
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "told/room", "--shapes", "boxes")
    assert done.code in (0, 1), done.err
    echousd.generate(tmp_path / "graph.usda", shapes="boxes").save(tmp_path / "called/room")
    told, called = (
        {
            str(file.relative_to(tmp_path / way)): file.read_bytes()
            for file in (tmp_path / way).rglob("*")
            if file.is_file()
        }
        for way in ("told", "called")
    )
    assert {"room/layers/dressing.usda", "room/room.usda"} <= set(told)
    assert [path for path in sorted(told.keys() | called.keys()) if told.get(path) != called.get(path)] == []


def test_a_lock_of_the_last_generation_stays(tmp_path):
    """A source that says nothing of a place does not undo what an edit or an update has locked there."""
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    root = room.save(tmp_path / "room", preview=False)
    locked = room.graph.update_node("wardrobe", locked=True, position=(-1.2, 0.0, 0.5), yaw=0.5)
    echousd.edit(root, locked, model=StandIn(), place=False).save(root.parent, preview=False)
    again = echousd.generate(small_graph(), seed=4, model=StandIn(), shapes="boxes", place=False, earlier=root.parent)
    assert again.graph.node("wardrobe").locked
    assert again.boxes.position[again.names.index("wardrobe")].tolist() == pytest.approx([-1.2, 0.0, 0.5], abs=1e-3)
    assert any(note.startswith("wardrobe stays locked as in the room that is there") for note in again.notes)
    edited = echousd.edit(root, locked.remove_node("lamp"), model=StandIn(), place=False)
    edited.save(root.parent, preview=False)
    for graph, told in ((small_graph(), True), (edited.graph, False)):
        notes = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, earlier=root.parent).notes
        assert any(note.startswith("what 2 edits made of the room that is there goes") for note in notes) == told
    bare = small_graph().with_room(size=None)
    again = echousd.generate(bare, seed=4, model=StandIn(), shapes="boxes", place=False, earlier=root.parent)
    assert again.graph.room == room.graph.room
    assert again.graph.room.openings
    moved = small_graph().update_node("wardrobe", position=(1.0, 0.0, 1.0))
    again = echousd.generate(moved, model=StandIn(), shapes="boxes", place=False, earlier=root.parent)
    assert not again.graph.node("wardrobe").locked


def test_windows_are_proposed_beside_a_stated_door():
    door = Opening("door", "door", 3, 0.3, 0.9, 2.0, 0.0)
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(door,)))
    room = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False)
    assert room.graph.room.openings[0] == door
    assert {opening.kind for opening in room.graph.room.openings[1:]} == {"window"}
    again = echousd.generate(room.graph, model=StandIn(), shapes="boxes", place=False)
    assert again.graph.room.openings == room.graph.room.openings


def their_stage(file, metres, axis, *paths):
    """A stage of somebody else's with a graph at each path."""
    layer = Sdf.Layer.CreateNew(str(file))
    for path in paths:
        echousd.write_graph(small_graph(), layer, path)
        for above in Sdf.Path(path).GetParentPath().GetPrefixes():
            layer.GetPrimAtPath(above).specifier = Sdf.SpecifierDef
    for key, value in (("metersPerUnit", metres), ("upAxis", axis)):
        layer.pseudoRoot.ClearInfo(key)
        if value is not None:
            layer.pseudoRoot.SetInfo(key, value)
    layer.Save()
    return file


@pytest.mark.parametrize(
    ("metres", "axis", "path", "said"),
    [
        (1.0, "Y", "/Room", ""),
        (None, None, "/Room", ""),
        (0.01, "Y", "/Room", "meters_per_unit 0.01, the room 1.0"),
        (1.0, "Z", "/Room", "up_axis 'Z', the room 'Y'"),
        (1.0, "Y", "/World/Flat/Living", "room_path '/World/Flat/Living', the room '/Room'"),
        (1.0, "Z", "/家/寝室", "up_axis 'Z', the room 'Y'; room_path '/家/寝室', the room '/Room'"),
    ],
)
def test_a_room_says_which_conventions_of_its_stage_it_does_not_keep(tmp_path, metres, axis, path, said):
    file = their_stage(tmp_path / "flat.usda", metres, axis, path)
    made = {"model": StandIn(), "shapes": "boxes", "place": False, **BARE}
    room = echousd.generate(file, **made)
    found = [note for note in room.notes if note.startswith("flat.usda")]
    assert found == ([f"flat.usda has {said} (like=flat.usda keeps them)"] if said else [])
    kept = echousd.generate(file, like=file, **made)
    assert not [note for note in kept.notes if note.startswith("flat.usda")]
    stage = kept.stage
    assert UsdGeom.GetStageMetersPerUnit(stage) == (metres or 1.0)
    assert UsdGeom.GetStageUpAxis(stage) == (axis or "Y")
    assert [*echousd.read_rooms(stage)] == [path]


def test_options_that_are_stated_are_not_those_of_the_other_stage(tmp_path):
    options = echousd.RoomOptions(like=their_stage(tmp_path / "a.usda", 0.01, "Z", "/World/Living"), room_path="/Flat")
    assert (options.meters_per_unit, options.up_axis, options.room_path, options.like) == (0.01, "Z", "/Flat", None)
    two = their_stage(tmp_path / "two.usda", 0.01, "Z", "/World/Living", "/World/Study")
    theirs = their_stage(tmp_path / "ie.usda", 0.01, "Z", "/家/寝室")
    assert echousd.RoomOptions(like=theirs).room_path == "/家/寝室"
    with pytest.raises(ValueError, match=r"two.usda: 2 rooms, name one \(room_path\): /World/Living, /World/Study"):
        echousd.RoomOptions(like=two)
    assert echousd.RoomOptions(like=two, room_path="/World/Study").meters_per_unit == 0.01
    for word in ("World", "/World/", "//Room", "/a-b", "/2nd"):
        with pytest.raises(
            ValueError, match=f"room_path is '{word}', allowed: a path of names of letters, digits and _"
        ):
            echousd.RoomOptions(room_path=word)


def test_lamps_that_are_told_to_be_near_something_low_hang_on_longer_cords():
    nodes = (Node("table", "dining_table"), Node("stool", "stool"), Node("lamp", "pendant_lamp"))
    spec = RoomSpec("dining_room", size=(4, 4), height=3.0)
    graph = SceneGraph(spec, nodes, (Relation("lamp", "close_by", "stool"),))
    size = np.array([(1.4, 0.75, 0.9), (0.4, 0.5, 0.4), (0.4, 0.6, 0.4)], np.float32)
    drawn = Boxes(size, np.array([(0, 0, 0), (0, 0, 1), (0, 2.4, 0)], np.float32), np.zeros(3, np.float32))

    def lamp(graph):
        (boxes, _), _ = layouts.finished_boxes(graph, drawn, True, StageTimer())
        return boxes.position[2, 1], boxes.size[2, 1]

    low, long = lamp(graph)
    assert low < 2.0
    assert low + long == pytest.approx(3.0, abs=1e-3)
    stated = graph.update_node("lamp", size=(0.4, 0.6, 0.4))
    assert lamp(stated)[1] == pytest.approx(0.6)


FIRM, LATE, NONE = (
    (1, set()),
    (1, {"door_free", "leaf_aside", "way_in", "window_free"}),
    (0, set()),
)  # windows, and terms that yield


def searches(monkeypatch, faults, *, poses=100, **options):
    """Windows, yielding terms and times anew of each search, where they leave so many faults."""
    graph = small_graph()
    window = Opening("window", "window", 1, 1.0, 0.9, 1.2, 0.9)
    graph = graph.replaced(room=graph.room.replaced(size=(4.0, 3.4), floor_polygon=None, openings=(window,)))
    asked = []

    def finished(graph, boxes, place, timer, config, begun):
        before = begun.setdefault(b"size", len(asked))  # the number of the search that it goes on from
        asked.append((len(graph.room.openings), config.yields, config.anew, before))
        return (boxes, ()), poses

    monkeypatch.setattr(layouts, "POSES", 8_000)
    monkeypatch.setattr(layouts, "finished_boxes", finished)
    monkeypatch.setattr(layouts, "_wishes", lambda *_: (faults[len(asked) - 1],))
    layouts.LayoutSearch(StandIn(), 1, StageTimer(), **options).best(graph)
    return asked


@pytest.mark.parametrize(
    ("proposed", "faults", "tried"),
    [
        (True, [0], [LATE]),
        (True, [3, 2, 1, 0], [LATE, NONE, NONE, LATE]),  # for every other draft, and as it was begun
        (True, [2, 3, 1, 1], [LATE, NONE, LATE, NONE]),
        (False, [3, 2, 1, 1], [FIRM, FIRM, FIRM, FIRM]),  # openings that somebody stated do not make way
    ],
)
def test_openings_that_nobody_stated_make_way_for_furniture(monkeypatch, proposed, faults, tried):
    asked = searches(monkeypatch, faults, drafts=2, proposed=proposed)
    assert [search[:2] for search in asked] == tried


@pytest.mark.parametrize(
    ("poses", "faults", "anew"),
    [
        (100, [0], [0]),
        (100, [3, 2, 0], [0, 0, 0]),
        (100, [3, 2, 4, 1, 0], [0, 0, 0, 2, 2]),  # all drafts in passing, then the best in earnest
        (100, [3, 2, 4, 3, 3, 3], [0, 0, 0, 2, 2, 2]),
        (3500, [3, 2, 1], [0, 2]),  # of 8000 three eighths go to drafts in passing
        (2500, [3, 2, 1, 1], [0, 0, 2, 2]),
        (2900, [3, 2, 1, 1], [0, 0, 2]),
    ],
)
def test_a_room_has_so_many_poses_for_all_its_searches(monkeypatch, poses, faults, anew):
    asked = searches(monkeypatch, faults, poses=poses, drafts=3)
    assert [search[2] for search in asked] == anew


def test_a_hall_that_holds_too_little_wishes_for_no_other_draft():
    graph = SceneGraph(RoomSpec("living_room", size=(8.0, 6.5)), (Node("plant", "plant"),))
    boxes = Boxes(*(np.array(of, np.float32) for of in ([(0.4, 1.0, 0.4)], [(0.0, 0.0, 0.0)], [0.0])))
    faults = {fault.rule for fault in living_faults(graph, boxes)}
    assert "floor_filled" in faults
    wishes = layouts._wishes(graph, (boxes, ()), None)
    rest = [fault for fault in living_faults(graph, boxes) if fault.rule != "floor_filled"]
    assert wishes == (0, 0, round(severity(rest), 2))


def test_drafts_that_end_alike_are_searched_once_in_earnest(monkeypatch):
    asked = searches(monkeypatch, [3, 2, 3, 2, 3, 3, *[1] * 8], drafts=8)
    assert [search[2:] for search in asked] == [*((0, number) for number in range(6)), (2, 1), (2, 0)]
    asked = searches(monkeypatch, [1] * 16, drafts=8)
    assert [search[2] for search in asked] == [0, 0, 0, 0, 2]


def test_a_search_in_earnest_goes_on_from_the_one_in_passing(monkeypatch):
    asked = searches(monkeypatch, [3, 2, 4, 1, 1, 1], drafts=3)
    assert [search[3] for search in asked] == [0, 1, 2, 1, 0, 2]
