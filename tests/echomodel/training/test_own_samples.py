"""What the network arranges alone as a lesson: gradients through the last steps alone, and a loss that falls."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from echomodel.compact.model import CompactModel
from echomodel.samplers import sample
from echomodel.training.layout_stage import LONGEST, LayoutStage, own_loss, own_rooms
from echomodel.training.recipe import Recipe, read_recipe
from echomodel.training.rooms import LayoutBatch, PackedRooms, draw_batch
from echomodel.training.run import open_run

RECIPES = Path(__file__).parents[3] / "model" / "recipes"


@pytest.fixture(scope="module")
def batch(packed: PackedRooms) -> LayoutBatch:
    return draw_batch(packed, 60, torch.Generator().manual_seed(0), dense=0.0)


def recipe(data: Path, *settings: str) -> Recipe:
    return read_recipe(RECIPES / "smoke.toml", [f"data={data}", "own_weight=1.0", *settings])


def tiny(data: Path, folder: Path) -> CompactModel:
    model = open_run(recipe(data), folder).model
    assert isinstance(model, CompactModel)
    for head in model.layout.heads:  # as it begins it predicts nothing, and nothing leads back from nothing
        torch.nn.init.normal_(head.weight, std=0.05)
    return model


def seeded(number: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(number)


def test_a_few_steps_lower_what_is_wrong_with_own_rooms(data: Path, batch: LayoutBatch, tmp_path: Path) -> None:
    model = tiny(data, tmp_path)
    optimizer = torch.optim.Adam(model.layout.parameters(), lr=2e-3)
    losses = []
    for _ in range(12):
        loss, parts = own_loss(model, batch, seeded(), kept=2)
        loss.backward()
        optimizer.step()
        optimizer.zero_grad()
        losses.append(loss.item())
        assert set(parts) == {"own_living", "own_relations", "own_physics"}
    assert min(losses[-3:]) < 0.9 * losses[0]


def test_the_gradient_goes_through_the_last_steps_alone_and_is_short(
    data: Path, batch: LayoutBatch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, graded, slopes = tiny(data, tmp_path), [], []
    forward = model.layout.drafts

    def watched(boxes: torch.Tensor, level: torch.Tensor, context: object) -> list[torch.Tensor]:
        out = forward(boxes, level, context)
        graded.append(out[-1].requires_grad)
        if boxes.requires_grad:
            boxes.register_hook(lambda slope: slopes.append(float(slope.norm(dim=1).max())))
        return out

    monkeypatch.setattr(model.layout, "drafts", watched)
    boxes = own_rooms(model, batch, seeded(), kept=3)
    assert graded == [False] * (len(graded) - 3) + [True] * 3
    (1000.0 * boxes.position.square().sum()).backward()
    assert len(slopes) == 2
    assert max(slopes) <= LONGEST * 1.001
    assert all(value.grad is None for value in model.latent.parameters())
    assert any(bool(value.grad.abs().max() > 0) for value in model.layout.parameters() if value.grad is not None)


def test_own_rooms_end_as_the_sampler_ends(data: Path, batch: LayoutBatch, tmp_path: Path) -> None:
    """The states below `LATE` are taken in the steps that sampling takes; the share of dense graphs is obeyed."""
    model = tiny(data, tmp_path)
    calls = []
    sample("ancestral", lambda x, level: calls.append(float(level[0])) or x, torch.randn(3, 8), 20, "velocity")
    seen = []
    model.layout.register_forward_pre_hook(lambda module, arguments: seen.append(float(arguments[1][0])))
    own_rooms(model, batch, seeded(), kept=1)
    assert [level for level in seen if level <= 0.5] == pytest.approx([level for level in calls if level <= 0.5])
    assert seen[0] == 1.0
    assert len(seen) < len(calls)
    assert int(batch.predicates.sum()) <= 4 * batch.graph.num_nodes + batch.graph.num_scenes


def test_a_run_with_own_rooms_logs_them_and_resumes_bit_for_bit(data: Path, tmp_path: Path) -> None:
    short = recipe(data, "steps=3", "nodes=40", "log_every=1", "validate_every=100")
    whole = open_run(short, tmp_path / "whole")
    whole.run()
    open_run(short, tmp_path / "parts").run(until=1)
    rest = open_run(short, tmp_path / "parts", resume=True)
    rest.run()
    assert isinstance(rest.stage, LayoutStage)
    for (name, a), b in zip(whole.model.state_dict().items(), rest.model.state_dict().values(), strict=True):
        assert torch.equal(a, b), name
    assert "own_living" in (tmp_path / "whole" / "log.csv").read_text()
