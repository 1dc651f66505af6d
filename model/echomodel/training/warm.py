"""Warm starts: a network begins with the tensors of an earlier, smaller one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.learned import places
from echomodel.compact.model import CompactModel, read_weights, words_of
from echomodel.vocabulary import vocabulary


def warm_start(model: CompactModel, path: Path) -> tuple[str, ...]:
    """Take over the tensors of a weights file whose parts the model has, and its box statistics; returns the parts.

    A tensor that has grown keeps what it had in its first rows and columns and is zero elsewhere, so that the network
    starts out computing what the earlier one did; a tensor that the file does not hold stays as initialised.

    Raises:
        ValueError: the file cannot be read, or a tensor of it is larger than the model's.
    """
    header, given = read_weights(path)
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
        statistics = BoxStatistics.from_json(json.loads(header["statistics"]))
        model.statistics = replace(statistics, classes=_grown(statistics.classes, model, path, header))
    return parts


def _grown(
    classes: tuple[tuple[float, ...], ...], model: CompactModel, path: Path, header: dict[str, str]
) -> tuple[tuple[float, ...], ...]:
    """Statistics of the model's categories from those of a file's; what is new has those of what it is like."""
    names, words = model.config.categories, vocabulary()
    numbers = torch.tensor([words.category_id(name) for name in names])
    return classes and tuple(classes[k] for k in places("categories", words_of(path, header)["categories"], numbers))
