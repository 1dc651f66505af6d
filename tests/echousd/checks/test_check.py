"""`echousd check`: each broken file of `bad/` is caught by its rule alone; rooms in other frames measure the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Gf, Usd, UsdGeom
from trimesh.triangles import closest_point

import echousd
from echousd.checks import Collision, check
from echousd.checks.placement import (
    Carriers,
    Whole,
    _small_faults,
    find_collisions,
)
from echousd.checks.report import find_living
from echousd.cli.main import run
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.make.collisions import distances, mesh_depth, surface_points, winding_number
from echousd.place.geometry import SOLID, Floor
from echousd.stage.contents import RoomContents, RoomObject, Shape, Surrounding

BAD = Path(__file__).parent.parent / "bad"

# file -> everything that the check may find in it
FOUND = {
    "good": set(),
    "broken_relation": {"broken"},
    "collision": {"collision"},
    "outside": {"outside"},
    "floating": {"floating"},
    "sunk": {"sunk"},
    "dangling_edge": {"echo:EdgeTargets"},
    "contradiction": {"echo:ConsistentGraph"},
    "missing_uvs": {"echo:TextureCoordinates"},
    "short_uvs": {"echo:TextureCoordinates"},
    "uv_index_out_of_range": {"echo:TextureCoordinates"},
    "nested_bodies": {"echo:NestedBodies"},
    "dynamic_triangle_mesh": {"echo:DynamicColliders"},
    "zero_scale": {"echo:Scale"},
    "uneven_scale": {"echo:Scale"},
    "unknown_type": {"echo:KnownTypes"},
    "unknown_api": {"echo:KnownTypes"},
    "missing_semantics": {"echo:Semantics"},
    "material_outside": {"echo:MaterialsInside"},
    "absolute_path": {"echo:RelativePaths"},
    "path_outside": {"echo:PathsInside"},
    "not_finite": {"echo:FiniteValues"},
    "nan_mass": {"echo:FiniteValues"},
    "nan_points": {"echo:FiniteValues", "empty"},
    "wrong_type": {"echo:ValueTypes", "usdValidation:AttributeTypeMismatch.AttributeTypeMismatch"},
    "missing_op": {"echo:TransformOps"},
    "moving": {"echo:AtRest"},
    "missing_variant": {"echo:Variants"},
    "bad_index": {"echo:MeshIndices"},
    "long_normals": {"echo:Normals"},
    "against_normals": {"echo:Winding"},
    "inside_out": {"echo:Winding"},
    "wrong_extent": {"echo:Extents"},
    "mirrored": {"echo:Mirrored"},
    "upside_down": {"echo:Upright"},
    "two_labels": {"echo:OneLabel"},
    "other_label": {"echo:OneLabel"},
    "mislabelled_wall": {"echo:LabelsAgree", "echo:Strangers"},
    "stated_size": {"echo:StatedBoxes"},
    "stated_yaw": {"echo:StatedBoxes"},
    "no_floor": {"echo:Floor"},
    "no_collider": {"echo:Colliders"},
    "far_collider": {"echo:Colliders"},
    "gravity_up": {"echo:Gravity"},
    "other_units": {"echo:Units"},
    "corrupt_image": {"echo:Images"},
    "unloaded": set(),  # its payload is loaded here; the rule has a test of its own
}


def found_in(stage: Path | Usd.Stage) -> set[str]:
    report = check(stage)
    assert report.ok == (report.to_json()["ok"]) == (not found(report))
    return found(report) | {fault.rule for fault in report.warnings}


def found(report) -> set[str]:
    names = {fault.rule for fault in report.errors} | {wrong.problem for wrong in report.placement}
    return names | {"broken" for _ in report.broken} | {"collision" for _ in report.collisions}


def test_every_file_is_tried() -> None:
    assert {path.stem for path in BAD.glob("*.usda")} == set(FOUND)


@pytest.mark.parametrize("name", FOUND)
def test_each_broken_file_is_caught_by_its_rule_alone(name: str) -> None:
    assert found_in(BAD / f"{name}.usda") == FOUND[name]


def test_what_is_not_loaded_is_called_so() -> None:
    stage = Usd.Stage.Open(str(BAD / "unloaded.usda"), Usd.Stage.LoadNone)
    report = check(stage)
    assert [(fault.rule, fault.prim) for fault in report.errors] == [("echo:PayloadsLoaded", "/Room")]
    assert "not loaded" in report.errors[0].message


def test_messages_name_what_was_found_and_what_is_allowed() -> None:
    def message(name: str) -> str:
        (fault,) = check(BAD / f"{name}.usda").errors
        return f"{fault.prim} {fault.message}"

    assert message("short_uvs").endswith("primvars:st has 20 texture coordinates, faceVarying interpolation needs 24")
    assert message("zero_scale") == "/Room/Objects/wardrobe/handle scale is (1, 0, 1), allowed: above 0"
    assert "'wardrobe in nightstand'" in message("contradiction")
    assert "bound to </Looks/wood>" in message("material_outside")
    assert "'/home/artist/rooms/room.usda' is absolute" in message("absolute_path")
    assert "unknown prim type 'EchoSchmea'" in message("unknown_type")


def wrapped(up: str, metres: float, turn: bool, tmp_path: Path) -> Usd.Stage:
    """The good room as another program would hold it: below a world prim, in another unit, turned upright or not."""
    path = tmp_path / "wrapped.usda"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    world = UsdGeom.Xform.Define(stage, "/World").GetPrim()
    stage.SetDefaultPrim(world)
    room = UsdGeom.Xform.Define(stage, "/World/Room")
    room.GetPrim().GetReferences().AddReference(str(BAD / "good.usda"))
    room.AddTranslateOp().Set(Gf.Vec3d(3 / metres, 0, 0))
    if turn:
        room.AddRotateXOp().Set(90)
    room.AddScaleOp().Set(Gf.Vec3f(1 / metres))
    return stage


def test_absolute_paths_in_variants_are_told(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "kinds.usda"))
    world = UsdGeom.Xform.Define(stage, "/World").GetPrim()
    stage.SetDefaultPrim(world)
    kinds, named = world.GetVariantSets().AddVariantSet("kind"), [tmp_path / "one.usda", tmp_path / "other.usda"]
    for kind in named:
        part = Usd.Stage.CreateNew(str(kind))
        part.SetDefaultPrim(UsdGeom.Xform.Define(part, "/Part").GetPrim())
        part.Save()
        kinds.AddVariant(kind.stem)
        kinds.SetVariantSelection(kind.stem)
        with kinds.GetVariantEditContext():
            world.GetReferences().AddReference(str(kind))
    stage.Save()
    told = [fault for fault in check(tmp_path / "kinds.usda").errors if fault.rule == "echo:RelativePaths"]
    assert {str(fault.prim) for fault in told} == {"/World"}
    said = sorted(fault.message.partition("asset path ")[2] for fault in told)
    assert said == [f"'{kind}' is absolute, allowed: ./relative/path" for kind in named]


@pytest.mark.parametrize(("up", "metres", "turn"), [("Y", 0.01, False), ("Z", 1.0, True), ("Z", 0.01, True)])
def test_axes_units_and_place_do_not_matter(up: str, metres: float, turn: bool, tmp_path: Path) -> None:
    report = check(wrapped(up, metres, turn, tmp_path))
    assert {fault.rule for fault in report.errors} == {"echo:RelativePaths"}  # the test's own reference
    assert not report.placement
    assert not report.collisions
    plain = check(BAD / "good.usda")
    assert [j.margin for j in report.relations] == pytest.approx([j.margin for j in plain.relations], abs=1e-4)


def thing(name: str, category: str, mesh: trimesh.Trimesh, position: tuple[float, float, float]) -> RoomObject:
    points = np.array(mesh.vertices) + position
    low, high = points.min(0), points.max(0)
    middle = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return RoomObject(points, np.array(mesh.faces), high - low, middle, 0.0, Node(name, category))


def box(*extents: float) -> trimesh.Trimesh:
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation((0, extents[1] / 2, 0))
    return mesh


def table(x: float, y: float, z: float) -> trimesh.Trimesh:
    top = trimesh.creation.box((x, 0.04, z))
    top.apply_translation((0, y - 0.02, 0))
    legs = []
    for a in (-1, 1):
        for b in (-1, 1):
            leg = box(0.05, y - 0.04, 0.05)
            leg.apply_translation((a * (x / 2 - 0.03), 0, b * (z / 2 - 0.03)))
            legs.append(leg)
    return trimesh.util.concatenate([top, *legs])


def hits(*objects: RoomObject) -> tuple[Collision, ...]:
    return find_collisions(Whole(RoomContents("/Room", None, objects, (), ())))


def test_what_fits_between_the_legs_does_not_collide() -> None:
    desk, cabinet = thing("desk", "desk", table(1.6, 0.75, 0.8), (0, 0, 0)), box(0.5, 0.6, 0.5)
    assert not hits(desk, thing("box", "cabinet", cabinet, (0, 0, 0.1)))
    (hit,) = hits(desk, thing("box", "cabinet", cabinet, (0.6, 0, 0.2)))
    assert (hit.first, hit.second) == ("desk", "box")
    assert hit.depth > 0.02
    assert hit.to_json() == {"objects": ["desk", "box"], "depth": round(hit.depth, 4)}


def test_a_chair_stands_under_a_table_and_not_in_it() -> None:
    top, low = thing("table", "dining_table", table(1.6, 0.75, 0.9), (0, 0, 0)), box(0.5, 0.6, 0.5)
    assert not hits(top, thing("chair", "dining_chair", low, (0, 0, 0.45)))
    assert hits(top, thing("chair", "dining_chair", low, (0.6, 0, 0.3)))  # in a leg
    high = box(0.5, 0.9, 0.5)
    (hit,) = hits(top, thing("chair", "dining_chair", high, (0, 0, 0.6)))  # its back in the top
    assert {hit.first, hit.second} == {"table", "chair"}


def test_depth_of_two_boxes() -> None:
    first = thing("a", "cabinet", box(1, 1, 1), (0, 0, 0))
    second = thing("b", "cabinet", box(1, 1, 1), (0.8, 0, 0))
    assert mesh_depth(first, second, SOLID) == pytest.approx(0.2, abs=0.04)
    assert mesh_depth(first, thing("c", "cabinet", box(1, 1, 1), (1.001, 0, 0)), SOLID) == 0.0


def test_depth_of_boards_that_overlap_is_that_of_a_slow_look() -> None:
    rng, seen = np.random.default_rng(5), []
    for _ in range(60):
        boards = []
        for size, at in zip(rng.uniform(0.02, 0.5, (6, 3)) ** 1.5, rng.uniform(-0.2, 0.2, (6, 3)), strict=True):
            boards.append(trimesh.creation.box(size).apply_translation(at))
        boards[5].update_faces(np.arange(12) > 1)  # an open one
        one, other = (trimesh.util.concatenate(some) for some in (boards[:3], boards[3:]))
        first, second = thing("a", "cabinet", one, (0, 0, 0)), thing("b", "cabinet", other, (0, 0, 0))
        slow = 0.0
        for surface, solid in ((first, second), (second, first)):
            points = surface_points(surface, solid)
            within = points[winding_number(points, solid.triangles) > 0.5] if len(points) else points
            slow = max([slow, *(float(distances(point, solid.triangles).min()) for point in within)])
        depth = mesh_depth(first, second, 0.03)
        seen.append(slow > 0.03)
        assert depth == pytest.approx(slow, abs=1e-6) if seen[-1] else depth <= 0.03
    assert 5 < sum(seen) < 55


def test_large_faces_that_touch_by_millimetres_are_no_collision() -> None:
    """Depth is measured to the faces themselves, however far apart samples of them would lie."""
    wide = thing("a", "dining_table", box(3, 0.8, 3), (0, 0, 0))
    for reach, deep in ((0.003, False), (0.02, True)):
        tip = box(0.02, 0.5, 0.3)
        tip.apply_translation((1.51 - reach, 0, 0))
        assert (mesh_depth(wide, thing("b", "cabinet", tip, (0, 0, 0)), SOLID) > SOLID) == deep


def test_winding_number_agrees_with_ray_casting() -> None:
    mesh = trimesh.creation.annulus(0.2, 0.5, 0.4)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (300, 3))
    plain = np.hypot(points[:, 0], points[:, 1])
    inside = (plain > 0.2) & (plain < 0.5) & (np.abs(points[:, 2]) < 0.2)
    clear = np.abs(np.abs(points[:, 2]) - 0.2) > 0.02
    clear &= (np.abs(plain - 0.2) > 0.02) & (np.abs(plain - 0.5) > 0.02)
    number = winding_number(points, mesh.triangles)
    np.testing.assert_allclose(number[clear], inside[clear], atol=1e-3)


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(BAD / "good.usda")]) == 0
    assert "4 of 4 kept" in capsys.readouterr().out
    assert run(["check", str(BAD / "collision.usda")]) == 1
    assert "bed and wardrobe" in capsys.readouterr().out
    assert run(["check", str(BAD / "broken_relation.usda"), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert set(report) == {"ok", "relations", "collisions", "placement", "living", "usd"}
    assert report["relations"]["kept"] == 3
    assert report["relations"]["broken"][0]["predicate"] == "behind"
    assert report["usd"] == {"errors": [], "warnings": []}


def test_bad_input(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["check", str(tmp_path / "none.usda")]) == 2
    assert "none.usda" in capsys.readouterr().err
    assert run(["check", str(BAD / "good.usda"), "--rules", "loose"]) == 2
    assert "unknown rules 'loose': allowed are strict, sgfront" in capsys.readouterr().err
    empty = Usd.Stage.CreateNew(str(tmp_path / "empty.usda"))
    empty.SetDefaultPrim(UsdGeom.Xform.Define(empty, "/World").GetPrim())
    UsdGeom.SetStageUpAxis(empty, "Y")
    UsdGeom.SetStageMetersPerUnit(empty, 1)
    empty.Save()
    assert run(["check", str(tmp_path / "empty.usda")]) == 2
    assert "no room (no EchoSceneGraph prim), nothing to check" in capsys.readouterr().err


def test_relations_of_what_has_no_geometry_are_not_measured(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    graph = SceneGraph(RoomSpec("study", size=(3.0, 3.0)), (Node("desk", "desk"), Node("chair", "office_chair")))
    echousd.write_graph(graph.relate("chair", "close_by", "desk"), tmp_path / "asked.usda")
    with pytest.warns(UserWarning, match="^</Room>: no object has geometry yet; its graph alone is checked$"):
        assert run(["check", str(tmp_path / "asked.usda")]) == 0
    assert "0 of 0 kept, 1 not measured" in capsys.readouterr().out
    room = echousd.generate(graph.relate("chair", "close_by", "desk"), shapes="boxes", dress="none", preview=False)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "room")))
    stage.GetPrimAtPath("/Room/Objects/chair/geo").SetActive(False)
    report = check(stage)
    assert [(one.sentence, one.state) for one in report.relations] == [("chair close_by desk", "unmeasured")]
    assert [(one.object, one.problem) for one in report.placement] == [("chair", "empty")]


def test_living_rules_are_warnings_unless_strict(capsys: pytest.CaptureFixture[str]) -> None:
    contents = RoomContents(
        "/Room",
        RoomSpec("bedroom", size=(4.0, 4.0)),
        (
            thing("bed", "double_bed", box(1.8, 1.0, 2.1), (0.0, 0.0, -0.94)),
            thing("wardrobe", "wardrobe", box(1.6, 2.2, 0.6), (0.0, 0.0, 0.5)),
        ),
        (),
        (),
    )
    found = {(fault.object, fault.rule): fault for fault in find_living(contents)}
    assert found["wardrobe", "at_wall"].says == "wardrobe stands 2.20 m off the wall behind it"
    assert found["wardrobe", "at_wall"].to_json()["object"] == "wardrobe"
    report = check(BAD / "good.usda")
    assert run(["check", str(BAD / "good.usda"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["living"]) == len(report.living)
    assert run(["check", str(BAD / "good.usda"), "--strict"]) == int(bool(report.living))
    assert "living" in capsys.readouterr().out
    assert report.ok


def test_a_radiator_is_no_body_and_nobody_asks_for_one(tmp_path: Path) -> None:
    nodes = (Node("rack", "coat_rack"), Node("heating", "radiator"), Node("bench", "bench"))
    graph = SceneGraph(RoomSpec("hallway", size=(2.4, 3.4)), nodes, ())
    report = check(echousd.generate(graph, seed=0, progress=None).save(tmp_path / "hall", preview=False))
    assert (report.placement, report.errors) == ((), ())


@pytest.mark.parametrize(("deep", "told"), [(0.033, []), (0.08, ["floating"]), (-0.05, ["floating"])])
def test_what_lies_on_a_soft_seat_is_pressed_into_it(deep: float, told: list[str]) -> None:
    prim, none = Usd.Stage.CreateInMemory().DefinePrim("/cushion"), np.zeros((0, 3))
    cushion = Surrounding(
        prim, "cushion", Shape(none, none, np.array([0.4, 0.4, 0.2]), np.array([0, 0.45 - deep, 0]), 0.0)
    )
    floor = Floor(np.array([(-1.0, -2.0), (1.0, -2.0), (1.0, 2.0), (-1.0, 2.0)]))
    sofa = thing("sofa", "sofa", box(1.6, 0.45, 0.8), (0.0, 0.0, 0.0))
    found = _small_faults(cushion, floor, Carriers([sofa]), np.zeros((0, 2, 2)))
    assert [word for word, _ in found] == told


@pytest.mark.parametrize(("rack", "told"), [(1.9, []), (1.0, ["off its wall"]), (0.0, ["off its wall"])])
def test_coats_hang_from_a_rack_that_stands_off_its_wall(rack: float, told: list[str]) -> None:
    prim = Usd.Stage.CreateInMemory().DefinePrim("/coats")
    none = np.zeros((0, 3))
    shape = Shape(none, none, np.array([0.6, 1.0, 0.22]), np.array([-0.7, 0.5, 0.0]), np.pi / 2)
    coats = Surrounding(prim, "coats", shape)
    floor = Floor(np.array([(-1.0, -2.0), (1.0, -2.0), (1.0, 2.0), (-1.0, 2.0)]))
    carriers = [thing("rack", "coat_rack", box(0.4, rack, 1.0), (-0.7, 0.0, 0.0))] if rack else []
    found = _small_faults(coats, floor, Carriers(carriers), np.zeros((0, 2, 2)))
    assert [word for word, _ in found] == told


def test_distances_are_those_of_trimesh_and_of_the_edge_where_there_is_no_area():
    rng = np.random.default_rng(0)
    triangles, points = rng.normal(size=(40, 3, 3)), 2 * rng.normal(size=(200, 3))
    for point in points:
        near = closest_point(triangles, np.broadcast_to(point, (40, 3)))
        np.testing.assert_allclose(distances(point, triangles), np.linalg.norm(near - point, axis=1), atol=1e-12)
    flat = np.array([np.zeros((3, 3)), [[0, 0, 0], [1, 0, 0], [2, 0, 0]]])
    np.testing.assert_allclose(distances(np.array([0.5, 1.0, 0.0]), flat), [np.sqrt(1.25), 1.0])
