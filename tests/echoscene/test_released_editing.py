"""Pseudo graphs of the inverse strategy, and their packing."""

from __future__ import annotations

import pytest
import torch
from drawn_noise import Drawn

from echoscene.config import EncoderConfig
from echoscene.echo import pack_changes, pack_scenes, pseudo_graph, without_node
from echoscene.encoder import GraphEncoder, SceneGraphTensors

CONFIG = EncoderConfig(text=6, learned=4, flag=4, hidden=8, layers=2, separated=False)


def _scene(objects: int, related: list[list[int]], texts: bool = True) -> SceneGraphTensors:
    count = objects + 2
    triples = torch.tensor([*related, *([i, 0, count - 1] for i in range(count - 1))])
    classes = torch.tensor([*range(1, objects + 1), 6, 0])
    edges = torch.arange(len(triples) * 6.0).reshape(-1, 6) if texts else None
    return SceneGraphTensors(classes, triples, torch.arange(count * 6.0).reshape(-1, 6), edges)


BED = _scene(3, [[1, 5, 0], [2, 1, 3], [0, 2, 1]])


def _text(subject: int, predicate: int, target: int) -> torch.Tensor:
    return torch.tensor([subject, predicate, target, 0, 0, 0]).float()


def test_a_node_taken_out() -> None:
    graph = without_node(BED, 1)
    assert graph.classes.tolist() == [1, 3, 6, 0]
    assert graph.triples.tolist() == [[1, 1, 2], [0, 0, 3], [1, 0, 3], [2, 0, 3]]
    assert torch.equal(graph.node_text, BED.node_text[[0, 2, 3, 4]])
    assert torch.equal(graph.edge_text, BED.edge_text[[1, 3, 5, 6]])


def test_all_three_kinds_are_drawn_and_fit() -> None:
    seen = {"added": 0, "touched": 0, "none": 0}
    for seed in range(60):
        change = pseudo_graph(BED, torch.Generator().manual_seed(seed), _text)
        before = change.before
        if change.added:
            seen["added"] += 1
            assert len(before.classes) == len(BED.classes) - 1
            assert change.added[0] < 3
        elif change.touched:
            seen["touched"] += 1
            row = int((before.triples != BED.triples).any(1).nonzero()[0])
            subject, predicate, target = before.triples[row].tolist()
            assert change.touched == (subject, target)
            assert row in (0, 2)  # the relation to the floor stays
            assert 1 <= predicate <= 11
            assert predicate != int(BED.triples[row, 1])
            assert torch.equal(before.edge_text[row], _text(subject, predicate, target))
        else:
            seen["none"] += 1
            assert before is BED
    assert min(seen.values()) >= 10


def test_scenes_that_cannot_be_edited_stay() -> None:
    bare = _scene(0, [], texts=False)
    for seed in range(6):
        assert pseudo_graph(bare, torch.Generator().manual_seed(seed)).before is bare
    with pytest.raises(ValueError, match="needs relation_text"):
        pseudo_graph(BED, torch.Generator())


def test_a_packed_change_is_what_single_changes_are() -> None:
    torch.manual_seed(0)
    net = GraphEncoder(CONFIG).eval()
    graphs = [BED, _scene(2, [[0, 8, 1]]), _scene(1, [])]
    seeds = (
        next(s for s in range(99) if getattr(pseudo_graph(g, torch.Generator().manual_seed(s), _text), kind))
        for g, kind in ((BED, "added"), (graphs[1], "touched"), (graphs[2], "added"))
    )
    changes = [pseudo_graph(g, torch.Generator().manual_seed(s), _text) for g, s in zip(graphs, seeds, strict=True)]
    whole, scene = pack_scenes(graphs)
    assert scene.tolist() == [0] * 5 + [1] * 4 + [2] * 3
    change = pack_changes(graphs, changes)
    flags = torch.randn(
        4, 4
    )  # of one added node, two touched ones and one added: ascending, as they stand in the batch
    with torch.inference_mode():
        latent, _ = net.encode(change.before)
        new, _, keep = net.manipulate(latent, whole, added=change.added, touched=change.touched, generator=Drawn(flags))
        singles = []
        for graph, single, noise in zip(graphs, changes, (flags[:1], flags[1:3], flags[3:]), strict=True):
            latent, _ = net.encode(single.before)
            singles.append(
                net.manipulate(latent, graph, added=single.added, touched=single.touched, generator=Drawn(noise))
            )
    assert torch.allclose(new, torch.cat([s[0] for s in singles]), atol=1e-5)
    assert torch.equal(keep, torch.cat([s[2] for s in singles]))
    assert int((~keep).sum()) == 4
