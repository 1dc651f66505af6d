"""GraphBatch: lossless packing and the text of its errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from echomodel.arrays import cast, kit
from echomodel.graph import GraphBatch, shifted
from echomodel.roomboxes import RoomBoxes
from echomodel.surroundings import trimmed


@st.composite
def graphs(draw: st.DrawFn) -> GraphBatch:
    nodes = draw(st.integers(1, 6))
    ends = st.tuples(st.integers(0, nodes - 1), st.integers(0, 15), st.integers(0, nodes - 1))
    triplets = draw(st.lists(ends.filter(lambda t: t[0] != t[2]), max_size=8)) if nodes > 1 else []
    corner = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 3.0), (2.0, 2.0), (0.0, 2.0))
    floor = draw(st.one_of(st.none(), st.just((4.0, 3.0)), st.just(corner)))
    categories = draw(st.lists(st.integers(0, 45), min_size=nodes, max_size=nodes))
    places = draw(st.lists(st.tuples(st.integers(0, nodes - 1), st.just(0), st.just(-1), st.just(-1)), max_size=3))
    if nodes > 2:
        places += draw(st.lists(st.just((nodes - 1, 2, 0, 1)), max_size=1))
    return GraphBatch.single(categories, triplets, room_type=draw(st.integers(0, 4)), floor=floor, placements=places)


def equal(a: GraphBatch, b: GraphBatch) -> bool:
    fields = ("category", "triplets", "scene", "room_type", "placements")
    same = all(torch.equal(getattr(a, k), getattr(b, k)) for k in fields)
    return same and torch.equal(a.floor.nan_to_num(-1), b.floor.nan_to_num(-1))


def unpacked(packed: GraphBatch) -> list[GraphBatch]:
    """One graph per scene, the inverse of `GraphBatch.pack`."""
    owner, placed = packed.scene[packed.triplets[:, 0]], packed.scene[packed.placements[:, 0]]
    out, start = [], 0
    for number, count in enumerate(packed.node_counts.tolist()):
        nodes, room = slice(start, start + count), slice(number, number + 1)
        triplets = packed.triplets[owner == number] - cast([start, 0, start], packed.triplets)
        graph = GraphBatch(
            packed.category[nodes], triplets, packed.scene[nodes] * 0, packed.room_type[room],
            trimmed(packed.floor[room]), there(packed.openings[room]),
            shifted(packed.placements[placed == number], -start), packed.height[room],
        )  # fmt: skip
        out.append(graph)
        start += count
    return out


def there(rows):
    """The rows (1, O, ROW) of one scene without padding."""
    return rows[:, : int(kit(rows).isfinite(rows[0, :, 0]).sum())]


@settings(max_examples=60)
@given(st.lists(graphs(), min_size=1, max_size=5))
def test_pack_unpack_is_lossless(singles: list[GraphBatch]) -> None:
    packed = GraphBatch.pack(singles)
    packed.check()
    assert packed.num_scenes == len(singles)
    assert packed.node_counts.tolist() == [g.num_nodes for g in singles]
    assert all(equal(a, b) for a, b in zip(unpacked(packed), singles, strict=True))
    assert equal(GraphBatch.pack(unpacked(packed)), packed)


def test_pack_of_packed_graphs() -> None:
    one = GraphBatch.single([1, 2], [[0, 1, 1]])
    bare = GraphBatch.single([3, 4, 5], [[2, 5, 0]])
    packed = GraphBatch.pack([GraphBatch.pack([one, bare]), bare])
    assert packed.triplets.tolist() == [[0, 1, 1], [4, 5, 2], [7, 5, 5]]
    assert packed.scene.tolist() == [0, 0, 1, 1, 1, 2, 2, 2]


def test_room_becomes_a_graph() -> None:
    room = RoomBoxes(
        id="r", room_type="living", floor_polygon=np.array([[0, 0], [5, 0], [5, 3], [0, 3.0]]), height=2.6,
        categories=("sofa_3", "bookcase"), size=np.ones((2, 3)), position=np.zeros((2, 3)), yaw=np.zeros(2),
        relations=np.array([[0, 1, 1]]),
    )  # fmt: skip
    with pytest.raises(ValueError, match="unknown category 'sofa_3x'"):
        RoomBoxes(**{**room.__dict__, "categories": ("sofa_3x", "bookcase")}).graph()
    room = RoomBoxes(**{**room.__dict__, "categories": ("couch", "bookcase")})
    graph = room.graph()
    assert graph.floor.tolist() == [[[-2.5, -1.5], [2.5, -1.5], [2.5, 1.5], [-2.5, 1.5]]]
    assert graph.room_type.tolist() == [1]
    assert graph.triplets.tolist() == [[0, 1, 1]]
    assert room.graph(triplets=[]).triplets.shape == (0, 3)


@pytest.mark.parametrize(
    ("graph", "text"),
    [
        (GraphBatch.single([]), "graph has no nodes"),
        (GraphBatch.single([73]), r"category of node 0 is 73, allowed: 0\.\.72"),
        (GraphBatch.single([1, 2], [[0, 20, 1]]), r"predicate of triplet 0 is 20, allowed: 0\.\.19"),
        (GraphBatch.single([1, 2], [[0, 1, 2]]), r"object of triplet 0 is 2, allowed: 0\.\.1"),
        (GraphBatch.single([1, 2], [[1, 1, 1]]), r"triplet 0 \[1, 1, 1\] relates a node to itself"),
        (GraphBatch.single([1], room_type=40), "room type of scene 0 is 40"),
        (GraphBatch.single([1], floor=(0.0, 2.0)), r"floor of scene 0 spans \[0.0, 2.0\] m and encloses no area"),
        (GraphBatch.single([1], floor=(2.0, np.inf)), r"floor of scene 0 has corners .* expected 3 or more, then NaN"),
        (GraphBatch.single([1], floor=((0, 0), (1, np.nan), (1, 1))), "floor of scene 0 has corners .* then NaN"),
        (GraphBatch.single([1], floor=((0, 0), (1, 1), (3, 3))), "floor of scene 0 spans .* and encloses no area"),
        (
            replace(GraphBatch.single([1], floor=(2, 2)), floor=torch.tensor([[[0.0, 0], [2, 0], [2, 2], [0, 2]]])),
            r"floor of scene 0 has its middle at \[1.0, 1.0\] m, expected \[0.0, 0.0\]",
        ),
        (
            GraphBatch.pack([GraphBatch.single([1]), GraphBatch.single([1])]).with_triplets(torch.tensor([[0, 1, 1]])),
            "crosses scenes",
        ),
    ],
)
def test_bad_values_are_named(graph: GraphBatch, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        graph.check()


def test_bad_shapes_are_named() -> None:
    one = torch.ones(1).long()
    with pytest.raises(ValueError, match=r"GraphBatch.scene is \(2,\) torch.int64, expected \(1,\)"):
        GraphBatch(one, torch.zeros(0, 3).long(), torch.zeros(2).long(), one, torch.ones(1, 4, 2))
    with pytest.raises(ValueError, match=r"GraphBatch.floor is \(1, 2\) torch.float32, expected \(1, 4, 2\)"):
        GraphBatch(one, torch.zeros(0, 3).long(), torch.zeros(1).long(), one, torch.ones(1, 2))
    with pytest.raises(ValueError, match=r"floor has shape \(3,\), expected \(2,\) extents or \(k, 2\) corners"):
        GraphBatch.single([1], floor=(1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="at least one graph"):
        GraphBatch.pack([])
