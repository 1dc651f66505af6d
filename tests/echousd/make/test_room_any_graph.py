"""Any graph becomes a room or one sentence: without relations, with one object, with everything fixed or locked."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st
from small_room import BARE

import echousd
from echomodel.vocabulary import vocabulary
from echousd.graph import GraphError, Node, RoomSpec, SceneGraph
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
