"""Any graph becomes a room or one sentence: without relations, with one object, with everything fixed or locked."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st
from small_room import BARE

import echousd
from echomodel.boxes2d import footprints
from echomodel.vocabulary import vocabulary
from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
from echousd.make.reading import read_room
from echousd.make.verdicts import RoomWarning

WORDS = st.sampled_from([row.name for row in vocabulary().categories])
SIDE = st.floats(0.1, 2.0).map(lambda value: round(value, 3))
AT = st.floats(-3.0, 3.0).map(lambda value: round(value, 3))


@st.composite
def plain_graphs(draw):
    fixed, locked = draw(st.sampled_from([(False, False), (True, False), (True, True), (False, True)]))
    nodes = []
    for number in range(draw(st.integers(1, 4))):
        box = {}
        if fixed:
            box = {"size": draw(st.tuples(SIDE, SIDE, SIDE)), "position": (draw(AT), 0.0, draw(AT)), "yaw": draw(AT)}
        nodes.append(Node(f"thing_{number}", draw(WORDS), locked=locked, **box))
    floor = draw(st.sampled_from([{}, {"size": (5.0, 4.0)}]))
    return SceneGraph(RoomSpec(draw(st.sampled_from(["bedroom", "study"])), **floor), tuple(nodes), ())


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(plain_graphs(), st.integers(0, 100))
def test_graphs_without_relations_become_rooms(graph, seed):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RoomWarning)
        try:
            room = echousd.generate(graph, seed=seed, shapes="boxes", drafts=1, **BARE)
        except GraphError:  # the floor is too small for it, which is said in one line
            reject()
    assert room.names == graph.names
    for row, node in enumerate(graph.nodes):
        if node.position is not None:
            assert room.boxes.position[row].tolist() == pytest.approx(node.position, abs=1e-4)
            assert room.boxes.size[row].tolist() == pytest.approx(node.size, abs=1e-4)
    assert np.isfinite(np.asarray(room.boxes.position)).all()


@pytest.mark.parametrize("seed", [0, 1])
def test_what_cannot_be_kept_drives_nothing_out_of_the_room(seed):
    """Tall lamps above one another and furniture above furniture in a room of 2.4 m: broken, told, and within it."""
    graph = SceneGraph(
        RoomSpec("bedroom", size=(3.0, 3.2), height=2.4),
        (
            Node("bed", "double_bed"), Node("stand", "nightstand"),
            *(Node(f"lamp_{n}", "pendant_lamp", size=(0.4, 1.4, 0.4)) for n in (1, 2)),
        ),
        tuple(
            Relation(one, "above", other)
            for one, other in (("lamp_1", "lamp_2"), ("stand", "bed"), ("lamp_2", "stand"))
        ),
    )  # fmt: skip
    with pytest.warns(RoomWarning, match="is broken"):
        room = echousd.generate(graph, seed=seed, shapes="boxes", drafts=1, **BARE)
    low, size = np.asarray(room.boxes.position, float), np.asarray(room.boxes.size, float)
    assert low[:, 1].min() > -1e-3
    assert (low[:, 1] + size[:, 1]).max() < 2.4 + 1e-3
    corners = footprints(size, low, np.asarray(room.boxes.yaw, float))
    assert (np.abs(corners).max((0, 1)) < np.array([1.5, 1.6]) + 0.01).all()


def test_boxes_are_as_their_meshes_fill_them(tmp_path):
    words = ("plant", "floor_lamp", "lazy_sofa", "pendant_lamp", "double_bed")
    told = (Relation("plant", "close_by", "lazy_sofa"), Relation("floor_lamp", "left", "double_bed"))
    graph = SceneGraph(RoomSpec("bedroom", size=(4.4, 4.2)), tuple(Node(word, word) for word in words), told)
    room = echousd.generate(graph, seed=3, drafts=1, dress="none")
    extents = [np.ptp(room.geometry[name].mesh.bounds, axis=0) for name in room.names]
    np.testing.assert_allclose(room.boxes.size, extents, atol=1e-4)
    root = room.save(tmp_path / "room", preview=False)
    np.testing.assert_allclose(read_room(root).boxes.size, room.boxes.size, atol=1e-4)
    seen = [verdict.margin for verdict in echousd.check(root).layouts[0].relations]
    np.testing.assert_allclose(seen, [verdict.margin for verdict in room.verdicts], atol=2e-4)
