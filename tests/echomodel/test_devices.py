"""Networks and their data lie on one device: numbers are drawn where the generator is and are equal on all devices."""

from __future__ import annotations

import copy
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import torch
from second_device import SECOND, second_device

from echomodel.compact.model import CompactModel
from echomodel.config import CompactConfig, from_dict
from echomodel.echo import EchoModel
from echomodel.furniture.style import WIDTH
from echomodel.graph import GraphEdit
from echomodel.metrics import pointsets
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.training import parts_stage
from echomodel.training.layout_stage import LayoutStage, statistics_of
from echomodel.training.parts_stage import PartsStage
from echomodel.training.recipe import OptimizerConfig, Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.shape_stage import AutoencoderStage, EncodedShapes, ShapeStage
from echomodel.training.trainer import Trainer, step_generator

GPU = pytest.param(torch.device("cuda"), marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))
DEVICES = [pytest.param(SECOND, id="second"), GPU]
CONFIG = from_dict(
    CompactConfig,
    {
        "latent": {"width": 8, "layers": 1},
        "layout": {"width": 16, "layers": 2, "drafts": 1, "sides": True, "steps": 2, "guidance_rounds": 1},
        "autoencoder": {"width": 8, "blocks": 1},
        "shape": {
            "width": 16, "layers": 1, "heads": 2, "components": 8, "tokens": 2, "echo_width": 8, "echo_layers": 1,
            "candidates": 2, "steps": 2,
        },
        "furniture": {"width": 16, "layers": 1, "steps": 2},
    },
)  # fmt: skip


@pytest.fixture(scope="module")
def rooms():
    made = []
    for room in generate_rooms(2, 1):
        relations = label_relations(room, rules="strict", drop=0.5, rng=np.random.default_rng(1))
        made.append(replace(room, relations=relations))
    return made


@pytest.fixture(scope="module")
def packed(rooms):
    return PackedRooms.build(rooms, CONFIG.rules.index("strict"))


@pytest.fixture
def model(packed):
    torch.manual_seed(0)
    made = CompactModel(CONFIG, statistics_of(packed.boxes, packed.category, len(CONFIG.categories)))
    with torch.no_grad():
        for parameter in made.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
        made.shape.basis.normal_()
        made.autoencoder.basis.normal_()
    return made


def on(device):
    return second_device() if device == SECOND else nullcontext()


def sampled(model: CompactModel, rooms, device) -> list[torch.Tensor]:
    """Boxes, shapes and descriptions of a room of which a piece is known, edited by one relation and one piece."""
    echo = EchoModel(copy.deepcopy(model).to(device))
    graph = rooms[0].graph()
    known = torch.arange(graph.num_nodes) == 1
    edit = GraphEdit(graph.triplets[1:], torch.arange(graph.num_nodes) == 2)
    edit = GraphEdit(edit.before[(edit.before[:, [0, 2]] != 2).all(1)], edit.added)
    told = {"edit": edit}
    boxes = echo.sample_layout(
        graph, generator=torch.Generator().manual_seed(1), known=rooms[0].boxes(), known_mask=known, **told
    )
    free = echo.sample_layout(graph, generator=torch.Generator().manual_seed(2))
    grids = echo.sample_shapes(graph, boxes, generator=torch.Generator().manual_seed(3), **told)
    pieces = echo.sample_furniture(
        graph, boxes, generator=torch.Generator().manual_seed(4), known=torch.zeros(graph.num_nodes, WIDTH),
        known_mask=known, styles=torch.zeros(graph.num_nodes, dtype=torch.int64), **told,
    )  # fmt: skip
    return [x.cpu() for x in (boxes.size, boxes.position, boxes.yaw, free.position, grids, pieces)]


@pytest.mark.parametrize("device", DEVICES)
def test_samples_are_the_same_on_another_device(device, model, rooms):
    here = sampled(model, rooms, torch.device("cpu"))
    with on(device):
        there = sampled(model, rooms, device)
    for a, b in zip(here, there, strict=True):
        assert torch.allclose(a, b, atol=1e-5 if device == SECOND else 1e-2)


class Grids:
    """A shape set of balls: noise has a surface in every cell."""

    held_out = np.arange(6) >= 4

    def tsdf(self, numbers):
        away = np.linalg.norm(np.indices((64, 64, 64)) - 31.5, axis=0)
        return np.stack([np.clip((away - 12 - n) / 4, -1, 1).astype(np.float32) for n in numbers])


@pytest.fixture(autouse=True)
def few_styles_and_steps(monkeypatch):
    monkeypatch.setattr(parts_stage, "STYLES", 20)
    monkeypatch.setattr(parts_stage, "HELD", 5)
    monkeypatch.setattr(pointsets, "SAMPLES", 200)
    monkeypatch.setattr(pointsets, "DENSE", 1000)
    monkeypatch.setattr("echomodel.compact.sampling.AFTER", 2)  # of forty equal steps


def stage_of(name: str, packed: PackedRooms, model: CompactModel):
    if name == "parts":
        return PartsStage(packed, 24)
    if name.startswith("vqvae"):
        return AutoencoderStage(Grids(), 2, *([model.shape] if name == "vqvae of components" else []))
    weights = {"measure_weight": 0.3, "physics_weight": 1.0, "drawn_weight": 1.0}
    layout = LayoutStage(packed, packed, Recipe("layout", 1, nodes=40, **weights))
    if name == "layout":
        return layout
    latents = torch.randn(3 * len(CONFIG.categories), 6, 16, 16, 16, generator=torch.Generator().manual_seed(0)).half()
    sizes = torch.ones(len(latents), 3)
    shapes = EncodedShapes(latents, sizes, len(CONFIG.categories), torch.tensor([0, 1]), torch.tensor([2]))
    return ShapeStage(packed, shapes, 24)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", ["layout", "shape", "parts", "vqvae", "vqvae of components"])
def test_a_step_of_training_is_the_same_on_another_device(name, device, packed, model, tmp_path):
    first = {key: value.clone() for key, value in model.state_dict().items()}
    found = []
    for place in (torch.device("cpu"), device):
        with on(place):
            model.cpu() if place.type == "cpu" else model.to(place)
            model.load_state_dict(first)
            stage = stage_of(name, packed, model)
            recipe = Recipe(
                stage="layout", steps=1, model=CONFIG, save_every=1, optimizer=OptimizerConfig(warmup=1), log_every=1
            )
            stage.validate = lambda model: {}
            trainer = Trainer(recipe, model, stage, tmp_path / place.type)
            assert trainer.device.type == place.type
            assert trainer.run() == 1
            found.append({key: value.detach().cpu().clone() for key, value in model.state_dict().items()})
    changed = [key for key in first if not torch.equal(first[key], found[0][key])]
    assert changed
    for key, value in found[0].items():
        assert torch.allclose(value, found[1][key], atol=1e-4), key


@pytest.mark.parametrize("device", DEVICES)
def test_validation_runs_on_another_device(device, packed, model):
    with on(device):
        model.to(device)
        for name in ("layout", "shape", "parts", "vqvae of components"):
            scores = stage_of(name, packed, model).validate(model.eval())
            assert scores, name
            assert all(np.isfinite(value) for value in scores.values())


def test_noise_comes_from_the_generator_alone():
    first, second = (torch.rand(3, generator=step_generator(1, step)) for step in (2, 3))
    assert not torch.equal(first, second)
