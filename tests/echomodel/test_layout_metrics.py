"""Layout metrics: true boxes score full marks, wrong ones do not, and edits change what they say."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.metrics.layout_evaluation import (
    OPPOSITE,
    LayoutEvaluation,
    evaluate_layout,
    kolmogorov_smirnov,
    relation_scores,
    size_rows,
    touched_triplets,
)
from echomodel.metrics.report import compare, section_means
from echomodel.metrics.room_figures import ray_lengths, room_figures, with_known_words
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(40, 11)


def truth(rooms):
    boxes = [Boxes.from_room(room) for room in rooms]
    calls = []

    def sample(edited):
        start = sum(calls) % len(boxes)
        calls.append(edited.graph.num_scenes)
        return Boxes.cat(boxes[start : start + edited.graph.num_scenes])

    return sample


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_true_boxes_keep_every_relation(rooms, rules):
    result = evaluate_layout(rooms, truth(rooms), LayoutEvaluation(rules=rules, scenes=16))
    assert result["generation"]["total"] == 1.0
    assert set(result["generation"]["groups"].values()) == {1.0}
    assert result["generation"]["n"] > 1000
    assert all(row["median_ratio"] == pytest.approx(1, abs=1e-3) for row in result["sizes"])
    assert all(row["ks"] in (None, 0.0) for row in result["sizes"])
    overlap, real = result["figures"]["overlap"], result["real_figures"]["overlap"]
    assert overlap == pytest.approx(real, abs=0.005)
    assert json.loads(json.dumps(result))["rooms"] == len(rooms)


def test_wrong_boxes_lose_what_they_break(rooms):
    right = truth(rooms)

    def mirrored(edited):
        boxes = right(edited)
        return Boxes(boxes.size, boxes.position * torch.tensor([1.0, 1.0, -1.0]), -boxes.yaw)

    scores = evaluate_layout(rooms, mirrored, LayoutEvaluation(scenes=16))["generation"]
    assert scores["groups"]["left/right"] == 0.0
    assert scores["groups"]["front/behind"] == 1.0
    assert scores["groups"]["close_by"] == 1.0
    assert scores["relations"]["left"]["kept"] == 0.0


def test_edits_are_scored_apart(rooms):
    seen = []
    right = truth(rooms)

    def sample(edited):
        seen.append(edited)
        return right(edited)

    settings = LayoutEvaluation(change=True, add=True, scenes=40, seed=3)
    result = evaluate_layout(rooms, sample, settings)
    plain, change, add = seen
    assert plain.before is None
    assert not plain.touched.any()
    # the true boxes break exactly what was turned round
    after = {tuple(t) for t in change.graph.triplets.tolist()}
    before = {tuple(t) for t in change.before.tolist()}
    turned = after - before
    assert len(turned) == len(rooms) or len(turned) == len([r for r in rooms if len(r) > 2])
    assert all((s, OPPOSITE[p], o) in before and (s, OPPOSITE[p], o) not in after for s, p, o in turned)
    assert all((o, OPPOSITE[OPPOSITE[p]], s) not in after - turned for s, p, o in turned if (s, p, o) not in before)
    assert result["change"]["total"] < 1.0
    assert result["change"]["untouched"]["total"] == 1.0
    broken = result["change"]["n"] * (1 - result["change"]["total"])
    assert round(broken) == len(turned)
    # the added node had no relation before, and everything else is as it was
    assert int(add.added.sum()) == len(rooms)
    assert not touched_triplets(add.before, add.added).any()
    kept = add.graph.triplets[~touched_triplets(add.graph.triplets, add.added)]
    assert torch.equal(kept, add.before)
    assert result["add"]["total"] == 1.0
    again = []
    evaluate_layout(rooms, lambda e: again.append(e) or right(e), settings)
    assert torch.equal(again[1].graph.triplets, change.graph.triplets)


def test_rooms_without_a_fault_are_drafted_no_further(rooms):
    some, sampled, finished = rooms[:6], [], []

    def sample(edited):
        sampled.append(edited.graph.num_scenes)
        return truth(some)(edited) if len(sampled) == 1 else Boxes.cat([Boxes.from_room(some[0])] * sampled[-1])

    def finish(room, triplets):
        finished.append(len(triplets))
        return room, (0 if len(finished) in (1, 2, 3, 5, 6, 8) else 9 - len(finished),)

    some = [some[0]] * 6  # so that the draft of any is that of all
    evaluate_layout(some, sample, LayoutEvaluation(told=1.0, drafts=4, scenes=6), finish=finish)
    assert sampled == [6, 1, 1]  # the fourth had a fault, then one again, then none
    assert len(finished) == 8
    assert len(set(finished)) == 1


def test_variety_looks_at_rooms_from_all_over_the_set(rooms, monkeypatch):
    seen = []
    monkeypatch.setattr("echomodel.metrics.layout_evaluation.VARIED", 4)
    monkeypatch.setattr(
        "echomodel.metrics.layout_evaluation.variety_scores", lambda graphs, *_: seen.extend(graphs) or {"rooms": 4}
    )
    evaluate_layout(rooms, truth(rooms), LayoutEvaluation(seeds=2, scenes=40))
    counts = [graph.num_nodes for graph in seen]
    assert counts == [len([room for room in rooms if len(room) > 1][number]) for number in (0, 10, 20, 30)]


def test_completion_gives_half_of_the_true_boxes(rooms):
    seen = []

    def sample(edited):
        seen.append(edited)
        if edited.known is None:
            return truth(rooms)(edited)
        position = torch.where(edited.known_mask[:, None], edited.known.position, 0 * edited.known.position)
        return replace(edited.known, position=position)

    result = evaluate_layout(rooms, sample, LayoutEvaluation(complete=True, scenes=40))
    given = seen[-1].known_mask
    assert 0.4 < given.float().mean() < 0.6
    assert torch.equal(seen[-1].touched, ~given)
    assert result["complete"]["untouched"]["total"] == 1.0  # relations between given boxes
    assert result["complete"]["edited"]["total"] < 0.8


def test_contradictions_stay_when_asked_for(rooms):
    counts = []
    for keep in (False, True):
        edges = []
        right = truth(rooms)
        settings = LayoutEvaluation(change=True, drop=0.0, scenes=40, contradictions=keep)

        def sample(edited, edges=edges, right=right):
            edges.append(len(edited.graph.triplets))
            return right(edited)

        evaluate_layout(rooms, sample, settings)
        counts.append(edges)
    assert counts[1][1] == counts[1][0]
    assert counts[0][0] - len(rooms) <= counts[0][1] < counts[0][0]


def test_scores_by_hand():
    boxes = Boxes(torch.ones(3, 3), torch.tensor([[0.0, 0, 0], [0, 0, 2], [3, 0, 0]]), torch.zeros(3))
    triplets = torch.tensor([[0, 1, 1], [1, 1, 0], [1, 2, 0], [2, 3, 0], [0, 13, 1]])
    scores = relation_scores(boxes, triplets)
    assert scores.share("left") == 0.5
    assert scores.group("left/right") == 0.75  # mean of left (1 of 2) and right (1 of 1)
    assert scores.group("close_by") is None
    told = scores.to_json()
    assert told["n"] == 4
    assert told["total"] == 0.75
    assert told["mean"] == pytest.approx((0.75 + 1.0) / 2)
    half = relation_scores(boxes, triplets, subset=torch.tensor([True, False, False, False, True])).to_json()
    assert half["n"] == 1


def test_size_rows_and_distances():
    rng = np.random.default_rng(0)
    a, b = rng.lognormal(0, 0.2, (50, 3)), rng.lognormal(0, 0.2, (60, 3)) * [1.5, 1, 1]
    rows = {row.axis: row for row in size_rows(["chair"] * 50, a, ["chair"] * 60, b)}
    assert rows["x"].median_ratio == pytest.approx(1 / 1.5, rel=0.15)
    assert rows["x"].ks > 0.5 > 0.3 > rows["y"].ks
    assert size_rows(["chair"] * 9, a[:9], ["chair"] * 60, b)[0].ks is None
    assert size_rows(["chair"], a[:1], ["plant"], b[:1]) == []
    assert kolmogorov_smirnov(np.array([0.0, 1.0]), np.array([2.0, 3.0])) == 1.0
    assert kolmogorov_smirnov(a[:, 0], a[:, 0]) == 0.0


def test_rays_meet_the_nearest_wall():
    polygon = np.array([[-2, -1], [2, -1], [2, 3], [0, 3], [0, 1], [-2, 1]], float)
    origin = np.array([[1.0, 0.0]] * 4)
    direction = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    assert ray_lengths(polygon, origin, direction).tolist() == pytest.approx([1, 3, 3, 1])


def test_figures_of_a_room_by_hand():
    floor = np.array([[-2, -2], [2, -2], [2, 2], [-2, 2]], float)
    room = RoomBoxes(
        "one", "living", floor, 2.6, ("sofa_3", "coffee_table", "sculpture"),
        np.array([[2.0, 0.8, 1.0], [1.0, 0.4, 0.6], [1, 1, 1]]), np.array([[0, 0, -1.4], [0.2, 0, -0.2], [0, 0, 1.0]]),
        np.array([0.0, np.pi, 0.0]),
    )  # fmt: skip
    known = with_known_words([room])
    assert known[0].categories == ("multi_seat_sofa", "coffee_table")
    assert known[0].room_type == "living_room"
    figures = room_figures(known)
    assert figures["walls"]["multi_seat_sofa"]["back_gap"][1] == pytest.approx(0.1)
    assert figures["walls"]["multi_seat_sofa"]["back"] == 1.0
    (pair,) = figures["pairs"]
    assert pair["lateral"][2] == pytest.approx(0.2)
    assert pair["forward"][2] == pytest.approx(1.2)
    assert pair["gap"][2] == pytest.approx(0.4)
    assert pair["turn"] == [0.0, 0.0, 1.0, 0.0]
    assert pair["faces"] == 1.0
    assert figures["rooms"]["living_room"]["area"][2] == pytest.approx(16.0)
    assert figures["overlap"] == {"floor_pairs": 0.0, "outside_floor": 0.0}


def test_report_is_near_for_our_rooms_and_far_for_scrambled_ones():
    rooms = generate_rooms(200, 21)
    near = section_means(compare(rooms))
    assert near["all"] < 0.1
    rng = np.random.default_rng(0)
    wild = [
        RoomBoxes(r.id, r.room_type, r.floor_polygon, r.height, r.categories, r.size * 1.4,
                  r.position[rng.permutation(len(r))], r.yaw, r.models, r.styles)
        for r in rooms
    ]  # fmt: skip
    assert section_means(compare(wild))["all"] > 2 * near["all"]
    assert section_means(compare(rooms[:140], rooms[60:]))["all"] < 0.06


def test_report_leaves_no_room_type_out():
    rows = compare(generate_rooms(30, 5, room_type="study"))
    assert {row.section for row in rows} >= {"room study", "presence study"}


def test_a_sampler_that_miscounts_and_empty_files_are_told(rooms):
    with pytest.raises(ValueError, match=r"the sampler gave 1 boxes for \d+ nodes"):
        evaluate_layout(rooms[:3], lambda edited: Boxes(torch.ones(1, 3), torch.ones(1, 3), torch.ones(1)))
    with pytest.raises(ValueError, match="no room with two or more known objects"):
        evaluate_layout([], truth(rooms))
