"""Small things that make a room look lived in: what there is, what it is called, and programs that build it of solids.

One row per kind; the words stand beside the furniture's vocabulary, because no graph and no weights know them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from echomodel.dressing import books, household, textiles, vessels
from echomodel.furniture.solids import Solid

Program = Callable[[np.ndarray, np.random.Generator], list[Solid]]
Size3 = tuple[float, float, float]


@dataclass(frozen=True)
class Kind:
    """One kind of small thing.

    Arguments:
        name: its category in our files. ade20k: its ADE20K class.
        program: builds it. low, high: usual extents, metres; what is fitted to its place has extents of its own.
        fixed: hangs or lies still; others are rigid bodies.
        lies: cloth that lies on something and carries nothing itself.
        yields: cloth that hangs and gives way, to the door of a wardrobe say.
        faces: most triangles of its mesh.
    """

    name: str
    ade20k: str
    program: Program
    low: Size3
    high: Size3
    fixed: bool = False
    lies: bool = False
    yields: bool = False
    faces: int = 1200


KINDS: dict[str, Kind] = {
    kind.program.__name__: kind
    for kind in (
        Kind("rug", "rug", textiles.rug, (1.2, 0.012, 0.8), (3.5, 0.012, 2.5), True, True),
        Kind("rug", "rug", textiles.round_rug, (1.2, 0.012, 1.2), (2.6, 0.012, 2.6), True, True),
        Kind("curtain", "curtain", textiles.curtain, (0.3, 1.2, 0.09), (0.8, 2.6, 0.09), True, yields=True),
        *(
            Kind("curtain", "curtain", program, (0.3, 1.2, 0.09), (0.8, 2.6, 0.09), True, yields=True)
            for program in (textiles.eyelet_curtain, textiles.pleated_curtain, textiles.sheer_curtain)
        ),
        Kind("blind", "blind", textiles.roman_blind, (0.5, 0.3, 0.016), (2.0, 0.8, 0.016), True),
        Kind("blind", "blind", textiles.blind, (0.5, 0.2, 0.016), (2.0, 0.8, 0.016), True),
        Kind("cushion", "cushion", textiles.cushion, (0.38, 0.36, 0.13), (0.46, 0.42, 0.16), faces=400),
        Kind("throw", "blanket", textiles.throw, (1.0, 0.2, 0.4), (2.0, 0.3, 0.7), True, True),
        Kind("folded_blanket", "blanket", textiles.folded_throw, (0.34, 0.05, 0.3), (0.42, 0.07, 0.36), faces=400),
        Kind("books", "book", books.book_row, (0.16, 0.19, 0.14), (0.5, 0.27, 0.2), faces=1600),
        Kind("book", "book", books.book, (0.018, 0.19, 0.13), (0.038, 0.25, 0.16)),
        Kind("books", "book", books.book_stack, (0.2, 0.06, 0.15), (0.28, 0.12, 0.2)),
        Kind("magazine", "book", books.magazine, (0.21, 0.008, 0.28), (0.23, 0.01, 0.3)),
        Kind("notebook", "book", books.notebook, (0.15, 0.018, 0.21), (0.17, 0.022, 0.23)),
        Kind("vase", "vase", vessels.vase, (0.1, 0.18, 0.1), (0.18, 0.34, 0.18)),
        Kind("flowers", "flower", vessels.flowers, (0.22, 0.34, 0.22), (0.3, 0.46, 0.3), faces=2600),
        Kind("small_plant", "plant", vessels.small_plant, (0.18, 0.2, 0.18), (0.3, 0.34, 0.3)),
        Kind("bowl", "pot", vessels.bowl, (0.2, 0.08, 0.2), (0.3, 0.13, 0.3)),
        Kind("candles", "light", vessels.candles, (0.13, 0.1, 0.07), (0.2, 0.18, 0.08)),
        Kind("cup", "glass", vessels.cup, (0.115, 0.09, 0.085), (0.125, 0.1, 0.09)),
        Kind("plate", "plate", vessels.plate, (0.25, 0.022, 0.25), (0.27, 0.024, 0.27)),
        Kind("glass", "glass", vessels.glass, (0.07, 0.1, 0.07), (0.08, 0.13, 0.08)),
        Kind("tray", "tray", vessels.tray, (0.34, 0.03, 0.24), (0.44, 0.04, 0.3)),
        Kind("plates", "plate", vessels.plates, (0.2, 0.06, 0.2), (0.26, 0.12, 0.26)),
        Kind("bottles", "bottle", vessels.bottles, (0.17, 0.2, 0.07), (0.24, 0.3, 0.08)),
        Kind("ball", "ball", vessels.toy_ball, (0.16, 0.16, 0.16), (0.24, 0.24, 0.24), faces=600),
        Kind("blocks", "plaything", vessels.blocks, (0.2, 0.13, 0.065), (0.26, 0.17, 0.085), faces=400),
        Kind("bear", "plaything", vessels.bear, (0.2, 0.26, 0.17), (0.26, 0.34, 0.22)),
        Kind("towel", "towel", textiles.towel, (0.36, 0.4, 0.05), (0.48, 0.6, 0.06), True),
        Kind("basket", "basket", vessels.basket, (0.36, 0.36, 0.36), (0.46, 0.48, 0.46)),
        Kind("picture", "painting", household.picture, (0.3, 0.4, 0.03), (1.2, 0.9, 0.03), True),
        Kind("mirror", "mirror", household.mirror, (0.5, 0.7, 0.03), (0.7, 1.1, 0.03), True),
        Kind("mirror", "mirror", household.round_mirror, (0.5, 0.5, 0.03), (0.8, 0.8, 0.03), True),
        Kind("wall_clock", "clock", household.wall_clock, (0.26, 0.26, 0.04), (0.36, 0.36, 0.04), True),
        Kind("wall_shelf", "shelf", household.wall_shelf, (0.7, 0.12, 0.2), (1.1, 0.12, 0.22), True),
        Kind("coats", "apparel", household.coats, (0.5, 0.95, 0.17), (0.64, 1.05, 0.19), True),
        Kind("mirror", "mirror", household.tall_mirror, (0.44, 1.4, 0.03), (0.55, 1.6, 0.03), True),
        Kind("photo", "painting", household.photo, (0.13, 0.18, 0.09), (0.18, 0.24, 0.1)),
        Kind("clock", "clock", household.clock, (0.1, 0.1, 0.05), (0.13, 0.13, 0.05)),
        Kind("laptop", "computer", household.laptop, (0.32, 0.22, 0.28), (0.36, 0.24, 0.3)),
        Kind("pens", "pot", household.pens, (0.08, 0.17, 0.08), (0.09, 0.19, 0.09)),
        Kind("remote", "box", household.remote, (0.045, 0.018, 0.17), (0.05, 0.02, 0.2)),
        Kind("television", "television receiver", household.television, (0.6, 0.39, 0.18), (0.95, 0.58, 0.22)),
        Kind("slippers", "apparel", vessels.slippers, (0.22, 0.07, 0.26), (0.24, 0.08, 0.28)),
        Kind("floor_plant", "plant", vessels.floor_plant, (0.42, 0.85, 0.42), (0.58, 1.35, 0.58), faces=2600),
        Kind("floor_vase", "vase", vessels.floor_vase, (0.24, 0.8, 0.24), (0.32, 1.1, 0.32)),
        Kind("pouf", "ottoman", vessels.pouf, (0.42, 0.34, 0.42), (0.52, 0.42, 0.52)),
        Kind("cable", "lamp", vessels.cable, (0.05, 0.008, 0.3), (0.12, 0.008, 2.4), True, True),
        Kind("shoes", "apparel", household.shoes, (0.24, 0.1, 0.27), (0.27, 0.12, 0.31)),
    )
}


def _category(name: str) -> Kind:
    """The kinds of one category, which agree but for their sizes, as one from the least to the largest."""
    kinds = [kind for kind in KINDS.values() if kind.name == name]
    low, high = np.min([kind.low for kind in kinds], axis=0), np.max([kind.high for kind in kinds], axis=0)
    return replace(kinds[0], low=tuple(low.tolist()), high=tuple(high.tolist()))


SMALL: dict[str, Kind] = {name: _category(name) for name in dict.fromkeys(kind.name for kind in KINDS.values())}


def usual_size(kind: str, rng: np.random.Generator) -> np.ndarray:
    """(3,) float, metres: extents of one such thing."""
    low, high = np.array(KINDS[kind].low), np.array(KINDS[kind].high)
    return np.round(low + (high - low) * rng.random(), 4)


def thing(kind: str, size: np.ndarray, rng: np.random.Generator) -> list[Solid]:
    """The solids of one small thing, about as large as `size` (3,), metres; +Y up, +Z its front, its bottom at 0."""
    return KINDS[kind].program(np.asarray(size, float), rng)
