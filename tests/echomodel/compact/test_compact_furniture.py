"""The furniture branch: known pieces stay, batches are their scenes, told styles are shared, the echo is the way."""

import json
import shutil

import pytest
import torch

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.model import CompactModel, WeightsError, load_weights
from echomodel.config import CompactConfig, FurnitureConfig
from echomodel.echo import EchoModel
from echomodel.furniture.style import GROUPS, HOT, STYLE, WIDTH
from echomodel.graph import GraphBatch

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)
SMALL = FurnitureConfig(width=32, layers=2, voices=2, steps=3)


def small(**changes) -> EchoModel:
    torch.manual_seed(0)
    from dataclasses import replace

    model = CompactModel(CompactConfig(furniture=replace(SMALL, **changes)), STATISTICS, ("latent", "furniture"))
    torch.nn.init.normal_(model.furniture.head.weight, std=0.3)
    return EchoModel(model)


def boxes(count: int) -> Boxes:
    return Boxes(torch.full((count, 3), 0.7), torch.zeros(count, 3), torch.zeros(count))


def sampled(model: EchoModel, graph: GraphBatch, **extra) -> torch.Tensor:
    return model.sample_furniture(graph, boxes(graph.num_nodes), generator=torch.Generator().manual_seed(1), **extra)


def test_the_config_describes_what_the_programs_read():
    assert FurnitureConfig().kinds == GROUPS
    assert HOT + FurnitureConfig().numbers == WIDTH


def test_descriptions_are_finite_and_kinds_are_probabilities():
    found = sampled(small(), GraphBatch.single([0, 5, 9], [(0, 13, 1)]))
    assert found.shape == (3, WIDTH)
    assert float(found.abs().max()) <= 1 + 1e-5
    start = 0
    for words in GROUPS:
        share = (found[:, start : start + words] + 1) / 2
        torch.testing.assert_close(share.sum(1), torch.ones(3), atol=1e-4, rtol=0)
        start += words


def test_known_pieces_come_back_and_are_heard():
    model, graph = small(), GraphBatch.single([0, 5, 9], [(0, 13, 1), (1, 13, 2)])
    given = torch.zeros(3, WIDTH)
    mask = torch.tensor([True, False, False])
    noise = torch.randn(3, WIDTH, generator=torch.Generator().manual_seed(2))
    one, other = (
        sampled(model, graph, known=given + value, known_mask=mask, noise=noise, sampler="ddim") for value in (0.0, 0.9)
    )
    torch.testing.assert_close(one[0], given[0])
    assert float((one[1:] - other[1:]).abs().max()) > 1e-4
    alone = small(echo=False)
    one, other = (
        sampled(alone, graph, known=given + value, known_mask=mask, noise=noise, sampler="ddim") for value in (0.0, 0.9)
    )
    torch.testing.assert_close(one[1:], other[1:])


def test_a_batch_is_its_scenes():
    model = small()
    graphs = [GraphBatch.single([0, 5, 9], [(0, 13, 1)]), GraphBatch.single([3, 3], [(0, 15, 1)])]
    noise = torch.randn(5, WIDTH, generator=torch.Generator().manual_seed(2))
    together = sampled(model, GraphBatch.pack(graphs), noise=noise, sampler="ddim")
    apart = [sampled(model, g, noise=n, sampler="ddim") for g, n in zip(graphs, noise.split([3, 2]), strict=True)]
    torch.testing.assert_close(together, torch.cat(apart), atol=1e-5, rtol=1e-5)


def test_equal_furniture_is_equal():
    found = sampled(small(), GraphBatch.single([4, 4, 4, 7], [(0, 13, 1), (1, 13, 2)]))
    torch.testing.assert_close(found[0], found[1])
    torch.testing.assert_close(found[0], found[2])
    assert not torch.allclose(found[0], found[3])


def test_weights_travel_with_the_latent_graph_and_say_what_is_missing(tmp_path):
    model = small()
    model.model.write(tmp_path / "all.safetensors", ("latent", "furniture"))
    loaded = EchoModel(*load_weights([tmp_path / "all.safetensors"]))
    assert loaded.branches == {"furniture"}
    with pytest.raises(ValueError, match="2 boxes for a graph of 3 nodes"):
        model.sample_furniture(GraphBatch.single([0, 1, 2]), boxes(2), generator=torch.Generator())


def test_weights_that_describe_furniture_in_other_words_are_refused(tmp_path):
    from importlib import resources

    from safetensors import safe_open
    from safetensors.torch import load_file, save_file

    weights = resources.files("echomodel") / "weights"
    shipped = str(weights / "parts.safetensors")
    with safe_open(shipped, "pt") as file:
        header = file.metadata()
    config = json.loads(header["config"])
    config["furniture"]["kinds"] = [9, 5, *config["furniture"]["kinds"][2:]]  # the same width, other words
    save_file(load_file(shipped), tmp_path / "parts.safetensors", {**header, "config": json.dumps(config)})
    shutil.copy(str(weights / "layout.safetensors"), tmp_path)
    with pytest.raises(WeightsError, match=r"parts.safetensors: .*was described in other words; train it"):
        EchoModel.load(tmp_path)


def test_the_shipped_weights_share_a_told_style_across_classes():
    model = EchoModel.load()
    told = [(0, 13, 1), (1, 13, 2), (2, 13, 3)]
    graph = GraphBatch.pack([GraphBatch.single([0, 15, 24, 32], told) for _ in range(6)])
    found = sampled(model, graph).reshape(6, 4, WIDTH)
    words, start = [], 0
    for size in GROUPS:
        words.append(found[..., start : start + size].argmax(-1))
        start += size
    kinds = torch.stack(words, -1)
    within = (kinds[:, :1] == kinds[:, 1:]).float().mean()
    between = (kinds[:-1] == kinds[1:]).float().mean()
    assert within > 0.95
    assert between < 0.5
    numbers = found[..., HOT:STYLE]
    spread = (numbers[:, :1] - numbers[:, 1:]).abs().mean()
    assert spread < 0.25 * (numbers[:-1] - numbers[1:]).abs().mean()
