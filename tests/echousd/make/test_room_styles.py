"""Rooms of a told style: furniture, colours, walls, doors and windows keep to it; told later, it reshapes in place."""

from dataclasses import replace

import numpy as np
import pytest

import echousd
from echomodel.boxes import Boxes
from echomodel.vocabulary import vocabulary
from echousd.draw.scenery import read_scenery, with_ceiling
from echousd.layers.structure import covered_walls, shell_prims
from echousd.shapes.looks import palette_of_room
from echousd.shapes.walls import millwork

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
    made = millwork(told.graph, 3)
    assert made.cornice == 0.09
    assert {made.window} <= set(DECO.windows)
    assert set(covered_walls(told).values()) <= set(DECO.covers)
    assert not any(one.label == "beam" for one in shell_prims(told))
    assert {palette_of_room(seed, "art_deco") for seed in range(30)} == set(DECO.palettes)
    assert not all(same(told.meshes[name], room.meshes[name]) for name in room.names)


def test_beams_lie_below_ceilings_of_country_rooms_and_are_drawn_below_them_alone():
    lamp = echousd.Node("lamp", "pendant_lamp", size=(0.5, 0.9, 0.5), position=(0.1, 1.7, 0.2), yaw=0.0)
    spec = echousd.RoomSpec("bedroom", size=(4.0, 3.4), style="country")
    made = [echousd.generate(echousd.SceneGraph(spec, (lamp,)), seed=seed, dress="none") for seed in range(4)]
    found = [[one for one in shell_prims(room) if one.label == "beam"] for room in made]
    assert {len(one) for one in found} == {0, 1}
    room, (beams,) = next((room, one) for room, one in zip(made, found, strict=True) if one)
    assert millwork(room.graph, room.provenance.seed).cornice == 0
    down = Boxes(room.boxes.size, room.boxes.position - np.array((0, 0.3, 0), np.float32), room.boxes.yaw)
    low = replace(room, graph=room.graph.with_room(height=2.4), layouts=(down,))
    assert not any(one.label == "beam" for one in shell_prims(low))
    corners = beams.meshes[0].form.points
    assert (corners[:, 1] > 2.4).all()
    assert not ((abs(corners[:, 0] - 0.1) < 0.25) & (abs(corners[:, 2] - 0.2) < 0.25)).any()
    scenery = read_scenery(room.stage)
    above = np.concatenate([part["triangles"] for part in scenery.above]).reshape(-1, 3)
    assert above[:, 1].min() == corners[:, 1].min()
    assert len(with_ceiling(scenery).triangles) == len(scenery.triangles) + len(above) // 3 + 2
