"""Boxes: normalisation there and back, room frame, bad input."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.roomboxes import RoomBoxes


def random_boxes(count: int = 50) -> Boxes:
    g = torch.Generator().manual_seed(3)
    size = torch.rand(count, 3, generator=g) * 2 + 0.1
    return Boxes(size, torch.randn(count, 3, generator=g) * 2, (torch.rand(count, generator=g) * 2 - 1) * 3.1)


@pytest.mark.parametrize("log_size", [False, True])
def test_encode_decode_round_trip(log_size: bool) -> None:
    boxes = random_boxes()
    statistics = BoxStatistics((-2, -2, -2), (1, 1, 2), (-3, -1, -3), (3, 1, 2), log_size=log_size)
    back = Boxes.decode(boxes.encode(statistics), statistics)
    for name in ("size", "position", "yaw"):
        torch.testing.assert_close(getattr(back, name), getattr(boxes, name), rtol=1e-5, atol=1e-5)


def test_published_normalisation() -> None:
    statistics = BoxStatistics((0, 0, 0), (2, 4, 2), (-3, 0, -3), (3, 2, 3))
    box = Boxes(torch.tensor([[1.0, 4, 0]]), torch.tensor([[3.0, 1, -3]]), torch.tensor([np.pi / 2]))
    vector = box.encode(statistics)
    torch.testing.assert_close(vector, torch.tensor([[0.0, 1, -1, 1, 0, -1, 1, 0]]), rtol=0, atol=1e-6)


def test_statistics_from_boxes_standardise_and_survive_json() -> None:
    boxes = random_boxes(400)
    statistics = BoxStatistics.from_boxes(boxes)
    vectors = boxes.encode(statistics)
    assert vectors[:, :6].std(0).sub(1).abs().max() < 0.1
    assert statistics.position_high[0] == statistics.position_high[2]
    assert BoxStatistics.from_json(statistics.to_json()) == statistics


def test_room_is_centred_on_its_floor() -> None:
    room = RoomBoxes(
        "r", "bedroom", np.array([[1, 2], [5, 2], [5, 8], [1, 8.0]]), 2.6, ("stool",),
        np.ones((1, 3)), np.array([[3.0, 0.5, 5.0]]), np.zeros(1),
    )  # fmt: skip
    assert Boxes.from_room(room).position.tolist() == [[0.0, 0.5, 0.0]]


def test_bad_input_is_named() -> None:
    with pytest.raises(ValueError, match=r"shapes \(2, 3\), \(2, 3\), \(1,\)"):
        Boxes(torch.ones(2, 3), torch.ones(2, 3), torch.ones(1))
    with pytest.raises(ValueError, match="box 1 has an extent that is not positive"):
        Boxes(torch.tensor([[1.0, 1, 1], [1, 0, 1]]), torch.zeros(2, 3), torch.zeros(2)).check()
    with pytest.raises(ValueError, match="box 0 is not finite"):
        Boxes(torch.full((1, 3), torch.nan), torch.zeros(1, 3), torch.zeros(1)).check()
    with pytest.raises(ValueError, match="size_high"):
        BoxStatistics((0, 0, 0), (1, 0, 1), (0, 0, 0), (1, 1, 1))
