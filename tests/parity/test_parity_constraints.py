"""Scene graph constraints (`sgfront` rules) against the published metric: verdicts, means, overlap and corners."""

from __future__ import annotations

import pytest
import torch
from parity_numbers import Numbers, close

from echomodel.boxes import Boxes
from echomodel.rules import verdicts
from echomodel.rules.geometry import pairs
from echomodel.vocabulary import vocabulary


def _boxes(numbers: Numbers) -> Boxes:
    raw = numbers["boxes"]
    return Boxes(raw[:, :3], raw[:, 3:6], torch.zeros(len(raw)))


def test_verdicts() -> None:
    numbers = Numbers("metrics_constraints")
    found = verdicts(_boxes(numbers), numbers["triples"], rules="sgfront")
    assert found.tolist() == numbers["per_triple"].tolist()


@pytest.mark.parametrize("kind", ["", "changed_", "unchanged_"])
def test_means_and_counts(kind: str) -> None:
    """All triplets, those with an end that was edited, and those between nodes that were kept."""
    numbers = Numbers("metrics_constraints")
    triples, keep = numbers["triples"], numbers["keep"][:, 0] > 0
    found = verdicts(_boxes(numbers), triples, rules="sgfront")
    both = keep[triples[:, 0]] & keep[triples[:, 2]]
    chosen = {"": torch.ones_like(both), "changed_": ~both, "unchanged_": both}[kind]
    ids = {
        word: p.id
        for p in vocabulary().predicates
        if p.sgfront
        for word in (p.sgfront, p.sgfront.removesuffix(" than"))
    }
    for row, name in enumerate(numbers.meta["order"]):
        inside = chosen & (found >= 0)
        if name != "total":
            inside &= triples[:, 1] == ids[name]
        assert int(inside.sum()) == int(numbers[f"{kind}counts"][row]), name
        expected = numbers[f"{kind}means"][row]
        if inside.any():
            close(found[inside].float().mean(), expected, 1e-6)


def test_overlap_and_corners() -> None:
    numbers = Numbers("metrics_constraints")
    boxes = _boxes(numbers)
    count = len(boxes)
    first, second = torch.meshgrid(torch.arange(count), torch.arange(count), indexing="ij")
    wide = Boxes(boxes.size.double(), boxes.position.double(), boxes.yaw.double())
    geometry = pairs(wide, first.flatten(), second.flatten(), torch.zeros(count, 3).double(), oriented=False)
    other = ~torch.eye(count, dtype=torch.bool)
    overlap = geometry.overlap_ratio.reshape(count, count)
    expected = numbers["overlap_over_min_volume"]
    known = other & torch.isfinite(expected)
    close(overlap[known], expected[known], 1e-5)
    corners = geometry.corner_distance.reshape(count, count)
    known = other & torch.isfinite(numbers["min_corner_distance"])
    close(corners[known], numbers["min_corner_distance"][known].double(), 1e-4)
