"""The shell: walls with holes where the openings are, solid and watertight, parts that a host can tell apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
from pxr import Usd, UsdGeom, UsdPhysics, UsdValidation
from small_room import StandIn, small_graph

import echousd
from echomodel.openings import Opening, hinge_point, inward_normal, rectangle, segment, swing_area
from echousd.checks import check
from echousd.checks.mesh_rules import extents
from echousd.checks.reading import Reading
from echousd.graph import RoomSpec
from echousd.options import RoomOptions
from echousd.shapes.bays import beams
from echousd.shapes.fittings import DADO, DOORS, NICHE, RAIL, WINDOWS, Millwork, millwork_of, window_frame
from echousd.shapes.walls import WALL, outline, slab, walls

NOTCHED = np.array([(0, 0), (1, 0), (1, 1), (4, 1), (4, 3), (0, 3)], float)
DOOR = Opening("door", "door", 2, 0.4, 0.9, 2.0, hinge="right")
WINDOW = Opening("window", "window", 0, 0.8, 1.4, 1.3, 0.9)
PASSAGE = Opening("way", "passage", 2, 2.0, 1.0, 2.1)


def pieces(parts) -> dict:
    return {piece.name: piece.mesh.trimesh for part in parts for piece in part.pieces} | (
        pieces([one for part in parts for one in part.inner]) if parts else {}
    )


@pytest.mark.parametrize("polygon", [rectangle(4.0, 3.0), rectangle(4.0, 3.0)[::-1].copy(), NOTCHED])
def test_walls_fill_the_ring_around_the_floor_but_for_the_openings(polygon) -> None:
    openings = (DOOR, WINDOW, PASSAGE) if len(polygon) == 4 else (DOOR,)
    made = pieces(walls(polygon, 2.6, openings))
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in made.values())
    solid = sum(made[f"Wall_{edge + 1}_mesh"].volume for edge in range(len(polygon)))
    ring = shapely.Polygon(outline(polygon)).area - shapely.Polygon(polygon).area
    assert solid == pytest.approx(ring * 2.7 - WALL * sum(o.width * o.height for o in openings), rel=1e-6)


def test_a_dado_is_the_foot_of_all_walls_below_a_rail_that_leaves_openings_free() -> None:
    niche, floor = Opening("niche", "window", 1, 1.0, 0.6, 0.7, 0.85), rectangle(4.0, 3.0)
    openings, dado = (DOOR, WINDOW, PASSAGE), Millwork(dado="boarding")
    parts = walls(floor, 2.6, openings, millwork=dado, cuts=[niche])
    plain, made = pieces(walls(floor, 2.6, openings, cuts=[niche])), pieces(parts)
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in made.values())
    for wall in ("Wall_1", "Wall_2", "Wall_3", "Wall_4"):
        low, high = made[f"{wall}_dado"], made[f"{wall}_mesh"]
        assert low.volume + high.volume == pytest.approx(plain[f"{wall}_mesh"].volume, rel=1e-6)
        assert low.bounds[1, 1] == high.bounds[0, 1] == made[f"{wall}_dado_rail"].bounds[1, 1] == DADO[1]
    looks = {piece.name: piece.look for part in parts for piece in part.pieces}
    assert {look for name, look in looks.items() if name.endswith("dado")} == {"boarding"}
    rail = made["Wall_3_dado_rail"]
    assert rail.contains([[1.9, 0.93, 1.495]])[0]
    assert not rail.contains([[2.0 - 0.85, 0.93, 1.495]])[0]  # the door
    assert not made["Wall_2_dado_rail"].contains([[1.995, 0.93, -1.5 + 1.3]])[0]  # the niche


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


@pytest.mark.parametrize("polygon", [rectangle(4.0, 3.0), rectangle(4.0, 3.0)[::-1].copy()], ids=["right", "left"])
@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("door", DOORS)
def test_millwork_of_every_kind_is_closed_and_stays_in_its_holes(polygon, window, door) -> None:
    made = pieces(walls(polygon, 2.6, (DOOR, WINDOW), millwork=Millwork(window, door, 0.1, 0.09)))
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in made.values())
    frame, glass = made["Wall_1_window_frame"], made["Wall_1_window_glass"]
    np.testing.assert_allclose(np.ptp(frame.bounds, axis=0)[:2], (WINDOW.width, WINDOW.height), atol=1e-6)
    share = frame.volume / 0.06 / (WINDOW.width * WINDOW.height)
    assert 0.1 < share < 0.45
    plain = pieces(walls(polygon, 2.6, (DOOR, WINDOW)))["Wall_1_window_frame"]
    assert frame.volume == plain.volume if window == "plain" else frame.volume > 1.02 * plain.volume
    assert glass.volume > 0
    assert ("Wall_3_door_pane" in made) == (door == "glazed")
    leaf = made["Wall_3_door_leaf"]
    assert leaf.bounds[1, 1] < DOOR.height
    assert np.ptp(leaf.bounds, axis=0)[2] < 0.06
    corner = made["Wall_1_cornice"].bounds
    assert corner[1, 1] == pytest.approx(2.6)
    assert np.ptp(corner, axis=0) == pytest.approx((4.0, 0.09, 0.072))
    switch, handle = made["Wall_3_door_switch"].bounds.mean(0), made["Wall_3_door_handle"].bounds.mean(0)
    hinge = leaf.bounds.mean(0) * 2 - handle
    assert abs(switch[0] - handle[0]) < abs(switch[0] - hinge[0])


def test_rooms_of_other_seeds_have_other_millwork_and_private_ones_no_glass_in_their_doors() -> None:
    drawn = [millwork_of(seed) for seed in range(60)]
    assert {one.window for one in drawn} == {*WINDOWS}
    assert {one.door for one in drawn} == {*DOORS}
    assert "glazed" not in {millwork_of(seed, private=True).door for seed in range(60)}
    assert millwork_of(3) == millwork_of(3)
    assert {work.boxed for work in drawn} == {work.bay for work in drawn} == {False, True}
    assert not any(work.beams and work.cornice for work in drawn)
    assert {millwork_of(seed, "country").beams for seed in range(60)} == {"", "beam"}
    assert not any(work.bay or work.beams for work in (millwork_of(seed, "modern") for seed in range(60)))
    assert not any(millwork_of(seed, "industrial").boxed for seed in range(60))


def test_ceiling_lies_on_the_walls() -> None:
    made = slab("Ceiling", NOTCHED, 2.6).pieces[0].mesh.trimesh
    assert made.bounds[0, 1] == pytest.approx(2.6)
    assert made.volume == pytest.approx(shapely.Polygon(NOTCHED).area * 0.1)


def test_prims_of_the_shell(tmp_path) -> None:
    spec = RoomSpec("bedroom", size=(4.0, 3.4), openings=(DOOR, WINDOW))
    graph = small_graph().replaced(room=spec)
    options = RoomOptions(walls=True, ceiling=True, dress="none")
    room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", options=options)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    shell = stage.GetPrimAtPath("/Room/Shell")
    pieces = [prim for prim in shell.GetChildren() if prim.IsA(UsdGeom.Xformable)]
    names = [prim.GetName() for prim in pieces]
    assert names == ["Floor", "Wall_1", "Wall_2", "Wall_3", "Wall_4", "Ceiling"]
    label = "semantics:labels:category"
    door = stage.GetPrimAtPath("/Room/Shell/Wall_3/Wall_3_door")
    assert Usd.ModelAPI(door).GetKind() == "subcomponent"
    assert all(Usd.ModelAPI(part).GetKind() == "" for part in door.GetChildren())  # a subcomponent has none below it
    assert list(door.GetAttribute(label).Get()) == ["door"]
    assert list(stage.GetPrimAtPath("/Room/Shell/Wall_1/Wall_1_window").GetAttribute(label).Get()) == ["window"]
    assert all(Usd.ModelAPI(prim).GetKind() == "component" for prim in pieces)
    collides = {p.GetName() for p in Usd.PrimRange(shell) if p.HasAPI(UsdPhysics.CollisionAPI)}
    assert {"Floor_mesh", "Wall_1_mesh", "Wall_3_door_leaf", "Wall_1_window_glass", "Ceiling_mesh"} <= collides
    assert "Wall_1_skirting" not in collides
    for prim in Usd.PrimRange(shell):
        assert prim.GetTypeName() != "Mesh" or UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(), prim.GetPath()


@pytest.mark.parametrize("swing", ["in", "out"])
@pytest.mark.parametrize("hinge", ["left", "right"])
@pytest.mark.parametrize("turn", [1, -1])
def test_a_leaf_opens_about_its_hinge_to_the_side_that_it_should(swing, hinge, turn) -> None:
    plan = rectangle(4.0, 3.0)[::turn].copy()
    door = Opening("door", "door", 2, 0.4, 0.9, 2.0, hinge=hinge, swing=swing)
    wall = walls(plan, 2.6, (door,))[2]
    (leaf,) = wall.inner[0].inner
    mesh = next(piece.mesh for piece in leaf.pieces if piece.name.endswith("leaf")).trimesh
    jamb, closed = hinge_point(plan, door)
    assert np.linalg.norm(np.array(leaf.joint.anchor)[[0, 2]] - jamb) < 0.04 + (WALL if swing == "out" else 0)
    axis = np.array(leaf.joint.axis)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(leaf.joint.reach, axis, leaf.joint.anchor))
    off = (mesh.vertices[:, [0, 2]] - jamb) @ inward_normal(plan, 2)  # metres into the room
    along = (mesh.vertices[:, [0, 2]] - jamb) @ closed
    assert np.abs(along).max() < 0.09  # open, it stands beside its jamb
    if swing == "in":
        assert off.max() > 0.8
        assert shapely.Polygon(swing_area(plan, door)).buffer(0.05).covers(shapely.MultiPoint(mesh.vertices[:, [0, 2]]))
    else:
        assert off.min() < -0.8 - WALL


@pytest.mark.parametrize("kind", DOORS)
@pytest.mark.parametrize(("turn", "hinge"), [(1, "left"), (1, "right"), (-1, "left")])
def test_a_leaf_slides_before_the_wall_and_sets_its_door_free(kind, turn, hinge) -> None:
    plan = rectangle(4.0, 3.0)[::turn].copy()
    door = Opening("door", "door", 2, 1.4, 0.9, 2.0, hinge=hinge, swing="slide")
    made = walls(plan, 2.6, (door,), millwork=Millwork(door=kind))[2].inner[0]
    (leaf,), (jamb, closed), inside = made.inner, hinge_point(plan, door), inward_normal(plan, 2)
    assert leaf.joint.kind == "prismatic"
    moved = np.array(leaf.joint.axis) * leaf.joint.reach
    hole = shapely.box(*(jamb + 0.01 * closed), *(jamb + 0.89 * closed + 0.01 * inside))
    for mesh in (piece.mesh.trimesh for piece in leaf.pieces):
        assert mesh.is_watertight
        off = (mesh.vertices[:, [0, 2]] - jamb) @ inside
        assert 0.012 < off.min() < off.max() < 0.09  # before the casing
    corners = leaf.pieces[0].mesh.vertices
    assert shapely.MultiPoint(corners[:, [0, 2]]).envelope.buffer(0.1).covers(hole)
    along = (corners + moved)[:, [0, 2]] @ closed - jamb @ closed
    assert along.max() < 0.04
    assert shapely.Polygon(plan).covers(shapely.MultiPoint((corners + moved)[:, [0, 2]]))
    track = next(piece.mesh for piece in made.pieces if piece.name.endswith("track"))
    assert np.ptp(track.vertices, axis=0).max() == pytest.approx(2 * 0.9 + 0.06, abs=0.01)


@pytest.mark.parametrize(("offset", "reach"), [(1.5, 0.9), (0.5, 0.47), (0.03, 0.01), (0.0, 0.01)])
def test_a_leaf_slides_no_further_than_its_wall(offset, reach) -> None:
    door = Opening("door", "door", 2, offset, 0.9, 2.0, hinge="left", swing="slide")
    joint = walls(rectangle(4.0, 3.0), 2.6, (door,))[2].inner[0].inner[0].joint
    assert (joint.kind, joint.axis[0]) == ("prismatic", 1.0)  # towards the first corner, at +x
    assert joint.reach == pytest.approx(reach)


@pytest.mark.parametrize(
    "polygon", [rectangle(4.6, 3.0), rectangle(3.0, 4.6), NOTCHED], ids=["wide", "deep", "notched"]
)
def test_beams_lie_from_wall_to_wall_below_the_ceiling_but_for_what_hangs_there(polygon) -> None:
    middle = shapely.Point(polygon.mean(0)).buffer(0.3)
    free, hung = (beams(polygon, 2.6, below) for below in (shapely.Polygon(), middle))
    room = shapely.Polygon(polygon)
    for bars, below in ((free, shapely.Polygon()), (hung, middle)):
        for one in (bar.trimesh for bar in bars):
            assert one.is_watertight
            np.testing.assert_allclose(one.bounds[:, 1], [2.45, 2.6])
            plan = shapely.MultiPoint(one.vertices[:, [0, 2]]).envelope
            assert room.buffer(1e-6).covers(plan)
            assert plan.boundary.intersection(room.boundary).length == pytest.approx(2 * 0.13)
            assert not plan.intersects(below)
    assert beams(polygon, 2.6, room) == []


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("window", WINDOWS)
def test_the_widest_window_stands_out_before_its_wall_on_three_sides(turn, window) -> None:
    plan, other = rectangle(4.0, 3.0)[::turn].copy(), Opening("small", "window", 2, 0.8, 1.2, 1.3, 0.9)
    made = pieces(walls(plan, 2.6, (WINDOW, other), millwork=Millwork(window, bay=True)))
    flat = pieces(walls(plan, 2.6, (WINDOW, other), millwork=Millwork(window)))
    assert all(mesh.is_watertight and mesh.volume > 0 for mesh in made.values())
    inside, (near, far) = inward_normal(plan, 0), segment(plan, WINDOW)
    panes = [made[f"Wall_1_window_glass{number}"] for number in ("", 1, 2)]
    offs = [(pane.vertices[:, [0, 2]] - near) @ -inside for pane in panes]
    assert min(off.min() for off in offs) > WALL - 0.06
    assert offs[1].min() == pytest.approx(offs[1].max(), abs=0.01)
    assert offs[1].max() > WALL + 0.4
    along = [(pane.vertices[:, [0, 2]] - near) @ (far - near) / WINDOW.width for pane in panes]
    assert min(a.min() for a in along) < 0.06
    assert max(a.max() for a in along) > WINDOW.width - 0.06
    assert ("Wall_3_small_glass1" in made, "Wall_3_small_body" in made) == (False, False)
    for name in ("Wall_1_mesh", "Wall_3_small_frame"):
        np.testing.assert_array_equal(made[name].vertices, flat[name].vertices)
    assert (made["Wall_1_window_body"].vertices[:, [0, 2]] - near) @ -inside == pytest.approx(WALL, abs=0.6)


def test_french_windows_have_a_foot_and_a_handle_and_no_board_or_bay() -> None:
    french = replace(WINDOW, sill=0.0, height=2.2)
    made, usual = (
        pieces(walls(rectangle(4.0, 3.0), 2.6, (one,), millwork=Millwork(bay=True))) for one in (french, WINDOW)
    )
    assert "Wall_1_window_sill" in usual
    assert "Wall_1_window_sill" not in made
    assert "Wall_1_window_body" not in made
    frame = made["Wall_1_window_frame"]
    assert frame.bounds[0, 1] == 0.0
    assert window_frame(french).vertices[:, 2].min() < window_frame(WINDOW).vertices[:, 2].min() - 0.02  # a handle
    assert not (np.abs(frame.vertices[:, 1] - 0.055) < 1e-6).any()


def test_no_window_stands_out_that_is_narrow_or_before_another_wall_or_outdoors() -> None:
    def bays(polygon, window, **how):
        made = pieces(walls(polygon, 2.6, (window,), millwork=Millwork(bay=True), **how))
        return sum("glass" in name for name in made) == 3

    plan, wide = rectangle(4.0, 3.0), Opening("window", "window", 2, 0.8, 1.4, 1.3, 0.9)
    assert bays(plan, wide)
    assert not bays(plan, replace(wide, width=1.2))
    assert not bays(plan, wide, outdoor=True)
    cut = np.array([(0, 0), (2, 0), (2, 1.2), (4, 1.2), (4, 4), (0, 4)], float)  # wall 1 and 2 meet in the inner corner
    assert not bays(cut, replace(wide, edge=2, offset=0.1))
    assert bays(cut, replace(wide, edge=2, offset=0.6, width=1.3))


def test_walls_are_cut_where_something_is_sunk_into_them_and_closed_behind() -> None:
    niche = Opening("niche", "window", 1, 0.8, 0.7, 0.9, 0.9)
    plan = rectangle(4.0, 3.0)
    whole, cut = (pieces(walls(plan, 2.6, (DOOR, WINDOW), cuts=cuts)) for cuts in ((), (niche,)))
    assert whole["Wall_2_mesh"].volume - cut["Wall_2_mesh"].volume == pytest.approx(0.7 * 0.9 * NICHE)
    assert cut["Wall_2_mesh"].is_watertight
    assert 0 < WALL - NICHE < 0.05
    middle = segment(plan, niche).mean(0)
    outward = -inward_normal(plan, 1)
    held = [(*(middle + off * outward), 1.3) for off in (0.01, NICHE - 0.01, NICHE + 0.01, WALL - 0.01)]
    assert cut["Wall_2_mesh"].contains([(x, y, z) for x, z, y in held]).tolist() == [False, False, True, True]
    for name in set(whole) - {"Wall_2_mesh"}:
        np.testing.assert_array_equal(whole[name].vertices, cut[name].vertices)


def test_doors_articulate(tmp_path) -> None:
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(DOOR, WINDOW)))
    for up in ("Y", "Z"):
        options = RoomOptions(up_axis=up, walls=True, dress="none")
        room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", options=options)
        stage = Usd.Stage.Open(str(room.save(tmp_path / up, preview=False)))
        door = stage.GetPrimAtPath("/Room/Shell/Wall_3/Wall_3_door")
        leaf = stage.GetPrimAtPath(f"{door.GetPath()}/Wall_3_door_hinge")
        assert not leaf.HasAPI(UsdPhysics.RigidBodyAPI)
        cache = UsdGeom.BBoxCache(0, ["default"])
        still = cache.ComputeWorldBound(leaf).ComputeAlignedRange()
        door.GetVariantSets().SetSelection("articulation", "articulated")
        assert leaf.HasAPI(UsdPhysics.RigidBodyAPI)
        assert 5 < UsdPhysics.MassAPI(leaf).GetMassAttr().Get() < 40
        joint = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(f"{leaf.GetPath()}_joint"))
        assert joint.GetBody1Rel().GetTargets() == [leaf.GetPath()]
        assert (joint.GetLowerLimitAttr().Get(), joint.GetUpperLimitAttr().Get()) == (0, pytest.approx(90))
        poses = [
            np.array(UsdGeom.Xformable(stage.GetPrimAtPath(body.GetTargets()[0])).ComputeLocalToWorldTransform(0)).T
            @ [*place.Get(), 1]
            for body, place in (
                (joint.GetBody0Rel(), joint.GetLocalPos0Attr()), (joint.GetBody1Rel(), joint.GetLocalPos1Attr()),
            )
        ]  # fmt: skip
        np.testing.assert_allclose(*poses, atol=1e-5)
        assert cache.ComputeWorldBound(leaf).ComputeAlignedRange() == still  # the choice moves nothing
        if up == "Z":
            continue
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        assert [e.GetMessage() for e in UsdValidation.ValidationContext(validators).Validate(stage)] == []
        assert check(tmp_path / up / f"{up}.usda").ok
        for state in ("articulated", "static"):  # opened, it is as good
            door.GetVariantSets().SetSelection("articulation", state)
            leaf.GetAttribute("xformOp:rotateY").Set(90.0)
            assert [one.message for one in extents(Reading(stage))] == []


def test_outdoors_walls_without_an_opening_are_parapets():
    plan = np.array([(-2.0, -1.5), (2.0, -1.5), (2.0, 1.5), (-2.0, 1.5)])
    door = Opening("door", "door", 2, 0.3, 0.9, 2.0)
    for outdoor, heights in ((False, [2.6] * 4), (True, [1.05, 1.05, 2.6, 1.05])):
        made = walls(plan, 2.6, (door,), outdoor=outdoor)
        assert [round(float(part.pieces[0].mesh.bounds[1, 1]), 3) for part in made] == heights


def test_boards_hide_the_rail_and_the_heads_of_what_hangs_there() -> None:
    rod, boards = (
        pieces(walls(rectangle(4.0, 3.0), 2.6, (WINDOW,), millwork=Millwork(boxed=boxed)))["Wall_1_window_rail"]
        for boxed in (False, True)
    )
    assert boards.is_watertight
    above, before, _ = RAIL
    assert boards.bounds[0, 1] < WINDOW.sill + WINDOW.height + above - 0.05 < boards.bounds[1, 1] < 2.6
    assert boards.bounds[0, 0] < rod.bounds[0, 0] < rod.bounds[1, 0] < boards.bounds[1, 0]
    wall = boards.bounds[0, 2]
    assert boards.bounds[1, 2] > wall + before + 0.045 + 0.01  # curtains are 9 cm deep at most
    assert boards.volume < 0.02
