"""Parametric furniture for every category: solids that give a watertight mesh and a signed distance."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echomodel.files import tables
from echomodel.furniture.solids import Joint, Solid, mesh_of
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late, lates
from echomodel.vocabulary import vocabulary

__all__ = ["Choices", "Style", "draw_choices", "draw_style", "mesh_of", "sample_size", "solids"]

draw_choices, draw_style, sample_size = lates(f"{__name__}.drawn", "draw_choices", "draw_style", "sample_size")
Builder = Callable[[np.ndarray, Style, Choices], list[Solid]]
PROGRAMS: dict[str, list[str]] = tables("programs.toml", __file__)
UNSAID = ("", "board")
BY_MATERIAL = {"fabric": "upholstery", "shade": "shade", "leaf": "leaf", "mirror": "mirror"}


def solids(category: str, style: Style, choices: Choices, size: np.ndarray) -> list[Solid]:
    """The parts of one piece of furniture, about as large as `size`.

    Arguments:
        category: a word of the vocabulary; raises `UnknownWord` for others.
        style: what the piece shares with its suite.
        choices: what the style leaves open.
        size: (3,) width x, height y, depth z in metres.

    Raises ValueError for a size that is not three positive numbers.
    """
    name = vocabulary().category(category).name
    size = np.asarray(size, float)
    if size.shape != (3,) or not (np.isfinite(size).all() and (size > 0).all()):
        raise ValueError(f"size of {name} is {size.tolist()}, need three positive numbers in metres")
    return _named(_builder(name)(size, style, choices))


def _named(parts: list[Solid]) -> list[Solid]:
    """The parts with their moving bodies numbered: drawer_1, drawer_2, door_1 ... in the order of the program.

    Those that the program gave no role have one by what they are made of.
    """
    names: dict[int, Joint] = {}
    counts: Counter[str] = Counter()
    out = []
    for part in parts:
        if part.joint is not None:
            if id(part.joint) not in names:
                counts[part.joint.body] += 1
                names[id(part.joint)] = replace(part.joint, body=f"{part.joint.body}_{counts[part.joint.body]}")
            part = replace(part, joint=names[id(part.joint)])
        out.append(part if part.role not in UNSAID else replace(part, role=BY_MATERIAL.get(part.material, "body")))
    return out


def _builder(name: str) -> Builder:
    """The program of a category, or of the one that its row is like."""
    row = vocabulary().category(name)
    for word in (name, row.like or row.sgfront):
        for module, programs in PROGRAMS.items():
            if word in programs:
                return Late(f"{__name__}.{module}:{word}")
    raise ValueError(f"no furniture is made for {name}")
