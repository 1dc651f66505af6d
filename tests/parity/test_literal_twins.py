"""The fast paths give what the networks give as written: all taps, queries and keys computed."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from literal_networks import literal_layout, literal_shape
from parity_numbers import close, fill

from echoscene.config import UNetConfig, shape_unet
from echoscene.model import LayoutNet, ShapeUNet
from echoscene.unet import packed

LAYOUT = UNetConfig(width=128, context=96, objects=40, hidden=32, layers=3, residual=True)
SHAPE = shape_unet(width=32, mult=(1, 2), blocks=1, attention=(2,), context=48, objects=24, hidden=32, layers=2, grid=8)
TRIPLES = {
    "usual": [[0, 1, 1], [1, 2, 0], [0, 1, 1], [2, 0, 3], [3, 15, 3]],
    "no edges": [],
    "one edge": [[4, 3, 0]],
}


def _graph(name: str) -> torch.Tensor:
    return torch.tensor(TRIPLES[name], dtype=torch.int64).reshape(-1, 3)


CHANGES: list[dict] = [{}, {"time_in_echo": False}, {"residual": False}]
BRANCHES = [
    (LayoutNet, LAYOUT, literal_layout, (6, 8), 1e-4),
    (ShapeUNet, SHAPE, literal_shape, (5, 3, 8, 8, 8), 5e-5),
]


# Every pair of branch, change and graph.
@pytest.mark.parametrize("number", range(9))
def test_both_branches(number: int) -> None:
    graph, change = [*TRIPLES][number // 3], CHANGES[number % 3]
    kind, sizes, literal, shape, tolerance = BRANCHES[(number // 3 + number) % 2]
    config = replace(sizes, **change)
    net = kind(config).eval()
    fill(net, seed=3)
    generator = torch.Generator().manual_seed(1)
    x, objects = torch.randn(shape, generator=generator), torch.randn(shape[0], config.objects, generator=generator)
    t = torch.tensor([0, 999, 5, 5, 500, 999])[: len(x)]
    expected = literal(net, x, objects, _graph(graph), t)
    with torch.inference_mode():
        close(net(x, objects, _graph(graph), t), expected, tolerance)
        if kind is LayoutNet:
            close(packed(net)(x, objects, _graph(graph), t), expected, tolerance)


def test_one_node_alone() -> None:
    layout, shape = LayoutNet(LAYOUT).eval(), ShapeUNet(SHAPE).eval()
    fill(layout, seed=3)
    fill(shape, seed=4)
    t, none = torch.tensor([7]), _graph("no edges")
    x, objects = torch.randn(1, 8), torch.randn(1, LAYOUT.objects)
    with torch.inference_mode():
        close(packed(layout)(x, objects, none, t), literal_layout(layout, x, objects, none, t), 1e-4)
    x, objects = torch.randn(1, 3, 8, 8, 8), torch.randn(1, SHAPE.objects)
    with torch.inference_mode():
        close(shape(x, objects, none, t), literal_shape(shape, x, objects, none, t), 5e-5)
