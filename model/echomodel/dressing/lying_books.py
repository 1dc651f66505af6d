"""Books that lie: a stack, a notebook."""

import numpy as np

from echomodel.dressing.books import COVER, COVERS
from echomodel.furniture.carpentry import Size
from echomodel.furniture.solids import Block, Solid, rotation


def book_stack(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Books that lie on one another, each a little turned."""
    w, h, d = size
    count = max(2, round(h / 0.03))
    parts: list[Solid] = []
    at = 0.0
    for number in range(count):
        thick = h / count
        share = 1.0 - 0.1 * number - rng.uniform(0, 0.05)
        turn = rotation(y=float(rng.uniform(-0.14, 0.14)))
        parts += _flat(at, thick, w * share * 0.92, d * share * 0.92, turn, str(rng.choice(COVERS)))
        at += thick
    return parts


def notebook(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A closed notebook, thick or thin, with a pencil on it."""
    w, h, d = size
    book = h * float(rng.uniform(0.45, 0.7))
    parts = _flat(0.0, book, w, d, rotation(), str(rng.choice(COVERS)))
    r, turn = (h - book) / 2, rotation(y=float(rng.uniform(-0.5, 0.5)))
    return [*parts, Block(np.array([w * 0.12, book + r, 0]), turn, "frame", half=np.array([r, r, d * 0.36]))]


def _flat(at: float, thick: float, w: float, d: float, turn: np.ndarray, cover: str) -> list[Solid]:
    half, board = np.array([w / 2, thick / 2, d / 2]), min(COVER, thick / 5)
    middle = np.array([0.0, at + thick / 2, 0.0])
    lower, upper = (middle + np.array([0, s * (thick / 2 - board / 2), 0]) for s in (-1, 1))
    plate, spine = np.array([w / 2, board / 2, d / 2]), np.array([board / 2, thick / 2, d / 2])
    back = middle + turn @ np.array([-w / 2 + board / 2, 0, 0])
    covers = [Block(at, turn, cover, half=part) for at, part in ((lower, plate), (upper, plate), (back, spine))]
    return [*covers, Block(middle, turn, "paper", half=half - (0.004, board, 0.004))]
