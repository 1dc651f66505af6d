"""Layout metrics: true boxes score full marks, wrong ones do not, and edits change what they say."""

from dataclasses import replace

import numpy as np
import pytest

from echomodel.metrics.layouts import (
    GROUPS,
    HALVES,
    OPPOSITE,
    Task,
    changed,
    clearance,
    extended,
    fullness,
    kept_relations,
    layout_scores,
    navigability,
    tasks_of,
)
from echomodel.metrics.pictures import bodies, body_scores, collisions, out_of_bounds
from echomodel.metrics.sets import (
    category_divergence,
    forest_auc,
    frechet_distance,
    kernel_distance,
    layout_distance,
    neighbours,
    object_features,
    set_figures,
    size_distances,
)
from echomodel.metrics.statistics import Counts, figure, paired_p
from echomodel.openings import Opening
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms

FLOOR = np.array([[-2, -2], [2, -2], [2, 2], [-2, 2]], float)


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(40, 11)


def room_with(*objects, openings=()):
    """A room of 4 x 4 m; objects are (word, size, position, yaw)."""
    words, size, position, yaw = zip(*objects, strict=True)
    floats = (np.array(size, float), np.array(position, float), np.array(yaw, float))
    return RoomBoxes("one", "living_room", FLOOR, 2.6, words, *floats, openings=tuple(openings))


def share(pair):
    return np.sum(pair[0]) / np.sum(pair[1])


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_true_boxes_keep_every_relation_and_mirrored_ones_lose_theirs(rooms, rules):
    tasks = tasks_of(rooms, 0, rules=rules)
    assert sum(len(task.stated) for task in tasks) > 1000
    mirrored = [replace(r, position=r.position * [1, 1, -1], yaw=-r.yaw) for r in rooms]
    for task, room, other in zip(tasks, rooms, mirrored, strict=True):
        assert share(kept_relations(task, room)["all"]) == 1.0
        found = kept_relations(task, other)
        assert set(found) == {*GROUPS, "all"}
        assert sum(found["left/right"][0]) == 0.0
        assert found["front/behind"][0] == found["front/behind"][1]


def test_people_tell_few_relations_of_near_pairs(rooms):
    few = tasks_of(rooms, 0, stated=1.0)
    assert all(0 < len(task.stated) <= len(task.room) for task in few)
    assert [task.stated.tolist() for task in tasks_of(rooms, 0, stated=1.0)] == [task.stated.tolist() for task in few]


def test_edits_turn_one_relation_or_bring_one_object(rooms):
    rng = np.random.default_rng(3)
    for task in tasks_of(rooms, 0, rules="sgfront"):
        turned = changed(task, rng)
        new = {tuple(t) for t in turned.stated.tolist()} - {tuple(t) for t in task.stated.tolist()}
        assert len(new) <= 1
        assert all((s, OPPOSITE[p], o) in {tuple(t) for t in turned.before.tolist()} for s, p, o in new)
        broken = kept_relations(turned, task.room)
        assert broken["rest"][0] == broken["rest"][1]
        assert broken["all"][1][0] - broken["all"][0][0] == bool(len(new)) or len(turned.stated) < len(task.stated)
        added = extended(task, rng)
        assert added.added.sum() == 1
        assert not added.added[added.before[:, [0, 2]]].any()
        assert np.array_equal(added.stated, task.stated)


def test_faults_are_counted_once_in_either_half(rooms):
    assert not HALVES[0] & HALVES[1]
    assert min(map(len, HALVES)) > 15
    total = 0.0
    for task in tasks_of(rooms[:10], 0, stated=1.0):
        wild = replace(task.room, position=np.roll(task.room.position, 1, axis=0))
        scores = layout_scores(task, wild)
        parts = sum(pair[0] for name, pair in scores.items() if name.startswith("term "))
        assert scores["faults"][0] == scores["faults A"][0] + scores["faults B"][0] == parts
        assert scores["faultless"][0] == (scores["faults"][0] == 0)
        total += parts
    assert total > 20


def test_ways_and_openings_by_hand():
    wall = ("cabinet", (0.2, 1.0, 4.0), (0.0, 0.0, 0.0), 0.0)
    halved = room_with(wall)
    assert navigability(halved)[0] == pytest.approx(0.5, abs=0.01)
    assert navigability(room_with(("pendant_lamp", (4, 0.3, 4), (0, 2.2, 0), 0.0)))[0] == 1.0  # over one's head
    assert fullness(halved) == (pytest.approx(0.8), pytest.approx(16.0))
    window = Opening("window", "window", 0, 1.0, 2.0, 1.0, sill=1.0)  # in the wall at z = -2
    before = ("cabinet", (1.0, 1.5, 0.4), (0.0, 0.0, -1.75), 0.0)  # covers half of its width and of its height
    assert clearance(room_with(before, openings=[window])) == (pytest.approx(0.75), 1.0)
    assert clearance(room_with(wall)) == (0.0, 0.0)
    bare = replace(halved, floor_polygon=np.zeros((0, 2)))
    scores = layout_scores(Task(bare, np.zeros((0, 3), int)), bare)
    assert "faults" in scores
    assert not {"walkable", "navigability", "clearance", "fullness"} & set(scores)  # nothing to measure them on


def test_bodies_that_touch_do_not_collide_and_those_that_cross_do():
    cabinet = ("cabinet", (1.0, 1.0, 0.5), (0.0, 0.0, 0.0), 0.0)
    for shift, hits in ((0.5, 0), (0.498, 0), (0.4, 2), (3.0, 0)):
        other = ("cabinet", (1.0, 1.0, 0.5), (0.0, 0.0, shift), 0.0)
        scores = body_scores(room_with(cabinet, other), 0)
        assert scores["colliding"] == (hits, 2.0), shift
        assert scores["rooms colliding"][0] == (hits > 0)
    one, two = (bodies(room_with(cabinet), seed)[0] for seed in (0, 1))
    assert len(one.faces) != len(two.faces) or not np.allclose(one.vertices, two.vertices)
    again = bodies(room_with(cabinet), 0)[0]
    assert np.array_equal(one.vertices, again.vertices)
    assert one.extents == pytest.approx([1.0, 1.0, 0.5], abs=1e-6)
    assert collisions([one]) == []
    inside = bodies(room_with(cabinet, ("cabinet", (1, 1, 0.5), (1.6, 0, 0), 0.0)), 0)
    assert out_of_bounds(inside, FLOOR) == [False, True]


def test_sets_on_closed_forms():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 1, (20000, 3)), rng.normal(2, 3, (20000, 3))
    assert frechet_distance(a, b) == pytest.approx(3 * (2**2 + (3 - 1) ** 2), rel=0.05)  # of two normal distributions
    assert frechet_distance(a, a) == pytest.approx(0, abs=1e-6)
    one, zero = np.ones((50, 4)), np.zeros((50, 4))
    assert kernel_distance(one, zero) == pytest.approx((1 + 1) ** 3 + 1 - 2 * 1)  # kernels 8, 1 and 1
    same = rng.normal(0, 1, (800, 4))
    assert abs(kernel_distance(same[:400], same[400:])) < 0.1
    line = np.arange(10.0)[:, None]
    assert neighbours(line, line + 100) == {"1-NNA": 1.0, "COV": 0.1, "MMD": pytest.approx(95.5 - 0.0, abs=1)}
    assert category_divergence([["bed"] * 9], [["bed"] * 9]) == 0.0
    p, q = np.array([1.5, 9.5]) / 11, np.array([9.5, 1.5]) / 11
    found = category_divergence([["bed"] * 9 + ["sofa"]], [["bed"] + ["sofa"] * 9])
    assert found == pytest.approx(float((p * np.log(p / q)).sum()))


def test_a_forest_tells_what_differs_and_nothing_else(rooms, monkeypatch):
    monkeypatch.setattr("echomodel.metrics.sets.TREES", 50)
    wild = [replace(r, position=np.roll(r.position, 1, axis=0)) for r in rooms[:20]]
    assert forest_auc(wild, rooms[:20], 0, paired=True).value > 0.85
    assert forest_auc(wild[:3], rooms[:3], 0, paired=True).value is None
    nothing = forest_auc(rooms[:20], rooms[20:], 0)
    assert nothing.low < 0.5 < nothing.high
    digits = [replace(r, position=r.position + 1e-4, yaw=r.yaw + 1e-4) for r in rooms[:20]]
    features = [np.concatenate([object_features(r) for r in part]) for part in (digits, rooms[:20])]
    assert np.mean(features[0] != features[1]) < 0.02  # what differs are files, not rooms
    assert forest_auc(wild, rooms[:20], 0) == forest_auc(wild, rooms[:20], 0)


def test_set_figures_have_intervals_and_see_scrambled_rooms(rooms):
    wild = [replace(r, position=np.roll(r.position, 1, axis=0)) for r in rooms[:20]]
    near, far = (set_figures(part, rooms[20:], 0) for part in (rooms[:20], wild))
    assert far["Frechet on layout features"].value > near["Frechet on layout features"].value
    assert all(f.low <= f.high for f in near.values())
    assert "FID" not in " ".join(near)
    large = [replace(r, size=r.size * 1.5) for r in rooms[:20]]
    assert min(size_distances(large, rooms[:20]).values()) > 0.3
    assert max(size_distances(rooms[:20], rooms[:20]).values()) == 0.0


def test_layouts_of_equal_pieces_may_swap():
    chair = (0.5, 1.0, 0.5)
    one = room_with(("chair", chair, (0, 0, 0), 0), ("chair", chair, (1, 0, 0), 0), ("desk", (1, 1, 1), (0, 0, 1), 0))
    swapped = replace(one, position=one.position[[1, 0, 2]])
    assert layout_distance(one, swapped) == 0.0
    moved = replace(one, position=one.position + np.array([0, 0, 0.3]))
    assert layout_distance(one, moved) == pytest.approx(0.3)


def test_intervals_tests_and_power():
    rng = np.random.default_rng(1)
    whole = np.full(200, 10.0)
    a, b = (Counts.of(list(zip(rng.binomial(10, p, 200), whole, strict=True))) for p in (0.3, 0.5))
    found = figure(a, 0, b)
    assert found.value == pytest.approx(0.3, abs=0.03)
    assert found.low < 0.3 < found.high
    assert found.high - found.low == pytest.approx(4 * np.sqrt(0.3 * 0.7 / 2000), rel=0.3)
    assert found.p < 0.01
    assert found.detects == pytest.approx(2.8 * np.sqrt((0.21 + 0.25) / 2000), rel=0.3)
    assert figure(a, 0, a).p == 1.0
    assert figure(Counts.of([(0.0, 0.0)] * 3), 0).value is None
    pairs = Counts.of([([1.0, 0.0], [1.0, 4.0]), ([1.0, 2.0], [3.0, 4.0])])
    assert pairs.value == pytest.approx((2 / 4 + 2 / 8) / 2)  # the mean of two shares, not the share of all
    null = [paired_p(*(Counts.of([(v, 1.0) for v in rng.random(20)]) for _ in range(2)), k) for k in range(60)]
    assert 0 <= np.mean(np.array(null) < 0.05) < 0.15
