"""Wholeness tells one piece that fills its box from fragments; of several draws the most whole is kept."""

from __future__ import annotations

import math
from dataclasses import replace

import torch

from echomodel.boxes import Boxes
from echomodel.compact.sampling import group_means
from echomodel.compact.shape import bearing, wholeness


def solid(*boxes: tuple[slice, slice, slice]) -> torch.Tensor:
    grid = torch.ones(64, 64, 64)
    for box in boxes:
        grid[box] = -1.0
    return grid


def test_wholeness() -> None:
    full = slice(2, 62)
    whole, low, empty = solid((full, full, full)), solid((full, slice(2, 32), full)), torch.ones(64, 64, 64)
    halves = solid((slice(2, 31), full, full), (slice(33, 62), full, full))
    found = wholeness(torch.stack([whole, low, halves, empty]))
    assert torch.allclose(found, torch.tensor([1.0, 0.5, 0.5, 0.0]))


def test_group_means() -> None:
    found = group_means(torch.tensor([1.0, 0.0, 0.5, 0.25]), torch.tensor([0, 0, 2, 3]))
    assert torch.allclose(found, torch.tensor([0.5, 0.5, 0.5, 0.25]))


def test_a_shelf_at_the_back_bears_no_lamp_in_the_middle() -> None:
    plain, hutch = torch.ones(64, 64, 64), torch.ones(64, 64, 64)
    plain[2:62, 2:62, 2:62] = -1
    hutch[2:62, 2:30, 2:62] = -1
    hutch[2:62, 2:62, 2:12] = -1  # the back is at -Z
    boxes = Boxes(
        torch.tensor([[1.4, 1.2, 0.6], [0.2, 0.4, 0.2]]),
        torch.tensor([[1.0, 0.0, 2.0], [1.0, 1.2, 2.0]]),
        torch.tensor([math.pi / 2, 0.0]),
    )
    told = torch.tensor([[1, 7, 0], [0, 1, 1]])
    lamp = torch.ones(64, 64, 64)
    assert bearing(torch.stack([plain, lamp]), boxes, told).tolist() == [1.0, 1.0]
    assert bearing(torch.stack([hutch, lamp]), boxes, told).tolist() == [0.0, 1.0]
    # turned by a quarter the back lies at -X of the room: there the shelf bears
    behind = replace(boxes, position=torch.tensor([[1.0, 0.0, 2.0], [0.73, 1.2, 2.0]]))
    assert bearing(torch.stack([hutch, lamp]), behind, told).tolist() == [1.0, 1.0]
    assert bearing(torch.stack([hutch, lamp]), boxes, told[1:]).tolist() == [1.0, 1.0]
