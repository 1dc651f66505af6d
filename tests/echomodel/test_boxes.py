"""Boxes: normalisation there and back, room frame, bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.roomboxes import RoomBoxes
from echomodel.training.layout_stage import statistics_of


def random_boxes(count: int = 50) -> Boxes:
    g = torch.Generator().manual_seed(3)
    size = torch.rand(count, 3, generator=g) * 2 + 0.1
    return Boxes(size, torch.randn(count, 3, generator=g) * 2, (torch.rand(count, generator=g) * 2 - 1) * 3.1)


@pytest.mark.parametrize("log_size", [False, True])
def test_encode_decode_round_trip(log_size: bool) -> None:
    boxes = random_boxes()
    statistics = BoxStatistics((-2, -2, -2), (1, 1, 2), (-3, -1, -3), (3, 1, 2), log_size=log_size)
    back = Boxes.decode(boxes.encode(statistics.scale()), statistics.scale())
    for name in ("size", "position", "yaw"):
        torch.testing.assert_close(getattr(back, name), getattr(boxes, name), rtol=1e-5, atol=1e-5)


def test_published_normalisation() -> None:
    statistics = BoxStatistics((0, 0, 0), (2, 4, 2), (-3, 0, -3), (3, 2, 3))
    box = Boxes(torch.tensor([[1.0, 4, 0]]), torch.tensor([[3.0, 1, -3]]), torch.tensor([np.pi / 2]))
    vector = box.encode(statistics.scale())
    torch.testing.assert_close(vector, torch.tensor([[0.0, 1, -1, 1, 0, -1, 1, 0]]), rtol=0, atol=1e-6)


def test_sizes_become_standard_scores_of_their_class_and_statistics_survive_json() -> None:
    boxes, category = random_boxes(4000), torch.arange(4000) % 4 // 2
    boxes = Boxes(torch.where(category[:, None] == 1, 5 * boxes.size.square(), boxes.size), boxes.position, boxes.yaw)
    statistics = statistics_of(boxes, category, 3)
    vectors = boxes.encode(statistics.scale(category))
    for number in (0, 1):
        scores = vectors[category == number, :3].quantile(torch.tensor([0.05, 0.5, 0.95]), dim=0)
        torch.testing.assert_close(scores, torch.tensor([-1.645, 0.0, 1.645])[:, None].expand(3, 3), rtol=0, atol=0.01)
    assert vectors[:, 3:6].std(0).sub(1).abs().max() < 0.1
    assert statistics.position_high[0] == statistics.position_high[2]
    assert len(statistics.classes) == 3  # the third has no boxes and gets the spread of all
    assert BoxStatistics.from_json(statistics.to_json()) == statistics
    back = Boxes.decode(vectors, statistics.scale(category))
    torch.testing.assert_close(back.size, boxes.size, rtol=1e-4, atol=1e-4)
    with pytest.raises(ValueError, match="the classes of the boxes are needed"):
        boxes.encode(statistics.scale())
    with pytest.raises(ValueError, match=r"class 0 is .* expected nine numbers"):
        replace(statistics, classes=((0.0,) * 9,))


def test_room_is_centred_on_its_floor() -> None:
    room = RoomBoxes(
        "r", "bedroom", np.array([[1, 2], [5, 2], [5, 8], [1, 8.0]]), 2.6, ("stool",),
        np.ones((1, 3)), np.array([[3.0, 0.5, 5.0]]), np.zeros(1),
    )  # fmt: skip
    assert room.boxes().position.tolist() == [[0.0, 0.5, 0.0]]


def test_bad_input_is_named() -> None:
    with pytest.raises(ValueError, match=r"shapes \(2, 3\), \(2, 3\), \(1,\)"):
        Boxes(torch.ones(2, 3), torch.ones(2, 3), torch.ones(1))
    with pytest.raises(ValueError, match="box 1 has an extent that is not positive"):
        Boxes(torch.tensor([[1.0, 1, 1], [1, 0, 1]]), torch.zeros(2, 3), torch.zeros(2)).check()
    with pytest.raises(ValueError, match="box 0 is not finite"):
        Boxes(torch.full((1, 3), torch.nan), torch.zeros(1, 3), torch.zeros(1)).check()
    with pytest.raises(ValueError, match="size_high"):
        BoxStatistics((0, 0, 0), (1, 0, 1), (0, 0, 0), (1, 1, 1))
