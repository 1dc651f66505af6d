"""Cost of the compact model, counted by torch's flop counter: python benchmarks/compact_budget.py [--json]."""

from __future__ import annotations

import json
import sys

import torch
from torch.utils.flop_counter import FlopCounterMode

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.model import PARTS, CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.config import CompactConfig
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch

LIMITS = {
    "layout MFLOP per node and step": 30.0,
    "shape GFLOP per object and step": 4.0,
    "decode GFLOP per object": 20.0,
    "million parameters": 21.0,
    "room of 8 with shapes, TFLOP": 1.0,
}


def dense_graph(nodes: int) -> GraphBatch:
    """A room in which every ordered pair is related, the most that an echo can cost."""
    triplets = [[i, 1 + (i + j) % 12, j] for i in range(nodes) for j in range(nodes) if i != j]
    return GraphBatch.single([i % 46 for i in range(nodes)], triplets, floor=(5.0, 4.0))


def flops(call) -> float:
    """Floating-point operations of one call without gradients."""
    with torch.no_grad(), FlopCounterMode(display=False) as counter:
        call()
    return float(counter.get_total_flops())


def budget() -> dict[str, float]:
    """What each part of the compact preset costs; the figures do not depend on the weights."""
    config, nodes = CompactConfig(), 12
    statistics = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3, log_size=True)
    model = CompactModel(config, statistics, PARTS).eval()  # those that ship
    graph = dense_graph(nodes)
    pairs = pairs_of(graph)
    latent = model.latent(graph.category, pairs)
    layout = model.layout.context(graph, pairs, latent, torch.zeros(1, dtype=torch.int64), statistics.scale())
    shape = model.shape.context(graph, torch.ones(nodes, 3), pairs, latent)
    coder = model.autoencoder
    level, codes = torch.ones(nodes), torch.randn(nodes, config.shape.components)
    cells = torch.randn(1, coder.channels, coder.cells, coder.cells, coder.cells)
    noisy = torch.randn(nodes, 8)
    room = dense_graph(8)
    boxes = Boxes(torch.ones(8, 3), torch.zeros(8, 3), torch.zeros(8))
    echo = EchoModel(model)

    def whole_room() -> None:
        generator = torch.Generator().manual_seed(0)
        echo.sample_layout(room, generator=generator)
        echo.sample_shapes(room, boxes, generator=generator)

    return {
        "layout MFLOP per node and step": flops(lambda: model.layout(noisy, level, layout)) / nodes / 1e6,
        "shape GFLOP per object and step": flops(lambda: model.shape(codes, level, shape)) / nodes / 1e9,
        "decode GFLOP per object": flops(lambda: model.autoencoder.decode(cells)) / 1e9,
        "million parameters": sum(t.numel() for t in model.state_dict().values()) / 1e6,
        "room of 8 with shapes, TFLOP": flops(whole_room) / 1e12,
    }


if __name__ == "__main__":
    found = budget()
    if "--json" in sys.argv:
        print(json.dumps(found))
    else:
        for name, value in found.items():
            print(f"{name:34} {value:8.3f}   at most {LIMITS[name]:g}")
