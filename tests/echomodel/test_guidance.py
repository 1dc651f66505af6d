"""Relation guidance pulls boxes to where the rules want them, leaves known ones alone and heeds the floor."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.floors import kept_free, opening_rows, rectangle
from echomodel.guidance import outside, relation_guided
from echomodel.openings import Opening
from echomodel.rules import fronts, verdicts
from echomodel.rules.placements import Stated, placement_margins
from echomodel.vocabulary import vocabulary

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True)
# 0 is to the right of 1 (larger z), close by it, and bigger than it
TRIPLETS = torch.tensor([[0, 2, 1], [0, 5, 1], [0, 8, 1], [0, 13, 1]])


def start() -> Boxes:
    return Boxes(torch.full((2, 3), 0.5), torch.tensor([[0.5, 0.0, -1.0], [0.0, 0.0, 1.5]]), torch.zeros(2))


def guide(
    boxes: Boxes, level: Tensor, triplets: Tensor = TRIPLETS, floor: Tensor | None = None, strength: float = 0.2
) -> Boxes:
    x = boxes.encode(STATISTICS.scale())
    pull = relation_guided(
        lambda x, level: x, triplets, STATISTICS.scale(), rules="strict", strength=strength, rounds=60, floor=floor
    )
    return Boxes.decode(pull(x, level), STATISTICS.scale())


def test_broken_relations_become_kept() -> None:
    boxes = start()
    assert verdicts(boxes, TRIPLETS).tolist() == [0, 0, 0, -1]
    assert verdicts(guide(boxes, torch.full((2,), 0.1)), TRIPLETS).tolist() == [1, 1, 1, -1]


def test_furniture_moves_aside_and_does_not_shrink() -> None:
    boxes = start()
    guided = guide(boxes, torch.full((2,), 0.1), TRIPLETS[:2], rectangle(1.2, 1.2).expand(2, 4, 2))
    assert verdicts(guided, TRIPLETS[:2]).tolist() == [1, 1]
    torch.testing.assert_close(guided.size, boxes.size)


def test_known_boxes_stay() -> None:
    boxes = start()
    guided = guide(boxes, torch.tensor([0.1, 0.0]))
    torch.testing.assert_close(guided.position[1], boxes.position[1])
    torch.testing.assert_close(guided.size[1], boxes.size[1])
    assert verdicts(guided, TRIPLETS).tolist() == [1, 1, 1, -1]


def test_kept_relations_change_nothing() -> None:
    boxes = guide(start(), torch.full((2,), 0.1))
    again = guide(boxes, torch.full((2,), 0.1))
    torch.testing.assert_close(again.position, boxes.position, rtol=0, atol=2e-3)


def test_boxes_are_brought_back_onto_the_floor() -> None:
    boxes = start()
    notched = [(-2.0, -1.5), (0.0, -1.5), (0.0, -0.5), (2.0, -0.5), (2.0, 1.5), (-2.0, 1.5)]
    floor = torch.stack([torch.tensor(notched), torch.full((6, 2), torch.nan)])
    missed = outside(boxes, floor)
    assert missed[0].max() == 0.75  # the first stands in the notch, its back farthest
    assert missed[1].max() == 0  # nothing is known of the second one's floor
    guided = guide(boxes, torch.full((2,), 0.1), TRIPLETS[:0], floor)
    assert outside(guided, floor).max() < 0.01
    torch.testing.assert_close(guided.position[1], boxes.position[1])
    torch.testing.assert_close(guided.size, boxes.size)


def test_a_box_larger_than_its_floor_stands_in_the_middle() -> None:
    wide = Boxes(torch.tensor([[2.4, 0.5, 0.5]]), torch.tensor([[0.3, 0.0, 0.0]]), torch.zeros(1))
    guided = guide(wide, torch.full((1,), 0.1), TRIPLETS[:0], rectangle(2.0, 2.0)[None], strength=0.02)
    assert guided.position[0, 0].abs() < 0.05
    torch.testing.assert_close(guided.size, wide.size)


def test_in_nothing_but_noise_boxes_stay() -> None:
    boxes, floor = start(), rectangle(1.2, 1.2).expand(2, 4, 2)
    x = boxes.encode(STATISTICS.scale())
    assert verdicts(boxes, TRIPLETS).min() < 1
    pull = relation_guided(lambda x, level: x, TRIPLETS, STATISTICS.scale(), rules="strict", strength=0.2, floor=floor)
    assert torch.equal(pull(x, torch.ones(2)), x)
    assert not torch.equal(pull(x, torch.tensor([0.9, 1.0])), x)


def test_nothing_to_measure_leaves_the_denoiser_alone() -> None:
    def predict(x: Tensor, level: Tensor) -> Tensor:
        return x

    same = relation_guided(predict, TRIPLETS[3:], STATISTICS.scale(), rules="strict", strength=0.1)
    assert same is predict


def test_furniture_is_pulled_out_of_the_way_of_doors() -> None:
    room = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
    door = Opening("door", "door", 0, 1.5, 0.9, 2.0, 0.0)
    rows = opening_rows([door], room)[None].expand(2, -1, -1)
    boxes = Boxes(torch.full((2, 3), 0.5), torch.tensor([[0.1, 0.0, -1.5], [1.2, 0.0, 1.5]]), torch.zeros(2))
    before = kept_free(boxes, rows)
    assert before[0] < -0.1
    assert before[1] > 0
    x = boxes.encode(STATISTICS.scale())
    none = torch.zeros(0, 3, dtype=torch.int64)
    pull = relation_guided(
        lambda x, level: x, none, STATISTICS.scale(), rules="strict", strength=0.2, rounds=60, openings=rows
    )
    guided = Boxes.decode(pull(x, torch.full((2,), 0.1)), STATISTICS.scale())
    assert kept_free(guided, rows).min() > 0
    torch.testing.assert_close(guided.position[1], boxes.position[1])
    torch.testing.assert_close(guided.size, boxes.size)


def test_placements_are_guided_to() -> None:
    words = vocabulary()
    kinds = [row.name for row in words.placements]
    category = torch.tensor([words.category_id(word) for word in ("wardrobe", "plant", "coffee_table", "sofa")])
    boxes = Boxes(
        torch.full((4, 3), 0.5),
        torch.tensor([[0.7, 0.0, 0.4], [0.8, 0.0, -0.8], [-1.2, 0.0, 1.2], [1.2, 0.0, 1.2]]),
        torch.tensor([3.0, 0.0, 0.0, 0.0]),
    )
    rows = [[0, kinds.index("against_wall"), -1, -1], [1, kinds.index("in_corner"), -1, -1],
            [2, kinds.index("between"), 1, 3]]  # fmt: skip
    stated = [Stated("against_wall", 0), Stated("in_corner", 1), Stated("between", 2, (1, 3))]
    floor = rectangle(4.0, 4.0)
    words_of = [words.categories[k].name for k in category.tolist()]
    assert (placement_margins(boxes, stated, floor.numpy(), words_of) < 0).all()
    x, none = boxes.encode(STATISTICS.scale()), torch.zeros(0, 3, dtype=torch.int64)
    pull = relation_guided(
        lambda x, level: x, none, STATISTICS.scale(), rules="strict", strength=0.05, rounds=300,
        floor=floor.expand(4, -1, -1), category=category, placements=torch.tensor(rows),
    )  # fmt: skip
    guided = Boxes.decode(pull(x, torch.full((4,), 0.1)), STATISTICS.scale())
    assert (placement_margins(guided, stated, floor.numpy(), words_of) > -0.01).all()
    torch.testing.assert_close(guided.size, boxes.size)


def test_without_walls_only_what_needs_none_is_guided() -> None:
    kinds = [row.name for row in vocabulary().placements]
    rows = torch.tensor([[0, kinds.index("against_wall"), -1, -1]])
    x, none = start().encode(STATISTICS.scale()), torch.zeros(0, 3, dtype=torch.int64)
    pull = relation_guided(
        lambda x, level: x, none, STATISTICS.scale(), rules="strict", strength=0.2, category=torch.zeros(2).long(),
        placements=rows,
    )  # fmt: skip
    torch.testing.assert_close(pull(x, torch.full((2,), 0.1)), x)


def test_beds_that_mirror_each_other_are_turned_alike() -> None:
    words = vocabulary()
    category = torch.tensor([words.category_id("single_bed")] * 2)
    triplets = torch.tensor([[0, words.predicate_id("symmetrical_to"), 1]])
    size = torch.tensor([[0.9, 0.5, 2.0]] * 2)
    boxes = Boxes(size, torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), torch.tensor([torch.pi / 2, torch.pi]))
    headed = fronts(["single_bed"] * 2)
    assert verdicts(boxes, triplets, fronts=headed).tolist() == [0]
    pull = relation_guided(
        lambda x, level: x, triplets, STATISTICS.scale(), rules="strict", strength=0.1, rounds=100, category=category
    )
    guided = Boxes.decode(pull(boxes.encode(STATISTICS.scale()), torch.full((2,), 0.1)), STATISTICS.scale())
    assert verdicts(guided, triplets, fronts=headed).tolist() == [1]


def test_pieces_that_run_into_each_other_are_parted_but_for_a_chair_at_its_table() -> None:
    words = vocabulary()
    category = torch.tensor([words.category_id(word) for word in ("wardrobe", "desk", "office_chair", "wardrobe")])
    boxes = Boxes(
        torch.tensor([[1.0, 2.0, 0.6], [1.2, 0.75, 0.6], [0.5, 0.9, 0.5], [1.0, 2.0, 0.6]]),
        torch.tensor([[0.0, 0.0, 0.0], [0.6, 0.0, 0.2], [0.6, 0.0, 0.6], [0.1, 0.0, 0.1]]),
        torch.zeros(4),
    )
    x, none = boxes.encode(STATISTICS.scale()), torch.zeros(0, 3, dtype=torch.int64)
    pull = relation_guided(
        lambda x, level: x, none, STATISTICS.scale(), rules="strict", strength=0.05, rounds=100, category=category,
        scene=torch.tensor([0, 0, 0, 1]),
    )  # fmt: skip
    guided = Boxes.decode(pull(x, torch.full((4,), 0.1)), STATISTICS.scale())
    away = (guided.position - boxes.position)[:, [0, 2]].norm(dim=1)
    assert away[3] < 1e-5  # alone in its room
    gap = (guided.position[0] - guided.position[1])[[0, 2]].abs() - torch.tensor([1.1, 0.6])
    assert gap.max() > -0.02
    chair = (guided.position[2] - guided.position[1])[2]
    assert 0.3 < chair < 0.55  # still under the desk
    torch.testing.assert_close(guided.size, boxes.size)
