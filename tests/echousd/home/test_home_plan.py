"""Plans: the graph is kept or the conflict is named, cells meet, doors swing free, and the same seed gives the same."""

from itertools import combinations

import numpy as np
import pytest
import shapely
from homes import homes
from hypothesis import assume, given, settings

from echomodel.openings import Opening, edge_lengths, rectangle, segment, signed_area, swing_area
from echousd.graph import GraphError
from echousd.home import plan as planning
from echousd.home.existing import next_plan
from echousd.home.graph import HomeGraph
from echousd.home.openings import Floor, _Hole
from echousd.home.plan import INNER, OUTER, conflicts, plan_home, plans, ways
from echousd.home.solve import EFFORTS, solved
from echousd.home.stages import home_layer

FLAT = "kitchen open_to living, hall door living, hall door bedroom*2, hall door bathroom"


@pytest.fixture(scope="module")
def flat():
    return plan_home(HomeGraph.from_words(FLAT, area=75))


@settings(max_examples=8)
@given(homes())
def test_a_plan_keeps_the_graph_or_the_conflict_is_named(home):
    try:
        plan = plan_home(home)
    except GraphError as error:
        told = str(error)
        assume("all of" not in told and "no plan found" not in told)  # named
        raise
    assert plan.broken() == ()
    cells = [shapely.Polygon(cell) for cell in plan.cells.values()]
    assert all(one.intersection(other).area < 1e-3 for one, other in combinations(cells, 2))
    for name, openings in plan.openings.items():
        floor, swings = plan.floors[name], []
        inside = shapely.Polygon(floor).buffer(0.01)
        for opening in openings:
            swing = swing_area(floor, opening)
            if len(swing):
                swings.append(shapely.Polygon(swing))
                assert inside.covers(swings[-1]), f"{name}: {opening} opens into a wall"
        assert all(one.intersection(other).area < 0.02 for one, other in combinations(swings, 2)), name


def test_cells_meet_and_walls_have_a_thickness(flat):
    whole = shapely.union_all([shapely.Polygon(cell) for cell in flat.cells.values()])
    assert whole.geom_type == "Polygon"
    assert len(whole.interiors) == 0
    assert whole.area == pytest.approx(sum(abs(signed_area(cell)) for cell in flat.cells.values()), abs=1e-2)
    assert {thick for walls in flat.walls.values() for thick in walls} == {INNER / 2, OUTER}
    assert flat.area == pytest.approx(75, rel=0.05)


def test_a_door_is_there_once(flat):
    through = {frozenset(pair): opening.kind for pair, opening in ways(flat)}
    assert through == {
        frozenset(("kitchen", "living")): "passage",
        **{frozenset(("hall", room)): "door" for room in ("living", "bedroom_1", "bedroom_2", "bathroom")},
    }
    leaves = sum(opening.kind == "door" for openings in flat.openings.values() for opening in openings)
    assert leaves == 4 + 1  # and the front door
    front = [opening for opening in flat.openings["hall"] if opening.kind == "door" and opening.width == 1.0]
    outer = shapely.union_all([shapely.Polygon(cell) for cell in flat.cells.values()]).boundary
    middle = shapely.Point(segment(flat.floors["hall"], front[0]).mean(0))
    assert shapely.distance(outer, middle) == pytest.approx(OUTER)


def test_windows_look_outside(flat):
    outer = shapely.union_all([shapely.Polygon(cell) for cell in flat.cells.values()]).boundary
    for name, openings in flat.openings.items():
        windows = [opening for opening in openings if opening.kind == "window"]
        assert name in ("hall", "bathroom") or windows, name
        for window in windows:
            middle = shapely.Point(segment(flat.floors[name], window).mean(0))
            assert shapely.distance(outer, middle) == pytest.approx(OUTER, abs=1e-3)


def test_windows_are_in_the_middle_until_the_furniture_is_there(flat):
    assert flat.lit == {"kitchen", "living", "bedroom_1", "bedroom_2", "bathroom"}
    for name in ("bedroom_1", "living"):
        window = next(opening for opening in flat.openings[name] if opening.kind == "window")
        wall = edge_lengths(flat.floors[name])[window.edge]
        assert abs(window.offset + window.width / 2 - wall / 2) < 0.3, name


def test_a_hole_stands_aside_by_the_nearest_corner_or_hole():
    floor = Floor("hall", rectangle(8, 4), (INNER / 2,) * 4)

    def hole(offset):
        return _Hole(((floor, Opening("door", "door", 0, offset, 0.9, 2.0)),), 0.0)

    assert hole(0.12).aside([]) == pytest.approx(0.12)
    assert hole(3.5).aside([]) == pytest.approx(3.5)
    assert hole(3.5).aside([hole(2.4), hole(7.0)]) == pytest.approx(0.2)


def test_doors_leave_whole_walls_to_the_room_in_the_middle():
    for seed in range(4):
        plan = plan_home(
            HomeGraph.from_words("living door bedroom*3, living door bathroom, living door study"), seed=seed
        )
        floor, doors = plan.floors["living"], [one for one in plan.openings["living"] if one.kind != "window"]
        ends = {0.0, *(end for one in doors for end in (one.offset, one.end)), *edge_lengths(floor).tolist()}
        assert max(min(abs(one.offset - end) for end in ends - {one.offset}) for one in doors) < 0.8, seed


def test_the_same_seed_gives_the_same_plan(flat):
    again = plan_home(HomeGraph.from_words(FLAT, area=75))
    assert all(np.array_equal(flat.cells[name], again.cells[name]) for name in flat.cells)
    assert flat.openings == again.openings


def test_plans_differ(flat):
    found = plans(HomeGraph.from_words(FLAT, area=75), 3)
    assert len(found) == 3
    assert all(np.array_equal(found[0].cells[name], flat.cells[name]) for name in flat.cells)


def test_a_given_outline_is_filled():
    outline = ((0.0, 0.0), (9.0, 0.0), (9.0, 5.0), (6.0, 5.0), (6.0, 8.4), (0.0, 8.4))
    plan = plan_home(HomeGraph.from_words("hall door living, hall door bedroom, hall door kitchen", outline=outline))
    whole = shapely.union_all([shapely.Polygon(cell) for cell in plan.cells.values()])
    assert whole.symmetric_difference(shapely.Polygon(outline)).area < 0.01
    assert plan.broken() == ()


def test_an_edit_begins_with_the_plan_of_before(flat):
    home = HomeGraph.from_words(FLAT, area=75).relate("kitchen adjacent hall")
    after, fresh = plan_home(home, before=flat), plan_home(home, seed=1)
    assert after.broken() == ()
    old, new, other = ({name: np.sort(cell, 0) for name, cell in each.cells.items()} for each in (flat, after, fresh))
    moved, without = (sum(np.abs(old[name] - each[name]).max() > 2.0 for name in old) for each in (new, other))
    assert moved < without


def test_other_ways_between_rooms_leave_the_floors_and_other_rooms_as_they_are(tmp_path, flat):
    home_layer(flat.home, flat).Export(str(tmp_path / "flat.usda"))
    home = flat.home.relate("kitchen door living")
    after = next_plan(home, before=tmp_path / "flat.usda")
    assert after.broken() == ()
    for name in flat.cells:
        np.testing.assert_allclose(after.cells[name], flat.cells[name], atol=1e-6)
        same = after.graph(name).room.openings == flat.graph(name).room.openings
        assert same == (name not in ("kitchen", "living")), name
    assert {o.kind for o in flat.openings["kitchen"]} - {o.kind for o in after.openings["kitchen"]} == {"passage"}
    further = next_plan(home.relate("bathroom larger_than living"), before=tmp_path / "flat.usda")
    assert further.areas["bathroom"] > further.areas["living"]


@pytest.mark.parametrize(
    ("words", "fields", "said"),
    [
        ("hall door bedroom, hall not_adjacent bedroom", {}, "'hall not_adjacent bedroom' cannot both"),
        ("hall north_of bedroom, bedroom north_of hall", {}, "cannot all hold"),
        ("hall larger_than bedroom, bedroom larger_than hall", {}, "cannot all hold"),
        ("hall door bedroom*3, hall door living", {"area": 12}, "m² at least"),
        ("hall door bedroom", {"outline": ((0, 0), (6, 0), (7, 5), (0, 5))}, "slanted wall"),
        ("hall door bedroom", {"outline": ((0, 0), (9, 0), (9, 5), (0, 5)), "area": 90}, "state one of them"),
    ],
)  # fmt: skip
def test_conflicts_are_named_before_solving(words, fields, said):
    told = conflicts(HomeGraph.from_words(words, **fields))
    assert said in told[0]
    with pytest.raises(GraphError) as raised:
        plan_home(HomeGraph.from_words(words, **fields))
    assert str(raised.value) == told[0]


def test_ways_that_would_cross_are_named():
    rooms = ["bedroom_1", "bedroom_2", "bedroom_3", "study_1", "study_2"]
    words = ", ".join(f"{one} door {other}" for one, other in combinations(rooms, 2))
    (told,) = conflicts(HomeGraph.from_words(words))
    assert told.startswith("no flat plan has all of 'bedroom_1 door bedroom_2'")


K4 = [f"{one} door {other}" for one, other in combinations(["living", "kitchen", "bedroom", "study"], 2)]
BETWEEN = ["hall north_of living", "living north_of kitchen", "hall door kitchen", "living east_of hall",
           "living west_of kitchen"]  # fmt: skip


@pytest.mark.parametrize(
    ("kept", "more"),
    [
        (K4, ["hall door living", "hall door bathroom", "bedroom larger_than study"]),
        (BETWEEN, ["hall door living", "living door kitchen", "hall larger_than kitchen"]),
    ],
)
def test_what_no_plan_keeps_is_a_smallest_set(kept, more):
    with pytest.raises(GraphError) as raised:
        plan_home(HomeGraph.from_words(", ".join([*more, *kept])))
    said = str(raised.value)
    named = said.partition(" has all of ")[2].partition("; ")[0]
    assert {*named.strip("'").split("', '")} == {*kept}
    for left_out in kept[::2]:
        rest = [one for one in kept if one != left_out]
        assert plan_home(HomeGraph.from_words(", ".join([*more, *rest]))).broken() == (), f"without {left_out}"


def test_a_hall_of_nine_doors_is_planned_without_a_long_search(monkeypatch):
    efforts = []
    monkeypatch.setattr(planning, "solved", lambda problem, effort: efforts.append(effort) or solved(problem, effort))
    rooms = ["kitchen", "living", "bathroom*2", "study", "bedroom*4"]
    plan = plan_home(HomeGraph.from_words(", ".join(f"hall door {room}" for room in rooms), area=140))
    assert plan.broken() == ()
    assert len(efforts) > 1, "the first form of the problem was found at once: a hall of more doors"
    assert {*efforts} == {EFFORTS[0]}


def test_without_the_solver_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ortools.sat.python.cp_model", None)
    with pytest.raises(GraphError, match=r"pip install 'echousd\[home\]'"):
        plan_home(HomeGraph.from_words("hall door bedroom"))
