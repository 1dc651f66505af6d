"""Warm starts: a network begins with the tensors of an earlier, smaller one."""

from __future__ import annotations

import json
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel


def warm_start(model: CompactModel, path: Path) -> tuple[str, ...]:
    """Take over the tensors of a weights file whose parts the model has, and its box statistics; returns the parts.

    A tensor that has grown keeps what it had in its first rows and columns and is zero elsewhere, so that the network
    starts out computing what the earlier one did; a tensor that the file does not hold stays as initialised.

    Raises:
        ValueError: the file cannot be read, or a tensor of it is larger than the model's.
    """
    try:
        with safe_open(path, "pt") as handle:
            header = handle.metadata() or {}
            given: dict[str, Tensor] = {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118
    except (OSError, SafetensorError) as error:
        raise ValueError(f"{path}: not a readable safetensors file ({error})") from None
    own = model.state_dict()
    for key, value in given.items():
        if key not in own:
            continue
        wanted = own[key]
        if value.ndim != wanted.ndim or any(a > b for a, b in zip(value.shape, wanted.shape, strict=True)):
            raise ValueError(f"{path}: {key} is {tuple(value.shape)}, the model's {tuple(wanted.shape)} cannot hold it")
        with torch.no_grad():
            if value.shape != wanted.shape:
                wanted.zero_()
            wanted[tuple(slice(0, size) for size in value.shape)] = value.to(wanted.dtype)
    parts = tuple(part for part in json.loads(header.get("parts", "[]")) if part in model.parts)
    if "layout" in parts:
        model.statistics = BoxStatistics.from_json(json.loads(header["statistics"]))
    return parts
