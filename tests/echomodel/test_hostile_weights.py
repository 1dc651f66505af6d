"""Weights files that somebody bent: refused in one line that names the file."""

from __future__ import annotations

from importlib import resources

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from echomodel.echo import EchoModel


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
