"""Weights files that somebody bent: refused in one line that names the file."""

from __future__ import annotations

import json
import resource
from importlib import resources

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from echomodel.config import CompactConfig, from_dict
from echomodel.echo import EchoModel
from echomodel.training.recipe import Recipe
from echoscene.checkpoint import load_released


@pytest.fixture(scope="module")
def layout():
    path = str(resources.files("echomodel") / "weights" / "layout.safetensors")
    with safe_open(path, "pt") as file:
        return file.metadata(), {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118


@pytest.mark.parametrize("field", ["config", "parts", "statistics"])
@pytest.mark.parametrize("text", ["[]", "7", "{", '{"layout": []}'])
def test_malformed_metadata(layout, tmp_path, field, text):
    metadata, tensors = layout
    save_file(tensors, tmp_path / "bent.safetensors", metadata={**metadata, field: text})
    with pytest.raises(ValueError, match=r"bent\.safetensors"):
        EchoModel.load(tmp_path / "bent.safetensors")


@pytest.mark.parametrize("bent", ["nan", "whole numbers"])
def test_tensors_that_are_no_weights(layout, tmp_path, bent):
    metadata, tensors = layout
    key = min(tensors)
    wrong = torch.full_like(tensors[key], torch.nan) if bent == "nan" else tensors[key].to(torch.int8)
    save_file({**tensors, key: wrong}, tmp_path / "bent.safetensors", metadata=metadata)
    with pytest.raises(ValueError, match=rf"bent\.safetensors: tensor {key} holds .*allowed: finite floating-point"):
        EchoModel.load(tmp_path / "bent.safetensors")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        (("layout", "width"), 10**9),
        (("layout", "width"), 2**70),
        (("layout", "layers"), 10**9),
        (("layout", "layers"), -1),
        (("layout", "drafts"), 10**9),
        (("layout", "frequencies"), 10**9),
        (("latent", "layers"), 10**9),
        (("categories",), 10**12),
        (("layout", "steps"), 10**9),
        (("layout", "steps"), 0),
        (("layout", "guidance_rounds"), 10**9),
        (("layout", "guidance"), float("nan")),
    ],
)
def test_a_configuration_that_asks_for_more_than_the_file_holds(layout, tmp_path, field, value):
    metadata, tensors = layout
    config = json.loads(metadata["config"])
    within = config
    for name in field[:-1]:
        within = within[name]
    within[field[-1]] = value
    save_file(tensors, tmp_path / "bent.safetensors", metadata={**metadata, "config": json.dumps(config)})
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=r"bent\.safetensors: "):
        EchoModel.load(tmp_path / "bent.safetensors")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # kB


@pytest.mark.parametrize(("part", "field"), [("encoder", "layers"), ("encoder", "hidden"), ("layout", "blocks")])
def test_converted_weights_that_ask_for_more_than_they_hold(tmp_path, part, field):
    config = {part: {field: 10**9}}
    save_file(
        {"a": torch.zeros(1)}, tmp_path / "bent.safetensors",
        metadata={"format": "echousd-released-1", "config": json.dumps(config), "vocabulary": "null",
                  "box_statistics": "null"},
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"bent\.safetensors: "):
        load_released(tmp_path / "bent.safetensors")


def test_settings_that_are_gone_are_passed_over(layout, tmp_path):
    metadata, tensors = layout
    config = json.loads(metadata["config"])
    config["layout"]["start"] = 0.05  # sampling could begin on an arrangement
    save_file(tensors, tmp_path / "before.safetensors", metadata={**metadata, "config": json.dumps(config)})
    assert EchoModel.load(tmp_path / "before.safetensors").config.layout == EchoModel.load().config.layout
    assert from_dict(Recipe, {"stage": "layout", "steps": 1, "model": {"layout": {"start": 0.05}}}).model.layout
    with pytest.raises(ValueError, match=r"unknown field 'shape\.conditioning'"):  # none that was another way
        from_dict(CompactConfig, {"shape": {"conditioning": "concat"}})
    assert from_dict(CompactConfig, {"shape": {"conditioning": "cross"}}) == CompactConfig()
    with pytest.raises(ValueError, match=r"unknown field 'layout\.begin'"):
        from_dict(CompactConfig, {"layout": {"begin": 0.05}})
