"""Rules: the published measurements number by number, the strict ones against slow twins, and labelling."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from shapely import affinity
from shapely.geometry import Polygon, box

from echomodel.boxes import Boxes
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import fronts, label_relations, label_rooms, margins, measured, rule_set, verdicts
from echomodel.rules.geometry import pairs
from echomodel.rules.margins import judged, pair_margins
from echomodel.rules.sets import NEAR
from echomodel.rules.telling import stated_relations
from echomodel.vocabulary import vocabulary

FIXTURE = Path(__file__).parent / "fixtures" / "metrics_constraints.safetensors"
P = {predicate.name: predicate.id for predicate in vocabulary().predicates}


def boxes_of(size, position, yaw=None, dtype=torch.float64):
    size, position = torch.as_tensor(size, dtype=dtype), torch.as_tensor(position, dtype=dtype)
    return SimpleNamespace(
        size=size,
        position=position,
        yaw=torch.zeros(len(size), dtype=dtype) if yaw is None else torch.as_tensor(yaw, dtype=dtype),
    )


def random_boxes(count, seed):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-2, 2, (count, 3)) * [1, 0, 1] + rng.choice([0.0, 0.5, 1.8], (count, 1)) * [0, 1, 0]
    return boxes_of(rng.uniform(0.2, 2.5, (count, 3)), position, rng.choice([0, np.pi / 2, 0.4, -2.0], count))


def all_triplets(count, predicates):
    return torch.tensor([[i, p, j] for i in range(count) for j in range(count) if i != j for p in predicates])


def room_of(categories, size, position, yaw=None, **more):
    floor = np.array([[-2, 2], [2, 2], [2, -2], [-2, -2]], float)
    yaw = np.zeros(len(categories)) if yaw is None else np.asarray(yaw, float)
    return RoomBoxes(
        "r", "bedroom", floor, 2.6, tuple(categories), np.asarray(size, float), np.asarray(position, float), yaw, **more
    )


@pytest.mark.parametrize(
    ("rules", "one", "other"),
    [("sgfront", "left", "right"), ("sgfront", "front", "behind"), ("strict", "left", "right"),
     ("strict", "front", "behind"), ("strict", "bigger_than", "smaller_than"),
     ("strict", "taller_than", "shorter_than")],
)  # fmt: skip
def test_two_words_for_one_fact_have_one_margin(rules, one, other):  # published sizes are divided by the subject's
    boxes, triplets = random_boxes(6, 3), all_triplets(6, [P[one]])
    turned = triplets[:, [2, 1, 0]].clone()
    turned[:, 1] = P[other]
    found, back = (margins(boxes, told, rules=rules) for told in (triplets, turned))
    assert torch.allclose(found, back, atol=1e-6)


def test_where_nothing_holds_nothing_is_told():
    told = stated_relations(torch.zeros(0, 3, dtype=torch.int64), random_boxes(3, 1), 2.0, torch.Generator())
    assert told.shape == (0, 3)


def test_sgfront_agrees_with_published_verdicts():
    data = load_file(FIXTURE)
    boxes = SimpleNamespace(size=data["boxes"][:, :3], position=data["boxes"][:, 3:], yaw=torch.rand(14))
    kept = verdicts(boxes, data["triples"], rules="sgfront").long()
    assert torch.equal(kept, data["per_triple"])
    i, j = torch.meshgrid(torch.arange(14), torch.arange(14), indexing="ij")
    pair = pairs(boxes, i.reshape(-1), j.reshape(-1), torch.zeros(14, 3), oriented=False)
    assert torch.allclose(pair.overlap_ratio.double(), data["overlap_over_min_volume"].reshape(-1), atol=1e-6)
    distance = data["min_corner_distance"].reshape(-1).nan_to_num(0)
    assert torch.allclose(pair.corner_distance, distance, atol=2e-6)


def footprint(boxes, k):
    x, _, z = boxes.size[k].tolist()
    # shapely's (x, y) plane holds (x, z): a yaw about +Y turns x towards -z.
    turned = affinity.rotate(box(-x / 2, -z / 2, x / 2, z / 2), -float(boxes.yaw[k]), (0, 0), use_radians=True)
    return affinity.translate(turned, float(boxes.position[k, 0]), float(boxes.position[k, 2]))


def slow_overlap(boxes, i, j):
    area = footprint(boxes, i).intersection(footprint(boxes, j)).area
    low = max(float(boxes.position[k, 1]) for k in (i, j))
    high = min(float(boxes.position[k, 1] + boxes.size[k, 1]) for k in (i, j))
    return area * max(high - low, 0.0) / min(float(boxes.size[k].prod()) for k in (i, j))


def test_oriented_geometry_agrees_with_shapely():
    boxes = random_boxes(40, 1)
    subject, _, object_ = all_triplets(40, [1]).T
    pair = pairs(boxes, subject, object_, torch.zeros(40, 3), oriented=True)
    for row, (i, j) in enumerate(zip(subject.tolist(), object_.tolist(), strict=True)):
        assert float(pair.overlap_ratio[row]) == pytest.approx(slow_overlap(boxes, i, j), abs=2e-4)
        a, b = footprint(boxes, i), footprint(boxes, j)
        assert (float(pair.footprint_penetration[row]) > 1e-9) == (a.intersection(b).area > 1e-9)
        nearest = min(np.hypot(*np.subtract(p, q)) for p in a.exterior.coords for q in b.exterior.coords)
        tops = [[float(boxes.position[k, 1]), float(boxes.position[k, 1] + boxes.size[k, 1])] for k in (i, j)]
        rise = min(abs(u - v) for u in tops[0] for v in tops[1])
        assert float(pair.corner_distance[row]) == pytest.approx(np.hypot(nearest, rise), abs=1e-5)


@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, 0.3])
def test_overlap_of_coinciding_and_touching_boxes(yaw):
    size = [[1.0, 1, 2], [1.0, 1, 2], [1.0, 1, 2], [0.5, 1, 2]]
    along = np.array([np.cos(yaw), 0, -np.sin(yaw)])  # the box's own x axis
    position = [np.zeros(3), np.zeros(3), along * 1.0, along * 0.25]
    boxes = boxes_of(size, np.array(position), [yaw, yaw, yaw, yaw])
    pair = pairs(boxes, torch.tensor([0, 0, 0]), torch.tensor([1, 2, 3]), torch.zeros(4, 3), oriented=True)
    assert pair.overlap_area.tolist() == pytest.approx([2.0, 0.0, 1.0], abs=1e-4)
    polygons = [Polygon(footprint(boxes, 0)).intersection(footprint(boxes, k)).area for k in (1, 2, 3)]
    assert pair.overlap_area.tolist() == pytest.approx(polygons, abs=1e-4)


def test_strict_rules_say_what_the_words_say():
    # 0 bed in the middle, 1 nightstand at its left (-z), 2 lamp on the nightstand, 3 lamp hanging over the bed.
    boxes = boxes_of(
        [[2.0, 1.0, 1.8], [0.5, 0.5, 0.5], [0.2, 0.4, 0.2], [0.6, 0.5, 0.6]],
        [[0, 0, 0], [-0.6, 0, -1.3], [-0.6, 0.5, -1.3], [0, 2.0, 0.1]],
    )
    told = {
        (1, "left", 0): 1, (0, "right", 1): 1, (1, "right", 0): 0,
        (1, "behind", 0): 1, (0, "front", 1): 1, (3, "front", 0): 0,
        (2, "standing_on", 1): 1, (2, "standing_on", 0): 0, (3, "standing_on", 0): 0,
        (3, "above", 0): 1, (3, "above", 1): 0, (2, "above", 1): 0,
        (0, "bigger_than", 1): 1, (1, "smaller_than", 0): 1, (1, "bigger_than", 0): 0,
        (3, "taller_than", 0): 1, (0, "shorter_than", 3): 1, (1, "close_by", 0): 1, (3, "close_by", 1): 0,
        (0, "same_style_as", 1): -1, (0, "in", 1): -1,
    }  # fmt: skip
    triplets = torch.tensor([[s, P[p], o] for s, p, o in told])
    assert verdicts(boxes, triplets).tolist() == list(told.values())
    margin = margins(boxes, triplets)
    assert [(m >= 0) == (v != 0) for m, v in zip(margin.tolist(), told.values(), strict=True)] == [True] * len(told)


def test_symmetry_of_what_has_a_front_includes_its_heading():
    boxes = boxes_of(np.ones((4, 3)), [[0, 0, 1.5], [0, 0, -1.5], [0, 0, -1.5], [0, 0, -1.5]])
    boxes = Boxes(boxes.size, boxes.position, torch.tensor([0.0, math.pi / 2, math.pi, math.pi - 0.4]))
    triplets = torch.tensor([[0, 12, 1], [0, 12, 2], [0, 12, 3], [0, 12, 0]])[:3]
    beds, tables = fronts(["single_bed"] * 4), fronts(["side_table", "bed", "Teppich", "stool"])
    assert beds.tolist() == [True] * 4
    assert tables.tolist() == [False, True, False, False]
    assert verdicts(boxes, triplets).tolist() == [1, 1, 1]  # places alone
    assert verdicts(boxes, triplets, fronts=tables).tolist() == [1, 1, 1]
    assert verdicts(boxes, triplets, fronts=beds).tolist() == [0, 1, 1]  # at right angles; mirrored; 23 degrees off
    assert verdicts(boxes, triplets, fronts=beds, rules="sgfront").tolist() == [1, 1, 1]
    askew = torch.tensor([1.3, math.pi - 0.6, math.pi - 1.2, 0.0])  # the image of 0 looks along pi - 1.3
    assert verdicts(Boxes(boxes.size, boxes.position, askew), triplets[:2], fronts=beds).tolist() == [0, 1]


def test_symmetry_is_about_the_axes_of_the_rooms_centre():
    boxes = boxes_of(np.ones((3, 3)), [[1 + 5, 0, 0.5], [-1 + 5, 0, 0.5], [-1 + 5, 0, -0.5]])
    triplets = torch.tensor([[0, 12, 1], [0, 12, 2]])
    assert verdicts(boxes, triplets, center=torch.tensor([5.0, 0.0])).tolist() == [1, 0]
    assert verdicts(boxes, triplets, center=torch.tensor([5.0, 0.0]), rules="sgfront").tolist() == [1, 1]
    assert verdicts(boxes, triplets).tolist() == [0, 0]


def test_scene_batches_equal_single_scenes():
    one, two = random_boxes(7, 3), random_boxes(5, 4)
    both = SimpleNamespace(**{k: torch.cat([getattr(one, k), getattr(two, k)]) for k in ("size", "position", "yaw")})
    triplets = [all_triplets(7, range(1, 13)), all_triplets(5, range(1, 13))]
    joined = torch.cat([triplets[0], triplets[1] + torch.tensor([7, 0, 7])])
    for rules in ("strict", "sgfront"):
        single = [margins(b, t, rules=rules) for b, t in zip((one, two), triplets, strict=True)]
        assert torch.equal(margins(both, joined, rules=rules), torch.cat(single))


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_margins_are_finite_and_their_gradient_improves_them(rules):
    boxes = random_boxes(8, 5)
    boxes.position[1], boxes.size[1], boxes.yaw[1] = boxes.position[0], boxes.size[0], boxes.yaw[0]  # a coincidence
    for leaf in (boxes.size, boxes.position, boxes.yaw):
        leaf.requires_grad_(True)
    triplets = all_triplets(8, sorted(measured(rules)))
    margin = margins(boxes, triplets, rules=rules)
    assert torch.isfinite(margin).all()
    loss = torch.relu(0.01 - margin).sum()
    loss.backward()
    leaves = [leaf for leaf in (boxes.size, boxes.position, boxes.yaw) if leaf.grad is not None]
    assert len(leaves) >= 2
    assert all(torch.isfinite(leaf.grad).all() for leaf in leaves)
    with torch.no_grad():
        for leaf in leaves:
            leaf -= 1e-5 * leaf.grad
        assert torch.relu(0.01 - margins(boxes, triplets, rules=rules)).sum() < loss


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_margins_of_pairs_are_those_of_their_boxes(rules):
    boxes = random_boxes(6, 9)
    triplets = all_triplets(6, [*sorted(measured(rules)), P["same_style_as"]])
    subject, predicate, object_ = triplets.unbind(1)
    pair = pairs(boxes, subject, object_, torch.zeros(6, 3), oriented=rule_set(rules).oriented)
    assert torch.allclose(pair_margins(pair, predicate, rule_set(rules)), margins(boxes, triplets, rules=rules))


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_labels_are_exactly_what_the_rules_accept(rules):
    boxes = random_boxes(9, 7)
    room = room_of(["chair"] * 9, boxes.size.numpy(), boxes.position.numpy(), boxes.yaw.numpy())
    labels = label_relations(room, rules=rules)
    kept = verdicts(room, torch.from_numpy(labels), rules=rules)
    assert (kept != 0).all()
    assert labels.tolist() == sorted(labels.tolist(), key=lambda row: (row[0], row[2], row[1]))
    if rules == "strict":
        every = all_triplets(9, sorted(rule_set(rules).labels))
        satisfied = {tuple(t) for t, m in zip(every.tolist(), margins(room, every).tolist(), strict=True) if m > 3e-4}
        near = vocabulary().predicate_id("close_by")  # more is near than what rooms are labelled with
        assert {t for t in satisfied if t[1] != near} <= {tuple(t) for t in labels.tolist()}


def test_what_stands_in_the_middle_of_a_long_side_is_near_and_labelled_by_corners_alone():
    size, position = [[2.4, 0.75, 0.9], [0.5, 0.9, 0.5], [0.4, 0.3, 0.4]], [[0, 0, 0], [0, 0, 0.65], [0, 2.1, 0]]
    room = room_of(["dining_table", "dining_chair", "pendant_lamp"], size, position)
    near = vocabulary().predicate_id("close_by")
    told = torch.tensor([[1, near, 0], [2, near, 0]])
    assert verdicts(room, told).tolist() == [1, 0]  # the lamp hangs far above it
    assert not (label_relations(room)[:, 1] == near).any()


@pytest.mark.parametrize(("words", "wide", "most"), [
    (("sideboard", "dining_table"), (1.4, 1.8), 0.9), (("armchair", "coffee_table"), (0.8, 1.1), 0.55),
    (("wardrobe", "double_bed"), (2.4, 2.0), 0.9), (("bookshelf", "bookshelf"), (0.8, 0.8), NEAR),
])  # fmt: skip
def test_what_is_near_is_half_as_far_as_the_longer_one_is_long_or_its_corners_are_near(words, wide, most):
    size = [[long, 0.8, 0.3] for long in wide]
    told = torch.tensor([[0, vocabulary().predicate_id("close_by"), 1]])
    for gap, kept in ((most - 0.01, 1), (most + 0.01, 0)):
        room = room_of(list(words), size, [[0, 0, 0.3 + gap], [0, 0, 0]])
        far = room_of(list(words), size, [[wide[0] / 2 + wide[1] / 2 + gap, 0, 0], [0, 0, 0]])
        assert [verdicts(one, told).tolist() for one in (room, far)] == [[kept]] * 2


def test_labels_from_style_category_and_model():
    room = room_of(
        ["double_bed", "nightstand", "kids_bed", "nightstand"],
        np.ones((4, 3)),
        [[0, 0, 0], [1, 0, 1], [-1, 0, 1], [1, 0, -1]],
        styles=(3, 3, -1, 4),
        models=("a", "b", "c", "b"),
    )
    labels = {tuple(t) for t in label_relations(room).tolist()}
    assert (0, P["same_style_as"], 1) in labels
    assert (1, P["same_style_as"], 3) in labels  # one model
    assert (1, P["same_material_as"], 3) in labels
    assert (0, P["same_material_as"], 1) not in labels
    assert (0, P["same_super_category_as"], 2) in labels
    assert (0, P["same_style_as"], 2) not in labels
    assert (1, P["symmetrical_to"], 3) in labels
    assert (0, P["symmetrical_to"], 2) not in labels  # another class


def test_dropping_is_seeded_and_joined_labels_equal_single_ones():
    rooms = [room_of(["chair"] * n, b.size.numpy(), b.position.numpy(), b.yaw.numpy()) for n in (6, 1, 8) for b in
             [random_boxes(n, n)]]  # fmt: skip
    assert [len(edges) == 0 for edges in label_rooms(rooms)] == [False, True, False]
    for room, edges in zip(rooms, label_rooms(rooms), strict=True):
        assert np.array_equal(edges, label_relations(room))
    full = label_relations(rooms[2])
    half = label_relations(rooms[2], drop=0.5, rng=np.random.default_rng(1))
    assert {tuple(t) for t in half.tolist()} < {tuple(t) for t in full.tolist()}
    assert 0.35 < len(half) / len(full) < 0.65
    assert np.array_equal(half, label_relations(rooms[2], drop=0.5, rng=np.random.default_rng(1)))


def test_errors_name_what_is_allowed():
    room = room_of(["chair"], np.ones((1, 3)), np.zeros((1, 3)))
    with pytest.raises(ValueError, match="unknown rules 'loose': allowed are strict, sgfront"):
        label_relations(room, rules="loose")
    with pytest.raises(ValueError, match=r"drop is 1\.5: allowed is a probability, 0 to 1"):
        label_relations(room, drop=1.5)
    with pytest.raises(ValueError, match="needs rng"):
        label_relations(room, drop=0.5)


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_rigid_margins_pull_at_sizes_for_sizes_alone(rules):
    boxes = random_boxes(6, 3)
    triplets = all_triplets(6, sorted(measured(rules)))
    whole, rigid = (margins(boxes, triplets, rules=rules, rigid=flag) for flag in (False, True))
    assert torch.equal(whole, rigid)
    boxes.size.requires_grad_()
    boxes.position.requires_grad_()
    of_size = torch.tensor([P[f"{word}_than"] for word in ("bigger", "smaller", "taller", "shorter")])
    of_size = torch.isin(triplets[:, 1], of_size)
    found = margins(boxes, triplets, rules=rules, rigid=True)

    def pull(values, at):
        (slope,) = torch.autograd.grad(values.square().sum(), at, retain_graph=True, materialize_grads=True)
        return float(slope.abs().sum())

    assert pull(found[~of_size], boxes.size) == 0
    assert pull(found[of_size], boxes.size) > 0
    assert pull(found[~of_size], boxes.position) > 0


def test_what_is_told_is_near_and_grows():
    for room in generate_rooms(8, seed=71):
        edges = torch.from_numpy(label_relations(room))
        few, many = (stated_relations(edges, room, per, torch.Generator().manual_seed(0)) for per in (0.5, 2.0))
        assert len(few) == round(0.5 * len(room))
        assert len(few) <= len(many) <= 2 * len(room)
        assert {tuple(row) for row in few.tolist()} <= {tuple(row) for row in edges.tolist()}
        pairs = {frozenset(row[::2]) for row in few.tolist()}
        assert len(pairs) == len(few)  # one relation for each pair


@pytest.mark.parametrize("gaps", [(0.02, 0.05, 0.1, 0.2), (0.1, 0.4, 0.9, 1.5), (0.5, 0.9, 1.4, 2.0)])
def test_the_nearest_pairs_are_told_first_at_every_distance(gaps):
    """Of things in a row, whose gaps grow by more than luck blurs them; those that overlap are nearest."""
    at = np.cumsum([0.0, 0.3, *(0.5 + gap for gap in gaps)])
    room = boxes_of(np.full((len(at), 3), 0.5), np.stack([at, 0 * at, 0 * at], 1))
    edges = torch.tensor([[number + 1, P["front"], number] for number in range(len(at) - 1)])
    for seed in range(5):
        told = stated_relations(edges, room, 5.0, torch.Generator().manual_seed(seed))
        assert told.tolist() == edges.tolist()


def test_a_bound_that_is_met_exactly_is_kept_but_for_open_ones():
    for rules, broken in (("strict", set()), ("sgfront", {"standing_on", "symmetrical_to"})):
        chosen = rule_set(rules)
        at_bound = torch.tensor([[0, predicate, 1] for predicate in chosen.margins])
        found = judged(torch.zeros(len(at_bound)), at_bound, rules).tolist()
        names = {row.id: row.name for row in vocabulary().predicates}
        assert {names[p] for p, one in zip(chosen.margins, found, strict=True) if one != 1} == broken
