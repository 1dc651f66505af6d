"""Relations that ask how objects are turned: measured by the strict rules, never labelled."""

import math

import torch

from echomodel.boxes import Boxes
from echomodel.rules import margins, rule_set, verdicts
from echomodel.vocabulary import vocabulary

WORDS = vocabulary()


def kept(predicate, offset, yaw, other=0.0):
    """Whether a subject at `offset` (x, z) from the object, turned by `yaw`, keeps a relation to it."""
    boxes = Boxes(
        torch.ones(2, 3), torch.tensor([[offset[0], 0.0, offset[1]], [0.0, 0.0, 0.0]]), torch.tensor([yaw, other])
    )
    return bool(verdicts(boxes, torch.tensor([[0, WORDS.predicate_id(predicate), 1]])))


def test_facing():
    assert kept("facing", (0.0, -2.0), 0.0)  # at yaw 0 the front looks along +Z
    assert kept("faces", (0.0, -2.0), math.radians(29))
    assert not kept("facing", (0.0, -2.0), math.radians(31))
    assert kept("looking at", (2.0, 0.0), -math.pi / 2)
    assert not kept("facing", (2.0, 0.0), math.pi / 2)
    assert kept("facing", (0.45, -0.7), 0.0)  # at the end of a table's side, 33 degrees beside its middle
    assert not kept("facing", (0.55, -0.7), 0.0)
    assert not kept("facing", (0.45, 0.7), 0.0)
    bench = Boxes(torch.tensor([[1.0, 1.0, 1.0], [2.4, 1.0, 0.4]]), torch.tensor([[1.0, 0, -0.8], [0, 0, 0]]),
                  torch.zeros(2))  # fmt: skip
    rows = torch.tensor([[0, WORDS.predicate_id("facing"), 1]])
    assert verdicts(bench, rows).tolist() == [1]  # straight ahead at one end of what is long


def test_opposite_asks_both():
    assert kept("across from", (0.0, -2.0), 0.0, math.pi)
    assert not kept("opposite", (0.0, -2.0), 0.0, 0.0)
    assert not kept("opposite", (0.0, -2.0), math.pi, math.pi)


def test_lines_are_the_objects():
    assert kept("aligned_with", (2.0, 0.05), 0.3)
    assert not kept("aligned_with", (2.0, 0.2), 0.0)
    assert kept("aligned_with", (math.sqrt(2), -math.sqrt(2)), 0.0, math.pi / 4)
    assert kept("centered on", (0.05, 3.0), 1.0)
    assert not kept("centered_on", (3.0, 0.05), 1.0)


def test_they_are_differentiable_and_not_labelled():
    position = torch.tensor([[0.3, 0.0, -2.0], [0.0, 0.0, 0.0]], requires_grad=True)
    yaw = torch.tensor([1.0, 0.2], requires_grad=True)
    rows = torch.tensor(
        [[0, WORDS.predicate_id(name), 1] for name in ("facing", "opposite", "aligned_with", "centered_on")]
    )
    margins(Boxes(torch.ones(2, 3), position, yaw), rows).sum().backward()
    assert position.grad.isfinite().all()
    assert yaw.grad.abs().sum() > 0
    assert not set(rows[:, 1].tolist()) & rule_set("strict").labels.keys()
    assert not set(rows[:, 1].tolist()) & rule_set("sgfront").margins.keys()
