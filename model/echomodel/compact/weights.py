"""Weights files: which parts of the compact model there are, and what a file says of its own beside the numbers.

Each part is registered once, under the name of its settings in `CompactConfig`. A branch is a part that gives something
of a room: boxes, shapes, furniture. A further branch is a module with its network and its sampling, its settings in
`CompactConfig`, its row here (and in `plain.NETS`), and a training stage in `echomodel.training`.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open

from echomodel.boxes import BoxStatistics
from echomodel.compact.learned import Names, places
from echomodel.config import CompactConfig, FurnitureConfig, from_dict
from echomodel.files import raising
from echomodel.late import Late
from echomodel.vocabulary import vocabulary


@dataclass(frozen=True)
class ModelPart:
    """What weights files and the model know of a part.

    Arguments:
        module: builds it from the whole configuration.
        needs: other parts without which it gives nothing.
        branch: whether it gives something of a room.
    """

    module: Callable[[CompactConfig], Any]
    needs: tuple[str, ...] = ()
    branch: bool = False


MODULES = "echomodel.compact.modules"
PARTS: dict[str, ModelPart] = {
    "latent": ModelPart(Late(f"{MODULES}:LatentGraph")),
    "layout": ModelPart(Late(f"{MODULES}:LayoutDenoiser"), ("latent",), branch=True),
    "autoencoder": ModelPart(Late("echomodel.compact.shape:Autoencoder")),
    "shape": ModelPart(Late("echomodel.compact.shape:ShapeDenoiser"), ("latent", "autoencoder"), branch=True),
    "furniture": ModelPart(Late(f"{MODULES}:FurnitureDenoiser"), ("latent",), branch=True),
}


def branches(parts: Iterable[str]) -> frozenset[str]:
    """Names of the branches among `parts` that have what they need beside them."""
    there = set(parts)
    return frozenset(name for name in there if PARTS[name].branch and there.issuperset(PARTS[name].needs))


WORDS = ("categories", "predicates", "room_types")
TABLES = {"category": "categories", "room_type": "room_types"}  # name of a table of vectors -> what its rows are of
FORMAT = "echousd-compact-1"


class WeightsError(ValueError):
    """A weights file that is not one, or whose tensors do not fit the configuration."""


def read_header(path: Path) -> dict[str, str]:
    """Metadata of a safetensors file; raises WeightsError where it cannot be read."""
    unreadable = raising(f"{path}: not a readable safetensors file", OSError, SafetensorError, kind=WeightsError)
    with unreadable, safe_open(path, "np") as handle:
        return handle.metadata() or {}


def joined_config(metadata: Mapping[Path, dict[str, str]]) -> CompactConfig:
    """Each part's settings from the file that holds the part, and the words of the file that knows the most; what all
    parts share must be equal, and words that a file knows be the first of those."""
    joined, first = None, None
    for path, header in metadata.items():
        own = from_dict(CompactConfig, {**json.loads(header["config"]), **words_of(path, header)})
        joined, first = joined or own, first or path
        for shared in (*WORDS, "rules"):
            few, more = sorted((vars(own)[shared], vars(joined)[shared]), key=len)
            if few != (more[: len(few)] if shared in TABLES.values() else more):
                raise WeightsError(f"{path}: {shared} differs from that of {first}, they are not one model")
            joined = replace(joined, **{shared: more})
        parts, known = json.loads(header["parts"]), FurnitureConfig()
        if "furniture" in parts and (own.furniture.kinds, own.furniture.numbers) != (known.kinds, known.numbers):
            raise WeightsError(f"{path}: its furniture was described in other words; train it again")
        joined = replace(joined, **{part: vars(own)[part] for part in parts})
    assert joined is not None
    return joined


def grown_tables(tensors: Mapping[str, Any], known: Mapping[str, Names], config: CompactConfig) -> dict[str, Any]:
    """Tensors by name, their tables in the words of `config`: one that a file does not know begins as what it is like.

    Arguments:
        known: words of the file, as `words_of` has them.
    """
    kinds = {key: TABLES.get(key.removesuffix(".weight").rpartition(".")[2], "") for key in tensors}
    return {key: value[_rows(kinds[key], known, config)] if kinds[key] else value for key, value in tensors.items()}


def _rows(kind: str, known: Mapping[str, Names], config: CompactConfig) -> np.ndarray | slice:
    """Which rows of a file's table of words those are that `config` names."""
    names, words = getattr(config, kind), vocabulary()
    if names == known[kind]:
        return slice(None)
    number = {row.name: place for place, row in enumerate(getattr(words, kind))}
    return places(kind, known[kind], np.array([number[words.name_of(kind, name)] for name in names]))


def own_statistics(metadata: Mapping[Path, Mapping[str, str]], config: CompactConfig) -> BoxStatistics:
    """The box statistics of the file with the layout branch, which alone knows boxes, else of the first file, of the
    categories of `config`."""
    path, own = max(metadata.items(), key=lambda of: "layout" in json.loads(of[1]["parts"]))
    statistics = BoxStatistics.from_json(json.loads(own["statistics"]))
    if statistics.classes:
        classes = np.array(statistics.classes)[_rows("categories", words_of(path, own), config)]
        statistics = replace(statistics, classes=tuple(map(tuple, classes.tolist())))
    return statistics


def words_of(path: Path, header: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """The words that a weights file names, of every kind in `WORDS`; files of before counted them in their
    configuration and named them beside. Raises WeightsError for a name that is there twice."""
    raw, beside = json.loads(header["config"]), json.loads(header.get("vocabulary", "{}"))
    named = {kind: tuple(beside[kind] if isinstance(raw[kind], int) else raw[kind]) for kind in WORDS}
    for kind, names in named.items():
        if twice := [name for number, name in enumerate(names) if name in names[:number]]:
            raise WeightsError(f"{path}: names {twice[0]!r} twice among its {kind}")
    return named
