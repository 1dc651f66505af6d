"""Losses on what the network draws: they see what is wrong, and a step down their slope mends it."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.compact.model import load_weights
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_rooms
from echomodel.training import layout_stage as draws
from echomodel.training.layout_losses import plan_of_batch
from echomodel.training.layout_stage import carrier_of, drawn_loss, missed_terms, sampled_boxes, steadied
from echomodel.training.rooms import PackedRooms, make_batch, plan_of_rooms


@pytest.fixture(scope="module")
def batch():
    rooms = generate_rooms(6, 5)
    labels = label_rooms(rooms, rules="strict")
    labelled = [replace(room, relations=told) for room, told in zip(rooms, labels, strict=True)]
    packed = PackedRooms.build(labelled, 1)
    batch = make_batch(packed, torch.arange(len(rooms)), torch.Generator().manual_seed(0), train=False)
    assert np.array_equal(carrier_of(batch), plan_of_rooms(labelled).carrier)  # some stand on others
    assert (carrier_of(batch) >= 0).any()
    return batch


@pytest.fixture
def model():
    with resources.as_file(resources.files("echomodel") / "weights" / "layout.safetensors") as path:
        return load_weights([path])[0]


def test_a_step_down_the_slope_lowers_what_is_missed(batch, model):
    with torch.no_grad():
        model.layout.heads[-1].weight.mul_(0.6)  # so that much is wrong
    optimizer, losses = torch.optim.Adam(model.layout.parameters(), 3e-4), []
    for _ in range(8):
        loss, parts = drawn_loss(model, batch, torch.Generator().manual_seed(1))
        assert set(parts) == {"drawn_terms", "drawn_physics", "drawn_relations"}
        losses.append(float(loss.detach()))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    assert losses[-1] < 0.8 * losses[0]


def test_every_part_of_what_is_wrong_counts(batch, model, monkeypatch):
    def loss() -> tuple[float, dict[str, float]]:
        with torch.no_grad():
            total, parts = drawn_loss(model, batch, torch.Generator().manual_seed(2))
        return float(total), {name: float(value) for name, value in parts.items()}

    total, parts = loss()
    wanted = parts["drawn_terms"] + draws.PHYSICS * parts["drawn_physics"] + draws.RELATIONS * parts["drawn_relations"]
    assert total == pytest.approx(wanted, rel=1e-5)
    assert min(parts.values()) > 0
    monkeypatch.setattr(draws, "ASKED", 0.1)
    farther = loss()[1]
    assert farther["drawn_terms"] > parts["drawn_terms"]
    assert farther["drawn_physics"] > parts["drawn_physics"]


def test_terms_see_a_bed_that_is_turned_and_moved_but_no_size(batch):
    free = torch.zeros(len(batch.boxes), dtype=torch.bool)
    yaw, size = batch.boxes.yaw.clone().requires_grad_(), batch.boxes.size.clone().requires_grad_()
    plan = plan_of_batch(batch, Boxes(size, batch.boxes.position, yaw), free)
    before = missed_terms(plan)
    turned = missed_terms(plan.at(plan.position, yaw + 0.3))
    assert turned > before + 0.1
    turned.backward()
    assert size.grad is None
    assert torch.isfinite(yaw.grad).all()
    assert (yaw.grad != 0).any()


def test_the_gradient_goes_through_the_last_steps_alone(batch, model, monkeypatch):
    calls = []
    predictor = draws.layout_predictor

    def watched(*given):
        predict = predictor(*given)

        def seen(x, level):
            calls.append(torch.is_grad_enabled())
            return predict(x, level)

        return seen

    monkeypatch.setattr(draws, "layout_predictor", watched)
    assert sampled_boxes(model, batch, torch.Generator().manual_seed(1), 5).position.requires_grad
    assert calls == [False, False, False, True, True]


def test_no_furniture_learns_to_be_smaller(batch, model):
    drawn_loss(model, batch, torch.Generator().manual_seed(1))[0].backward()
    for head in model.layout.heads:
        assert (head.weight.grad[:3] == 0).all()  # the sizes of a box
        assert (head.weight.grad[3:] != 0).any()


def test_no_box_drowns_the_others():
    x = torch.ones(4, 8, requires_grad=True)
    scale = torch.tensor([1e9, 1.0, float("nan"), -2.0])
    (steadied(x * 1.0) * scale[:, None]).mean().backward()
    lengths = x.grad.norm(dim=1)
    assert lengths[0] == pytest.approx(draws.LONGEST / 4)
    assert lengths[2] == 0
    assert lengths[1] == pytest.approx(8**0.5 / 32)
