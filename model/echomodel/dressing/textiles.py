"""Cloth: rugs, curtains, cushions, throws."""

from dataclasses import replace

import numpy as np

from echomodel.dressing import PRINTS, any_of
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.cloth import Sheet, Slumped, pillow, seam
from echomodel.furniture.solids import Solid, rotation, tube, turned

BOUND, TASSEL, APART = 0.014, 0.055, 0.03  # metres of a rug that its edge and tassels take, and between these
EDGES = {"cloth": "cushion", "cloth2": "drape", "blanket": "velvet", "accent": "accent_plain"}  # by what is woven in
LIES = (17, 28)  # rows and columns in which a throw knows what it lies on
FULL = (0.4, 1.0)  # of the fullest fold at a foot, the others
BREAK = (0.05, 0.3)  # share of its height over its foot where a curtain breaks, and of a fold that is less deep there
# Metres of a throw: of its folds where it lies and where it hangs, and between them; over an edge, thick.
GATHERED, PLEATED, FOLDED, OVER_EDGE, THIN = 0.045, 0.022, 0.24, 0.08, 0.006
BENDS, ROUND = (np.arange(10) + 0.5) * np.pi / 5, 0.075  # where in a fold, radians, points are; wider than a wave there
DRAPES = ("curtain", "curtain", "linen", "drape", "drape", "velvet", "drape_striped")  # what curtains are of
THROWS = ("accent_cloth", "accent_cloth", "accent_striped", "accent_checked")


def rug(size: Size, rng: np.random.Generator, shown: str = "", form: str = "rug") -> list[Solid]:
    """Pile in a bound edge, a rectangle, some with tassels at both ends, or `form` "round", also oval; `shown`: a row
    of `prints.toml` that is woven into it."""
    (w, h, d), shown = size, shown or any_of("rug", form, rng)
    tassels = [_tassels(w / 2, 0.6 * h, d - 2 * BOUND, rng)] * bool(PRINTS[shown].get("fringed"))
    ends = [replace(one, turn=rotation(y=turn)) for turn in (0, np.pi) for one in tassels]
    bound = EDGES.get(PRINTS[shown]["of"][0].get("color", ""), "linen")
    made: list[Solid] = []
    for material, out, high in ((shown, BOUND, h), (bound, 0.0, 0.85 * h)):
        x, z = w / 2 - out - TASSEL * len(tassels), d / 2 - out
        round_ = turned((0, 0, 0), (x, z), high, rounding=0.45 * high, material=material)
        made.append(round_ if form == "round" else box((-x, 0, -z), (x, high, z), material, 0.45 * high))
    return made + ends


def _tassels(end: float, high: float, wide: float, rng: np.random.Generator) -> Solid:
    """Those of the end of a rug at x = `end`, over `wide` metres."""
    z = np.linspace(-wide / 2, wide / 2, 2 * round(wide / APART) + 1)
    tips = end - TASSEL * np.where(np.arange(len(z)) % 2, rng.uniform(0, 0.3, len(z)), 0.75)
    x, y = np.stack([np.full(len(z), end - TASSEL), tips], 1), np.broadcast_to((high, 0.3 * high), (len(z), 2))
    front = np.stack([x, y, np.repeat(z, 2).reshape(-1, 2)], -1)
    return Sheet(front=front, back=front * (1, 0, 1), material="linen")


def curtain(
    size: Size, rng: np.random.Generator, fold: float, *, top: float, drift: float, narrow: float = 0.04,
    material: str = "", head: float = 0.0, tied: float = 0.0, rings: float | None = None,
) -> list[Solid]:  # fmt: skip
    """Cloth in round folds of about `fold` metres, no two alike, at its head `top` times as deep and by `narrow` of its
    width less wide; they wander by `drift` of a fold from head to foot.

    `head`: metres from the top of `size` to that of the cloth, which is one of `DRAPES` where no `material` is told.
    `tied`: share of its width that a band draws in below its middle. `rings`: metres from the top to those of a rod.
    """
    (w, h, d), cloth = size, material or str(rng.choice(DRAPES))
    count = max(2, round(w / fold))
    phase, wander = rng.uniform(0, 2 * np.pi, 4), drift * rng.uniform(-1, 1, 3)
    turn = (np.arange(count)[:, None] * 2 * np.pi + BENDS).ravel()
    along = (turn / (2 * np.pi) + ROUND * np.sin(2 * turn)) / count - 0.5
    full = rng.uniform(*FULL, count)  # how wide each fold comes to be below
    ends = np.concatenate([[0.0], full.cumsum() / full.sum()]) - 0.5
    below, uneven = np.interp(turn / (2 * np.pi), np.arange(count + 1), ends), full.repeat(len(BENDS)) / FULL[1]
    rows = []
    for share in np.concatenate([[0, BREAK[0]], np.linspace(0, 1, 6 if count < 5 or tied else 4 if h > 1 else 2)[1:]]):
        slack = 1 - share
        waist = tied * np.exp(-(((share - 0.38) / 0.16) ** 2))
        wide = (1 - narrow * share) * (1 - waist) * w
        aside = slack * (np.sin(6 * along + phase[2]) + wander[1] * slack * np.sin(11 * along + phase[3]))
        x = wide * (along + slack * (below - along) + 0.6 * wander[0] / count * aside)
        deep = (1 - (1 - top) * share) * (1 - 0.3 * waist) * (1 - (BREAK[1] if share == BREAK[0] else 0.0))
        z = (d - 0.012) / 2 * deep * (1 + slack * (uneven - 1)) * np.cos(turn)
        rows.append(np.stack([x, np.full_like(x, share * (h - head)), z], 1))
    front, thick = np.stack(rows), np.array([0, 0, 0.004])
    made: list[Solid] = [Sheet(front=front + thick, back=front - thick, material=cloth)]
    r, across = min(0.018, 0.45 * d), np.linspace(0.03 - w / 2, w / 2 - 0.03, count)
    for x in across if rings is not None else ():
        made.append(turned((x, h - rings - r, 0), (r, r), 0.005, turn=rotation(z=np.pi / 2), material="metal"))
    if tied:
        made.append(turned((0, 0.37 * h, 0), (0.34 * w, 0.4 * d), 0.04, rounding=0.012, power=3.0, material=cloth))
    return made


CLOTHS = ("accent_cloth", "accent_plain", "accent_striped", "accent_checked", "blanket", "velvet", "linen", "drape")
LEAN, UPRIGHT = 0.28, 0.225  # of its height that a top is behind its foot; metres, the deepest that is upright


def cushion(size: Size, rng: np.random.Generator, shown: str = "", lie: tuple[float, ...] = ()) -> list[Solid]:
    """A cushion on a side, full or slack, of one of some cloths or of a print, often corded; a deep one leans back.

    `lie`: metres that its top is behind its foot and its sides are before its middle, as what it lies against has it.
    """
    (w, h, _), (lean, bend) = size, lie or (LEAN * size[1] if size[2] > UPRIGHT else 0.0, 0.0)
    d, aside = size[2] - lean - bend, float(rng.uniform(-0.12, 0.12)) * h if lean else 0.0
    cloth, corded = str(rng.choice(CLOTHS)), bool(rng.random() < 0.4)
    cord = str(rng.choice(("linen", "ebony", "blanket", "accent_plain")))
    w -= abs(aside)
    body = pillow((0, h / 2, 0), (w / 2, h / 2, d / 2), shown or cloth)
    made: list[Solid] = [replace(body, power=float(rng.uniform(1.3, 1.9)))]
    made += [tube(seam(body.half) + np.array([0, h / 2, 0]), 0.004, cord)] * corded
    form = {"tall": h, "lean": lean, "aside": aside, "bend": 4 * bend / w**2}
    return [Slumped(material=one.material, of=one, **form) for one in made] if lean + bend else made


def throw(size: Size, rng: np.random.Generator, lie: tuple[float, ...] = ()) -> list[Solid]:
    """A blanket over the foot of a bed or an arm: it lies across in a few broad folds, follows what is below point by
    point, and hangs down at both sides, where its folds run on; its hems are thin.

    `lie`: how far it hangs down at its left and right, metres, by its height where nothing is told; how far below its
    top the bed is, in `LIES` rows from the head and columns from the left.
    """
    (w, h, d), turn, (left, right, *lower_by) = size, np.linspace(0, np.pi / 2, 4), lie or (size[1], size[1])
    bend, x1 = min(OVER_EDGE, 0.1 * w), w / 2 - 1.3 * PLEATED
    edge = np.stack([x1 - bend * (1 - np.sin(turn)), bend * (1 - np.cos(turn))], 1)
    one, other = (np.concatenate([edge, np.linspace((x1, bend), (x1, fall), 4)[1:]]) for fall in (left, right))
    top = np.linspace((bend - x1, 0), (x1 - bend, 0), LIES[1] - 2)[1:-1]
    across, drop = np.concatenate([one[::-1] * (-1, 1), top, other]).T
    share, phase = np.linspace(-1, 1, LIES[0]), rng.uniform(0, 2 * np.pi, 4)
    x, z = np.meshgrid(across, share * d / 2)
    end, steep = np.abs(share[:, None]), np.clip(drop / bend, 0, 1)  # of its way around the edge
    hung = drop / np.where(across < 0, left, right)
    cells, at = np.reshape(lower_by or np.zeros(LIES), LIES), (np.arange(LIES[1]) + 0.5) / LIES[1] * 2 - 1
    beside = np.pad(cells, ((0, 0), (2, 2)), "edge")
    cells = np.minimum(cells, (beside[:, 4:] + beside[:, :-4]) / 2)  # it lies over narrow valleys
    lower = np.array([np.interp(across / (w / 2), at, row) for row in cells])
    # broad folds that run across, wander, swell and fade, and none along its hems
    way = d / FOLDED * np.pi * (share[:, None] + 0.25 * np.sin(1.9 * x + phase[0]) + 0.1 * np.sin(4.7 * x + phase[1]))
    swell = 0.65 + 0.35 * np.sin(2.3 * x + 2.6 * share[:, None] + phase[2])
    fold = (0.5 + 0.5 * np.cos(way + phase[3])) ** 4 * swell * (1 - end**4)
    fold, high = fold / fold.max(), min(1.0, w) * GATHERED
    out = (fold * np.sqrt(hung) + 0.3 * hung) * PLEATED
    skew = (0.03 * np.sin(2.2 * x + phase[1]) + 0.06 * (phase[2] / np.pi - 1) * x) * (1 - hung / 2)
    along = z * (1 - 0.12 * np.sin(1.4 * x + phase[2]) ** 2) * (1 - 0.07 * hung) + skew
    short = 0.012 * (1 + np.sin(2.8 * share[:, None] + phase[0])) * hung
    y = h - np.maximum(drop, lower) - (1 - fold) * high * (1 - steep) + short
    front = np.stack([x + np.sign(x) * out, y, along + 0.012 * np.sin(6 * x + phase[1]) * share[:, None]], -1)
    under = THIN * (1 - 0.6 * end**6)
    back = front - np.stack([np.sign(x) * under * steep, under * (1 - steep), 0 * x], -1)
    return [Sheet(front=front, back=back, material=str(rng.choice(THROWS)))]
