"""The token branch: learns, resumes bit for bit, samples whole pieces, and no piece hears its own padding."""

from pathlib import Path

import numpy as np
import pytest
import torch

from echomodel.compact.assembling import sample_tokens
from echomodel.compact.given import Sampling
from echomodel.compact.model import CompactModel, load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.config import CompactConfig
from echomodel.data.furniture.mirroring import solids_of
from echomodel.data.furniture.snapping import snapped
from echomodel.data.furniture.tokens import GROUPS, WIDTH
from echomodel.data.tokenset import build_tokens
from echomodel.graph import GraphBatch
from echomodel.training.recipe import read_recipe
from echomodel.training.run import open_run

ROOT = Path(__file__).parents[3]
SHIPPED = ROOT / "model/echomodel/weights/layout.safetensors"


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    build_tokens(folder / "tokens", 3, 8, 1)
    return folder


def recipe(data: Path, *settings: str):
    small = ["nodes=8", "model.tokens.width=32", "model.tokens.layers=1", "log_every=1", "optimizer.warmup=1"]
    small += ["optimizer.cooldown=2", "validate_every=4", "save_every=2", f'start=["{SHIPPED}"]', f"data={data}"]
    return read_recipe(ROOT / "model/recipes/tokens.toml", [*small, *settings])


def test_a_run_learns_resumes_and_its_weights_make_pieces(data, tmp_path):
    whole = open_run(recipe(data, "steps=4"), tmp_path / "whole")
    whole.run()
    open_run(recipe(data, "steps=4"), tmp_path / "halves").run(until=2)
    again = open_run(recipe(data, "steps=4"), tmp_path / "halves", resume=True)
    again.run()
    for name, value in whole.model.tokens.state_dict().items():
        assert torch.equal(value, again.model.tokens.state_dict()[name]), name
    model, _ = load_weights([SHIPPED, tmp_path / "whole" / "weights.safetensors"])
    graph, size = GraphBatch.single([4, 4, 30]), torch.tensor([[0.5, 0.9, 0.5], [0.5, 0.9, 0.5], [1.0, 2.0, 0.4]])
    generator = torch.Generator().manual_seed(0)
    found = sample_tokens(model, graph, size, torch.tensor([0, 0, 2]), generator, Sampling(generator, steps=2))
    assert len(found[0]) == len(found[1])
    for tokens, box in zip(found, size.numpy(), strict=True):
        assert tokens.shape[1] == WIDTH
        assert solids_of(snapped(tokens.numpy(), box), box)


def test_words_are_as_the_configuration_says():
    settings = CompactConfig().tokens
    assert settings.kinds == GROUPS
    assert sum(settings.kinds) + settings.numbers == WIDTH


def test_pieces_may_stand_in_any_order_and_do_not_hear_padding():
    torch.manual_seed(0)
    shipped, _ = load_weights([SHIPPED])
    model = CompactModel(CompactConfig(), shipped.statistics, ("latent", "tokens"))
    torch.nn.init.normal_(model.tokens.head.weight, std=0.1)
    size, count = torch.rand(3, 3) + 0.3, torch.tensor([2, 5, 3])
    x, level, latent = torch.randn(3, 5, WIDTH), torch.tensor([0.3, 0.3, 0.0]), torch.randn(3, 96)

    def said(rows: list[int]) -> torch.Tensor:
        graph = GraphBatch.single([[1, 20, 7][n] for n in rows])
        context = model.tokens.context(graph, size[rows], pairs_of(graph), latent[rows], count[rows])
        return model.tokens(x[rows, : int(count[rows].max())], level[rows], context)

    straight = said([0, 1, 2])
    np.testing.assert_allclose(said([2, 0, 1])[[1, 2, 0]].detach(), straight.detach(), atol=1e-5)
    assert (straight[0, 2:] == 0).all()
    x[0, 2:] = 99.0
    np.testing.assert_allclose(said([0, 1, 2]).detach(), straight.detach(), atol=1e-5)
