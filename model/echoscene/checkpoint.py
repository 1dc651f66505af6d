"""Published checkpoints in, one safetensors file out; no pickle is ever executed."""

from __future__ import annotations

import math
import os
import pickle
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import torch
from torch import Tensor

from echomodel.boxes import BoxStatistics
from echomodel.vocabulary import vocabulary
from echoscene.config import ReleasedConfig
from echoscene.inference import VQVAE as VQVAE_PREFIX
from echoscene.inference import CheckpointError, infer_config
from echoscene.weights import build, write_released

IGNORED = ("epoch", "counter", "opt")  # what the published training keeps beside the weights
NESTED = ("vqvae", "shape_df")


def read_published(path: str | os.PathLike[str]) -> dict[str, Tensor]:
    """Tensors of a published file by flat name.

    Arguments:
        path: a file written by `torch.save`: a state dict, nested dicts `vqvae` and `shape_df` and training counters
            allowed. A bare autoencoder comes back under `vqvae.`.

    Raises:
        CheckpointError: not such a file, cut short, or holding anything but tensors, numbers and containers of them
            (which is refused, not executed); names the file and the entry.
        OSError: the file cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        head = file.read(16)
    if head[8:9] == b"{" and path.suffix == ".safetensors":
        raise CheckpointError(f"{path}: is a safetensors file already, expected a checkpoint written by torch.save")
    try:
        # Mapped, not read: the optimiser's state in a published file is twice as large as the weights.
        raw = torch.load(path, map_location="cpu", weights_only=True, mmap=is_zipfile(path))
    except pickle.UnpicklingError as error:
        told = str(error)
        named = re.search(r"GLOBAL ([\w.]+)", told) or re.search(r"`?([\w.]+)`? (?:was not an allowed|is not)", told)
        what = f"it refers to {named.group(1)}" if named else "it is not a plain pickle of tensors"
        raise CheckpointError(
            f"{path}: refused, {what}; only tensors, numbers and containers of them are read, nothing is executed"
        ) from None
    except (
        RuntimeError,
        EOFError,
        ValueError,
        KeyError,
        AttributeError,
        UnicodeDecodeError,
        IndexError,
        TypeError,
    ) as error:
        reason = str(error).strip().splitlines()[0][:160] if str(error).strip() else type(error).__name__
        raise CheckpointError(f"{path}: truncated, or not a file written by torch.save ({reason})") from None
    if not isinstance(raw, Mapping):
        raise CheckpointError(f"{path}: holds a {type(raw).__name__}, expected a dict of tensors")
    return _flatten(raw, path)


def _flatten(raw: Mapping[Any, Any], path: Path) -> dict[str, Tensor]:
    out: dict[str, Tensor] = {}
    for key, value in raw.items():
        if key in IGNORED:
            continue
        if key in NESTED and isinstance(value, Mapping):
            for inner, tensor in value.items():
                out[f"{key}.{inner}"] = _tensor(f"{key}.{inner}", tensor, path)
        else:
            out[str(key)] = _tensor(str(key), value, path)
    if not out:
        raise CheckpointError(f"{path}: holds no tensors")
    if "quantize.embedding.weight" in out or "encoder.conv_in.weight" in out:
        out = {f"{VQVAE_PREFIX}{key}": tensor for key, tensor in out.items()}
    return out


def _tensor(key: str, value: object, path: Path) -> Tensor:
    if not isinstance(value, Tensor):
        raise CheckpointError(f"{path}: key {key} holds a {type(value).__name__}, expected a tensor")
    return value


def class_names(count: int) -> tuple[str, ...] | None:
    """Names of `count` classes in the order of their ids, or None if no published mapping has as many (14, 15, 36)."""
    words = vocabulary()
    coarse = words.coarse_categories
    if count == len(coarse):
        return coarse
    if count == len(coarse) + 1:  # the mapping that keeps stools apart
        return tuple(sorted([*coarse, "stool"]))
    fine = tuple(sorted({*words.structure, *(c.sgfront for c in words.categories)}))
    return fine if count == len(fine) else None


def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    classes: Sequence[str] | None = None,
    statistics: BoxStatistics | None = None,
) -> ReleasedConfig:
    """Write a published checkpoint as one safetensors file with config, vocabulary and box statistics inside.

    Arguments:
        source: the published file. target: the file to write; appears whole or not at all.
        classes: class names in the order of their ids; None = those of the published mappings.
        statistics: box normalisation; None = unknown (sampling of boxes then asks for it).

    Returns:
        The config read off the keys.

    Raises:
        CheckpointError: as `read_published` and `build`, or the number of class names is wrong.
    """
    tensors = read_published(source)
    try:
        config = infer_config({key: tuple(value.shape) for key, value in tensors.items()})
    except ValueError as error:
        raise CheckpointError(f"{source}: {error}") from None
    count = config.encoder.classes if config.encoder else 0
    names = class_names(count) if classes is None else tuple(classes)
    if classes is not None and len(classes) != count:
        raise CheckpointError(f"{len(classes)} class names for a model of {count} classes")
    model = build(config, tensors, str(source))
    write_released(target, model, config, names, statistics)
    return config


def statistics_from_bounds(bounds: Sequence[float]) -> BoxStatistics:
    """Fourteen numbers, lowest and highest size (3 + 3, metres), position (3 + 3, metres) and angle (unused).

    Raises:
        ValueError: not fourteen finite numbers, or a highest that is not above its lowest.
    """
    numbers = [float(v) for v in bounds]
    if len(numbers) != 14 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"box bounds: {len(numbers)} numbers, expected 14 finite ones")
    low, high, start, stop = (tuple(numbers[i : i + 3]) for i in (0, 3, 6, 9))
    return BoxStatistics(low, high, start, stop, log_size=False)


def read_bounds(path: str | os.PathLike[str]) -> BoxStatistics:
    """Read a `centered_bounds_*_trainval.txt` file; raises ValueError naming the file."""
    try:
        return statistics_from_bounds([float(word) for word in Path(path).read_text("utf-8").split()])
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
