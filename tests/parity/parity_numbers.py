"""Fixture files of the published networks' inputs and outputs, and the seeded weights that belong to them.

`ECHOUSD_PARITY_DIR` names another folder of the same form; everything (seeds, widths, names, counts) is read from the
files' metadata, nothing is fixed here.
"""

from __future__ import annotations

import json
import os
import re
import zlib
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import torch
from safetensors import safe_open
from torch import Tensor, nn

LISTINGS = Path(__file__).parent / "fixtures"
FOLDER = Path(os.environ.get("ECHOUSD_PARITY_DIR") or LISTINGS)
DEFAULT_GAIN = 0.7
AT_ONCE = 1 << 16  # numbers drawn at a time: they stay in the cache, and some networks have hundreds of millions


class Numbers:
    """One fixture file: tensors by name (`numbers["eps"]`) and its metadata (`numbers.meta`)."""

    def __init__(self, name: str) -> None:
        self.path = FOLDER / f"{name}.safetensors"
        if not self.path.is_file():
            pytest.skip(f"{self.path} is not there")
        with safe_open(self.path, framework="pt") as file:
            self.meta: dict[str, Any] = json.loads((file.metadata() or {}).get("meta", "{}"))
            self.names = list(file.keys())

    def __getitem__(self, name: str) -> Tensor:
        with safe_open(self.path, framework="pt") as file:
            return file.get_tensor(name)

    def __contains__(self, name: str) -> bool:
        return name in self.names

    @cached_property
    def seed(self) -> int:
        """Seed of the weights."""
        return int(self.meta.get("recipe", self.meta)["seed"])

    @cached_property
    def gain(self) -> float:
        """Gain of the weights: a field, or an argument in the prose of `weights`."""
        recipe = self.meta.get("recipe", self.meta)
        if "gain" in recipe:
            return float(recipe["gain"])
        said = re.search(r"gain=([0-9.]+)", str(self.meta.get("weights", "")))
        return float(said.group(1).rstrip(".")) if said else DEFAULT_GAIN

    @cached_property
    def keys(self) -> dict[str, list[int]]:
        """Parameter names and shapes, of this file or of the one whose weights it uses."""
        recipe = self.meta.get("recipe", {})
        if "keys" in recipe:
            return recipe["keys"]
        source = recipe.get("as") or self.meta.get("weights_from")
        return Numbers(source).keys if source else {}

    @property
    def config(self) -> dict[str, Any]:
        """The configuration: this file's own, or that of the file whose weights it uses."""
        source = self.meta.get("weights_from")
        return self.meta if "model_channels" in self.meta or not source else Numbers(source).config

    def gradient_norms(self) -> dict[str, float]:
        """Expected gradient norm of each parameter."""
        prefix = "gradnorm/"
        return {name[len(prefix) :]: float(self[name]) for name in self.names if name.startswith(prefix)}

    def net(self, kind: Callable[[Any], nn.Module], config: Any) -> Any:
        """A network of this config with the seeded weights: torch's own are not drawn before."""
        kept = {name: lambda tensor, *_, **__: tensor for name in ("kaiming_uniform_", "uniform_", "normal_")}
        with patch.multiple(nn.init, **kept):
            return self.fill(kind(config))

    def fill(self, module: nn.Module) -> nn.Module:
        """Give a module the seeded weights, and check its names and shapes against the file's."""
        state = nn.Module.state_dict(module)
        if self.keys:
            assert {k: list(v.shape) for k, v in state.items()} == self.keys
        fill(module, self.seed, self.gain)
        return module.eval()


def value(key: str, shape: tuple[int, ...], seed: int, gain: float) -> np.ndarray:
    """One seeded weight: uniform numbers from a stream named by key and seed, scaled by the role of the parameter.

    Norm gains scatter about 1, biases and running means about 0, running variances lie in [0.5, 1.5], embeddings have
    unit variance, other weights variance gain^2 / fan-in.
    """
    stream = np.random.RandomState((zlib.crc32(key.encode()) + seed) % 2**32)
    role = key.rpartition(".")[2]
    embeds = key.endswith("embedding.weight") or "embeddings_" in key or "pred_embeddings" in key
    out = np.empty(int(np.prod(shape)), np.float32)
    for part in np.split(out, range(AT_ONCE, len(out), AT_ONCE)):
        centred = stream.random_sample(len(part))
        centred *= 2.0
        centred -= 1.0
        if role == "running_mean":
            part[:] = 0.2 * centred
        elif role == "running_var":
            part[:] = 0.5 + (centred + 1.0) / 2.0
        elif role == "bias":
            part[:] = 0.1 * centred
        elif len(shape) == 1:
            part[:] = 1.0 + 0.2 * centred
        elif embeds:
            part[:] = 3**0.5 * centred
        else:
            centred *= 3**0.5
            centred *= gain
            centred /= np.sqrt(np.prod(shape[1:]))
            part[:] = centred
    return out.reshape(shape)


def fill(module: nn.Module, seed: int, gain: float = DEFAULT_GAIN) -> None:
    """Seeded weights for every floating-point entry of a module, one at a time, in place; counters become 0."""
    with torch.no_grad():
        for key, tensor in nn.Module.state_dict(module).items():
            if tensor.is_floating_point():
                tensor.copy_(torch.from_numpy(value(key, tuple(tensor.shape), seed, gain)))
            else:
                tensor.zero_()


def close(found: Tensor, expected: Tensor, absolute: float = 0.0, relative: float = 0.0) -> None:
    """Assert that every number is within the tolerance; says the largest difference otherwise."""
    assert found.shape == expected.shape
    found, expected = found.detach(), expected.detach()
    difference = (found.double() - expected.double()).abs()
    worst = float((difference - relative * expected.double().abs()).max()) if difference.numel() else 0.0
    assert worst <= absolute, f"off by {float(difference.max()):.3g}, allowed {absolute:g} + {relative:g} * value"


def check_gradients(net: nn.Module, expected: dict[str, float]) -> None:
    """Gradient norms within 1e-3; a parameter that cannot matter has none here and a vanishing one there."""
    found = {k: 0.0 if p.grad is None else float(p.grad.norm()) for k, p in net.named_parameters()}
    assert expected
    assert set(expected) <= set(found)
    scale = max(expected.values())
    for key, norm in expected.items():
        assert abs(found[key] - norm) <= 1e-3 * norm + 1e-6 * scale, f"{key}: {found[key]:.6g}, expected {norm:.6g}"
    for key in set(found) - set(expected):
        assert found[key] == 0.0, key
