"""Homes on disk: rooms in their places, doors once, one palette; a room is made anew and the others stay."""

import json
import shutil
import threading
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
from homes import QUICK, inline
from pxr import Sdf, Usd, UsdGeom

import echousd
from echomodel.openings import KINDS
from echousd.batches.plan import room_digest
from echousd.folder.found import room_at
from echousd.folder.lock import locked
from echousd.folder.manifest import find_manifest
from echousd.home.check import check_home
from echousd.home.existing import plan_there
from echousd.home.files import load_home
from echousd.home.plan import plan_home
from echousd.home.stages import furniture
from echousd.make.reading import read_room
from echousd.place.living import living_faults

FLAT = """home: {area: 34}
rooms:
  living: {type: living_room, objects: {sofa: sofa, table: coffee_table}}
  bedroom: {type: bedroom, objects: {bed: double_bed}}
relations: [living door bedroom]
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder that the first test makes a home in."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture
def made(kept, tmp_path, monkeypatch, echousd_command):
    """A copy of the home, and what its making told."""
    inline(monkeypatch)
    if not (kept / "told").exists():
        (kept / "flat.yaml").write_text(FLAT)
        done = echousd_command("generate", kept / "flat.yaml", "-o", kept / "out", *QUICK, "--json")
        assert done.code == 0, done.err
        (kept / "told").write_text(done.out)
    shutil.copy(kept / "flat.yaml", tmp_path)
    shutil.copytree(kept / "out", tmp_path / "out")
    return tmp_path / "out", json.loads((kept / "told").read_text().replace(str(kept), str(tmp_path)))


def test_a_home_has_one_writer_at_a_time(made, tmp_path, echousd_command):
    out, entered, leave = made[0], threading.Event(), threading.Event()

    def hold():
        with locked(out):
            entered.set()
            leave.wait()

    holder = threading.Thread(target=hold)
    holder.start()
    entered.wait()
    before = digests(out)
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", out, *QUICK, "--seed", "9", "--force")
    leave.set()
    holder.join()
    assert done.code == 2
    assert "is writing it; try later, or wait for it (--wait)" in done.err
    assert digests(out) == before
    assert echousd_command("generate", tmp_path / "flat.yaml", "-o", out, *QUICK, "--wait").code == 0


def digests(folder):
    return {path.name: room_digest(path) for path in (folder / "rooms").iterdir()}


def test_a_home_is_whole(made, echousd_command, tmp_path):
    folder, told = made
    assert told["written"] == [str(folder / "home.usda")]
    assert {name: row["objects"] for name, row in told["rooms"].items()} == {"living": 2, "bedroom": 1}
    stage = Usd.Stage.Open(str(folder / "home.usda"))
    assert stage.GetCompositionErrors() == []
    assert list(echousd.read_rooms(stage)) == ["/House/Rooms/living", "/House/Rooms/bedroom"]
    assert stage.GetPrimAtPath("/House/Rooms/living").HasPayload()
    lights = [prim for prim in stage.Traverse() if prim.GetTypeName() == "DomeLight"]
    assert len(lights) == 1
    leaves = [
        prim for prim in stage.Traverse() if prim.GetTypeName() == "Mesh" and prim.GetName().endswith("door_leaf")
    ]
    assert len(leaves) == 2  # the front door, and the one between the rooms
    palettes = {find_manifest(folder / "rooms" / name)["palette"] for name in ("living", "bedroom")}
    assert len(palettes) == 1
    done = echousd_command("check", folder)
    assert done.code == 0, done.out + done.err
    assert "ok  plan   1 of 1 relations of rooms kept" in done.out
    assert "ok  ways   2 of 2 rooms reached from the entrance" in done.out
    assert "ok  room   bedroom" in done.out
    done = echousd_command("check", folder, "--json")
    assert json.loads(done.out)["reached"]["bedroom"] > 0.5
    assert echousd_command("render", folder, "-o", tmp_path / "top.png", "--view", "top", "--size", "32").code == 0


def test_windows_go_where_furniture_leaves_the_walls_free_and_told_ones_stay(tmp_path, monkeypatch):
    inline(monkeypatch)
    (tmp_path / "flat.yaml").write_text(FLAT.replace("bed: double_bed", "bed: double_bed, tv: tv_stand, w: wardrobe"))
    plan = plan_home(load_home(tmp_path / "flat.yaml"))
    assert plan.lit == {"living", "bedroom"}
    options = {"shapes": "boxes", "dress": "none", "preview": False}

    def made(plan, folder):
        root = echousd.generate_home(plan, tmp_path / folder, workers=1, **options).root
        there = plan_there(root)
        assert not check_home(root).faults
        for name, own in there.openings.items():
            assert [one.kind for one in own].count("window") >= 1, name
            assert own == read_room(root.parent / "rooms" / name / f"{name}.usda").graph.room.openings
        return there

    def holes(plan, kinds):
        return {name: [o for o in own if o.kind in kinds] for name, own in plan.openings.items()}

    free, told = made(plan, "free"), made(replace(plan, lit=frozenset()), "told")
    assert holes(told, KINDS) == holes(plan, KINDS)
    assert holes(free, ("door", "passage")) == holes(plan, ("door", "passage"))
    for name in plan.lit:
        found = living_faults(free.graph(name), read_room(tmp_path / "free" / "rooms" / name / f"{name}.usda").boxes)
        assert not [fault for fault in found if fault.rule == "window_free"]
    again = echousd.generate_home(free.home, tmp_path / "free", workers=1, **options)
    assert set(again.rooms.values()) == {None}  # nothing is made anew


def test_floors_meet_in_the_doorway(made):
    stage = Usd.Stage.Open(str(made[0] / "home.usda"))
    cache = UsdGeom.BBoxCache(0, ["default"])

    def box(path):
        return cache.ComputeWorldBound(stage.GetPrimAtPath(path)).ComputeAlignedRange()

    (threshold,) = (p for p in stage.GetPrimAtPath("/House/Plan").GetChildren() if p.GetTypeName() == "Xform")
    between = box(threshold.GetPath())
    floors = [box(f"/House/Rooms/{name}/Shell/Floor") for name in ("living", "bedroom")]
    assert all(abs(between.GetMax()[1] - floor.GetMax()[1]) < 1e-6 for floor in floors)
    gaps = [
        max(max(between.GetMin()[i] - f.GetMax()[i], f.GetMin()[i] - between.GetMax()[i]) for i in (0, 2))
        for f in floors
    ]
    assert gaps == pytest.approx([0, 0], abs=2e-3)


def test_rooms_stand_in_their_places_in_another_unit_and_with_z_up(made, tmp_path, echousd_command):
    written = ("--meters-per-unit", "0.01", "--up-axis", "Z")
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", tmp_path / "other", *QUICK, *written)
    assert done.code == 0, done.err
    places = []
    for folder in (made[0], tmp_path / "other"):
        stage = Usd.Stage.Open(str(folder / "home.usda"))
        cache = UsdGeom.BBoxCache(0, ["default"])
        for name in ("living", "bedroom"):
            found = cache.ComputeWorldBound(stage.GetPrimAtPath(f"/House/Rooms/{name}")).ComputeAlignedRange()
            places.append(np.array([found.GetMin(), found.GetMax()]) * UsdGeom.GetStageMetersPerUnit(stage))
    for ours, other in zip(places[:2], places[2:], strict=True):
        turned = np.sort(np.stack([other[:, 0], other[:, 2], -other[:, 1]], 1), axis=0)
        np.testing.assert_allclose(turned, ours, atol=1e-4)
    done = echousd_command("check", tmp_path / "other")
    assert done.code == 0, done.out + done.err
    assert "ok  walls  0 faults where rooms meet" in done.out


def test_a_room_that_changes_leaves_the_others_as_they_are(made, tmp_path, echousd_command):
    folder, _ = made
    before = digests(folder)
    (tmp_path / "flat.yaml").write_text(FLAT.replace("bed: double_bed", "bed: single_bed"))
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", folder, *QUICK)
    assert done.code == 0, done.err
    assert "kept     living" in done.out
    after = digests(folder)
    assert after["living"] == before["living"]
    assert after["bedroom"] != before["bedroom"]


def test_somebody_elses_file_stays(tmp_path, echousd_command):
    (tmp_path / "flat.yaml").write_text(FLAT)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "home.usda").write_text("#usda 1.0\n")
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", tmp_path / "out", *QUICK)
    assert done.code == 2
    assert "out: holds home.usda and no home of echousd; choose another folder or use --force" in done.err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["home.usda"]
    (tmp_path / "out" / "home.usda").rename(tmp_path / "out" / "mine.usda")
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", tmp_path / "out", *QUICK)
    assert "out: holds mine.usda and no home of echousd; choose another folder or use --force" in done.err


def test_a_damaged_home_is_replaced_when_told_so(made, tmp_path, echousd_command):
    root = made[0] / "home.usda"
    root.write_bytes(root.read_bytes()[:-20])
    command = ("generate", tmp_path / "flat.yaml", "-o", made[0], *QUICK)
    done = echousd_command(*command, "--force")
    assert done.code == 0, done.err
    assert echousd_command("check", made[0]).code == 0
    root.write_text("#usda 1.0\ndef {")
    done = echousd_command(*command)
    assert done.code == 2
    assert "out: holds home.usda, plan.usda and no home of echousd; choose another folder or use" in done.err


@pytest.mark.parametrize("words", [("plan", "-o", "{tmp}/flat.png"), ("generate", "-o", "{tmp}/flat")])
def test_what_cannot_be_planned_is_told_with_its_file(tmp_path, echousd_command, words):
    rooms = "{bed: {type: bedroom, area: 40}, bath: {type: bathroom, area: 30}}"
    (tmp_path / "small.yaml").write_text(f"home: {{area: 50}}\nrooms: {rooms}\nrelations: [bed door bath]\n")
    command, *rest = (word.format(tmp=tmp_path) for word in words)
    done = echousd_command(command, tmp_path / "small.yaml", *rest)
    assert done.code == 2
    assert "small.yaml: the rooms need 70 m² at least (bed 40, bath 30), the home has 50 m²" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["small.yaml"]


def test_a_room_that_cannot_be_made_is_named(tmp_path, monkeypatch, echousd_command):
    inline(monkeypatch)
    text = FLAT.replace("bed: double_bed", "bed: {category: double_bed, size: [9, 1, 9], position: [0, 0, 0]}")
    (tmp_path / "flat.yaml").write_text(text)
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", tmp_path / "out", *QUICK)
    assert done.code == 1
    assert "failed   bedroom: " in done.out
    assert "room     living" in done.out


def test_an_edit_follows_through(made, echousd_command):
    folder, _ = made
    before = digests(folder)
    done = echousd_command("edit", folder, "--relate", "living open to bedroom", "--dry-run")
    assert (done.code, sorted(done.out.split())) == (0, ["bedroom", "living", "opened", "opened"])
    assert digests(folder) == before
    done = echousd_command("edit", folder / "home.usda", "--relate", "living open to bedroom", "--json")
    assert done.code == 0, done.err
    stage = Usd.Stage.Open(str(folder / "home.usda"))
    assert stage.GetPrimAtPath("/House/Graph/living__open_to__bedroom")
    assert not stage.GetPrimAtPath("/House/Graph/living__door__bedroom")
    assert echousd_command("check", folder).code == 0
    done = echousd_command("edit", folder, "--unrelate", "living door bedroom")
    assert "no relation 'living door bedroom' in this home, allowed: 'living open_to bedroom'" in done.err
    done = echousd_command("edit", folder, "--add", "fern:plant")
    assert "home.usda: a home, which composes rooms; name one of them: rooms/bedroom/bedroom.usda" in done.err
    assert "allowed for it are --relate and --unrelate alone, their --undo and --redo" in done.err


def test_edits_are_taken_back_and_made_again(made, echousd_command):
    folder, _ = made
    plans = [(folder / "plan.usda").read_bytes()]
    for sentence in ("living open to bedroom", "bedroom larger than living"):
        assert echousd_command("edit", folder, "--relate", sentence).code == 0
        plans.append((folder / "plan.usda").read_bytes())
    assert len(set(plans)) == 3
    steps = [("undo", 1), ("undo", 0), ("redo", 1), ("redo", 2), ("undo", 1)]
    for word, number in steps:
        done = echousd_command("edit", folder, f"--{word}")
        assert done.code == 0, done.err
        assert (folder / "plan.usda").read_bytes() == plans[number]
        assert echousd_command("check", folder).code == 0
    (folder / "plans" / "mine.usda").write_text("#usda 1.0\n")
    assert echousd_command("edit", folder, "--relate", "living larger than bedroom").code == 0
    assert sorted(path.name for path in (folder / "plans").iterdir()) == ["0.usda", "1.usda", "2.usda", "mine.usda"]
    done = echousd_command("edit", folder, "--redo")
    assert (done.code, "home.usda: no edit of the home to redo" in done.err) == (2, True)
    assert echousd_command("edit", folder, "--undo").code == 0
    assert (folder / "plan.usda").read_bytes() == plans[1]
    assert echousd_command("edit", folder, "--undo").code == 0
    done = echousd_command("edit", folder, "--undo")
    assert (done.code, "home.usda: no edit of the home to undo" in done.err) == (2, True)
    layer = Sdf.Layer.FindOrOpen(str(folder / "home.usda"))
    layer.customLayerData = {**layer.customLayerData, "plan": {"a": 1}}
    layer.Save()
    done = echousd_command("edit", folder, "--redo")  # no number is the first plan
    assert done.code == 0, done.err


def test_edits_inside_a_room_are_not_lost_unsaid(made, tmp_path, echousd_command):
    folder, _ = made
    room = folder / "rooms" / "bedroom"
    done = echousd_command("edit", room, "--add", "chair:chair")
    assert done.code == 0, done.err
    before = digests(folder)
    done = echousd_command("generate", tmp_path / "flat.yaml", "-o", folder, *QUICK)
    assert done.code == 0, done.err
    assert done.out.count("kept     ") == 2
    assert digests(folder) == before
    moved = ("--relate", "bedroom larger than living")  # its floor is another then
    told = json.loads(echousd_command("edit", folder, *moved, "--dry-run", "--json").out)
    assert (sorted(told["new"]), told["opened"]) == (["bedroom", "living"], [])
    done = echousd_command("edit", folder, *moved)
    assert done.code == 2
    assert "bedroom would be made anew, which gives up what was edited in it since" in done.err
    assert digests(folder) == before
    assert echousd_command("edit", folder, *moved, "--force").code == 0
    assert "chair" not in read_room(room_at(room)).graph.names


def test_furniture_stays_where_a_room_only_gets_other_openings(made, echousd_command):
    folder, _ = made
    room = folder / "rooms" / "bedroom"
    assert echousd_command("edit", room, "--add", "chair:chair").code == 0
    before = read_room(room_at(room))
    done = echousd_command("edit", folder, "--relate", "living open to bedroom")
    assert done.code == 0, done.err
    after = read_room(room_at(room))
    assert after.graph.names == before.graph.names == ("bed", "chair")
    moved = after.boxes.position - before.boxes.position
    np.testing.assert_allclose(moved[1], 0, atol=1e-4)
    assert np.abs(moved[0]).max() < 0.5  # a bed before three metres of passage makes way for it, no more
    assert after.graph.room.openings != before.graph.room.openings
    assert echousd_command("check", folder).code == 0
    made_again = echousd_command("edit", folder, "--relate", "living open to bedroom", "--dry-run")
    assert "bedroom would" not in made_again.err
    options = echousd_command("generate", folder / "home.usda", "-o", folder, *QUICK, "--palette", "coast")
    assert "gives up what was edited in it since" in options.err  # in other colours all is another


def test_a_home_is_edited_after_it_was_edited(made, echousd_command):
    folder, _ = made
    assert echousd_command("edit", folder, "--relate", "living open to bedroom").code == 0
    assert find_manifest(folder / "rooms" / "bedroom")["history"]  # of its openings alone
    done = echousd_command("edit", folder, "--relate", "bedroom larger than living")
    assert done.code == 0, done.err
    assert echousd_command("check", folder).code == 0


def test_rooms_of_another_version_are_made_anew(made, monkeypatch, echousd_command):
    folder, _ = made
    ways = (("door", []), ("open to", ["bedroom", "living"]))
    told = [("edit", folder, "--relate", f"living {way} bedroom", "--dry-run", "--json") for way, _ in ways]
    assert [sorted(json.loads(echousd_command(*words).out)["opened"]) for words in told] == [names for _, names in ways]
    monkeypatch.setattr(echousd, "__version__", "9.9.9")
    for words in told:
        facts = json.loads(echousd_command(*words).out)
        assert (sorted(facts["new"]), facts["opened"]) == (["bedroom", "living"], [])


def test_a_plan_is_drawn_with_what_stands_in_it(made, tmp_path, echousd_command):
    done = echousd_command("plan", "export", made[0], "-o", tmp_path / "flat.dxf")
    assert done.code == 0, done.err
    space = ezdxf.readfile(tmp_path / "flat.dxf").modelspace()
    assert sorted(one.dxf.name for one in space.query("INSERT[layer=='furniture']")) == [
        "coffee_table", "double_bed", "sofa",
    ]  # fmt: skip
    assert len(space.query("DIMENSION")) == 2
    done = echousd_command("plan", "import", tmp_path / "flat.dxf", "-o", tmp_path / "again.usda", "--json")
    assert json.loads(done.out)["found"]["fixed pieces"] == 3
    home, plan = load_home(tmp_path / "again.usda"), plan_there(made[0] / "home.usda")
    (bed,) = home.room("bedroom").graph.nodes
    (there,) = (thing for thing in furniture(plan, made[0] / "home.usda") if thing.node.name == "bed")
    place = np.array(bed.position)[[0, 2]] + plan_there(tmp_path / "again.usda").origin("bedroom")
    assert place == pytest.approx(there.corners.mean(0), abs=0.02)
    assert echousd_command("plan", made[0], "-o", tmp_path / "flat.svg").code == 0
    assert (tmp_path / "flat.svg").read_text().count("<path") > 20


def test_rooms_of_one_name_are_told_apart(made, tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "same.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    for above, room in (("A", "living"), ("B", "bedroom")):
        prim = stage.DefinePrim(f"/World/{above}/room")
        prim.GetReferences().AddReference(str(made[0] / "home.usda"), f"/House/Rooms/{room}")
    stage.Save()
    plan = plan_there(tmp_path / "same.usda")
    assert [*plan.floors] == ["World_A_room", "World_B_room"]
    there = {thing.node.name for thing in furniture(plan, tmp_path / "same.usda")}
    assert there == {"sofa", "table", "bed"}
