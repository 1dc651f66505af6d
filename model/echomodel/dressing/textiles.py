"""Cloth: rugs, curtains, cushions, throws."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from echomodel.dressing.prints import any_of
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.cloth import folds, pillow, seam
from echomodel.furniture.solids import FINEST, Array, Solid, ball, rotation, tube, turned

FOLD = 0.14  # metres of curtain from one fold to the next
DRAPES = {"curtain": 0.3, "linen": 0.15, "drape": 0.3, "velvet": 0.25}  # what curtains are of, how often


@dataclass(frozen=True, eq=False)
class Sheet(Solid):
    """Cloth: `front` and `back` (n, m, 3) float are its two sides, point for point, metres."""

    front: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))
    back: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        n, m = self.front.shape[:2]
        index = np.arange(n * m).reshape(n, m)
        vertices = np.concatenate([self.front.reshape(-1, 3), self.back.reshape(-1, 3)])
        border = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
        after = np.roll(border, -1)
        far = n * m
        faces = np.concatenate(
            [
                _quads(index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]),
                _quads(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]) + far,
                _quads(after, border, border + far, after + far),
            ]
        )
        corners = vertices[faces]
        volume = np.einsum("nx,nx->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
        return vertices, faces if volume > 0 else np.ascontiguousarray(faces[:, ::-1])


def _quads(a: Array, b: Array, c: Array, d: Array) -> Array:
    a, b, c, d = (v.ravel() for v in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def rug(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A rectangle of pile; `shown`: a row of `prints.toml` that is woven into it."""
    w, h, d = size
    return [box((-w / 2, 0, -d / 2), (w / 2, h, d / 2), shown or any_of("rug", "rug", rng), h * 0.45)]


def round_rug(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A round or oval of pile, as `rug`."""
    w, h, d = size
    return [turned((0, 0, 0), (w / 2, d / 2), h, rounding=h * 0.45, material=shown or any_of("rug", "round", rng))]


def curtain(size: Size, rng: np.random.Generator) -> list[Solid]:
    """One curtain in loose folds below rings, which spread towards its foot."""
    return [*_hung(size, rng, FOLD, top=0.65, drift=0.4, head=0.03), *_rings(size, FOLD)]


def eyelet_curtain(size: Size, rng: np.random.Generator) -> list[Solid]:
    """One curtain in even waves from its rod to its foot, as eyelets make them."""
    return [*_hung(size, rng, 1.3 * FOLD, top=1.0, drift=0.0), *_rings(size, 0.65 * FOLD, below=0.02)]


def pleated_curtain(size: Size, rng: np.random.Generator) -> list[Solid]:
    """One curtain whose head is pinched into narrow pleats and whose foot is wide."""
    return _hung(size, rng, 0.75 * FOLD, top=0.3, drift=0.25, narrow=0.16)


def sheer_curtain(size: Size, rng: np.random.Generator) -> list[Solid]:
    """One thin curtain in many small folds, through which light comes."""
    return _hung(size, rng, 0.6 * FOLD, top=0.5, drift=0.5, material="sheer")


def cafe_curtain(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A thin curtain on a rod across a window, below eye level: thick cloth before the light would be a dark fence."""
    w, h, d = size
    rod = tube([(-w / 2, h - 0.012, 0), (w / 2, h - 0.012, 0)], 0.006, "metal")
    within = np.array([0.97 * w, h - 0.02, d])
    cloth = _hung(within, rng, 0.75 * FOLD, top=0.7, drift=0.3, narrow=0.0, material="sheer")
    return [*cloth, *_rings(np.array([w, h, d]), FOLD), rod]


def _drape(rng: np.random.Generator) -> str:
    return str(rng.choice(list(DRAPES), p=list(DRAPES.values())))


def _rings(size: Size, apart: float, below: float = 0.0) -> list[Solid]:
    """Rings on a rod, about `apart` metres from one to the next, their highest points `below` the head of a curtain."""
    w, h, d = size
    r = min(0.018, 0.45 * d)
    across = np.linspace(0.03 - w / 2, w / 2 - 0.03, max(2, round(w / apart)))
    on_edge, high = rotation(z=np.pi / 2), h - below - r
    return [turned((x, high, 0), (r, r), 0.005, turn=on_edge, material="metal") for x in across]


def _hung(
    size: Size, rng: np.random.Generator, fold: float, *, top: float, drift: float, narrow: float = 0.04,
    material: str = "", head: float = 0.0,
) -> list[Solid]:  # fmt: skip
    """Cloth in folds of `fold` metres, at its head `top` times as deep and by `narrow` of its width less wide.

    `head`: metres from the top of `size` to that of the cloth, which is one of `DRAPES` where no `material` is told.
    """
    w, h, d = size
    cloth = material or _drape(rng)
    folds = max(2, round(w / fold))
    x = np.linspace(-w / 2, w / 2, 7 * folds + 1)
    phase, wander = rng.uniform(0, 2 * np.pi), drift * rng.uniform(-1, 1, 3)
    rows = []
    for share in np.linspace(0, 1, 5):
        depth = (d - 0.012) / 2 * (1.0 - (1.0 - top) * share)
        bend = wander[0] * np.sin(2.1 * x / w + wander[1]) * (1 - share)
        z = depth * np.sin(2 * np.pi * folds * (x + w / 2) / w + phase + bend)
        rows.append(np.stack([x * (1.0 - narrow * share), np.full_like(x, share * (h - head)), z], 1))
    front, thick = np.stack(rows), np.array([0, 0, 0.004])
    return [Sheet(front=front + thick, back=front - thick, material=cloth)]


def blind(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A roller blind let down: cloth from the roller at its top to the bar at its foot."""
    (w, h, d), cloth = size, _drape(rng)
    roller, bar = min(0.03, 0.2 * h), min(0.02, 0.1 * h)
    return [
        box((-w / 2, h - roller, -d / 2), (w / 2, h, d / 2), "frame", 0.3 * d),
        box((-0.49 * w, bar, -0.001), (0.49 * w, h - roller, 0.001), cloth),
        box((-0.49 * w, 0, -0.3 * d), (0.49 * w, bar, 0.3 * d), "frame", 0.1 * d),
    ]


def roman_blind(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A blind drawn up: cloth that falls flat from its head, and below in folds one before the other."""
    (w, h, d), cloth = size, _drape(rng)
    stack = min(0.16, 0.5 * h)
    solids: list[Solid] = [box((-w / 2, h - 0.03, -d / 2), (w / 2, h, d / 2), cloth, 0.2 * d)]
    solids.append(box((-0.495 * w, 0.8 * stack, -0.002), (0.495 * w, h - 0.03, 0.002), cloth))
    for number in range(3):
        low = 0.2 * stack * number
        solids.append(
            box((-0.495 * w, low, -d / 2), (0.495 * w, low + 0.5 * stack, d * (0.5 - 0.2 * number)), cloth, 0.3 * d)
        )
    return solids


CLOTHS = {"accent_cloth": 0.25, "accent_plain": 0.2, "blanket": 0.15, "velvet": 0.15, "linen": 0.15, "drape": 0.1}
TRIMS = ("", "", "cord", "cord", "button", "tassels")  # of cushions


def cushion(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A cushion on one of its sides, full or slack, of one of some cloths or of a print, trimmed in some way."""
    w, h, d = size
    cloth, trim = str(rng.choice(list(CLOTHS), p=list(CLOTHS.values()))), str(rng.choice(TRIMS))
    cord = str(rng.choice(("linen", "ebony", "blanket", "accent_plain")))
    body = pillow((0, h / 2, 0), (w / 2, h / 2, d / 2), shown or cloth)
    made: list[Solid] = [replace(body, power=float(rng.choice((3.0, 4.0, 5.5))))]
    if trim == "cord":
        made.append(tube(seam(w / 2, h / 2) + np.array([0, h / 2, 0]), 0.004, cord))
    if trim == "button":
        made.append(ball((0, h / 2, 0), (0.016, 0.016, 0.51 * d), cord))
    ends = [(x, y) for x in (-0.47 * w, 0.47 * w) for y in (0.03 * h, 0.97 * h)] if trim == "tassels" else ()
    return made + [ball((x, y, 0), (0.016, 0.022, 0.014), cord) for x, y in ends]


def lumbar_cushion(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A long low cushion for the small of the back, as `cushion`."""
    return cushion(size, rng, shown)


def throw(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A blanket over the foot of a bed: it lies across and hangs down at both sides by its height."""
    w, h, d = size
    thick, round_off = 0.012, 0.05
    flat = w / 2 - round_off
    turn = np.linspace(0, np.pi / 2, 4)
    corner = np.stack([flat + round_off * np.sin(turn), h - round_off * (1 - np.cos(turn))], 1)
    hang = np.stack([np.full(3, w / 2), np.linspace(h - round_off, 0, 4)[1:]], 1)
    flats = [[share * flat, h] for share in (0.12, 0.25, 0.37, 0.5, 0.62, 0.75, 0.87)]
    side = np.concatenate([flats, corner, hang])
    profile = np.concatenate([side[::-1] * (-1, 1), [[0.0, h]], side])
    inner = np.stack([profile[:, 0] * (1 - 2 * thick / w), profile[:, 1] - thick * (profile[:, 1] > h - round_off)], 1)
    z = np.linspace(-d / 2, d / 2, 11)
    ripple = 0.012 * np.sin(np.linspace(0, 9, len(z)) + rng.uniform(0, 6))
    phase = rng.uniform(0, 6, 3)

    def spread(line: np.ndarray) -> np.ndarray:
        rows = [np.stack([line[:, 0], line[:, 1], np.full(len(line), at)], 1) for at in z]
        out = np.stack(rows)
        hanging = np.clip((h - line[:, 1]) / max(h, 1e-6), 0, 1)
        out[..., 0] += np.sign(line[:, 0]) * hanging * ripple[:, None]
        out[..., 1] -= 0.01 * folds(out[..., 0], 2.5 * out[..., 2], phase) * (hanging < 0.1)
        return out

    return [Sheet(front=spread(profile), back=spread(inner), material="accent_cloth")]
