"""Rooms of a told style: furniture, colours, walls, doors and windows keep to it; told later, it reshapes in place."""

import numpy as np
import pytest

import echousd
from echomodel.vocabulary import vocabulary
from echousd.layers.structure import covered_walls, millwork
from echousd.shapes.looks import palette_of_room

DECO = vocabulary().style("Art Deco")


@pytest.fixture(scope="module")
def room():
    graph = echousd.SceneGraph(
        "bedroom",
        (
            echousd.Node("bed", "double_bed"), echousd.Node("stand", "nightstand"), echousd.Node("chest", "dresser"),
            echousd.Node("seat", "armchair", style="industrial"),
        ),
        (echousd.Relation("stand", "left", "bed"),),
    )  # fmt: skip
    return echousd.generate(graph, seed=3, drafts=1, dress="none")


def same(one, other):
    return one.vertices.shape == other.vertices.shape and np.allclose(one.bounds, other.bounds, atol=2e-3)


def test_a_style_told_of_the_room_reshapes_its_furniture_in_place(room, tmp_path):
    root = room.save(tmp_path / "bedroom", preview=False)
    wished = room.graph.lock("stand")
    after = echousd.edit(root, wished.replaced(room=wished.room.replaced(style="Art Deco")))
    np.testing.assert_allclose(after.boxes.position, room.boxes.position, atol=0.02)
    np.testing.assert_allclose(after.boxes.size, room.boxes.size, atol=1e-3)
    alike = {name: same(room.meshes[name], after.meshes[name]) for name in room.names}
    assert alike == {"bed": False, "stand": True, "chest": False, "seat": True}  # locked; of a style of its own
    again = echousd.edit(after.save(root.parent, preview=False), after.graph)
    assert all(same(after.meshes[name], again.meshes[name]) for name in room.names)


def test_all_of_a_room_keeps_to_its_style(room):
    spec = room.graph.room.replaced(style="art_deco")
    told = echousd.generate(room.graph.replaced(room=spec), seed=3, drafts=1, dress="none")
    assert millwork(told).cornice == 0.09
    assert {millwork(told).window} <= set(DECO.windows)
    assert set(covered_walls(told).values()) <= set(DECO.covers)
    assert {palette_of_room(seed, "art_deco") for seed in range(30)} == set(DECO.palettes)
    assert not all(same(told.meshes[name], room.meshes[name]) for name in room.names)
