"""The published networks behind the calls of the echo model: vocabulary, frames, edits, what they cannot do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from published_shapes import fit_to_box, mesh_from_grid

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.vocabulary import vocabulary
from echoscene.checkpoint import class_names, convert, statistics_from_bounds, write_released
from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig, shape_unet
from echoscene.echo import ReleasedEcho, floor_relations
from echoscene.model import ReleasedModel, Schedule
from echousd.shapes.meshing import mesh_from_shape

WIDTH = 12
SMALL = {"hidden": 16, "layers": 2, "code": 8, "predicate": 8, "context": 32}
CONFIG = ReleasedConfig(
    encoder=EncoderConfig(text=WIDTH, learned=4, flag=4, hidden=16, layers=2, separated=False),
    layout=UNetConfig(width=128, mult=(1, 1), blocks=1, attention=(2,), objects=16, **SMALL),
    shape=shape_unet(width=32, mult=(1, 1), blocks=1, attention=(2,), objects=32, grid=8, **SMALL),
    vqvae=VQConfig(channels=8, codes=16, resolution=32),
)
PAPER = replace(
    CONFIG,
    preset="paper",
    layout=replace(CONFIG.layout, objects=32, edge_features=WIDTH),
    shape=replace(CONFIG.shape, edge_features=WIDTH),
)
BOUNDS = statistics_from_bounds([0.1, 0.1, 0.1, 3.0, 3.0, 3.0, -2.0, 0.0, -2.0, 2.0, 3.0, 2.0, -3.2, 3.2])


class Words:
    """Text features of a test: they differ from text to text and remember what was asked."""

    name, width = "words", WIDTH

    def __init__(self) -> None:
        self.asked: list[str] = []

    def __call__(self, texts):
        self.asked += texts
        rows = [np.random.default_rng(list(text.encode())).normal(size=WIDTH) for text in texts]
        return torch.tensor(np.array(rows), dtype=torch.float32).reshape(-1, WIDTH)


def echo(config: ReleasedConfig = CONFIG, text: Words | None = None) -> ReleasedEcho:
    torch.manual_seed(0)
    model = ReleasedModel(config, classes=class_names(14), statistics=BOUNDS)
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
    model.layout_tables = Schedule.linear(1e-3, 0.2, 20)  # the published 1,000 steps are for tests/parity
    return ReleasedEcho(model, text or Words())


def graph(*categories: str, relations=()) -> GraphBatch:
    words = vocabulary()
    triplets = [(s, words.predicate_id(p), o) for s, p, o in relations]
    return GraphBatch.single([words.category_id(word) for word in categories], triplets)


BEDROOM = graph(
    "double_bed", "nightstand", "table_lamp", "wardrobe", relations=[(1, "close_by", 0), (2, "standing_on", 1)]
)


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("config", [CONFIG, PAPER], ids=["released", "paper"])
def test_boxes_and_shapes_for_the_objects_alone(config):
    words, told = Words(), []
    model = echo(config, words)
    boxes = model.sample_layout(BEDROOM, generator=seeded(), progress=lambda *state: told.append(state))
    boxes.check()
    assert len(boxes) == 4
    assert told[-1] == (20, 20)
    again = model.sample_layout(BEDROOM, generator=seeded())
    assert torch.equal(boxes.position, again.position)
    grids = model.sample_shapes(BEDROOM, boxes, generator=seeded(), steps=2, progress=lambda *s: told.append(s))
    assert grids.shape == (4, 32, 32, 32)
    assert torch.isfinite(grids).all()
    assert told[-1] == (2, 2)
    assert {"bed", "nightstand", "lamp", "wardrobe", "floor", "room"} <= set(words.asked)
    assert ("lamp standing on nightstand" in words.asked) == (model.preset == "paper")


def test_steps_are_spread_over_the_published_ones():
    model, told = echo(), []
    few = model.sample_layout(BEDROOM, generator=seeded(), steps=5, progress=lambda *state: told.append(state))
    few.check()
    assert told == [(done, 5) for done in range(1, 6)]
    whole = model.sample_layout(BEDROOM, generator=seeded())
    assert not torch.equal(few.position, whole.position)
    every = model.sample_layout(BEDROOM, generator=seeded(), steps=20)
    assert torch.equal(every.position, whole.position)
    with pytest.raises(ValueError, match=r"layout steps is 21, allowed: 1\.\.20"):
        model.sample_layout(BEDROOM, generator=seeded(), steps=21)


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_spaced_tables_are_a_schedule_of_their_own(count):
    published = Schedule.linear()
    tables, steps = published.spaced(count)
    assert len(steps) == len(tables.betas) == count
    assert int(steps[-1]) == 999
    assert bool((steps.diff() > 0).all())
    assert torch.equal(tables.alphas_cumprod, published.alphas_cumprod[steps])
    assert torch.allclose((1 - tables.betas.double()).cumprod(0), tables.alphas_cumprod.double(), rtol=1e-5)


def test_fixed_boxes_come_back():
    known = Boxes(torch.full((4, 3), 0.5), torch.full((4, 3), 0.25), torch.full((4,), 0.75))
    mask = torch.tensor([True, False, False, True])
    boxes = echo().sample_layout(BEDROOM, generator=seeded(), known=known, known_mask=mask)
    assert torch.equal(boxes.size[mask], known.size[mask])
    assert torch.equal(boxes.yaw[mask], known.yaw[mask])
    assert not torch.equal(boxes.position[1], known.position[1])


def test_two_rooms_at_once_are_told_apart():
    both = GraphBatch.pack([BEDROOM, graph("desk", "office_chair")])
    boxes = echo().sample_layout(both, generator=seeded())
    assert len(boxes) == 6


def test_every_object_stands_on_the_floor_or_is_above_it():
    words = vocabulary()
    on, above = words.predicate_id("standing_on"), words.predicate_id("above")
    with_lamp = graph("desk", "table_lamp", "pendant_lamp", relations=[(1, "standing_on", 0)])
    assert floor_relations(with_lamp.category, with_lamp.triplets).tolist() == [
        [0, on, 3],
        [1, above, 3],
        [2, above, 3],
    ]


def test_shapes_arrive_as_the_published_code_places_them(monkeypatch):
    """A bracket without any symmetry, through our grid and meshes and through the published marching cubes and fit."""
    grid = np.full((32, 32, 32), 0.2, np.float32)
    grid[4:28, 2:6, 6:26] = -0.2
    grid[4:10, 2:30, 6:12] = -0.2
    model = echo()
    latents = torch.zeros(6, 3, 8, 8, 8)
    monkeypatch.setattr(model.model, "sample_shapes", lambda *a, **k: latents)
    monkeypatch.setattr(model.model.vqvae, "decode", lambda z: torch.tensor(grid).expand(len(z), 1, -1, -1, -1))
    turned = model.sample_shapes(BEDROOM, None, generator=seeded())[0].numpy()
    size = np.array([1.0, 0.8, 1.6])
    ours = mesh_from_shape(turned, size)
    published = mesh_from_grid(grid)
    published.vertices = fit_to_box(published.vertices, np.array([*size, 0, 0, 0, 0.0]), centre_first=False)
    if published.volume < 0:
        published.invert()
    np.testing.assert_allclose(ours.bounds, published.bounds, atol=1e-6)
    np.testing.assert_allclose(ours.volume, published.volume, rtol=0.05)
    np.testing.assert_allclose(ours.center_mass, published.center_mass, atol=0.02)
    distance = trimesh.proximity.closest_point(published, ours.vertices)[1]
    assert distance.max() < 0.06


def test_an_edit_reaches_the_papers_networks_and_not_the_released_ones():
    before = BEDROOM.triplets[:1]
    edit = GraphEdit(before, torch.tensor([False, False, True, False]))
    for config, changes in ((PAPER, True), (CONFIG, False)):
        model = echo(config)
        plain = model.sample_layout(BEDROOM, generator=seeded())
        edited = model.sample_layout(BEDROOM, generator=seeded(), edit=edit)
        assert torch.allclose(plain.position, edited.position) != changes


def test_words_that_the_model_lacks_are_named():
    model = echo()
    model.classes = tuple(word for word in model.classes if word not in ("nightstand", "lamp"))
    with pytest.raises(
        ValueError, match=r"no class for nightstand( \(nearest: \w+\))?, table_lamp.*; allowed: bed, book"
    ):
        model.sample_layout(BEDROOM, generator=seeded())


def test_files_and_features_that_do_not_fit_are_named(tmp_path: Path):
    source = tmp_path / "model.pth"
    config = replace(
        CONFIG,
        layout=UNetConfig(width=32, objects=16, **SMALL),
        shape=replace(CONFIG.shape, grid=16),
        vqvae=VQConfig(channels=8, codes=16),
    )
    torch.save(ReleasedModel(config).state_dict(), source)
    file = tmp_path / "model.safetensors"
    convert(source, file)
    with pytest.raises(
        ValueError, match=r"model.safetensors: text features of \S+ have 512 numbers, the model reads 12"
    ):
        ReleasedEcho.load(file)
    loaded = ReleasedEcho.load(file, Words())
    assert loaded.model.text_encoder is None  # a published checkpoint: CLIP
    for name, text in (
        ("random-7", r"text features of random-7 have 7 numbers, the model reads 12"),
        ("word2vec", r"trained with the text encoder 'word2vec', allowed: ViT-B-32-quickgelu-openai, random-WIDTH"),
    ):
        loaded.model.text_encoder = name
        write_released(tmp_path / "named.safetensors", loaded.model, loaded.model.config, loaded.classes, None)
        with pytest.raises(ValueError, match=f"named.safetensors: .*{text}"):
            ReleasedEcho.load(tmp_path / "named.safetensors")
    loaded.model.text_encoder = "random-12"
    write_released(tmp_path / "named.safetensors", loaded.model, loaded.model.config, loaded.classes, None)
    assert ReleasedEcho.load(tmp_path / "named.safetensors").text.name == "random-12"
    assert (loaded.preset, len(loaded.hash), loaded.branches) == ("released", 12, {"layout", "shape"})
    with pytest.raises(ValueError, match="box statistics are missing: convert the checkpoint with --bounds FILE"):
        loaded.sample_layout(BEDROOM, generator=seeded())
    loaded.model.classes = None
    with pytest.raises(ValueError, match="names of the model's 14 classes are unknown: convert with --classes FILE"):
        ReleasedEcho(loaded.model, Words())
