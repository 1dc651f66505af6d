"""The paper preset trains from its recipe, at a size for tests: autoencoder, both branches, a resumed run, a sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from published_shapes import fit_to_box
from smoke_data import smoke_data

from echomodel.data.roomset import RoomSet
from echomodel.data.shapeset import ShapeSet
from echomodel.text import RandomTextEncoder, TextEncoder
from echomodel.training.recipe import Recipe, read_recipe
from echomodel.training.run import open_run
from echomodel.training.trainer import read_log, step_generator
from echoscene.checkpoint import load_released
from echoscene.echo import DISTANCE, ReleasedEcho, published_grids, turned_back
from echoscene.model import ReleasedModel, Schedule
from echoscene.training import PaperModel, PaperStage, scene_boxes, text_encoder

RECIPE = Path(__file__).parents[2] / "model" / "recipes" / "paper.toml"
SMALL = {
    "text": 12, "learned": 4, "flag": 4, "hidden": 16, "layers": 2, "context": 32, "code": 8, "heads": 2,
    "layout_width": 128, "layout_mult": [1, 1], "shape_width": 32, "shape_mult": [1, 1], "blocks": 1,
    "vq_channels": 4, "vq_codes": 16, "grid": 8,
}  # fmt: skip


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return smoke_data(tmp_path_factory)


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "cache"))


def small(data: Path, *settings: str) -> Recipe:
    sizes = [f"paper.{name}={value}" for name, value in SMALL.items()]
    plain = ["text=random", "steps=2", "scenes=2", "shapes_per_batch=24", "validate_every=2", "log_every=1"]
    return read_recipe(RECIPE, [f"data={data}", *plain, *sizes, *settings])


@pytest.fixture(scope="module")
def autoencoder(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("vqvae")
    recipe = small(data, "stage=paper_vqvae", "shapes_per_batch=2", "optimizer.rate=0.002", "steps=4")
    trainer = open_run(recipe, folder)
    before = {name: value.clone() for name, value in trainer.model.state_dict().items()}
    trainer.run()
    moved = {name.split(".")[0] for name, value in trainer.model.state_dict().items() if not value.equal(before[name])}
    assert moved == {"vqvae"}
    return folder / "weights.safetensors"


def test_both_branches_train_on_one_latent_graph_and_sample(data: Path, autoencoder: Path, tmp_path: Path) -> None:
    recipe = small(data, f'start=["{autoencoder}"]')
    trainer = open_run(recipe, tmp_path / "run")
    before = {name: value.clone() for name, value in trainer.model.named_parameters()}
    assert trainer.run() == 2
    moved = {name.split(".")[0] for name, value in trainer.model.named_parameters() if not value.equal(before[name])}
    assert {"gconv_net_ec", "gconv_net_manipulation", "LayoutDiff", "rel_s_mlp", "shape_df"} <= moved
    assert "vqvae" not in moved
    logged = {name for _, name, _ in read_log(tmp_path / "run" / "log.csv")}
    assert {"loss", "layout", "shape", "held/layout", "held/shape"} <= logged
    model = load_released(tmp_path / "run" / "weights.safetensors")
    assert isinstance(model, ReleasedModel)
    assert model.config.preset == "paper"
    assert model.text_encoder == "random-12"
    assert isinstance(ReleasedEcho.load(tmp_path / "run" / "weights.safetensors").text, RandomTextEncoder)
    stage = trainer.stage
    assert isinstance(stage, PaperStage)
    graph = stage.scene(stage.rooms.room(0, rules="sgfront"))
    model.layout_tables = Schedule.linear(1e-3, 0.2, 20)  # 1,000 steps would take too long here
    boxes = model.sample_layout(graph, generator=torch.Generator().manual_seed(0))
    latents = model.sample_shapes(graph, generator=torch.Generator().manual_seed(0), steps=2)
    assert len(boxes) == len(latents) == len(graph.classes)
    assert torch.isfinite(boxes.position).all()
    with torch.inference_mode():
        assert torch.isfinite(model.vqvae.decode(latents[:1])).all()


def test_a_resumed_run_is_bit_equal(data: Path, autoencoder: Path, tmp_path: Path) -> None:
    recipe = small(data, f'start=["{autoencoder}"]', "validate_every=9")
    whole = open_run(recipe, tmp_path / "whole")
    whole.run()
    open_run(recipe, tmp_path / "parts").run(until=1)
    rest = open_run(recipe, tmp_path / "parts", resume=True)
    rest.run()
    for (name, one), other in zip(whole.model.state_dict().items(), rest.model.state_dict().values(), strict=True):
        assert torch.equal(one, other), name


@pytest.mark.parametrize(
    "switch", ["paper.time_in_echo=false", "paper.echo=false", "paper.conditioning=concat"], ids=lambda s: s[6:]
)
def test_table_4_reaches_the_recipe(data: Path, autoencoder: Path, tmp_path: Path, switch: str) -> None:
    plain = small(data, "stage=paper_vqvae")
    changed = open_run(small(data, "stage=paper_vqvae", switch), tmp_path)
    assert isinstance(changed.model, PaperModel)
    usual = set(open_run(plain, tmp_path).model.state_dict())
    assert changed.model.config.shape != open_run(plain, tmp_path).model.config.shape  # type: ignore[union-attr]
    if "concat" not in switch:
        assert set(changed.model.state_dict()) < usual
    with pytest.raises(ValueError, match=r"was not trained with the sizes in the recipe's \[paper\]"):
        open_run(small(data, f'start=["{autoencoder}"]', switch), tmp_path)
    changed.stage.trained = ("network",)  # type: ignore[misc]
    changed.model.requires_grad_(True)
    loss, parts = changed.stage.loss(changed.model, step_generator(0, 0))
    loss.backward()
    assert torch.isfinite(parts["shape"])


def test_shapes_lie_in_the_published_frame(data: Path) -> None:
    """A shape's front comes to lie at +Z when the published fitting places it."""
    grid = torch.ones(64, 64, 64)
    grid[10:54, 2:20, 2:62] = -1.0  # a seat, wider along z than along x ...
    grid[10:54, 20:60, 2:12] = -1.0  # ... with its back at -z
    placed = published_grids(grid[None])
    assert placed.shape == (1, 1, 64, 64, 64)
    assert float(placed.max()) == pytest.approx(0.0625)
    assert torch.equal(turned_back(placed) / DISTANCE, grid[None])
    inside = (placed[0, 0] < 0).nonzero().double().numpy() / 64 - 0.5
    fitted = fit_to_box(inside, np.array([2.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]), centre_first=False)
    top = fitted[fitted[:, 1] > 0.5]
    assert top[:, 2].max() < -0.2
    assert np.ptp(top[:, 0]) > 1.9


def test_boxes_of_a_scene(data: Path, tmp_path: Path) -> None:
    model = open_run(small(data, "stage=paper_vqvae"), tmp_path).model
    room = RoomSet(data / "rooms").room(0)
    assert model.statistics is not None
    vectors = scene_boxes(room, model.statistics)
    assert vectors.shape == (len(room) + 2, 8)
    assert float(vectors[:, :6].abs().max()) <= 1 + 1e-5
    assert vectors[-1].tolist() == pytest.approx([-1.0] * 6 + [float(np.sin(-1)), float(np.cos(-1))])
    assert len(ShapeSet(data / "shapes")) > 0


def test_what_a_paper_run_needs_is_named(data: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="stage 'paper' needs the weights of a 'paper_vqvae' run"):
        open_run(small(data), tmp_path)
    with pytest.raises(ValueError, match=r"'paper.text' is 12, CLIP's features have 512 numbers"):
        open_run(small(data, "stage=paper_vqvae", "text=clip"), tmp_path)
    with pytest.raises(ValueError, match="no such weights file for the text encoder"):
        text_encoder(str(tmp_path / "clip.pt"), 512)


def test_random_texts_are_told_apart() -> None:
    encoder = RandomTextEncoder(64)
    assert isinstance(encoder, TextEncoder)
    chair, table, again = encoder(["chair", "table", "chair"])
    assert torch.equal(chair, again)
    assert abs(float(chair @ table)) < 0.6 < float(chair @ chair) < 1.5
    assert encoder([]).shape == (0, 64)
