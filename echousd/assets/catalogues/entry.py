"""What a catalogue says of a model before its file is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echousd.assets.model_file import ModelFile

Told = Callable[[str], None]  # is told of what cannot be read, one line each


@dataclass(frozen=True, eq=False)
class Entry:
    """One model on offer.

    Arguments:
        key: unique in the catalogue. file: where it lies.
        name: what it is called. words: of its class, the surest first. group: the shelf it lies on.
        category: of the vocabulary, where the catalogue says it for certain. decided: whether it does, even where that
            is none.
        dims: width, height, depth in metres after `turn`, None where only the mesh knows.
        metres: per unit, None where the file or its size says.
        turn: (3, 3) the model's axes to the object frame, None where nobody says.
        placement: as in `AssetRecord`, "" where the category says it.
    """

    key: str
    file: ModelFile
    name: str = ""
    words: tuple[str, ...] = ()
    group: str = ""
    category: str = ""
    decided: bool = False
    dims: np.ndarray | None = None
    metres: float | None = None
    turn: np.ndarray | None = None
    licence: str = ""
    author: str = ""
    placement: str = ""
    tags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Catalogue:
    """A kind of library; a catalogue is a module of this package with one instance named `CATALOGUE`.

    Arguments:
        title: its name. holds: of a path, whether it is a library of this kind.
        entries: of such a path, its models; what cannot be read is told, not raised.
    """

    title: str
    holds: Callable[[Path], object]
    entries: Callable[[Path, Told], list[Entry]]
