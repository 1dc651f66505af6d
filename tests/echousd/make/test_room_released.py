"""`echousd generate --weights FILE` with a converted published checkpoint: small random weights of the same form."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from pxr import Usd, UsdGeom
from safetensors.torch import save_file
from small_room import ball_tsdf, small_graph

import echousd
from echomodel.metrics.layouts import extended, kept_relations, tasks_of
from echomodel.roomboxes import RoomBoxes
from echomodel.text import ClipTextEncoder
from echoscene.checkpoint import convert, statistics_from_bounds
from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig, shape_unet
from echoscene.model import ReleasedModel, Schedule
from echoscene.vqvae import VQVAE
from echousd.evaluation.systems import System, drawn

SMALL = {"hidden": 16, "layers": 2, "code": 8, "predicate": 8, "context": 32}
ENCODER = EncoderConfig(learned=8, flag=4, hidden=16, layers=2, separated=False)
CONFIG = ReleasedConfig(
    encoder=ENCODER,
    layout=UNetConfig(width=32, objects=ENCODER.node, **SMALL),
    shape=shape_unet(width=32, mult=(1, 1), blocks=1, attention=(2,), objects=32, **SMALL),
    vqvae=VQConfig(channels=8, codes=16),
)
BOUNDS = [0.3, 0.3, 0.3, 2.0, 2.0, 2.0, -2.0, 0.0, -2.0, 2.0, 1.0, 2.0, -3.2, 3.2]


@pytest.fixture
def weights(tmp_path, monkeypatch) -> Path:
    torch.manual_seed(1)
    torch.save(ReleasedModel(CONFIG).state_dict(), tmp_path / "model.pth")
    convert(tmp_path / "model.pth", tmp_path / "model.safetensors", statistics=statistics_from_bounds(BOUNDS))
    # few steps, and text features as a cache holds them: no download in a test
    monkeypatch.setattr(ReleasedModel, "layout_tables", Schedule.linear(1e-3, 0.2, 10))
    # random weights decode to noise, of which no mesh is left
    ball = torch.tensor(0.2 * ball_tsdf())
    monkeypatch.setattr(VQVAE, "decode", lambda self, z: ball.expand(len(z), 1, -1, -1, -1))
    labels = ("bed", "nightstand", "lamp", "wardrobe", "floor", "room")
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path))
    save_file({word: torch.randn(512) for word in labels}, tmp_path / f"text-{ClipTextEncoder().name}.safetensors")
    return tmp_path / "model.safetensors"


def test_room_from_a_converted_checkpoint(weights, tmp_path, echousd_command):
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    folder = tmp_path / "out" / "bedroom"
    words = ("--weights", weights, "--seed", 3, "--steps", 2, "--faces", 400)
    words += ("--drafts", 1, "--no-walls", "--dress", "none")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", folder, *words)
    assert done.code == 0, done.err
    manifest = json.loads((folder / "bedroom.json").read_text())
    assert manifest["preset"] == "released"
    assert len(manifest["model"]) == 12
    stage = Usd.Stage.Open(str(folder / "bedroom.usda"))
    assert stage.GetCompositionErrors() == []
    bed = UsdGeom.Mesh(stage.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh"))
    assert len(bed.GetFaceVertexCountsAttr().Get()) > 12  # a shape, not a box


def test_scored_like_any_other_model(weights):
    size, x = np.full((3, 3), 0.5), np.array([-1.0, 0.0, 1.0])
    room = RoomBoxes(
        "room", "bedroom", np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]), 2.6,
        ("double_bed", "nightstand", "wardrobe"), size, np.stack([x, 0 * x, 0.5 * x], 1), 0 * x,
    )  # fmt: skip
    system = System.parse(str(weights))
    assert system.weights == weights
    tasks = tasks_of([room], 0, rules="sgfront", drop=0.0)
    for task in (*tasks, extended(tasks[0], np.random.default_rng(0))):
        (made,) = drawn(system, [task], 0)
        kept, measured = kept_relations(task, made)["all"]
        assert measured[0] >= 4
        assert 0 <= kept[0] <= measured[0]


def test_what_does_not_fit_is_named(weights, tmp_path, echousd_command, monkeypatch):
    graph, out = tmp_path / "graph.usda", tmp_path / "room"
    echousd.write_graph(small_graph(), graph)
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "empty"))
    from echomodel.text import TextEncoderError

    def absent(self):
        raise TextEncoderError("text features need the package open_clip_torch: pip install 'echousd[text]'")

    monkeypatch.setattr(ClipTextEncoder, "model", property(absent))
    fresh = shutil.copy(weights, tmp_path / "fresh.safetensors")  # a file that this process has not loaded yet
    done = echousd_command("generate", graph, "-o", out, "--weights", fresh)
    assert (done.code, out.exists()) == (2, False)
    assert "pip install 'echousd[text]'" in done.err
    assert done.err.strip().splitlines()[-1].startswith("error: ")


def test_categories_without_a_class_are_named(tmp_path, echousd_command):
    config = ReleasedConfig(encoder=EncoderConfig(classes=4, learned=8, flag=4, hidden=16, layers=2, separated=False))
    config = ReleasedConfig(encoder=config.encoder, layout=CONFIG.layout, shape=None, vqvae=None)
    torch.save(ReleasedModel(config).state_dict(), tmp_path / "model.pth")
    classes = ["_scene_", "bed", "floor", "wardrobes"]
    file = tmp_path / "model.safetensors"
    convert(tmp_path / "model.pth", file, classes=classes, statistics=statistics_from_bounds(BOUNDS))
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    words = ("--weights", file, "--shapes", "boxes")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", *words)
    assert done.code == 2
    said = " ".join(done.err.split())
    assert "no class for nightstand, table_lamp, wardrobe (nearest: wardrobes), pendant_lamp" in said
    assert "allowed: bed, wardrobes" in said
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", "--weights", file)
    assert "no shape branch; use shapes 'boxes'" in " ".join(done.err.split())


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("missing.safetensors", "no such weights, allowed: a file or folder of `echousd train` or `convert`"),
        ("damaged.safetensors", "not a readable safetensors file"),
        ("folder", "holds no weights files (.safetensors)"),
    ],
)
def test_weights_that_are_missing_or_damaged_are_named(tmp_path, echousd_command, name, text):
    (tmp_path / "folder").mkdir()
    (tmp_path / "damaged.safetensors").write_bytes(bytes([200, 1, 0, 0, 0, 0, 0, 0]) + b'{"format":')
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    done = echousd_command("generate", tmp_path / "graph.usda", "-o", tmp_path / "room", "--weights", tmp_path / name)
    assert done.code == 2
    said = done.err.strip().splitlines()[-1]
    assert said.startswith(f"error: {tmp_path / name}: {text}")
    assert not (tmp_path / "room").exists()
