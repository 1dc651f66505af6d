"""Recipes: small TOML files that say what to train, on what and for how long."""

import json
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from echomodel.config import C, CompactConfig, from_dict, to_json
from echomodel.files import SHIPPED, raising

Stage = Literal["vqvae", "layout", "shape", "parts", "paper_vqvae", "paper"]


@dataclass(frozen=True)
class OptimizerConfig:
    """AdamW with a learning-rate schedule.

    Arguments:
        rate: peak learning rate.
        schedule: `cosine` (warm-up, then to zero), `trapezoid` (warm-up, constant, linear to zero over `cooldown`
            steps), or `paper` (1e-4, halved at 35k, 1e-5 at 70k, 5e-6 at 140k steps; `rate` scales it).
        warmup, cooldown: steps.
        decay: weight decay.
        clip: largest norm of the gradient.
        average: decay of the exponential moving average of the weights.
    """

    rate: float = 1e-3
    schedule: Literal["cosine", "trapezoid", "paper"] = "cosine"
    warmup: int = 500
    cooldown: int = 2000
    decay: float = 0.01
    clip: float = 1.0
    average: float = 0.9995

    def rate_at(self, step: int, steps: int) -> float:
        """Learning rate of step `step` (from 0) of `steps`."""
        if self.schedule == "paper":
            factors = ((35_000, 1.0), (70_000, 0.5), (140_000, 0.1), (math.inf, 0.05))
            return self.rate * next(factor for limit, factor in factors if step < limit)
        warm = min(1.0, (step + 1) / max(self.warmup, 1))
        if self.schedule == "trapezoid":
            return self.rate * min(warm, (steps - step) / max(self.cooldown, 1), 1.0)
        return self.rate * warm * 0.5 * (1 + math.cos(math.pi * min(step / steps, 1.0)))


# field, least and most: what is beyond ends the process or never ends
BOUNDS: tuple[tuple[str, float, float], ...] = (
    *((name, 1, 10**9) for name in ("steps", "validate_every", "save_every", "log_every")),
    *((name, 1, 10**6) for name in ("nodes", "shapes_per_batch", "scenes")),
    ("seed", 0, 2**63 - 1),
    ("threads", 0, 1024),
    ("workers", 0, 1024),
    *((f"{name}_weight", 0, 10**6) for name in ("relation", "measure", "physics", "drawn")),
)


@dataclass(frozen=True)
class Recipe:
    """One training run.

    Arguments:
        stage: `vqvae` (autoencoder), `layout`, `shape` or `parts` (descriptions of furniture); `paper_vqvae` and
            `paper` are the autoencoder and the joint stage of the `paper` preset.
        steps: optimiser steps.
        seed: seed of the initial weights and of every batch.
        data: folder that `echousd data build` made, or a packed set of rooms; its held-out part is for validation.
        start: weights files to start from.
        warm: weights files, of an earlier version too, whose tensors are taken over as far as they reach: what has
            grown keeps what it had in its first rows and columns and begins with zeros in the others; a name alone
            that no file has, as layout.safetensors, is of those that ship.
        frozen: parts that the stage would train but that stay as they are.
        new_words: of the others too all stays but categories and room types that the file of `warm` does not know, so
            that rooms without them are drawn as before.
        nodes: node budget of a batch of rooms. shapes_per_batch: objects per shape batch.
        scenes, text: `paper` alone: scenes per batch, and where text features come from: `clip` (downloaded once), a
            weights file of CLIP's, or `random` (vectors that only tell texts apart).
        relation_weight: weight of the hinge on the relations' margins of the predicted boxes.
        measure_weight: weight of the difference in what predicted and true boxes measure (gaps to walls, ...).
        physics_weight: weight of collisions of the predicted boxes, and of what is through a wall or in a door's way.
        drawn_weight: weight of what is wrong with rooms that the network draws itself (`training.layout_stage`).
        validate_every, save_every: steps.
        precision: `float32` or `bfloat16` (autocast).
        threads: CPU threads, 0 = as many as torch likes. workers: processes that draw batches of rooms ahead of a GPU,
            0 = none.
        compiled: what is measured on boxes, two of five small operations of a step, is compiled for the machine.
        model: sizes of the compact model. paper: settings of the `paper` preset (`echoscene.config.SETTINGS`).
        optimizer: how to step.
    """

    stage: Stage
    steps: int
    seed: int = 0
    data: str = ""
    start: tuple[str, ...] = ()
    warm: tuple[str, ...] = ()
    frozen: tuple[str, ...] = ()
    new_words: bool = False
    nodes: int = 512
    shapes_per_batch: int = 32
    scenes: int = 64
    text: str = "clip"
    relation_weight: float = 0.5
    measure_weight: float = 0.0
    physics_weight: float = 0.0
    drawn_weight: float = 0.0
    validate_every: int = 2000
    save_every: int = 1000
    log_every: int = 50
    precision: Literal["float32", "bfloat16"] = "float32"
    threads: int = 0
    workers: int = 0
    compiled: bool = False
    model: CompactConfig = field(default_factory=CompactConfig)
    paper: dict = field(default_factory=dict)
    optimizer: OptimizerConfig = field(default_factory=OptimizerConfig)

    @property
    def warm_files(self) -> tuple[Path, ...]:
        """Where the files of `warm` lie."""
        return tuple(
            SHIPPED / one if Path(one).name == one and not Path(one).exists() else Path(one) for one in self.warm
        )

    def __post_init__(self) -> None:
        for name, least, most in BOUNDS:
            found = getattr(self, name)
            if not least <= found <= most:  # NaN is neither
                raise ValueError(f"{name} is {found}, allowed: {least} to {most}")
        for name in ("rate", "decay", "clip", "average"):
            found = getattr(self.optimizer, name)
            if not 0 <= found < math.inf:
                raise ValueError(f"optimizer.{name} is {found}, allowed: a finite number, 0 or more")


def read_recipe(path: Path, settings: list[str] | None = None) -> Recipe:
    """Read a recipe file and apply `key=value` settings; paths in it are relative to the working folder.

    Raises ValueError where the file is not TOML, or a field is unknown or has a wrong type; the message names file and
    field.
    """
    try:
        raw = tomllib.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{path}: no such recipe") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file ({error})") from None
    missing = [name for name in ("stage", "steps") if name not in raw]
    if missing:
        raise ValueError(f"{path}: field {missing[0]!r} is missing")
    with raising(f"{path}:"):
        return with_settings(from_dict(Recipe, raw), settings or [])


def with_settings(config: C, settings: list[str]) -> C:
    """The configuration with `key.sub=value` settings applied; values are read as JSON, else as text.

    Raises ValueError where a setting has no `=`, names no field or has a value of the wrong type.
    """
    raw: dict[str, Any] = json.loads(to_json(config))
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals:
            raise ValueError(f"setting {setting!r} has no '=', expected key=value")
        *parents, last = key.strip().split(".")
        here: Any = raw
        for parent in parents:
            if not isinstance(here, dict) or parent not in here:
                raise ValueError(f"setting {key!r}: no field {parent!r}")
            here = here[parent]
        if not isinstance(here, dict):
            raise ValueError(f"setting {key!r}: {parents[-1]!r} has no fields")
        try:
            here[last] = json.loads(text)
        except json.JSONDecodeError:
            here[last] = text.strip()
    return from_dict(type(config), raw)
