"""Pairs, echo layers, latent graph and layout denoiser of the compact model, each beside its slow obvious twin."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel
from echomodel.compact.modules import EchoLayer
from echomodel.compact.pairs import Pairs, inverse_predicates, pair_messages, pairs_of
from echomodel.config import CompactConfig, from_dict, names_of
from echomodel.graph import GraphBatch

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True)
SMALL = from_dict(CompactConfig, {"latent": {"width": 16}, "layout": {"width": 32, "layers": 2, "drafts": 1}})


def small_model() -> CompactModel:
    torch.manual_seed(0)
    model = CompactModel(SMALL, STATISTICS, ("latent", "layout"))
    for parameter in model.parameters():  # zero-initialised outputs would hide everything
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.1)
    return model.eval()


def random_graph(nodes: int, triplets: int, seed: int) -> GraphBatch:
    g = torch.Generator().manual_seed(seed)
    rows = []
    for _ in range(triplets):
        subject, target = torch.randperm(nodes, generator=g)[:2].tolist()
        rows.append([subject, int(torch.randint(16, (1,), generator=g)), target])
    category = torch.randint(46, (nodes,), generator=g)
    return GraphBatch.single(category, rows, room_type=seed % 5, floor=(4.0, 3.0 + seed))


def run(model: CompactModel, graph: GraphBatch, boxes: Tensor, level: Tensor) -> Tensor:
    pairs = pairs_of(graph)
    latent = model.latent(graph.category, pairs)
    rules, scale = torch.zeros_like(graph.room_type), model.statistics.scale(graph.category)
    return model.layout(boxes, level, model.layout.context(graph, pairs, latent, rules, scale))


def test_pairs_against_loops() -> None:
    graph = GraphBatch.pack([random_graph(4, 9, 0), random_graph(1, 0, 1), random_graph(3, 5, 2)])
    pairs, inverse = pairs_of(graph), inverse_predicates(names_of("predicates"))
    expected = []
    for i in range(graph.num_nodes):
        for j in range(graph.num_nodes):
            if i == j or graph.scene[i] != graph.scene[j]:
                continue
            told = [0.0] * 32
            for s, p, o in graph.triplets.tolist():
                if (s, o) == (i, j):
                    told[p] = 1.0
                    if inverse[p] >= 0:
                        told[16 + int(inverse[p])] = 1.0
                if (s, o) == (j, i):
                    told[16 + p] = 1.0
                    if inverse[p] >= 0:
                        told[int(inverse[p])] = 1.0
            expected.append((i, j, told))
    assert list(zip(pairs.receiver.tolist(), pairs.sender.tolist(), pairs.stated.tolist(), strict=True)) == expected


def test_repeated_triplets_count_once() -> None:
    graph = random_graph(4, 6, 3)
    twice = graph.with_triplets(torch.cat([graph.triplets, graph.triplets]))
    assert torch.equal(pairs_of(graph).stated, pairs_of(twice).stated)


def test_echo_layer_against_loops() -> None:
    torch.manual_seed(1)
    layer, graph = EchoLayer(8, 32), random_graph(5, 8, 4)
    pairs, x = pairs_of(graph), torch.randn(5, 8)
    normed, rows = layer.norm(x), []
    for i in range(5):
        total = torch.zeros(8)
        for p in range(len(pairs.sender)):
            if pairs.receiver[p] == i:
                ends = layer.ends(normed[i])[:8] + layer.ends(normed[pairs.sender[p]])[8:]
                total = total + torch.nn.functional.silu(ends + layer.told(pairs.stated[p]))
        rows.append(x[i] + layer.message(total / 2))
    expected = torch.stack(rows)
    expected = expected + layer.mlp(layer.norm_mlp(expected))
    torch.testing.assert_close(layer(x, pairs), expected)


def test_pair_messages_gradient() -> None:
    g = torch.Generator().manual_seed(0)
    a, b = (torch.randn(4, 3, generator=g, dtype=torch.float64, requires_grad=True) for _ in range(2))
    e = torch.randn(6, 3, generator=g, dtype=torch.float64, requires_grad=True)
    receiver, sender = torch.tensor([0, 0, 1, 2, 3, 3]), torch.tensor([1, 2, 0, 3, 0, 2])
    assert torch.autograd.gradcheck(lambda *t: pair_messages(*t, receiver, sender), (a, b, e))


def test_a_batch_is_its_single_runs() -> None:
    model = small_model()
    graphs = [random_graph(5, 9, 0), random_graph(1, 0, 1), random_graph(7, 0, 2), random_graph(3, 20, 3)]
    packed = GraphBatch.pack(graphs)
    g = torch.Generator().manual_seed(0)
    boxes, level = torch.randn(packed.num_nodes, 8, generator=g), torch.rand(packed.num_nodes, generator=g)
    with torch.no_grad():
        together = run(model, packed, boxes, level)
        start = 0
        for graph in graphs:
            stop = start + graph.num_nodes
            torch.testing.assert_close(
                run(model, graph, boxes[start:stop], level[start:stop]), together[start:stop], rtol=1e-5, atol=2e-6
            )
            start = stop


def test_the_echo_can_be_taken_out() -> None:
    """Without the echo no object hears of another."""
    graph = random_graph(5, 9, 0)
    boxes, level = torch.randn(5, 8, generator=torch.Generator().manual_seed(1)), torch.full((5,), 0.4)
    torch.manual_seed(0)
    alone = CompactModel(replace(SMALL, layout=replace(SMALL.layout, echo=False)), STATISTICS, ("latent", "layout"))
    for head in alone.layout.heads:
        torch.nn.init.normal_(head.weight, std=0.1)
    moved = boxes.clone()
    moved[0] += 1.0
    with torch.no_grad():
        before, after = (run(alone, graph, given, level) for given in (boxes, moved))
    assert torch.equal(before[1:], after[1:])
    assert not torch.allclose(before[0], after[0])


def test_the_outline_of_the_floor_reaches_the_boxes() -> None:
    model, plain = small_model(), random_graph(4, 6, 1)
    notched = [(-2.0, -2.0), (0.0, -2.0), (0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (-2.0, 2.0)]  # of the same extents
    cut = GraphBatch(plain.category, plain.triplets, plain.scene, plain.room_type, torch.tensor([notched]))
    boxes, level = torch.randn(4, 8, generator=torch.Generator().manual_seed(1)), torch.full((4,), 0.5)
    assert (run(model, plain, boxes, level) - run(model, cut, boxes, level)).abs().max() > 1e-3
    together = run(model, GraphBatch.pack([plain, cut]), boxes.repeat(2, 1), level.repeat(2))
    alone = torch.cat([run(model, graph, boxes, level) for graph in (plain, cut)])
    torch.testing.assert_close(together, alone, rtol=1e-4, atol=1e-5)


def test_drafts_come_before_the_prediction() -> None:
    model, graph = small_model(), random_graph(4, 6, 1)
    pairs, boxes, level = pairs_of(graph), torch.randn(4, 8), torch.full((4,), 0.5)
    latent = model.latent(graph.category, pairs)
    context = model.layout.context(graph, pairs, latent, torch.zeros(1).long(), model.statistics.scale())
    drafts = model.layout.drafts(boxes, level, context)
    assert len(drafts) == 2
    assert torch.equal(drafts[-1], model.layout(boxes, level, context))
    for drafts_, layers in ((-1, 3), (3, 3)):
        settings = {"layout": {"width": 32, "layers": layers, "drafts": drafts_}}
        with pytest.raises(ValueError, match=f"layout.layers {layers} are too few for layout.drafts {drafts_}"):
            CompactModel(from_dict(CompactConfig, settings), STATISTICS, ("layout",))


def test_node_order_does_not_matter() -> None:
    model, graph = small_model(), random_graph(6, 10, 5)
    order = torch.randperm(6, generator=torch.Generator().manual_seed(0))
    place = torch.argsort(order)
    triplets = torch.stack([place[graph.triplets[:, 0]], graph.triplets[:, 1], place[graph.triplets[:, 2]]], dim=1)
    moved = GraphBatch(graph.category[order], triplets, graph.scene, graph.room_type, graph.floor)
    boxes, level = torch.randn(6, 8), torch.rand(6)
    torch.testing.assert_close(
        run(model, moved, boxes[order], level[order]), run(model, graph, boxes, level)[order], rtol=1e-4, atol=1e-5
    )


def test_gradients_reach_encoder_and_manipulator() -> None:
    model, graph = small_model(), random_graph(6, 10, 6)
    run(model, graph, torch.randn(6, 8), torch.rand(6)).square().sum().backward()
    for name, parameter in model.latent.named_parameters():
        if name != "touched":  # only edits use it
            assert parameter.grad is not None, name
            assert parameter.grad.abs().sum() > 0, name


def test_an_edit_acts_through_the_latent_graph_alone() -> None:
    """With the denoiser's own edges held fixed, changing a relation still moves the boxes."""
    model, graph = small_model(), random_graph(4, 5, 7)
    changed = graph.triplets.clone()
    changed[0, 1] = (changed[0, 1] + 1) % 16
    edited = graph.with_triplets(changed)
    boxes, level, rules = torch.randn(4, 8), torch.ones(4), torch.zeros(1, dtype=torch.int64)
    pairs = pairs_of(graph)
    outputs = []
    for source in (graph, edited):
        latent = model.latent(graph.category, pairs_of(source))
        context = model.layout.context(graph, pairs, latent, rules, STATISTICS.scale())
        outputs.append(model.layout(boxes, level, context))
    assert (outputs[0] - outputs[1]).abs().max() > 1e-4


def test_added_nodes_enter_with_an_empty_latent() -> None:
    model, graph = small_model(), random_graph(4, 6, 8)
    pairs, added = pairs_of(graph), torch.tensor([False, True, False, False])
    before = pairs.without(~added, pairs.stated)
    assert not (before.receiver == 1).any()
    assert not (before.sender == 1).any()
    plain = model.latent(graph.category, pairs)
    grown = model.latent(graph.category, pairs, before=before, added=added, touched=added)
    assert (plain - grown).abs().max() > 1e-4


def test_without_keeps_messages_of_others() -> None:
    pairs = pairs_of(random_graph(3, 4, 9))
    kept: Pairs = pairs.without(torch.tensor([True, False, True]), pairs.stated)
    assert kept.receiver.tolist() == [0, 2]
    assert kept.sender.tolist() == [2, 0]


@pytest.mark.parametrize("nodes", [1, 200])
def test_one_and_two_hundred_nodes(nodes: int) -> None:
    model, graph = small_model(), random_graph(nodes, 0, 0)
    with torch.no_grad():
        out = run(model, graph, torch.randn(nodes, 8), torch.ones(nodes))
    assert out.shape == (nodes, 8)
    assert torch.isfinite(out).all()
