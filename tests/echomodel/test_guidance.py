"""Relation guidance pulls boxes to where the rules want them, leaves known ones alone and heeds the floor."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.guidance import outside, relation_guided
from echomodel.rules import verdicts

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True)
# 0 is to the right of 1 (larger z), close by it, and bigger than it
TRIPLETS = torch.tensor([[0, 2, 1], [0, 5, 1], [0, 8, 1], [0, 13, 1]])


def start() -> Boxes:
    return Boxes(torch.full((2, 3), 0.5), torch.tensor([[0.5, 0.0, -1.0], [0.0, 0.0, 1.5]]), torch.zeros(2))


def guide(boxes: Boxes, level: Tensor, triplets: Tensor = TRIPLETS, floor: Tensor | None = None) -> Boxes:
    x = boxes.encode(STATISTICS)
    pull = relation_guided(
        lambda x, level: x, triplets, STATISTICS, rules="strict", strength=0.2, rounds=60, floor=floor
    )
    return Boxes.decode(pull(x, level), STATISTICS)


def test_broken_relations_become_kept() -> None:
    boxes = start()
    assert verdicts(boxes, TRIPLETS).tolist() == [0, 0, 0, -1]
    assert verdicts(guide(boxes, torch.full((2,), 0.1)), TRIPLETS).tolist() == [1, 1, 1, -1]


def test_furniture_moves_aside_and_does_not_shrink() -> None:
    boxes = start()
    guided = guide(boxes, torch.full((2,), 0.1), TRIPLETS[:2], torch.full((2, 2), 1.2))
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
    boxes, floor = start(), torch.tensor([[4.0, 3.0], [torch.nan, 2.0]])
    assert outside(boxes, floor).tolist() == [[0.0, 0.0], [0.0, 0.75]]
    guided = guide(boxes, torch.full((2,), 0.1), TRIPLETS[:0], floor)
    assert outside(guided, floor).max() < 0.01
    torch.testing.assert_close(guided.position[0], boxes.position[0])


def test_nothing_to_measure_leaves_the_denoiser_alone() -> None:
    def predict(x: Tensor, level: Tensor) -> Tensor:
        return x

    same = relation_guided(predict, TRIPLETS[3:], STATISTICS, rules="strict", strength=0.1)
    assert same is predict
