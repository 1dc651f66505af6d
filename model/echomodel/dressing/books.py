"""Books: single ones, rows, stacks."""

from dataclasses import replace
from itertools import islice

import numpy as np

from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import Solid, rotation

COVERS = ("book_a", "book_b", "book_c", "book_d")
COVER = 0.003  # metres


def book_row(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Books upright side by side with their spines to the front, the last one leaning where there is room."""
    w, h, d = size
    parts: list[Solid] = []
    at = -w / 2
    while True:
        thick = float(rng.uniform(0.016, 0.042))
        if at + thick > w / 2:
            break
        tall, deep = h * rng.uniform(0.78, 1.0), d * rng.uniform(0.8, 1.0)
        parts += _upright(at, thick, tall, deep, d, str(rng.choice(COVERS)))
        at += thick + 0.0008
    if not parts:
        parts += _upright(-w / 2, w, h, d, d, COVERS[0])
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
    """One book upright, its spine to the front: in paper, between boards, or these with a round back."""
    (w, h, d), cover, kind = size, str(rng.choice(COVERS)), rng.random()
    if kind < 0.3:
        edge, spine = float(rng.uniform(0.0006, 0.0045)), float(rng.uniform(0.0005, 0.004))
        inner = box((edge - w / 2, 0, -d / 2), (w / 2 - edge, h, d / 2 - edge), "paper")
        sides = [box((x - edge, 0, -d / 2), (x, h, d / 2), cover) for x in (edge - w / 2, w / 2)]
        return [*sides, box((-w / 2, 0, d / 2 - 2 * edge), (w / 2, h, d / 2), cover, spine), inner]
    board, over = rng.uniform((0.0016, 0.002), (0.005, 0.008))
    if kind < 0.65:
        return _upright(-w / 2, w, h, d, d, cover, board, over)
    back = float(rng.uniform(0.003, 0.006))
    whole = _upright(-w / 2, w, h, d - back, d - 2 * back, cover, board, over)
    steps = ((0.43, 0.6), (0.3, 1.0))  # half widths and how far before the boards
    return whole + [box((-x * w, 0, d / 2 - 2 * back), (x * w, h, d / 2 - (1 - out) * back), cover) for x, out in steps]


def _upright(
    at: float, thick: float, tall: float, deep: float, d: float, cover: str, board: float = COVER, over: float = 0.003
) -> list[Solid]:
    """A book between boards that reach `over` metres beyond its pages, spine and boards in one."""
    front = d / 2
    pages = box((at + board, over, front - deep + over), (at + thick - board, tall - over, front - board), "paper")
    return [
        box((at, 0, front - deep), (at + board, tall, front), cover),
        box((at + thick - board, 0, front - deep), (at + thick, tall, front), cover),
        box((at, 0, front - board), (at + thick, tall, front), cover, 0.0012),
        pages,
    ]


LAID = np.array([(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])  # turns what is upright on its side


def book_stack(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Books that lie on one another, each a little turned and smaller than the one below."""
    w, h, d = size
    count = max(2, round(h / 0.03))
    parts: list[Solid] = []
    for number in range(count):
        share = 0.92 * (1.0 - 0.1 * number - rng.uniform(0, 0.05))
        middle, place = np.array([0, d * share / 2, 0]), np.array([0, (number + 0.5) * h / count, 0])
        turn = rotation(y=float(rng.uniform(-0.14, 0.14))) @ LAID
        upright = book(np.array([h / count, d * share, w * share]), rng)
        parts += [replace(one, centre=turn @ (one.centre - middle) + place, turn=turn) for one in upright]
    return parts
