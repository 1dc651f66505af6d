"""The published files' listings: every key finds its place, none is left over, switches are read off the keys."""

from __future__ import annotations

import gzip
import json

import pytest
import torch
from parity_numbers import LISTINGS

from echoscene.checkpoint import CheckpointError, build, class_names, infer_config
from echoscene.config import ReleasedConfig

FILES = sorted(LISTINGS.glob("state_dict_*.json.gz"))


def _tensors(path) -> dict[str, torch.Tensor]:
    """Zeros of the listed shapes that take no memory."""
    out = {}
    for key, shape in json.loads(gzip.decompress(path.read_bytes())).items():
        dtype, dims = (
            (getattr(torch, shape[0]), shape[1:]) if shape and isinstance(shape[0], str) else (torch.float32, shape)
        )
        out[key.replace("/", ".", 1)] = torch.zeros((), dtype=dtype).expand(dims)
    if "encoder.conv_in.weight" in out:
        out = {f"vqvae.{key}": value for key, value in out.items()}
    return out


def _config(name: str) -> tuple[ReleasedConfig, dict[str, torch.Tensor]]:
    tensors = _tensors(LISTINGS / f"state_dict_{name}.json.gz")
    return infer_config({key: tuple(value.shape) for key, value in tensors.items()}), tensors


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name.split(".")[0])
def test_every_key_is_taken(path) -> None:
    tensors = _tensors(path)
    config = infer_config({key: tuple(value.shape) for key, value in tensors.items()})
    model = build(config, tensors, path.name)
    assert set(model.state_dict()) == set(tensors)


def test_switches_of_the_full_model() -> None:
    config, _ = _config("echoscene")
    assert config == ReleasedConfig()
    assert class_names(config.encoder.classes)[:2] == ("_scene_", "bed")


def test_switches_of_the_layout_models() -> None:
    timed, plain = _config("echolayout")[0], _config("echolayout_no_temb")[0]
    assert timed.layout == ReleasedConfig().layout
    assert (timed.layout.time_in_echo, plain.layout.time_in_echo) == (True, False)
    assert (timed.shape, timed.vqvae) == (None, None)
    assert timed.encoder.separated
    assert timed.encoder.own_manipulator_table


def test_autoencoder_alone() -> None:
    config, _ = _config("vqvae")
    assert (config.encoder, config.layout, config.shape) == (None, None, None)
    assert config.vqvae == ReleasedConfig().vqvae


@pytest.mark.parametrize("classes", [15, 36, 40])
def test_other_class_counts(classes: int) -> None:
    _, tensors = _config("echolayout")
    for key in ("obj_embeddings_ec.weight", "obj_embeddings_dc.weight"):
        tensors[key] = torch.zeros(()).expand(classes + 1, 128)
    config = infer_config({key: tuple(value.shape) for key, value in tensors.items()})
    assert config.encoder.classes == classes
    build(config, tensors, "file")
    names = class_names(classes)
    assert names is None if classes == 40 else (len(names) == classes and names[0] == "_scene_")


def test_not_separated_and_not_residual() -> None:
    _, tensors = _config("echoscene")
    tensors = {k: v for k, v in tensors.items() if "_rel_" not in k and "linear_projection" not in k}
    config = infer_config({key: tuple(value.shape) for key, value in tensors.items()})
    assert not config.encoder.separated
    assert [part.residual for part in (config.encoder, config.layout, config.shape)] == [False] * 3
    build(config, tensors, "file")


def test_wrong_keys_are_named() -> None:
    config, tensors = _config("echolayout")
    del tensors["LayoutDiff.df.model.out.2.bias"]
    tensors["LayoutDiff.df.model.extra"] = torch.zeros(1)
    tensors["LayoutDiff.df.model.out.0.weight"] = torch.zeros(3)
    with pytest.raises(CheckpointError) as error:
        build(config, tensors, "model.pth")
    assert str(error.value) == (
        "model.pth: keys do not match the published model: 1 missing (first: LayoutDiff.df.model.out.2.bias); "
        "1 unexpected (first: LayoutDiff.df.model.extra); "
        "1 misshapen (first: LayoutDiff.df.model.out.0.weight [3] instead of [512])"
    )
