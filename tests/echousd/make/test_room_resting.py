"""Rooms are written as they come to rest, and what does not is named."""

import json
from dataclasses import replace

import numpy as np
import pytest
from small_room import StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echousd.make.resting import settled
from echousd.make.verdicts import RoomWarning
from echousd.options import RoomOptions

pytestmark = pytest.mark.skipif("not __import__('importlib.util').util.find_spec('mujoco')", reason="extra sim")


PLAIN = RoomOptions(shapes="boxes", place=False, walls=False, dress="none", preview=False)


class High(StandIn):
    """A model whose first object stands 2 cm above the floor."""

    def sample_layout(self, graph, **more):
        found = super().sample_layout(graph, **more)
        found.position[0, 1] += 0.02
        return found


def lifted(up_axis="Y", **by):
    room = echousd.generate(small_graph(), model=StandIn(), options=PLAIN, up_axis=up_axis)
    position = room.boxes.position.copy()
    for name, way in by.items():
        position[room.names.index(name)] += way
    boxes = Boxes(room.boxes.size, position, room.boxes.yaw)
    return replace(room, layouts=(boxes,))


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
def test_what_stands_too_high_is_put_where_it_rests(up_axis):
    room = lifted(up_axis, wardrobe=(0, 0.02, 0))
    found = settled(room)
    assert found.notes == (*room.notes, "wardrobe stands where it comes to rest")
    assert [outcome.restless for outcome in found.outcomes] == [()]
    row = room.names.index("wardrobe")
    assert found.boxes.position[row, 1] == pytest.approx(0.0, abs=1e-3)
    np.testing.assert_allclose(
        found.boxes.position[row],
        room.boxes.position[row] - np.array([0, 0.02, 0]),
        atol=3e-3,
    )
    np.testing.assert_allclose(found.boxes.yaw, room.boxes.yaw, atol=0.02)
    others = [i for i in range(len(room.names)) if i != row]
    assert found.boxes.position[others].tolist() == room.boxes.position[others].tolist()
    assert len(found.outcomes) == len(found.layouts) == 1


def test_a_room_that_rests_is_the_same_room():
    room = lifted()
    assert settled(room) is room


def test_what_is_locked_stays_and_is_named():
    room = lifted(wardrobe=(0, 0.02, 0))
    nodes = tuple(node.replaced(locked=node.name == "wardrobe") for node in room.graph.nodes)
    found = settled(replace(room, graph=room.graph.replaced(nodes=nodes)))
    assert found.notes == room.notes
    (told,) = found.outcomes[0].restless
    assert told.startswith("wardrobe does not rest: it ")
    assert found.faults[-1] == told
    assert found.outcomes[0].to_json()["restless"] == [told]


def test_python_takes_the_option_as_the_command_does():
    name = small_graph().names[0]
    asked = {"model": High(), "options": PLAIN}
    high, room = (echousd.generate(small_graph(), settle=settle, **asked) for settle in (False, True))
    assert room.notes == (*high.notes, f"{name} stands where it comes to rest")
    assert float((high.boxes.position - room.boxes.position)[0, 1]) == pytest.approx(0.02, abs=1e-3)
    assert room.timings["settle"] > 0
    assert "settle" not in high.timings


def test_python_warns_of_what_does_not_rest():
    graph = small_graph()
    name = graph.names[0]
    graph = graph.update_node(name, position=(0.0, 0.5, 0.0), yaw=0.0, locked=True)
    with pytest.warns(RoomWarning, match=f"{name} does not rest: it falls 0.5"):
        room = echousd.generate(graph, model=StandIn(), options=PLAIN, settle=True, layouts=2)
    assert [len(outcome.restless) for outcome in room.outcomes] == [1, 1]
    assert [fault for fault in room.faults if "rest" in fault][1].startswith(f"layout_1: {name} does not rest: it ")


def test_python_needs_the_extra_before_it_works(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ValueError, match="MuJoCo is not installed"):
        echousd.generate("no such file.yaml", settle=True)


def test_the_command_writes_poses_at_rest_and_names_what_falls(tmp_path, echousd_command, monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: High()))
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    name = small_graph().names[0]
    options = ("--shapes", "boxes", "--no-place", "--no-walls", "--dress", "none", "--settle")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", *options)
    assert f"note     {name} stands where it comes to rest" in done.out
    manifest = json.loads((tmp_path / "room" / "room.json").read_text())
    assert f"{name} stands where it comes to rest" in json.dumps(manifest)
    assert (
        echousd_command("check", tmp_path / "room" / "room.usda", "--settle", "--json").out.count('"restless": []') == 1
    )


def test_the_command_needs_the_extra_before_it_works(tmp_path, echousd_command, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "mujoco", None)
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", "--settle")
    assert done.code == 2
    assert "MuJoCo is not installed: pip install 'echousd[sim]'" in done.err
    assert not (tmp_path / "room").exists()
