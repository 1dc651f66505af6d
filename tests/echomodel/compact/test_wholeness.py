"""Wholeness tells one piece that fills its box from fragments; of several draws the most whole is kept."""

from __future__ import annotations

import torch

from echomodel.compact.wholeness import group_means, wholeness


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
