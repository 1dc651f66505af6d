"""What hangs on walls, lies on desks and stands by doors: pictures, mirrors, shelves, coats, laptops, pens, shoes."""

from __future__ import annotations

import numpy as np

from echomodel.dressing import household
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import Block, Lathe, Solid, ball, rotation, tube, turned

PICTURES = tuple(f"picture_{number}" for number in range(60))  # what is printed, by its material


def picture(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A framed picture behind a mount; its back is at the wall."""
    w, h, d = size
    bar = float(np.clip(0.035 * max(w, h), 0.012, 0.028))
    mount = float(np.clip(0.11 * min(w, h), 0.02, 0.09)) if rng.random() < 0.7 else 0.0
    x, back, front = w / 2, -d / 2, d / 2
    parts = _frame(w, h, d, bar)
    parts.append(box((-x + bar / 2, bar / 2, back), (x - bar / 2, h - bar / 2, front - 0.012), "paper"))
    inset = bar + mount
    parts.append(box((-x + inset, inset, back), (x - inset, h - inset, front - 0.0105), _painting(rng)))
    return parts


def _painting(rng: np.random.Generator) -> str:
    return PICTURES[int(rng.integers(len(PICTURES)))]


def _frame(w: float, h: float, d: float, bar: float) -> list[Solid]:
    x, z = w / 2, d / 2
    return [
        box((-x, 0, -z), (x, bar, z), "frame", 0.002),
        box((-x, h - bar, -z), (x, h, z), "frame", 0.002),
        box((-x, 0, -z), (-x + bar, h, z), "frame", 0.002),
        box((x - bar, 0, -z), (x, h, z), "frame", 0.002),
    ]


def mirror(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A framed mirror."""
    w, h, d = size
    bar = 0.03
    glass = box((-w / 2 + bar / 2, bar / 2, -d / 2), (w / 2 - bar / 2, h - bar / 2, d / 2 - 0.008), "mirror")
    return [*_frame(w, h, d, bar), glass]


def round_mirror(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A round mirror in a narrow frame."""
    w, h, d = size
    face = rotation(x=np.pi / 2)
    back = np.array([0.0, h / 2, -d / 2])
    rim = turned(back, (w / 2, h / 2), d * 0.8, turn=face, material="frame")
    inner = (w / 2 - 0.018, h / 2 - 0.018)
    return [rim, turned(back, inner, d, turn=face, material="mirror")]


def photo(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A small framed picture that leans on its strut."""
    w, h, d = size
    lean = rotation(x=-0.2)
    thick, bar = 0.012, 0.014
    parts: list[Solid] = []
    for low, high, material in (
        ((-w / 2, 0, 0), (w / 2, bar, thick), "frame"),
        ((-w / 2, h - bar, 0), (w / 2, h, thick), "frame"),
        ((-w / 2, 0, 0), (-w / 2 + bar, h, thick), "frame"),
        ((w / 2 - bar, 0, 0), (w / 2, h, thick), "frame"),
        ((-w / 2 + bar / 2, bar / 2, 0), (w / 2 - bar / 2, h - bar / 2, thick * 0.6), _painting(rng)),
    ):
        block = box(low, high, material)
        parts.append(Block(centre=lean @ block.centre, half=block.half, turn=lean, material=material))
    strut = np.array([[0, h * 0.7, -0.13 * h], [0, 0.004, -d]])
    parts.append(tube(strut, 0.004, "frame"))
    return parts


def clock(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A clock, its case round or nearly square, its rim narrow or wide, at some time of the day."""
    w, h, d = size
    face, middle = rotation(x=np.pi / 2), np.array([0.0, h / 2, -d / 2])
    power, rim = float(rng.choice((2.0, 2.0, 4.0, 8.0))), float(rng.choice((0.38, 0.42, 0.46)))
    case = str(rng.choice(("frame", "metal", "ceramic")))
    parts: list[Solid] = [turned(middle, (w / 2, h / 2), d * 0.9, turn=face, power=power, material=case)]
    parts.append(turned(middle, (w * rim, h * rim), d * 0.92, turn=face, power=power, material="paper"))
    hour = float(rng.uniform(0, 12))
    for angle, length in ((-2 * np.pi * hour / 12, 0.24), (-2 * np.pi * hour, 0.36)):
        turn = rotation(z=angle)
        half3 = np.array([0.012 * w + 0.001, length * h / 2, d * 0.02])
        centre = np.array([0, h / 2, d * 0.45]) + turn @ np.array([0, length * h / 2, 0])
        parts.append(Block(centre=centre, half=half3, turn=turn, material="soil"))
    return parts


def laptop(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A laptop, open."""
    w, h, d = size
    base, deep = 0.016, d * 0.86
    lean = rotation(x=-0.3)
    tall = (h - base) / np.cos(0.3)
    hinge = np.array([0.0, base * 0.8, d / 2 - deep])
    front = d / 2
    parts: list[Solid] = [
        box((-w / 2, 0, front - deep), (w / 2, base, front), "metal", 0.004),
        box((-w * 0.43, base * 0.9, front - deep * 0.9), (w * 0.43, base + 0.001, front - deep * 0.45), "screen"),
        box((-w * 0.16, base * 0.9, front - deep * 0.38), (w * 0.16, base + 0.0006, front - deep * 0.08), "metal"),
    ]
    for half, forward, material in (((w / 2, tall / 2, 0.004), 0.0, "metal"), ((w * 0.475, tall * 0.46, 0.003), 0.002,
                                                                                "screen")):  # fmt: skip
        centre = hinge + lean @ np.array([0, tall / 2, forward])
        parts.append(Block(centre=centre, half=np.array(half), turn=lean, radius=0.002, material=material))
    return parts


def pens(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A pot with pens."""
    w, h, d = size
    r, tall = min(w, d) / 2 * 0.9, h * 0.6
    pot = np.array([[r, 0], [r, tall], [r - 0.004, tall], [r - 0.004, tall * 0.1], [0.001, tall * 0.1]])
    parts: list[Solid] = [Lathe(profile=pot, material="ceramic")]
    for number in range(5):
        yaw = 2 * np.pi * number / 5
        foot = np.array([np.sin(yaw), 0.0, np.cos(yaw)]) * r * 0.4 + (0, tall * 0.15, 0)
        tip = np.array([np.sin(yaw), 0.0, np.cos(yaw)]) * r * 0.95 + (0, h * rng.uniform(0.85, 1.0), 0)
        material = ("frame", "book_a", "soil", "metal", "book_c")[number]
        parts.append(tube([foot, tip], 0.0036, material))
    return parts


def shoes(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A pair of shoes side by side, the toes to the front."""
    w, h, d = size
    parts: list[Solid] = []
    for side in (-1, 1):
        x, wide = side * w * 0.27, w * 0.21
        slip = float(rng.uniform(-0.03, 0.03)) * d
        sole = turned((x, 0, slip), (wide, d * 0.46), h * 0.2, power=2.6, material="paper")
        toe = ball((x, h * 0.3, slip + d * 0.12), (wide * 0.96, h * 0.28, d * 0.34), "leather", power=2.4)
        heel = ball((x, h * 0.48, slip - d * 0.2), (wide * 0.94, h * 0.5, d * 0.25), "leather", power=2.6)
        mouth = ball((x, h * 0.86, slip - d * 0.21), (wide * 0.62, h * 0.14, d * 0.17), "soil")
        parts += [sole, toe, heel, mouth]
    return parts


def wall_clock(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A round clock with twelve marks and two hands; its back is at the wall."""
    w, h, d = size
    parts = household.clock(size, rng)
    for number in range(12):
        turn = rotation(z=2 * np.pi * number / 12)
        centre = np.array([0, h / 2, d * 0.44]) + turn @ np.array([0, 0.37 * h, 0])
        parts.append(Block(centre=centre, half=np.array([0.008 * w, 0.028 * h, d * 0.02]), turn=turn, material="soil"))
    return parts


def wall_shelf(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A board on two brackets; what stands on it stands at its top."""
    w, h, d = size
    thick = 0.025
    parts: list[Solid] = [box((-w / 2, h - thick, -d / 2), (w / 2, h, d / 2), "frame", 0.003)]
    for x in (-0.36 * w, 0.36 * w):
        back, under = -d / 2, h - thick
        parts.append(box((x - 0.01, 0, back), (x + 0.01, under, back + 0.008), "metal"))
        parts.append(box((x - 0.01, under - 0.006, back), (x + 0.01, under, d * 0.32), "metal"))
        stay = np.array([[x, 0.012, back + 0.006], [x, under - 0.006, d * 0.28]])
        parts.append(tube(stay, 0.005, "metal"))
    return parts


def coats(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A rail of four hooks with a coat and a bag on it."""
    w, h, d = size
    back, level = -d / 2, h - 0.06
    parts: list[Solid] = [box((-w / 2, level - 0.05, back), (w / 2, level + 0.05, back + 0.02), "frame", 0.003)]
    hooks = np.linspace(-0.38, 0.38, 4) * w
    for x in hooks:
        hook = np.array([[x, level, back + 0.015], [x, level - 0.01, back + 0.07], [x, level + 0.03, back + 0.08]])
        parts.append(tube(hook, 0.006, "metal"))
    coat, bag = hooks[int(rng.integers(2))], hooks[3]
    tall, deep = level - 0.03, d * 0.5
    # a coat hangs narrow from its loop, wide at the shoulders, open at the hem
    for low, high, wide in ((0.0, 0.72, 0.3), (0.62, 1.0, 0.24)):
        half = np.array([wide * w * 0.75, (high - low) * tall / 2, deep / 2])
        middle = np.array([coat, (low + high) / 2 * tall, back + 0.03 + deep / 2])
        parts.append(ball(middle, half, "blanket", power=3.4))
    for side in (-1, 1):
        half = np.array([0.045, 0.27 * tall, deep * 0.36])
        middle = np.array([coat + side * 0.23 * w * 0.9, 0.58 * tall, back + 0.035 + deep / 2])
        turn = rotation(z=0.08 * side)
        parts.append(ball(middle, half, "blanket", power=2.8, turn=turn))
    size_bag = np.array([0.105, 0.13, deep * 0.36])
    middle = np.array([bag - 0.02, level - 0.5, back + 0.03 + deep * 0.4])
    parts.append(ball(middle, size_bag, "leather", power=4.0))
    strap = np.array([[bag - 0.09, middle[1] + 0.1, middle[2]], [bag, level + 0.005, back + 0.06],
                      [bag + 0.05, middle[1] + 0.1, middle[2]]])  # fmt: skip
    parts.append(tube(strap, 0.006, "leather"))
    return parts


def tall_mirror(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A mirror for the whole person."""
    if rng.random() < 0.5:
        return household.mirror(size, rng)
    w, h, d = size
    face, back = rotation(x=np.pi / 2), np.array([0.0, h / 2, -d / 2])
    rim = turned(back, (w / 2, h / 2), d * 0.8, power=4.0, turn=face, material="frame")
    inner = (w / 2 - 0.016, h / 2 - 0.016)
    glass = turned(back, inner, d, power=4.0, turn=face, material="mirror")
    return [rim, glass]
