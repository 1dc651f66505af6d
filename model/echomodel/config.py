"""Frozen, serialisable configurations of the compact echo model; they travel inside the weights files."""

import json
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from types import UnionType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

from echomodel.vocabulary import vocabulary

Objective = Literal["noise", "velocity", "flow"]
Sampler = Literal["ddim", "ancestral"]
C = TypeVar("C")


@dataclass(frozen=True)
class LatentConfig:
    """Graph encoder and graph manipulator (EchoScene 3.2).

    Arguments:
        width: channels of the latent node z.
        layers: triplet-GCN layers of the encoder and of the manipulator each.
    """

    width: int = 96
    layers: int = 2


@dataclass(frozen=True)
class BranchConfig:
    """What every branch has.

    Arguments:
        width: channels of a node or token.
        layers: echo layers or transformer blocks.
        echo: exchange information between the objects at every step (Table 4: off = every object alone).
        objective: what the network is trained to predict; `flow` is rectified flow.
        steps: default number of sampling steps.
        sampler: default sampler.
        temperature: scale of the noise that the ancestral sampler adds; below one, fewer stray pieces and less variety.
    """

    width: int = 192
    layers: int = 8
    echo: bool = True
    objective: Objective = "flow"
    steps: int = 20
    sampler: Sampler = "ancestral"
    temperature: float = 1.0


@dataclass(frozen=True)
class LayoutConfig(BranchConfig):
    """Layout denoiser (EchoScene 3.3).

    Arguments:
        drafts: how often the prediction so far is measured and told to the next layers.
        frequencies: octaves of the Fourier features of the noisy box.
        guidance: default of the first step of the guidance, metres and radians, 0 = off (see `echomodel.guidance`).
        guidance_rounds: its steps per call of the denoiser in the last part of the sampling.
    """

    drafts: int = 3
    frequencies: int = 4
    objective: Objective = "velocity"
    guidance: float = 0.1
    guidance_rounds: int = 4
    GONE: ClassVar = {"start": None, "sides": None, "measures": 2}  # files of before name them; None = whatever it is


@dataclass(frozen=True)
class AutoencoderConfig:
    """Autoencoder of 64^3 truncated signed distances.

    Arguments:
        patch: side of a patch in voxels; the latent grid has 64 / patch cells a side.
        channels: channels of the latent.
        width: channels of the refining convolutions of the decoder.
        blocks: residual convolution blocks of the decoder.
    """

    patch: int = 4
    channels: int = 6
    width: int = 64
    blocks: int = 2
    GONE: ClassVar = {"levels": 0}  # latents that are not rounded


@dataclass(frozen=True)
class ShapeConfig(BranchConfig):
    """Latent shape denoiser (EchoScene 3.4).

    Arguments:
        heads: attention heads.
        components: principal components of whole latents that the denoiser works in.
        tokens: tokens that share the components, the strongest first.
        echo_width: channels of a node in the shape echo.
        echo_layers: triplet-GCN layers of the shape echo.
        candidates: draws per object, of which the most whole is kept.
    """

    width: int = 256
    layers: int = 4
    heads: int = 4
    components: int = 384
    tokens: int = 4
    echo_width: int = 128
    echo_layers: int = 2
    candidates: int = 8
    steps: int = 10
    GONE: ClassVar = {"echo_time": True, "conditioning": "cross", "prediction": "sample"}


@dataclass(frozen=True)
class FurnitureConfig(BranchConfig):
    """Denoiser of descriptions of furniture (`echomodel.furniture.style`); the network says the clean description.

    Arguments:
        kinds: words of every kind that a description tells, in order.
        numbers: its proportions and open choices.
        voices: weighted means of the others' descriptions that a node hears at every step.
    """

    kinds: tuple[int, ...] = (5, 9, 2, 7, 5, 7, 4, 4, 7)
    numbers: int = 36
    width: int = 160
    layers: int = 3
    voices: int = 4
    steps: int = 16


def names_of(kind: str) -> tuple[str, ...]:
    """Names of the `categories`, `room_types` or `predicates` that new networks learn: of relations SG-FRONT's."""
    return tuple(row.name for row in getattr(vocabulary(), kind) if kind != "predicates" or row.sgfront is not None)


@dataclass(frozen=True)
class CompactConfig:
    """The compact echo model: sizes of its parts and of its vocabulary.

    Arguments:
        categories, predicates, room_types: the words that the networks know, by name, in the order of their rows.
        rules: names of the rule sets that relations may be meant in.
    """

    categories: tuple[str, ...] = field(default_factory=lambda: names_of("categories"))
    predicates: tuple[str, ...] = field(default_factory=lambda: names_of("predicates"))
    room_types: tuple[str, ...] = field(default_factory=lambda: names_of("room_types"))
    rules: tuple[str, ...] = ("sgfront", "strict")
    latent: LatentConfig = field(default_factory=LatentConfig)
    layout: LayoutConfig = field(default_factory=LayoutConfig)
    autoencoder: AutoencoderConfig = field(default_factory=AutoencoderConfig)
    shape: ShapeConfig = field(default_factory=ShapeConfig)
    furniture: FurnitureConfig = field(default_factory=FurnitureConfig)


def to_json(config: Any) -> str:
    """A configuration as one line of JSON."""
    return json.dumps(asdict(config), sort_keys=True)


def from_dict(kind: type[C], raw: dict[str, Any], where: str = "") -> C:
    """A configuration from nested plain values; fields left out keep their defaults, `GONE` ones have the one value.

    Raises ValueError where a field is not known or its value has the wrong type.
    """
    if not isinstance(raw, dict):
        raise ValueError(f"{where or kind.__name__} is {raw!r}, expected fields with values")
    hints, names = get_type_hints(kind), [f.name for f in fields(kind)]  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, value in raw.items():
        path = f"{where}.{name}" if where else name
        if getattr(kind, "GONE", {}).get(name, names) in (None, value):
            continue
        if name not in names:
            raise ValueError(f"unknown field {path!r}, allowed: {', '.join(names)}")
        values[name] = _typed(hints[name], value, path)
    return kind(**values)


def _typed(hint: Any, value: Any, path: str) -> Any:
    if is_dataclass(hint):
        return from_dict(hint, value, path)  # type: ignore[arg-type]
    origin, choices = get_origin(hint), get_args(hint)
    if origin is UnionType:  # with None
        return None if value is None else _typed(choices[0], value, path)
    if origin is Literal:
        if value not in choices:
            raise ValueError(f"{path} is {value!r}, allowed: {', '.join(map(str, choices))}")
        return value
    if origin is tuple:
        if not isinstance(value, (list, tuple)) or not all(isinstance(v, choices[0]) for v in value):
            raise ValueError(f"{path} is {value!r}, expected a list of {choices[0].__name__}")
        return tuple(value)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, hint) or (hint is int and isinstance(value, bool)):
        raise ValueError(f"{path} is {value!r}, expected {hint.__name__}")
    return value
