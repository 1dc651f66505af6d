"""The shell: walls with holes where the openings are, solid and watertight, parts that a host can tell apart."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from pxr import Usd, UsdGeom, UsdPhysics
from small_room import StandIn, small_graph

import echousd
from echomodel.openings import Opening, rectangle
from echousd.graph import RoomSpec
from echousd.room.room import RoomOptions
from echousd.room.walls import WALL, ceiling, outline, walls

NOTCHED = np.array([(0, 0), (1, 0), (1, 1), (4, 1), (4, 3), (0, 3)], float)
DOOR = Opening("door", "door", 2, 0.4, 0.9, 2.0, hinge="right")
WINDOW = Opening("window", "window", 0, 0.8, 1.4, 1.3, 0.9)
PASSAGE = Opening("way", "passage", 2, 2.0, 1.0, 2.1)


def pieces(parts) -> dict:
    return {p.name: p.mesh for part in parts for one in (part, *part.inner) for p in one.pieces}


@pytest.mark.parametrize("polygon", [rectangle(4.0, 3.0), rectangle(4.0, 3.0)[::-1].copy(), NOTCHED])
def test_walls_fill_the_ring_around_the_floor_but_for_the_openings(polygon) -> None:
    openings = (DOOR, WINDOW, PASSAGE) if len(polygon) == 4 else (DOOR,)
    made = pieces(walls(polygon, 2.6, openings))
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in made.values())
    solid = sum(made[f"Wall_{edge + 1}_mesh"].volume for edge in range(len(polygon)))
    ring = shapely.Polygon(outline(polygon)).area - shapely.Polygon(polygon).area
    assert solid == pytest.approx(ring * 2.7 - WALL * sum(o.width * o.height for o in openings), rel=1e-6)


def test_parts_of_openings_stand_in_their_holes() -> None:
    made = pieces(walls(rectangle(4.0, 3.0), 2.6, (DOOR, WINDOW, PASSAGE)))
    leaf, glass = made["Wall_3_door_leaf"].bounds, made["Wall_1_window_glass"].bounds
    np.testing.assert_allclose(leaf[:, 0], [2.0 - 1.3, 2.0 - 0.4], atol=0.04)  # wall 2 runs from +x to -x
    assert leaf[0, 2] > 1.49
    assert leaf[1, 2] < 1.5 + WALL
    np.testing.assert_allclose(glass[:, 1], [0.9, 2.2], atol=0.03)
    assert -1.5 - WALL < glass[0, 2] < glass[1, 2] < -1.5
    assert "Wall_3_way_frame" in made
    assert "Wall_3_way_leaf" not in made
    skirting = made["Wall_3_skirting"]
    middle_of_door = np.array([[2.0 - 0.85, 0.04, 1.495]])
    assert not skirting.contains(middle_of_door)[0]
    assert skirting.contains([[1.9, 0.04, 1.495]])[0]


def test_the_handle_is_away_from_the_hinges() -> None:
    for hinge, side in (("left", 1), ("right", -1)):  # facing -z from inside, -x is on the left
        door = Opening("door", "door", 0, 1.0, 0.9, 2.0, hinge=hinge)
        handle = pieces(walls(rectangle(4.0, 3.0), 2.6, (door,)))["Wall_1_door_handle"].bounds.mean(0)
        assert side * (handle[0] - (-2.0 + 1.45)) > 0.15


def test_ceiling_lies_on_the_walls() -> None:
    slab = ceiling(NOTCHED, 2.6).pieces[0].mesh
    assert slab.bounds[0, 1] == pytest.approx(2.6)
    assert slab.volume == pytest.approx(shapely.Polygon(NOTCHED).area * 0.1)


def test_prims_of_the_shell(tmp_path) -> None:
    spec = RoomSpec("bedroom", size=(4.0, 3.4), openings=(DOOR, WINDOW))
    graph = small_graph().replaced(room=spec)
    options = RoomOptions(walls=True, ceiling=True)
    room = echousd.generate(graph, model=StandIn(), repair=False, shapes="boxes", options=options)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    shell = stage.GetPrimAtPath("/Room/Shell")
    pieces = [prim for prim in shell.GetChildren() if prim.IsA(UsdGeom.Xformable)]
    names = [prim.GetName() for prim in pieces]
    assert names == ["Floor", "Wall_1", "Wall_2", "Wall_3", "Wall_4", "Ceiling"]
    label = "semantics:labels:category"
    door = stage.GetPrimAtPath("/Room/Shell/Wall_3/Wall_3_door")
    assert Usd.ModelAPI(door).GetKind() == "subcomponent"
    assert list(door.GetAttribute(label).Get()) == ["door"]
    assert list(stage.GetPrimAtPath("/Room/Shell/Wall_1/Wall_1_window").GetAttribute(label).Get()) == ["window"]
    assert all(Usd.ModelAPI(prim).GetKind() == "component" for prim in pieces)
    collides = {p.GetName() for p in Usd.PrimRange(shell) if p.HasAPI(UsdPhysics.CollisionAPI)}
    assert {"Floor_mesh", "Wall_1_mesh", "Wall_3_door_leaf", "Wall_1_window_glass", "Ceiling_mesh"} <= collides
    assert "Wall_1_skirting" not in collides
    for prim in Usd.PrimRange(shell):
        assert prim.GetTypeName() != "Mesh" or UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(), prim.GetPath()
