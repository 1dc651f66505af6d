"""Fitted runs: flush, cut to their wall, around corners; what hangs over them; nothing before doors and windows."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
import shapely

from echomodel.boxes import Boxes
from echomodel.boxes2d import footprints
from echomodel.objective import fitted
from echomodel.objective.plan import plan_of
from echomodel.openings import WINDOWS, Opening, free_area, rectangle
from echomodel.rooms.generator import generate_rooms
from echomodel.rooms.runs import Site, obstacles, runs
from echomodel.vocabulary import vocabulary

KITCHEN = ("sink_unit", "dishwasher", "base_unit", "hob_unit", "base_unit", "tall_unit", "fridge", "wall_unit",
           "range_hood")  # fmt: skip
NOTHING = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)


def planned(floor, words=KITCHEN, openings=(), rigid=(), **more):
    kinds = [vocabulary().category(word) for word in words]
    size = np.array([kind.sizes[1] for kind in kinds])
    free = ~np.isin(np.arange(len(words)), rigid)
    return kinds, size, runs(kinds, size, free, Site(floor, obstacles(floor, openings, *NOTHING)), **more)


@pytest.mark.parametrize(("floor", "walls"), [((5.2, 2.2), 1), ((3.4, 3.0), 2), ((2.7, 2.3), 3)])
@pytest.mark.parametrize("turn", [1, -1])
def test_runs_are_flush_and_around_corners(floor, walls, turn):
    outline = rectangle(*floor)[::turn].copy()
    kinds, _, found = planned(outline, most=100)
    assert found
    used = Counter()
    for run in found:
        used[len({round(float(yaw), 2) for yaw in run.yaw})] += 1
        words = [kinds[i].name for i in run.which]
        assert sorted(run.which.tolist()) == list(range(len(kinds)))
        assert shapely.Polygon(outline).buffer(1e-6).covers(shapely.MultiPolygon(
            [shapely.Polygon(plan) for plan in footprints(run.size, run.position, run.yaw)]))  # fmt: skip
        plan = plan_of(Boxes(*map(np.asarray, (run.size, run.position, run.yaw))), words, outline)
        assert bool((fitted.row_flush(plan).margin >= 0).all())
        low = [shapely.Polygon(p) for p, at in zip(footprints(run.size, run.position, run.yaw), run.position,
                                                   strict=True) if at[1] == 0]  # fmt: skip
        assert sum(plan.area for plan in low) == pytest.approx(shapely.union_all(low).area, abs=1e-6)
        hood = words.index("range_hood")
        hob = words.index("hob_unit")
        assert np.hypot(*(run.position[hood] - run.position[hob])[[0, 2]]) < 0.15
    assert used[walls]


def test_a_run_is_cut_to_its_wall():
    _, size, found = planned(rectangle(4.9, 2.2))
    one = next(run for run in found if len({*run.yaw.round(3)}) == 1)
    low = np.sort(one.position[one.position[:, 1] == 0][:, 0])
    floor_units = one.position[:, 1] == 0
    assert one.size[floor_units, 0].sum() == pytest.approx(4.9)
    assert len(low) == 7
    edges = sorted((x - w / 2, x + w / 2) for x, w in zip(one.position[floor_units, 0], one.size[floor_units, 0],
                                                            strict=True))  # fmt: skip
    assert all(a[1] == pytest.approx(b[0]) for a, b in pairwise(edges))
    assert one.size[list(one.which).index(0), 0] == pytest.approx(size[0, 0])  # a sink is as it is sold


def test_what_states_its_size_keeps_it():
    _, size, found = planned(rectangle(4.9, 2.2), rigid=(2,))
    for run in found:
        assert run.size[list(run.which).index(2)] == pytest.approx(size[2])


def test_doors_stay_free_and_nothing_high_covers_a_window():
    floor = rectangle(4.4, 2.6)
    openings = [Opening("door", "door", 0, 0.1, 0.9, 2.0), Opening("window", "window", 2, 1.3, 1.6, 1.3, 0.95)]
    kinds, _, found = planned(floor, openings=openings)
    assert found
    door, window = (shapely.Polygon(free_area(floor, one)) for one in openings)
    for run in found:
        for i, plan, own, at in zip(run.which, footprints(run.size, run.position, run.yaw), run.size, run.position,
                                    strict=True):  # fmt: skip
            assert shapely.Polygon(plan).intersection(door).area < 1e-6
            if at[1] + own[1] > 1.3 and kinds[i].task != "vent":
                assert shapely.Polygon(plan).intersection(window).area < 1e-6, kinds[i].name


def test_nothing_is_planned_where_it_does_not_fit():
    assert planned(rectangle(1.6, 1.6))[2] == []
    assert planned(rectangle(4.0, 3.0), words=("base_unit", "wall_unit"))[2] == []  # one unit is no run


def test_plans_go_where_the_draft_is_and_by_what_they_miss():
    draft = np.tile([0.0, 0.0, 1.2], (len(KITCHEN), 1))
    for side in (1, -1):
        best = planned(rectangle(5.0, 2.4), draft=side * draft, most=1)[2][0]
        assert np.sign(best.position[:, 2].mean()) == side

    def left(run):
        at = {KITCHEN[i]: x for i, (x, _, _) in zip(run.which, run.position, strict=True)}
        return 10.0 * (at["fridge"] > at["sink_unit"])

    assert left(planned(rectangle(5.0, 2.4), missed=left, most=1)[2][0]) == 0.0


@pytest.mark.parametrize("room_type", ["kitchen", "bathroom", "hallway", "utility_room", "balcony", "childrens_room"])
def test_the_generator_has_rooms_of_a_home(room_type):
    rooms = generate_rooms(4, 4, room_type=room_type)
    row = vocabulary().room_type(room_type)
    for room in rooms:
        assert room.room_type == room_type
        assert {sign for sign in row.signs} & set(room.categories) or room_type in ("hallway", "childrens_room")
    area = np.median([shapely.Polygon(room.floor_polygon).area for room in rooms])
    low, middle, high = row.floor[0]
    assert (low * middle) ** 0.5 < area < (middle * high) ** 0.5
    if room_type == "kitchen":
        for room in rooms:
            assert {"sink_unit", "hob_unit", "fridge", "base_unit", "range_hood"} <= set(room.categories)
            plan = plan_of(room, list(room.categories), room.floor_polygon, room.openings)
            assert bool((fitted.row_flush(plan).margin >= 0).all()), room.id


def test_windows_of_kitchens_begin_above_worktops():
    rooms = [room for kind in ("kitchen", "bathroom") for room in generate_rooms(6, 4, room_type=kind)]
    sills = {opening.sill for room in rooms for opening in room.openings if opening.kind == "window"}
    assert sills == {WINDOWS["wet"][0]}
