"""Books: single ones and rows."""

from dataclasses import replace
from itertools import islice

import numpy as np

from echomodel.furniture.carpentry import Size, both, box
from echomodel.furniture.solids import Solid

COVERS = ("book_a", "book_b", "book_c", "book_d")


def book_row(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Books upright side by side with their spines to the front."""
    (w, h, d), parts, at = size, list[Solid](), -float(size[0]) / 2
    while at + (thick := float(rng.uniform(0.016, 0.042))) <= w / 2:
        tall, deep = h * rng.uniform(0.78, 1.0), d * rng.uniform(0.8, 1.0)
        place = np.array([at + thick / 2, 0, (d - deep) / 2])
        parts += [replace(one, centre=one.centre + place) for one in book(np.array([thick, tall, deep]), rng)]
        at += thick + 0.0008
    return parts


BOUND = 400  # kinds of single books, of which a room has a few, so that a wall of them shares few assets


def fitting_books(tall: float, deep: float, most: int, rng: np.random.Generator) -> list[int]:
    """Numbers of at most so many single books, as they are drawn, that are no taller and no deeper, metres."""
    order = ((number, book_size(number)) for number in rng.permutation(BOUND).tolist())
    return list(islice((number for number, size in order if size[1] <= tall and size[2] <= deep), most))


def book_size(number: int) -> np.ndarray:
    """(3,) float, metres: extents of single book `number`, 0 to `BOUND` - 1."""
    thick, tall, deep = np.random.default_rng([number, 1]).uniform((0.014, 0.17, 0.62), (0.044, 0.26, 0.75))
    return np.round([thick, tall, tall * deep], 3)


def book(size: Size, rng: np.random.Generator) -> list[Solid]:
    """One book upright, its spine to the front: in paper, or between boards, its back flat or round."""
    (x, h, z), cover = size / (2, 1, 2), str(rng.choice(COVERS))
    board, over = rng.uniform((0.0016, 0.002), (0.005, 0.008)) if rng.random() < 0.7 else (0.001, 0.0)
    back = float(rng.uniform(0.003, 0.006)) if over and rng.random() < 0.5 else 0.0012  # how round it is
    sides = both(box((x - board, 0, -z), (x, h, z - back), cover))
    spine = box((-x, 0, z - max(board, 2 * back)), (x, h, z), "spines", back)
    return [*sides, spine, box((board - x, over, over - z), (x - board, h - over, z - board), "paper")]
