"""A model of the published networks as one safetensors file: config, vocabulary and box statistics inside."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from echomodel.boxes import BoxStatistics
from echomodel.config import check_numbers, from_dict
from echomodel.files import whole_file
from echomodel.vocabulary import vocabulary
from echoscene.config import ReleasedConfig
from echoscene.model import ReleasedModel
from echoscene.vqvae import VQVAE

FORMAT = "echousd-released-1"


class CheckpointError(ValueError):
    """A file that does not hold the published model; the message names the file's first keys at fault."""


def build(config: ReleasedConfig, tensors: Mapping[str, Tensor], where: str) -> nn.Module:
    """The model of a config with these very tensors as its weights (cast to float32, else not copied).

    Returns `ReleasedModel`, or a module with `vqvae` alone where the config has no encoder.
    Raises CheckpointError: names `where` and the first missing, unexpected and misshapen keys.
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


def write_released(
    target: str | os.PathLike[str], model: nn.Module, config: ReleasedConfig, classes: Sequence[str] | None,
    statistics: BoxStatistics | None,
) -> None:  # fmt: skip
    """Write a model's tensors with config, vocabulary, box statistics and the name of its text encoder, if it has one.

    The file appears whole or not at all.

    Arguments:
        target: the file. model: what `config` describes. classes: names by id. statistics: box normalisation.
    """
    metadata = {
        "format": FORMAT,
        "config": json.dumps(asdict(config)),
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


def load_released(path: str | os.PathLike[str]) -> nn.Module:
    """Load a converted file.

    Returns `ReleasedModel` in evaluation mode, or a module with `vqvae` alone.

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
            config = from_dict(ReleasedConfig, dict(raw))
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
