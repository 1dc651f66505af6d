"""Published checkpoints: what converts, what is refused, and that nothing in a file is executed."""

from __future__ import annotations

import json
import os
import pickle
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from torch import nn

from echoscene.checkpoint import CheckpointError, convert, load_released, read_published, statistics_from_bounds
from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig, shape_unet
from echoscene.model import ReleasedModel

ENCODER = EncoderConfig(text=16, learned=8, flag=4, hidden=8, layers=2)
SMALL = {"hidden": 8, "layers": 2, "code": 8, "predicate": 8, "context": 32}
CONFIG = ReleasedConfig(
    encoder=ENCODER,
    layout=UNetConfig(width=32, objects=24, time_in_echo=False, **SMALL),
    shape=shape_unet(width=32, mult=(1, 1), blocks=1, attention=(2,), objects=32, **SMALL),
    vqvae=VQConfig(channels=8, codes=16),
)
BOUNDS = [0.1, 0.1, 0.1, 3.0, 3.0, 3.0, -2.0, 0.0, -2.0, 2.0, 3.0, 2.0, -3.2, 3.2]


@pytest.fixture(scope="module")
def model() -> ReleasedModel:
    torch.manual_seed(0)
    return ReleasedModel(CONFIG)


def _published(model: ReleasedModel) -> dict:
    """The state as the published training writes it: flat, with two nested dicts and its own counters."""
    state: dict = {"epoch": 2050, "counter": 7, "opt": {"state": {0: {"step": torch.ones(())}}, "param_groups": []}}
    for key, value in nn.Module.state_dict(model).items():
        part, _, rest = key.partition(".")
        if part in ("vqvae", "shape_df"):
            state.setdefault(part, {})[rest] = value
        else:
            state[key] = value
    return state


@pytest.mark.parametrize("zipped", [True, False])
def test_full_model(model: ReleasedModel, tmp_path: Path, zipped: bool) -> None:
    source, target = tmp_path / "model2050.pth", tmp_path / "out" / "echo.safetensors"
    torch.save(_published(model), source, _use_new_zipfile_serialization=zipped)
    statistics = statistics_from_bounds(BOUNDS)
    assert convert(source, target, statistics=statistics) == CONFIG
    loaded = load_released(target)
    assert isinstance(loaded, ReleasedModel)
    assert (loaded.config, loaded.statistics, loaded.classes[6]) == (CONFIG, statistics, "floor")
    state = loaded.state_dict()
    for key, value in nn.Module.state_dict(model).items():
        assert torch.equal(state[key], value), key
    with safe_open(target, framework="pt") as file:
        metadata = file.metadata()
    assert json.loads(metadata["vocabulary"])["predicates"][1] == "left"
    assert json.loads(metadata["box_statistics"])["size_high"] == [3.0, 3.0, 3.0]
    assert [path.name for path in target.parent.iterdir()] == ["echo.safetensors"]


def test_autoencoder_alone(model: ReleasedModel, tmp_path: Path) -> None:
    sdf = torch.rand(1, 1, 64, 64, 64) - 0.5
    with torch.inference_mode():
        expected = model.eval().vqvae(sdf)
    for number, state in enumerate((model.vqvae.state_dict(), {"vqvae": dict(model.vqvae.state_dict())})):
        source, target = tmp_path / f"{number}.pth", tmp_path / f"{number}.safetensors"
        torch.save(state, source)
        assert convert(source, target).encoder is None
        with torch.inference_mode():
            assert torch.allclose(load_released(target).vqvae(sdf), expected, atol=1e-5)


def test_wrong_keys_are_named(model: ReleasedModel, tmp_path: Path) -> None:
    source = tmp_path / "model.pth"
    state = _published(model)
    del state["shape_df"]["diffusion_net.out.2.bias"]
    state["LayoutDiff.df.model.out.0.weight"] = torch.zeros(3)
    state["surprise"] = torch.zeros(1)
    torch.save(state, source)
    expected = (
        r"model\.pth: .*1 missing \(first: shape_df\.diffusion_net\.out\.2\.bias\); 1 unexpected \(first: surprise\); "
        r"1 misshapen \(first: LayoutDiff\.df\.model\.out\.0\.weight \[3\] instead of \[32\]\)"
    )
    with pytest.raises(CheckpointError, match=expected):
        convert(source, tmp_path / "out.safetensors")
    assert not (tmp_path / "out.safetensors").exists()


def test_other_models_are_named(tmp_path: Path) -> None:
    source = tmp_path / "resnet.pth"
    for raw, text in (
        ({"fc.weight": torch.zeros(2, 2)}, r"resnet\.pth: no obj_embeddings_ec\.weight .*\(fc\.weight \.\.\.\)"),
        ({"epoch": 3}, r"resnet\.pth: holds no tensors"),
        ({"name": "a text"}, r"resnet\.pth: key name holds a str, expected a tensor"),
        ([torch.zeros(1)], r"resnet\.pth: holds a list, expected a dict of tensors"),
        ({"obj_embeddings_ec.weight": torch.zeros(15, 8)}, r"missing key gconv_net_ec\.gconvs"),
    ):
        torch.save(raw, source)
        with pytest.raises(CheckpointError, match=text):
            convert(source, tmp_path / "out.safetensors")


def test_numbers_that_are_not_finite_are_named(model: ReleasedModel, tmp_path: Path) -> None:
    state = _published(model)
    state["rel_s_mlp.0.bias"] = torch.full_like(state["rel_s_mlp.0.bias"], torch.nan)
    torch.save(state, tmp_path / "model.pth")
    with pytest.raises(CheckpointError, match=r"key rel_s_mlp\.0\.bias holds numbers that are not finite"):
        convert(tmp_path / "model.pth", tmp_path / "out.safetensors")


@pytest.mark.parametrize("keep", [0, 10, 1000, -100])
@pytest.mark.parametrize("zipped", [True, False])
def test_truncated_files_are_named(model: ReleasedModel, tmp_path: Path, keep: int, zipped: bool) -> None:
    whole, source = tmp_path / "whole.pth", tmp_path / "cut.pth"
    torch.save(model.vqvae.state_dict(), whole, _use_new_zipfile_serialization=zipped)
    source.write_bytes(whole.read_bytes()[:keep])
    with pytest.raises(CheckpointError, match=r"cut\.pth: (truncated|refused)"):
        convert(source, tmp_path / "out.safetensors")


def test_files_cut_within_a_number_are_named_too(tmp_path: Path) -> None:
    whole, source = tmp_path / "whole.pth", tmp_path / "cut.pth"
    torch.save({f"key_{n}": torch.zeros(2) for n in range(300)}, whole, _use_new_zipfile_serialization=False)
    for keep in range(200, 1400, 3):
        source.write_bytes(whole.read_bytes()[:keep])
        with pytest.raises(CheckpointError, match=r"cut\.pth: (truncated|refused)"):
            convert(source, tmp_path / "out.safetensors")


class _Bomb:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple:
        return os.mkdir, (str(self.mark),)


@pytest.mark.parametrize("form", ["zip", "legacy", "pickle"])
def test_no_pickle_is_executed(tmp_path: Path, form: str) -> None:
    mark, source = tmp_path / "executed", tmp_path / "model.pth"
    state = {"obj_embeddings_ec.weight": torch.zeros(15, 128), "opt": _Bomb(mark)}
    if form == "pickle":
        source.write_bytes(pickle.dumps(_Bomb(mark), protocol=2))  # as torch writes, which tells others apart
    else:
        torch.save(state, source, _use_new_zipfile_serialization=form == "zip")
    with pytest.raises(CheckpointError, match=r"model\.pth: refused, .*nothing is executed"):
        read_published(source)
    assert not mark.exists()


def test_converted_files_are_checked(model: ReleasedModel, tmp_path: Path) -> None:
    source, target = tmp_path / "vq.pth", tmp_path / "vq.safetensors"
    torch.save(model.vqvae.state_dict(), source)
    convert(source, target)
    with pytest.raises(CheckpointError, match="is a safetensors file already"):
        convert(target, tmp_path / "out.safetensors")
    target.write_bytes(target.read_bytes()[:-50])
    with pytest.raises(CheckpointError, match="truncated, or not a converted checkpoint"):
        load_released(target)


def test_class_names_are_counted(model: ReleasedModel, tmp_path: Path) -> None:
    torch.save(_published(model), tmp_path / "model.pth")
    with pytest.raises(CheckpointError, match="2 class names for a model of 14 classes"):
        convert(tmp_path / "model.pth", tmp_path / "out.safetensors", classes=["bed", "desk"])
