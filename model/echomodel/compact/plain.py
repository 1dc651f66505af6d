"""The networks of the weights that ship as arrays of numpy: number for number those of torch, but for rounding.

Rooms are small: torch takes as long to be loaded as all of a bedroom takes to be made.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load

from echomodel.arrays import silu
from echomodel.boxes import BoxStatistics
from echomodel.compact.furniture import Furniture
from echomodel.compact.layout import Layout
from echomodel.compact.learned import places
from echomodel.compact.pairs import Echo, Latents
from echomodel.compact.weights import TABLES, grown_tables, joined_config, own_statistics, read_header, words_of
from echomodel.config import CompactConfig

EPSILON = 1e-5  # of a norm's variance, as torch has it


class Net:
    """A network by the names of its weights: maps, norms, tables and lists of them."""

    weight: np.ndarray

    def __init__(self, weights: Mapping[str, np.ndarray], config: CompactConfig) -> None:
        own: dict[str, dict[str, np.ndarray]] = defaultdict(dict)
        for key, value in weights.items():
            name, _, rest = key.partition(".")
            own[name][rest] = value
        for name, held in own.items():
            if "" in held:
                part: Any = held[""]
            elif name in TABLES:
                part = Table(held["weight"], TABLES[name], config)
            else:
                part = (EchoLayer if "ends.weight" in held else Net)(held, config)
            setattr(self, name, part)
        if "weight" in own:
            self.transposed = np.ascontiguousarray(own["weight"][""].T)  # a few rows times it are twice as fast
        self.numbered = sorted(int(name) for name in own if name.isdigit())

    def __call__(self, *arguments: Any, **named: Any) -> np.ndarray:
        """What a network of its own kind does with these, else what `mapped` does."""
        return getattr(self, "forward", self.mapped)(*arguments, **named)

    def __getitem__(self, number: int) -> "Net":
        return vars(self)[str(number)]

    def __iter__(self) -> "Iterator[Net]":
        return (self[number] for number in self.numbered)

    def mapped(self, x: np.ndarray) -> np.ndarray:
        """A linear map, a norm, rows of a table, or maps one after the other."""
        if self.numbered:
            for number in self.numbered:
                x = self[number](silu(x) if number else x)
            return x
        weight, bias = self.weight, vars(self).get("bias", np.float32(0))
        if weight.ndim == 1:
            off = x - np.add.reduce(x, -1, keepdims=True) / np.float32(len(weight))
            spread = np.einsum("...i,...i", off, off)[..., None] / np.float32(len(weight))
            return off / np.sqrt(spread + np.float32(EPSILON)) * weight + bias
        return weight[x] if x.dtype == np.int64 else x @ self.transposed + bias


class Table:
    """Vectors of words, a row for each that the weights name."""

    def __init__(self, rows: np.ndarray, kind: str, config: CompactConfig) -> None:
        self.rows, self.kind, self.names = rows, kind, getattr(config, kind)

    def __call__(self, words: np.ndarray) -> np.ndarray:
        return self.rows[places(self.kind, self.names, words)]


class EchoLayer(Echo, Net):
    """An echo."""


class LatentGraph(Latents, Net):
    """The latent graph."""


class LayoutDenoiser(Layout, Net):
    """The denoiser of boxes."""


class FurnitureDenoiser(Furniture, Net):
    """The denoiser of descriptions of furniture."""


NETS = {"latent": LatentGraph, "layout": LayoutDenoiser, "furniture": FurnitureDenoiser}  # of parts


@dataclass(frozen=True, eq=False)
class PlainModel:
    """What of a `CompactModel` rooms need.

    Arguments:
        parts: of the files, those that need torch among them.
    """

    config: CompactConfig
    statistics: BoxStatistics
    parts: tuple[str, ...]
    latent: LatentGraph
    layout: LayoutDenoiser
    furniture: FurnitureDenoiser
    device: None = None


def load_plain(paths: Sequence[Path]) -> tuple[PlainModel, str]:
    """The model in files that are known to be whole, as those are that ship, and a short hash of their contents."""
    metadata = {path: read_header(path) for path in sorted(paths)}
    config, digest = joined_config(metadata), hashlib.sha256()
    nets: dict[str, Any] = {}
    for path, header in metadata.items():
        digest.update(content := path.read_bytes())
        parts = json.loads(header["parts"])
        held = grown_tables(load(content) if set(parts) & NETS.keys() else {}, words_of(path, header), config)
        for part in set(parts) & NETS.keys():
            own = {key[len(part) + 1 :]: value.astype(np.float32) for key, value in held.items()
                   if key.startswith(f"{part}.")}  # fmt: skip
            nets[part] = NETS[part](own, config)
            vars(nets[part])["settings"] = getattr(config, part)
    held_parts = tuple(part for header in metadata.values() for part in json.loads(header["parts"]))
    return PlainModel(config, own_statistics(metadata, config), held_parts, **nets), digest.hexdigest()[:12]
