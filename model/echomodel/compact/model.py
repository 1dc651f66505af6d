"""The compact model as one module, and its weights files: parts, config, vocabulary and box statistics together.

Each part is registered once, under the name of its settings in `CompactConfig`. A branch is a part that gives something
of a room: boxes, shapes, furniture. A further branch is a module with its network and its sampling, its settings in
`CompactConfig`, its row here, and a training stage in `echomodel.training`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn
from torch.overrides import TorchFunctionMode

from echomodel.boxes import BoxScale, BoxStatistics
from echomodel.compact.furniture import FurnitureDenoiser
from echomodel.compact.layout import LayoutDenoiser
from echomodel.compact.learned import WordTable, places
from echomodel.compact.pairs import EchoLayer, Pairs
from echomodel.config import CompactConfig, FurnitureConfig, check_numbers, from_dict, to_json
from echomodel.files import whole_file
from echomodel.late import Late

if TYPE_CHECKING:
    from echomodel.compact.shape import Autoencoder, ShapeDenoiser


class LatentGraph(nn.Module):
    """Encodes the graph before an edit and carries its latents over to the edited graph.

    Encoder: z = GCN(category | relations). Manipulator: z' = GCN(z, touched, category | edited relations), where added
    nodes enter with z = 0 and nodes whose relations changed are marked as touched.

    Shapes:
        category (N,) int64 of the edited graph, `Pairs` over the same N nodes, added, touched (N,) -> (N, width)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        width, layers = config.latent.width, config.latent.layers
        self.category = WordTable("categories", config.categories, width)
        self.touched = nn.Parameter(torch.randn(width) * 0.1)
        self.encoder = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.mix = nn.Linear(2 * width, width)
        self.manipulator = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.norm = nn.LayerNorm(width)

    def forward(
        self, category: Tensor, pairs: Pairs, *, before: Pairs | None = None, added: Tensor | None = None,
        touched: Tensor | None = None,
    ) -> Tensor:  # fmt: skip
        """Latent nodes of the edited graph.

        Arguments:
            category: (N,) int64, classes of the edited graph's nodes.
            pairs: relations of the edited graph.
            before: relations before the edit over the same nodes, None = there was no edit.
            added: (N,) bool, nodes that were not there before.
            touched: (N,) bool, nodes that were added or that an edited relation meets.
        """
        classes = self.category(category)
        z = classes
        source = pairs if before is None else before
        for layer in self.encoder:
            z = layer(z, source)
        if added is not None:
            z = z * ~added[:, None]
        known = classes if touched is None else classes + touched[:, None] * self.touched
        z = self.mix(torch.cat([z, known], dim=1))
        for layer in self.manipulator:
            z = layer(z, pairs)
        return self.norm(z)


MEASURES = 2  # set of measures of the drafts that this version computes


@dataclass(frozen=True)
class Part:
    """What weights files and the model know of a part.

    Arguments:
        module: builds it from the whole configuration.
        needs: other parts without which it gives nothing.
        branch: whether it gives something of a room.
        outdated: settings as a weights file holds them -> why this version cannot use them, None = it can; None = it
            can use all.
    """

    module: Callable[[CompactConfig], nn.Module]
    needs: tuple[str, ...] = ()
    branch: bool = False
    outdated: Callable[[Mapping[str, Any]], str | None] | None = None


def _outdated_layout(settings: Mapping[str, Any]) -> str | None:
    if "drafts" not in settings:
        return "whose layout branch did not draft; train it again"
    if settings.get("measures", 1) != MEASURES:
        return "whose layout branch knew no doors and windows; start a training from it with the recipe's field 'warm'"
    return None


def _outdated_furniture(settings: Mapping[str, Any]) -> str | None:
    known = FurnitureConfig()
    told = tuple(settings.get("kinds", known.kinds)), settings.get("numbers", known.numbers)
    if told != (known.kinds, known.numbers):
        return "whose furniture was described in other words; train it again"
    return None


PARTS: dict[str, Part] = {
    "latent": Part(LatentGraph),
    "layout": Part(LayoutDenoiser, ("latent",), branch=True, outdated=_outdated_layout),
    "autoencoder": Part(Late("echomodel.compact.shape:Autoencoder")),
    "shape": Part(Late("echomodel.compact.shape:ShapeDenoiser"), ("latent", "autoencoder"), branch=True),
    "furniture": Part(FurnitureDenoiser, ("latent",), branch=True, outdated=_outdated_furniture),
}


def branches(parts: Iterable[str]) -> frozenset[str]:
    """Names of the branches among `parts` that have what they need beside them."""
    there = set(parts)
    return frozenset(name for name in there if PARTS[name].branch and there.issuperset(PARTS[name].needs))


WORDS = ("categories", "predicates", "room_types")
_SHARED = (*WORDS, "rules")
FORMAT = "echousd-compact-1"
ROUNDED = ("shape.basis",)  # nearly half of all weights; its rows are directions, which two digits tell well enough
SCALES = ".scales"


class WeightsError(ValueError):
    """A weights file that is not one, or whose tensors do not fit the configuration."""


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
        self.later: dict[str, Callable[[], nn.Module]] = {}  # parts that are read when they are asked for
        for name in self.parts:
            self.add_module(name, PARTS[name].module(config))

    def __getattr__(self, name: str) -> Any:
        make = self.__dict__.get("later", {}).pop(name, None)
        if make is not None:
            self.add_module(name, make().to(self.device).eval())
        return super().__getattr__(name)

    latent: LatentGraph
    layout: LayoutDenoiser
    autoencoder: Autoencoder
    shape: ShapeDenoiser
    furniture: FurnitureDenoiser

    def scale(self, category: Tensor) -> BoxScale:
        """What the normalised numbers of boxes of `category` (N,) int64 stand for."""
        return self.statistics.scale(places("categories", self.config.categories, category))

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.parameters()).device

    def part_parameters(self, part: str) -> list[nn.Parameter]:
        """Parameters of one part."""
        return list(self.get_submodule(part).parameters())

    def write(self, path: Path, parts: Sequence[str]) -> None:
        """Write parts to a weights file, see `save_weights`."""
        save_weights(path, self, parts)


def save_weights(path: Path, model: CompactModel, parts: Sequence[str]) -> None:
    """Write parts of a model with everything needed to use them; floats as float16, some in 8 bits."""
    tensors: dict[str, Tensor] = {}
    for part in parts:
        for key, value in model.get_submodule(part).state_dict().items():
            stored = value.half() if value.is_floating_point() else value
            tensors[f"{part}.{key}"] = stored.detach().cpu().contiguous()
    metadata = {
        "format": FORMAT,
        "config": to_json(model.config),
        "statistics": json.dumps(model.statistics.to_json()),
        "parts": json.dumps(list(parts)),
    }
    with whole_file(path) as beside:
        save_file(rounded(tensors), beside, metadata=metadata)


class _Undrawn(TorchFunctionMode):
    """Leaves initial values undrawn: on the meta device torch would load its compiler for them, for seconds."""

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        given = kwargs or {}
        if func is torch.randn:
            return torch.empty(*args)
        drawn = func in (nn.init.normal_, torch.Tensor.mul, torch.Tensor.__mul__)
        return (args[0] if args else given["tensor"]) if drawn else func(*args, **given)


def read_header(path: Path) -> dict[str, str]:
    """Metadata of a safetensors file; raises WeightsError where it cannot be read."""
    try:
        with safe_open(path, "pt") as handle:
            return handle.metadata() or {}
    except (OSError, SafetensorError) as error:
        raise WeightsError(f"{path}: not a readable safetensors file ({error})") from None


def read_weights(path: Path) -> tuple[dict[str, str], dict[str, Tensor]]:
    """Metadata and tensors of a safetensors file as they are; raises WeightsError where it cannot be read."""
    try:
        with safe_open(path, "pt") as handle:
            return handle.metadata() or {}, {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118
    except (OSError, SafetensorError) as error:
        raise WeightsError(f"{path}: not a readable safetensors file ({error})") from None


def load_weights(
    paths: Sequence[Path], device: torch.device | str = "cpu", later: Collection[str] = ()
) -> tuple[CompactModel, str]:
    """Build the model that the files hold together and return it with a short hash of their contents.

    Arguments:
        paths: at least one. device: where to.
        later: parts whose files are read when the parts are asked for, where they hold nothing else.

    Raises WeightsError where a file is missing, truncated or of another kind, two files disagree on the configuration,
    or tensors are missing, unexpected or misshapen; the first of each are named.
    """
    if not paths:
        raise WeightsError("no weights files found: install the package with its weights or name a file")
    metadata: dict[Path, dict[str, str]] = {}
    tensors: dict[str, Tensor] = {}
    waiting: dict[str, Path] = {}
    digest = hashlib.sha256()
    for path in sorted(paths):
        header = read_header(path)
        digest.update(path.read_bytes())
        if header.get("format") != FORMAT:
            raise WeightsError(f"{path}: format is {header.get('format')!r}, expected {FORMAT!r}")
        metadata[path] = header
        if later and set(json.loads(header["parts"])) <= set(later):
            waiting |= dict.fromkeys(json.loads(header["parts"]), path)
        else:
            tensors.update(_numbers(path))
    first, where = next(iter(metadata)), ", ".join(str(path) for path in metadata if path not in waiting.values())
    try:
        config = _joined_config(metadata)
        held = {part for header in metadata.values() for part in json.loads(header["parts"])}
        parts = [part for part in PARTS if part in held and part not in waiting]
        # only a file with the layout branch knows the boxes
        own = next((h for h in metadata.values() if "layout" in json.loads(h["parts"])), metadata[first])
        statistics = BoxStatistics.from_json(json.loads(own["statistics"]))
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
    _fill(model, tensors)
    model.later = {part: partial(_read_part, path, config, part) for part, path in waiting.items()}
    model.parts = tuple(part for part in PARTS if part in held)
    return model.to(device).eval(), digest.hexdigest()[:12]


def _fill(module: nn.Module, tensors: Mapping[str, Tensor]) -> None:
    wanted = module.state_dict()
    module.load_state_dict({key: value.to(wanted[key].dtype) for key, value in tensors.items()})


def _read_part(path: Path, config: CompactConfig, part: str) -> nn.Module:
    """One part from its file, which ships with the package."""
    module, held = PARTS[part].module(config), _numbers(path)
    own = {key.removeprefix(f"{part}."): value for key, value in held.items() if key.startswith(f"{part}.")}
    _check_fit(module.state_dict(), own, str(path))
    _fill(module, own)
    return module


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


def _joined_config(metadata: dict[Path, dict[str, str]]) -> CompactConfig:
    """Each part's settings from the file that holds the part; what all parts share must be equal."""
    joined, first = None, None
    for path, header in metadata.items():
        raw, parts = json.loads(header["config"]), json.loads(header["parts"])
        for part in parts:
            outdated = PARTS[part].outdated
            if outdated and (reason := outdated(raw[part])):
                raise WeightsError(f"{path}: is of an earlier version, {reason}")
        named = words_of(path, header)
        own = from_dict(CompactConfig, {**{key: raw[key] for key in ("rules", *parts)}, **named})
        for other in (set(PARTS) - set(parts)) & set(raw):
            # settings of a part that lies in another file; an older version's may hold fields that are gone
            with suppress(ValueError):
                own = replace(own, **{other: vars(from_dict(CompactConfig, {other: raw[other]}))[other]})
        if joined is None:
            joined, first = own, path
        for shared in _SHARED:
            if vars(own)[shared] != vars(joined)[shared]:
                raise WeightsError(f"{path}: {shared} differs from that of {first}, they are not one model")
        joined = replace(joined, **{part: vars(own)[part] for part in parts})
    assert joined is not None
    return joined


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


def words_of(path: Path, header: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """The words that a weights file names, of every kind in `WORDS`; files of before counted them in their
    configuration and named them beside. Raises WeightsError for a wrong count or a name that is there twice."""
    raw, beside = json.loads(header["config"]), json.loads(header.get("vocabulary", "{}"))
    named = {kind: tuple(beside[kind] if isinstance(raw[kind], int) else raw[kind]) for kind in WORDS}
    for kind, names in named.items():
        if isinstance(raw[kind], int) and raw[kind] != len(names):
            raise WeightsError(f"{path}: names {len(names)} {kind}, its configuration counts {raw[kind]}")
        if twice := [name for number, name in enumerate(names) if name in names[:number]]:
            raise WeightsError(f"{path}: names {twice[0]!r} twice among its {kind}")
    return named


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
