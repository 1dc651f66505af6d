"""The published architecture on a second device: equal samples and equal training losses, edits included."""

from __future__ import annotations

import copy
from contextlib import nullcontext

import pytest
import torch
from second_device import SECOND, second_device

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.text import RandomTextEncoder
from echomodel.vocabulary import vocabulary
from echoscene.config import paper
from echoscene.echo import ReleasedEcho, pack_changes, pack_scenes, published_scene
from echoscene.model import GraphChange, ReleasedModel, Schedule

SIZES = dict(
    text=12, learned=4, flag=4, hidden=16, layers=2, context=32, code=8, heads=2, layout_width=128,
    layout_mult=(1, 1), shape_width=32, shape_mult=(1, 1), blocks=1, vq_channels=4, vq_codes=16, grid=8,
)  # fmt: skip
GPU = pytest.param(torch.device("cuda"), marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))
DEVICES = [pytest.param(SECOND, id="second"), GPU]
CLOSE = {"rtol": 1e-3, "atol": 1e-3}  # the CPU runs packed maps, other devices those that were trained


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    classes = vocabulary().coarse_categories
    bounds = BoxStatistics((0.1,) * 3, (3.0,) * 3, (-3.0, 0.0, -3.0), (3.0, 3.0, 3.0))
    made = ReleasedModel(paper(len(classes), SIZES), classes, bounds)
    made.layout_tables = Schedule.linear(1e-3, 0.2, 6)
    return made.eval()


def on(device):
    return second_device() if device == SECOND else nullcontext()


def graph() -> GraphBatch:
    words = vocabulary()
    category = [words.category_id(name) for name in ("double_bed", "nightstand", "wardrobe")]
    triplets = [[1, words.predicate_id("left"), 0], [2, words.predicate_id("taller_than"), 1]]
    return GraphBatch.single(torch.tensor(category), torch.tensor(triplets))


def sampled(model, device):
    echo = ReleasedEcho(copy.deepcopy(model).to(device), RandomTextEncoder(12))
    told = graph()
    added = torch.tensor([False, False, True])
    edit = GraphEdit(told.triplets[:1], added)
    known = Boxes(torch.ones(3, 3), torch.zeros(3, 3), torch.zeros(3))
    boxes = echo.sample_layout(
        told, generator=torch.Generator().manual_seed(1), edit=edit, known=known, known_mask=~added
    )
    grids = echo.sample_shapes(told, boxes, generator=torch.Generator().manual_seed(2), steps=2, edit=edit)
    assert boxes.size.device.type == grids.device.type == device.type
    return [x.cpu() for x in (boxes.size, boxes.position, grids)]


@pytest.mark.parametrize("device", DEVICES)
def test_samples_are_the_same(device, model):
    here = sampled(model, torch.device("cpu"))
    with on(device):
        there = sampled(model, device)
    for a, b in zip(here, there, strict=True):
        torch.testing.assert_close(a, b, **CLOSE)


def losses(model, device):
    model = copy.deepcopy(model).to(device)
    classes, text = vocabulary().coarse_categories, RandomTextEncoder(12)
    scenes = [
        published_scene(["bed", "nightstand"][:count], torch.zeros(0, 3), classes=classes, text=text, edges=True)
        for count in (1, 2)
    ]
    whole, scene = pack_scenes(scenes)
    change = pack_changes(scenes, [GraphChange(scenes[0]), GraphChange(scenes[1], touched=(0,))])
    drawn = torch.Generator().manual_seed(3)
    boxes, latents = torch.randn(7, 8, generator=drawn), torch.randn(7, 3, 8, 8, 8, generator=drawn)
    found = model.training_losses(
        whole, scene, boxes, latents, generator=torch.Generator().manual_seed(4), change=change
    )
    found["loss"].backward()
    assert found["loss"].device.type == device.type
    return {name: value.detach().cpu() for name, value in found.items()}


@pytest.mark.parametrize("device", DEVICES)
def test_losses_are_the_same(device, model):
    here = losses(model, torch.device("cpu"))
    with on(device):
        there = losses(model, device)
    assert set(here) >= {"loss", "layout", "shape"}
    for name, value in here.items():
        torch.testing.assert_close(value, there[name], **CLOSE)
