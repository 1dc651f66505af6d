"""What a draft of the boxes is measured for: gaps to the walls and between pairs, at the right places and signs."""

from __future__ import annotations

import torch

from echomodel.boxes import Boxes
from echomodel.compact.layout import PAIR_FEATURES, WALL_FEATURES, pair_features, temperatures, wall_features
from echomodel.compact.pairs import pairs_of
from echomodel.config import LayoutConfig
from echomodel.graph import GraphBatch
from echomodel.surroundings import centred, padded


def boxes() -> Boxes:
    """A wide box with its back to the wall at -z, a smaller one 0.25 m before it that looks back at it."""
    size, position = torch.tensor([[2.0, 1.0, 1.0], [1.0, 0.5, 0.5]]), torch.tensor([[0.0, 0, -1.0], [0.0, 0, 0.0]])
    return Boxes(size, position, torch.tensor([0.0, torch.pi]))


def test_gaps_to_the_walls() -> None:
    known = torch.from_numpy(centred((4, 3)))[None]
    features = wall_features(boxes(), padded([known, torch.full((1, 4, 2), torch.nan)]))
    assert features.shape == (2, WALL_FEATURES)
    gaps = torch.atanh(features[0, :12]) * 3
    torch.testing.assert_close(gaps[:4], torch.tensor([1.0, 1.0, 2.0, 0.0]), atol=1e-4, rtol=0)  # +x, -x, +z, -z
    torch.testing.assert_close(gaps[[4, 5, 8, 9]], torch.tensor([0.0, 0.0, 1.0, 1.0]), atol=1e-4, rtol=0)
    assert features[0, -1] == 1
    assert not features[1].any()


def test_pairs_are_measured_from_the_receiver() -> None:
    graph = GraphBatch.single([0, 1])
    pairs, own = pairs_of(graph), boxes()
    features = pair_features(own, pairs)
    assert features.shape == (2, PAIR_FEATURES)
    first = features[pairs.receiver == 0][0]
    torch.testing.assert_close(first[:3], torch.tensor([0.0, 0.0, 0.5]))
    torch.testing.assert_close(torch.atanh(first[6:8]) * 0.4, torch.tensor([-1.5, 0.25]), atol=1e-4, rtol=0)
    torch.testing.assert_close(torch.atanh(first[10:12]), torch.tensor([0.0, 1.0]), atol=1e-5, rtol=0)
    back = features[pairs.receiver == 1][0]
    torch.testing.assert_close(torch.atanh(back[10:12]), torch.tensor([0.0, 1.0]), atol=1e-5, rtol=0)  # it looks back
    torch.testing.assert_close(back[17:19], -first[17:19])  # the larger one is larger
    mirrored = Boxes(own.size, torch.tensor([[-1.5, 0, 0.5], [1.5, 0, -0.5]]), own.yaw)
    assert not pair_features(mirrored, pairs)[:, 13:17].any()


def test_gradients_are_finite_where_the_floor_is_unknown() -> None:
    own = boxes()
    position = own.position.clone().requires_grad_()
    floor = padded([torch.from_numpy(centred((4, 3)))[None], torch.full((1, 4, 2), torch.nan)])
    wall_features(Boxes(own.size, position, own.yaw), floor).square().sum().backward()
    assert position.grad is not None
    assert torch.isfinite(position.grad).all()
    assert position.grad[0].any()
    assert not position.grad[1].any()


def test_sizes_vary_whatever_the_temperature_of_places():
    scales = temperatures(LayoutConfig(temperature=0.25), torch.zeros(1))
    assert scales.tolist() == [1.0] * 3 + [0.25] * 5
