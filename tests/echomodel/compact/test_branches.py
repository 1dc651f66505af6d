"""A further branch is its own code, its settings and two registrations: weights, training and models take it in."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from types import SimpleNamespace
from typing import ClassVar, get_args

import pytest
import torch
from torch import nn

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel, load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.compact.weights import PARTS, ModelPart, branches
from echomodel.config import CompactConfig, LatentConfig
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.training.recipe import Recipe, Stage
from echomodel.training.run import STAGES, open_run

GRAPH = GraphBatch.single([0, 1], [(0, 0, 1)])
STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)


@dataclass(frozen=True)
class ColourConfig:
    width: int = 8


WithColours = make_dataclass(
    "WithColours", [("colours", ColourConfig, field(default_factory=ColourConfig))], bases=(CompactConfig,), frozen=True
)
CONFIG = WithColours(latent=LatentConfig(width=8, layers=1))


class Colours(nn.Module):
    """A colour (N, 3) for every node."""

    def __init__(self, config) -> None:
        super().__init__()
        self.hidden = nn.Linear(config.latent.width, config.colours.width)
        self.head = nn.Linear(config.colours.width, 3)

    def forward(self, latent):
        return self.head(self.hidden(latent).relu())


class ColourStage:
    parts: ClassVar[tuple[str, ...]] = ("latent", "colours")
    needs: ClassVar[tuple[str, ...]] = ("latent",)
    trained = saved = ("colours",)

    @classmethod
    def open(cls, start):
        return cls()

    def loss(self, model, generator):
        colours = model.colours(model.latent(GRAPH.category, pairs_of(GRAPH)))
        loss = (colours - torch.rand(colours.shape, generator=generator)).square().mean()
        return loss, {"colours": loss}

    def validate(self, model):
        return {"held/colours": 0.0}


@pytest.fixture
def colours(monkeypatch):
    monkeypatch.setitem(PARTS, "colours", ModelPart(Colours, ("latent",), branch=True))
    monkeypatch.setitem(STAGES, "colours", SimpleNamespace(itself=ColourStage))
    monkeypatch.setattr("echomodel.compact.weights.CompactConfig", WithColours)


def test_a_third_branch_is_built_trained_saved_and_loaded(colours, tmp_path):
    torch.manual_seed(0)
    latent = CompactModel(CONFIG, STATISTICS, ("latent",))
    latent.write(tmp_path / "latent.safetensors", ("latent",))
    settings = {"steps": 2, "save_every": 1, "validate_every": 1, "log_every": 1, "model": CONFIG}
    with pytest.raises(ValueError, match="stage 'colours' needs weights with latent"):
        open_run(Recipe(stage="colours", **settings), tmp_path / "run")
    trainer = open_run(
        Recipe(stage="colours", start=(str(tmp_path / "latent.safetensors"),), **settings), tmp_path / "out"
    )
    assert trainer.run() == 2
    model, _ = load_weights([tmp_path / "latent.safetensors", tmp_path / "out" / "weights.safetensors"])
    assert model.parts == ("latent", "colours")
    assert EchoModel(model).branches == {"colours"}
    assert torch.isfinite(model.colours(model.latent(GRAPH.category, pairs_of(GRAPH)))).all()


def test_every_part_has_settings_and_every_stage_a_name():
    assert PARTS.keys() <= vars(CompactConfig()).keys()
    assert {*STAGES, "paper", "paper_vqvae"} == set(get_args(Stage))
    for stage in (late.itself for late in STAGES.values()):
        assert {*stage.parts} <= PARTS.keys()
        assert {*stage.needs} <= {*stage.parts}
    assert branches(("latent", "layout", "shape")) == {"layout"}  # a shape branch without its autoencoder
