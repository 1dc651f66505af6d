"""Bad input: the compact and the released model on hostile graphs, and what else they refuse."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest
import torch

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.model import CompactModel
from echomodel.config import CompactConfig, from_dict
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.samplers import clean_from
from echomodel.text import ClipTextEncoder, TextEncoderError
from echoscene.config import paper
from echoscene.encoder import SceneGraphTensors
from echoscene.model import ReleasedModel, Schedule

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True)
SIZES = {
    "latent": {"width": 8, "layers": 1},
    "layout": {"width": 16, "layers": 2, "drafts": 1, "steps": 2},
    "autoencoder": {"width": 4},
    "shape": {
        "width": 8, "layers": 1, "heads": 2, "echo_width": 8, "steps": 1, "components": 4, "tokens": 2, "candidates": 1,
    },
}  # fmt: skip
HOSTILE = {
    "no edges": ([3, 4], []),
    "one node": ([3], []),
    "isolated node": ([3, 4, 5], [[0, 1, 1]]),
    "200 nodes": ([k % 13 + 1 for k in range(200)], [[k, 1, k + 1] for k in range(199)]),
}


@pytest.fixture(autouse=True)
def few_mending_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echomodel.compact.sampling.AFTER", 3)


@pytest.fixture(scope="module")
def compact() -> EchoModel:
    torch.manual_seed(0)
    return EchoModel(CompactModel(from_dict(CompactConfig, SIZES), STATISTICS))


@pytest.fixture(scope="module")
def published() -> ReleasedModel:
    torch.manual_seed(0)
    sizes = dict(
        text=12, learned=4, flag=4, hidden=16, layers=2, context=32, code=8, heads=2, layout_width=128,
        layout_mult=(1, 1), shape_width=32, shape_mult=(1, 1), blocks=1, grid=8, vq_channels=4, vq_codes=16,
    )  # fmt: skip
    model = ReleasedModel(paper(14, sizes), statistics=STATISTICS).eval()
    model.layout_tables = Schedule.linear(1e-3, 0.2, 5)
    return model


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(0)


def scene(classes: list[int], triples: list[list[int]]) -> SceneGraphTensors:
    edges = torch.tensor(triples, dtype=torch.int64).reshape(-1, 3)
    return SceneGraphTensors(torch.tensor(classes), edges, torch.ones(len(classes), 12), torch.ones(len(edges), 12))


@pytest.mark.parametrize("name", HOSTILE)
def test_unusual_graphs_get_boxes(compact: EchoModel, published: ReleasedModel, name: str) -> None:
    classes, triples = HOSTILE[name]
    found = compact.sample_layout(GraphBatch.single(classes, triples), generator=seeded())
    found.check()
    assert len(found) == len(classes)
    others = published.sample_layout(scene(classes, triples), generator=seeded())
    assert len(others) == len(classes)
    assert bool(torch.isfinite(others.position).all())


@pytest.mark.parametrize("name", ["no edges", "one node", "isolated node"])
def test_unusual_graphs_get_shapes(compact: EchoModel, published: ReleasedModel, name: str) -> None:
    classes, triples = HOSTILE[name]
    boxes = Boxes(torch.ones(len(classes), 3), torch.zeros(len(classes), 3), torch.zeros(len(classes)))
    grids = compact.sample_shapes(GraphBatch.single(classes, triples), boxes, generator=seeded())
    assert bool(torch.isfinite(grids).all())
    latents = published.sample_shapes(scene(classes, triples), generator=seeded(), steps=1)
    assert bool(torch.isfinite(latents).all())


def test_unknown_ids_are_named(compact: EchoModel, published: ReleasedModel) -> None:
    boxes = Boxes(torch.ones(2, 3), torch.zeros(2, 3), torch.zeros(2))
    unknown = GraphBatch.single([3, 73])
    for call in (
        lambda: compact.sample_layout(unknown, generator=seeded()),
        lambda: compact.sample_shapes(unknown, boxes, generator=seeded()),
    ):
        with pytest.raises(ValueError, match=r"category of node 1 is 73, allowed: 0\.\.72"):
            call()
    for call in (
        lambda: published.sample_layout(scene([3, 14], []), generator=seeded()),
        lambda: published.sample_shapes(scene([3, 14], []), generator=seeded()),
    ):
        with pytest.raises(ValueError, match=r"class of node 1 is 14, allowed: 0\.\.13"):
            call()


def test_nan_in_a_condition_is_named(compact: EchoModel, published: ReleasedModel) -> None:
    graph, noise = GraphBatch.single([3, 4]), torch.zeros(2, 8)
    noise[1, 2] = torch.nan
    with pytest.raises(ValueError, match="noise of node 1 is not finite"):
        compact.sample_layout(graph, generator=seeded(), noise=noise)
    boxes = Boxes(torch.ones(2, 3), torch.zeros(2, 3), torch.tensor([0.0, torch.nan]))
    with pytest.raises(ValueError, match="box 1 is not finite"):
        compact.sample_shapes(graph, boxes, generator=seeded())
    broken = scene([3, 4], [[0, 1, 1]])
    broken.node_text[1, 0] = torch.nan
    for call in (published.sample_layout, published.sample_shapes):
        with pytest.raises(ValueError, match="text feature of node 1 is not finite"):
            call(broken, generator=seeded())
    edged = scene([3, 4], [[0, 1, 1]])
    assert edged.edge_text is not None
    edged.edge_text[0, 0] = torch.inf
    with pytest.raises(ValueError, match="text feature of edge 0 is not finite"):
        published.sample_layout(edged, generator=seeded())
    targets = torch.zeros(2, 8)
    targets[0, 0] = torch.nan
    with pytest.raises(ValueError, match="box of node 0 is not finite"):
        published.train().training_losses(
            scene([3, 4], [[0, 1, 1], [1, 2, 0]]), torch.zeros(2, dtype=torch.int64), targets, None, generator=seeded()
        )
    published.eval()


def test_boxes_without_extent_are_named(compact: EchoModel) -> None:
    graph = GraphBatch.single([3, 4])
    flat = Boxes(torch.tensor([[1.0, 1.0, 1.0], [1.0, 0.0, 1.0]]), torch.zeros(2, 3), torch.zeros(2))
    with pytest.raises(ValueError, match="box 1 has an extent that is not positive"):
        compact.sample_shapes(graph, flat, generator=seeded())
    with pytest.raises(ValueError, match="box 1 has an extent that is not positive"):
        compact.sample_layout(graph, generator=seeded(), known=flat, known_mask=torch.tensor([False, True]))


def test_a_wild_guess_at_pure_noise_has_finite_sizes_and_gradients() -> None:
    """Noise prediction divides by the signal's strength, 0.007 at level 1; the boxes' exponential must survive that."""
    output = torch.full((1, 8), -3.0, requires_grad=True)
    clean = clean_from(output, torch.ones(1, 8), torch.ones(1), "noise")
    assert clean.detach().abs().max() > 400
    boxes = Boxes.decode(clean, STATISTICS.scale())
    boxes.size.clamp(0.05, 8.0).sum().backward()
    assert bool(torch.isfinite(boxes.size).all())
    assert output.grad is not None
    assert bool(torch.isfinite(output.grad).all())


def test_weights_that_cannot_be_loaded_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    offline = ModuleType("open_clip")

    def create_model(*args: object, **options: object) -> None:
        raise OSError("no route to host")

    offline.create_model = create_model  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "open_clip", offline)
    with pytest.raises(TextEncoderError, match=r"CLIP weights 'openai' could not be loaded \(no route to host\)"):
        ClipTextEncoder()(["chair"])
