"""Published checkpoints in, one safetensors file out; no pickle is ever executed."""

from __future__ import annotations

import json
import os
import pickle
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from echomodel.boxes import BoxStatistics
from echomodel.config import check_numbers
from echomodel.files import whole_file
from echomodel.released.config import ReleasedConfig
from echomodel.released.inference import VQVAE as VQVAE_PREFIX
from echomodel.released.inference import CheckpointError, infer_config
from echomodel.released.model import ReleasedModel
from echomodel.released.vqvae import VQVAE
from echomodel.vocabulary import vocabulary

FORMAT = "echousd-released-1"
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


def build(config: ReleasedConfig, tensors: Mapping[str, Tensor], where: str) -> nn.Module:
    """The model of a config with these very tensors as its weights (cast to float32, else not copied).

    Returns:
        `ReleasedModel`, or a module with `vqvae` alone where the config has no encoder.

    Raises:
        CheckpointError: names `where` and the first missing, unexpected and misshapen keys.
    """
    with torch.device("meta"):
        model: nn.Module = ReleasedModel(config) if config.encoder else _Autoencoder(config)
    expected = nn.Module.state_dict(model)
    problems = []
    missing, unexpected = [k for k in expected if k not in tensors], [k for k in tensors if k not in expected]
    wrong = [k for k in expected if k in tensors and expected[k].shape != tensors[k].shape]
    for word, keys in (("missing", missing), ("unexpected", unexpected), ("misshapen", wrong)):
        if keys:
            detail = keys[0]
            if word == "misshapen":
                detail += f" {list(tensors[detail].shape)} instead of {list(expected[detail].shape)}"
            problems.append(f"{len(keys)} {word} (first: {detail})")
    if problems:
        raise CheckpointError(f"{where}: keys do not match the published model: {'; '.join(problems)}")
    state = {k: v.float() if v.is_floating_point() else v for k, v in tensors.items()}
    for key, value in state.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise CheckpointError(f"{where}: key {key} holds numbers that are not finite")
    model.load_state_dict(state, strict=True, assign=True)
    return model.eval()


class _Autoencoder(nn.Module):
    def __init__(self, config: ReleasedConfig) -> None:
        super().__init__()
        if config.vqvae is None:
            raise CheckpointError("neither an encoder nor an autoencoder is there")
        self.config, self.vqvae = config, VQVAE(config.vqvae)


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


def write_released(
    target: str | os.PathLike[str],
    model: nn.Module,
    config: ReleasedConfig,
    classes: Sequence[str] | None,
    statistics: BoxStatistics | None,
) -> None:
    """Write a model's tensors with config, vocabulary, box statistics and the name of its text encoder, if it has one.

    The file appears whole or not at all.

    Arguments:
        target: the file. model: what `config` describes. classes: names by id. statistics: box normalisation.
    """
    metadata = {
        "format": FORMAT,
        "config": json.dumps(config.to_json()),
        "vocabulary": json.dumps(
            {"classes": classes, "predicates": [p.name for p in vocabulary().predicates]} if config.encoder else None
        ),
        "box_statistics": json.dumps(statistics.to_json() if statistics else None),
    }
    if isinstance(model, ReleasedModel) and model.text_encoder is not None:
        metadata["text_encoder"] = model.text_encoder
    state = {key: value.detach().clone().contiguous() for key, value in nn.Module.state_dict(model).items()}
    target = Path(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(target) as beside:
        save_file(state, beside, metadata=metadata)


def is_released(path: str | os.PathLike[str]) -> bool:
    """Whether a file says that it holds a converted model; False for anything else, unreadable files included."""
    try:
        with safe_open(path, framework="pt") as file:
            return (file.metadata() or {}).get("format") == FORMAT
    except (OSError, SafetensorError):
        return False


def load_released(path: str | os.PathLike[str]) -> nn.Module:
    """Load a converted file.

    Returns:
        `ReleasedModel` in evaluation mode, or a module with `vqvae` alone.

    Raises:
        CheckpointError: not a converted file, or damaged; names the file and the first keys at fault.
        OSError: the file cannot be read.
    """
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            if metadata.get("format") != FORMAT:
                raise CheckpointError(
                    f"{path}: format is {metadata.get('format')!r}, expected {FORMAT!r} (echousd convert)"
                )
            raw = json.loads(metadata["config"])
            check_numbers(raw, len(file.keys()))
            config = ReleasedConfig.from_json(raw)
            words, bounds = json.loads(metadata["vocabulary"]), json.loads(metadata["box_statistics"])
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except CheckpointError:
        raise
    except (SafetensorError, KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        reason = " ".join(str(error).split())[:200]
        raise CheckpointError(f"{path}: truncated, or not a converted checkpoint ({reason})") from None
    model = build(config, tensors, str(path))
    if isinstance(model, ReleasedModel):
        model.classes = tuple(words["classes"]) if words and words["classes"] else None
        model.statistics = BoxStatistics.from_json(bounds) if bounds else None
        model.text_encoder = metadata.get("text_encoder")
    return model
