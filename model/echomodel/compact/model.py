"""The compact model as modules of torch, and how its parts are written and read.

What is told beside the numbers stands in `echomodel.compact.weights`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn
from torch.overrides import TorchFunctionMode

from echomodel.boxes import BoxStatistics
from echomodel.compact.modules import FurnitureDenoiser, LatentGraph, LayoutDenoiser
from echomodel.compact.weights import (
    FORMAT,
    PARTS,
    WeightsError,
    grown_tables,
    joined_config,
    own_statistics,
    read_header,
    words_of,
)
from echomodel.config import CompactConfig, to_json
from echomodel.files import raising
from echomodel.tensors import write_tensors

if TYPE_CHECKING:
    from echomodel.compact.shape import Autoencoder, ShapeDenoiser

ROUNDED = ("shape.basis",)  # nearly half of all weights; its rows are directions, which two digits tell well enough
SCALES = ".scales"


DEPTHS = frozenset({"layers", "echo_layers", "blocks", "drafts", "voices"})  # each of them costs tensors
RANGES = {  # of what costs no tensors, but time
    "steps": (1, 1000), "candidates": (1, 64), "guidance_rounds": (0, 64), "guidance": (0, 100),
    "temperature": (0, 10), "heads": (1, 64), "frequencies": (0, 16), "patch": (1, 64),
}  # fmt: skip


class CompactModel(nn.Module):
    """Latent graph, the denoisers of layouts, shapes and furniture, autoencoder, configuration and box statistics.

    Arguments:
        config: sizes.
        statistics: normalisation of the boxes.
        parts: which of `PARTS` to build.
    """

    def __init__(self, config: CompactConfig, statistics: BoxStatistics, parts: Iterable[str] = PARTS) -> None:
        super().__init__()
        self.config, self.statistics = config, statistics
        self.parts = tuple(parts)
        for name in self.parts:
            self.add_module(name, PARTS[name].module(config))

    latent: LatentGraph
    layout: LayoutDenoiser
    autoencoder: Autoencoder
    shape: ShapeDenoiser
    furniture: FurnitureDenoiser

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.parameters()).device

    def part_parameters(self, part: str) -> list[nn.Parameter]:
        """Parameters of one part."""
        return list(self.get_submodule(part).parameters())

    def write(self, path: Path, parts: Sequence[str]) -> None:
        """Write parts of the model with everything needed to use them; floats as float16, some in 8 bits."""
        tensors: dict[str, Tensor] = {}
        for part in parts:
            for key, value in self.get_submodule(part).state_dict().items():
                stored = value.half() if value.is_floating_point() else value
                tensors[f"{part}.{key}"] = stored.detach().cpu().contiguous()
        metadata = {
            "format": FORMAT,
            "config": to_json(self.config),
            "statistics": json.dumps(self.statistics.to_json()),
            "parts": json.dumps(list(parts)),
        }
        write_tensors(path, rounded(tensors), metadata)


def check_numbers(raw: dict[str, Any], tensors: int, where: str = "") -> None:
    """Raises ValueError for numbers of a file's configuration that would cost more than its tensors: layers, steps.

    Arguments:
        raw: nested plain values of a configuration. tensors: how many the file holds.
    """
    for name, value in raw.items():
        path = f"{where}.{name}" if where else name
        if isinstance(value, dict):
            check_numbers(value, tensors, path)
        elif name in DEPTHS and isinstance(value, int) and not 0 <= value <= tensors:
            raise ValueError(f"{path} is {value}, the file holds {tensors} tensors")
        elif name in RANGES and not RANGES[name][0] <= value <= RANGES[name][1]:
            raise ValueError(f"{path} is {value}, allowed: {RANGES[name][0]} to {RANGES[name][1]}")


class _Undrawn(TorchFunctionMode):
    """Leaves initial values undrawn: on the meta device torch would load its compiler for them, for seconds."""

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        named = kwargs or {}
        if func is torch.randn:
            return torch.empty(*args)
        drawn = func in (nn.init.normal_, torch.Tensor.mul, torch.Tensor.__mul__)
        return (args[0] if args else named["tensor"]) if drawn else func(*args, **named)


def read_weights(path: Path) -> tuple[dict[str, str], dict[str, Tensor]]:
    """Metadata and tensors of a safetensors file as they are; raises WeightsError where it cannot be read."""
    unreadable = raising(f"{path}: not a readable safetensors file", OSError, SafetensorError, kind=WeightsError)
    with unreadable, safe_open(path, "pt") as handle:
        return handle.metadata() or {}, {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118


def load_weights(paths: Sequence[Path], device: torch.device | str = "cpu") -> tuple[CompactModel, str]:
    """Build the model that the files hold together and return it with a short hash of their contents.

    Arguments:
        paths: at least one. device: where to.

    Raises WeightsError where a file is missing, truncated or of another kind, two files disagree on the configuration,
    or tensors are missing, unexpected or misshapen; the first of each are named.
    """
    if not paths:
        raise WeightsError("no weights files found: install the package with its weights or name a file")
    metadata: dict[Path, dict[str, str]] = {}
    held_by: dict[Path, dict[str, Tensor]] = {}
    digest = hashlib.sha256()
    for path in sorted(paths):
        header = read_header(path)
        digest.update(path.read_bytes())
        if header.get("format") != FORMAT:
            raise WeightsError(f"{path}: format is {header.get('format')!r}, expected {FORMAT!r}")
        metadata[path] = header
        held_by[path] = _numbers(path)
    where = ", ".join(map(str, metadata))
    try:
        config = joined_config(metadata)
        tensors: dict[str, Tensor] = {}
        for path, header in metadata.items():
            tensors |= grown_tables(held_by[path], words_of(path, header), config)
        held = {part for header in metadata.values() for part in json.loads(header["parts"])}
        parts = [part for part in PARTS if part in held]
        statistics = own_statistics(metadata, config)
        check_numbers(asdict(config), len(tensors))
        with torch.device("meta"), _Undrawn():  # sizes that a bent configuration asks for cost nothing there
            _check_fit(CompactModel(config, statistics, parts).state_dict(), tensors, where)
        model = CompactModel(config, statistics, parts)
    except WeightsError:
        raise
    except (
        KeyError, TypeError, ValueError, AttributeError, IndexError, RuntimeError, RecursionError, ArithmeticError
    ) as error:  # fmt: skip
        reason = " ".join(str(error).split())[:200]
        raise WeightsError(f"{where}: malformed metadata ({type(error).__name__}: {reason})") from None
    wanted = model.state_dict()
    model.load_state_dict({key: value.to(wanted[key].dtype) for key, value in tensors.items()})
    return model.to(device).eval(), digest.hexdigest()[:12]


def _numbers(path: Path) -> dict[str, Tensor]:
    """The tensors of a weights file as they are used; raises WeightsError for some that are no finite numbers."""
    try:
        tensors = restored(read_weights(path)[1])
    except WeightsError:
        raise
    except ValueError as error:
        raise WeightsError(f"{path}: {error}") from None
    for key, tensor in tensors.items():
        if not tensor.is_floating_point() or not bool(torch.isfinite(tensor).all()):
            what = "numbers that are not finite" if tensor.is_floating_point() else f"{tensor.dtype}"
            raise WeightsError(f"{path}: tensor {key} holds {what}, allowed: finite floating-point numbers")
    return tensors


def _check_fit(wanted: Mapping[str, Tensor], tensors: dict[str, Tensor], where: str) -> None:
    missing = sorted(wanted.keys() - tensors.keys())
    unexpected = sorted(tensors.keys() - wanted.keys())
    misshapen = [key for key in sorted(wanted.keys() & tensors.keys()) if wanted[key].shape != tensors[key].shape]
    problems = [
        f"{len(keys)} {text} ({', '.join(keys[:3])})"
        for text, keys in (("missing", missing), ("unexpected", unexpected), ("misshapen", misshapen))
        if keys
    ]
    if problems:
        raise WeightsError(f"{where}: tensors do not fit the configuration: {'; '.join(problems)}")


def rounded(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors as a file keeps them: those in `ROUNDED` (rows, n) as int8, with float32 scales (rows,) beside."""
    out = dict(tensors)
    for name in ROUNDED:
        if name in out:
            rows = out[name].float()
            scale = rows.abs().amax(1) / 127
            steps = rows / scale.clamp_min(torch.finfo(scale.dtype).tiny)[:, None]
            out[name], out[name + SCALES] = steps.round().clamp(-127, 127).to(torch.int8), scale
    return out


def restored(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of a file as numbers; those that are not rounded, as in older files, as they are.

    Raises ValueError for rows and scales that are not of a kind or do not fit.
    """
    out = dict(tensors)
    for name in ROUNDED:
        scales = out.pop(name + SCALES, None)
        if scales is None:
            continue
        rows = out.get(name)
        if rows is None or rows.dtype != torch.int8 or scales.dtype != torch.float32:
            raise ValueError(f"{name + SCALES} is {scales.dtype}, {name} {rows if rows is None else rows.dtype}, "
                             "allowed: float32 scales of int8 rows")  # fmt: skip
        if rows.ndim != 2 or scales.shape != rows.shape[:1]:
            shapes = f"{tuple(scales.shape)} and {tuple(rows.shape)}"
            raise ValueError(f"{name + SCALES} and {name} have shapes {shapes}, allowed: (r,) and (r, n)")
        out[name] = rows.float() * scales[:, None]
    return out
