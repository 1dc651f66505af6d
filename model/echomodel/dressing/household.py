"""What hangs on walls and stands about: pictures, mirrors, clocks, vases, plants in pots, a lamp's cable."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from echomodel.dressing import any_of
from echomodel.furniture.carpentry import Size, box, framed
from echomodel.furniture.solids import Block, Lathe, Solid, ball, rotation, tube, turned
from echomodel.late import Late

FRAMES = ("frame", "frame", "ebony", "ebony", "enamel", "metal", "")  # of what; "" = canvas without a frame


def picture(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A picture, framed behind a mount or on canvas, with its back at the wall; `shown`: a row of `prints.toml`."""
    w, h, d = size
    of, slim, mounted = str(rng.choice(FRAMES)), float(rng.choice((0.6, 1.0))), rng.random() < 0.6
    shown = shown or any_of("picture", "wide" if w > h else "tall", rng)
    x, back, front = w / 2, -d / 2, d / 2
    if not of:
        canvas = box((-x, 0, back), (x, h, front - 0.001), "linen")
        return [canvas, box((-x, 0, front - 0.001), (x, h, front), shown)]
    bar = slim * float(np.clip(0.035 * max(w, h), 0.014, 0.028))
    mount = float(np.clip(0.11 * min(w, h), 0.02, 0.09)) if mounted else 0.0
    parts = framed((-x, 0, back), (x, h, front), bar, of)
    parts.append(box((-x + bar / 2, bar / 2, back), (x - bar / 2, h - bar / 2, front - 0.012), "paper"))
    inset = bar + mount
    parts.append(box((-x + inset, inset, back), (x - inset, h - inset, front - 0.0105), shown))
    return parts


def mirror(size: Size, rng: np.random.Generator, powers: Sequence[float] = (60.0,)) -> list[Solid]:
    """A mirror in a narrow frame, an ellipse of power 2, the more of a rectangle the larger one of `powers` is."""
    (w, h, d), power = size, float(rng.choice(powers))
    back, turn = np.array([0.0, h / 2, -d / 2]), rotation(x=np.pi / 2)
    rim = turned(back, (w / 2, h / 2), d * 0.8, material="frame", turn=turn, power=power)
    return [rim, turned(back, (w / 2 - 0.018, h / 2 - 0.018), d, material="mirror", turn=turn, power=power)]


round_mirror, tall_mirror = partial(mirror, powers=(2.0,)), partial(mirror, powers=(4.0, 60.0))


def clock(size: Size, rng: np.random.Generator, marks: int = 0) -> list[Solid]:
    """A clock with its back at the wall, its case round or nearly square, its rim narrow or wide, at some time."""
    w, h, d = size
    face, middle = rotation(x=np.pi / 2), np.array([0.0, h / 2, -d / 2])
    power, rim = float(rng.choice((2.0, 2.0, 4.0, 8.0))), float(rng.choice((0.38, 0.42, 0.46)))
    case = str(rng.choice(("frame", "metal", "ceramic")))
    parts: list[Solid] = [turned(middle, (w / 2, h / 2), d * 0.9, turn=face, power=power, material=case)]
    parts.append(turned(middle, (w * rim, h * rim), d * 0.92, turn=face, power=power, material="paper"))
    hour = float(rng.uniform(0, 12))
    hands = [(-hour / 12, 0.0, 0.24, 0.012 * w + 0.001), (-hour, 0.0, 0.36, 0.012 * w + 0.001)]
    for share, low, high, half in (*hands, *((number / marks, 0.342, 0.398, 0.008 * w) for number in range(marks))):
        turn = rotation(z=2 * np.pi * share)
        centre = np.array([0, h / 2, d * 0.45]) + turn @ np.array([0, (low + high) / 2 * h, 0])
        half3 = np.array([half, (high - low) / 2 * h, d * 0.02])
        parts.append(Block(centre=centre, half=half3, turn=turn, material="soil"))
    return parts


wall_clock = partial(clock, marks=12)


grown, species = Late("echomodel.furniture.plants:grown"), Late("echomodel.furniture.plants:species")


def vessel(outer: np.ndarray, wall: float, material: str, inside: float = 0.1) -> Lathe:
    """A vessel whose outer side is `outer` (k, 2): radius and height from the foot to the rim."""
    top = outer[-1, 1]
    inner = outer[outer[:, 1] > inside * top][::-1] - (wall, 0.0)
    foot = np.array([[max(inner[-1, 0] * 0.6, 1e-3), inside * top]])
    return Lathe(profile=np.concatenate([outer, inner, foot]), material=material)


def _outline(radii: list[float], size: Size) -> np.ndarray:
    heights = np.linspace(0, 1, len(radii))
    fine = np.linspace(0, 1, 9)
    return np.stack([np.interp(fine, heights, radii) * min(size[0], size[2]) / 2, fine * size[1]], 1)


SHAPES = (
    [0.55, 0.95, 1.0, 0.85, 0.5, 0.42, 0.5],
    [0.5, 0.75, 0.95, 1.0, 0.9, 0.6, 0.38, 0.42],
    [0.8, 0.85, 0.9, 0.95, 1.0],
    [0.6, 1.0, 0.8, 0.45, 0.35, 0.35, 0.4],
)


POTS = ([0.78, 0.9, 1.0], [0.95, 1.0, 1.0], [0.7, 1.0, 0.92], [0.6, 0.95, 1.0, 0.86], [1.0, 0.86, 0.8])
POTTERY = ("ceramic", "ceramic", "enamel", "wicker", "soil", "metal")


def vase(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A vase alone."""
    return [vessel(_outline(SHAPES[int(rng.integers(len(SHAPES)))], size), 0.006, "ceramic", 0.05)]


def flowers(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A vase with branches."""
    w, h, d = size
    body = np.array([w * 0.5, h * 0.42, d * 0.5])
    parts: list[Solid] = [vessel(_outline(SHAPES[int(rng.integers(2))], body), 0.006, "ceramic", 0.05)]
    count = int(rng.integers(5, 8))
    for number in range(count):
        yaw = 2 * np.pi * (number + rng.uniform(-0.2, 0.2)) / count
        reach = min(w, d) / 2 * rng.uniform(0.45, 0.9)
        tall = h * rng.uniform(0.78, 0.97)
        tip = np.array([np.sin(yaw) * reach, tall, np.cos(yaw) * reach])
        knee = np.array([tip[0] * 0.35, h * 0.62, tip[2] * 0.35])
        parts.append(tube([[0, h * 0.1, 0], knee, tip], 0.0022, "stem"))
        for at in (0.55, 0.75, 0.92):
            place = knee + (tip - knee) * at
            lean = rotation(y=yaw + rng.uniform(-1.2, 1.2)) @ rotation(x=-rng.uniform(0.2, 0.9))
            half = np.array([0.014, 0.003, 0.026]) * rng.uniform(0.8, 1.2)
            parts.append(ball(place + lean @ (0, 0, 0.022), half, "leaf", turn=lean))
        parts.append(ball(tip, 0.014 * rng.uniform(0.8, 1.3), "petal"))
    return parts


def small_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A plant of a table in a pot."""
    return _potted(size, str(rng.choice(species("table"))), rng.uniform(0.3, 0.42) * size[1], 0.27, rng)


def _potted(size: Size, kind: str, tall: float, share: float, rng: np.random.Generator) -> list[Solid]:
    """A species in a pot that is `tall` metres high and whose rim's radius is a share of the plant's width."""
    radius = share * min(size[0], size[2])
    shape = POTS[int(rng.integers(len(POTS)))]
    pot = vessel(_outline(shape, np.array([2 * radius, tall, 2 * radius])), 0.006, str(rng.choice(POTTERY)), 0.8)
    soil = Lathe(
        profile=np.array([[0.9 * radius * shape[-1], 0.7 * tall], [0.9 * radius * shape[-1], 0.9 * tall]]),
        material="soil",
    )
    return [pot, soil, *grown(kind, 0.88 * tall, size, radius, rng)]


def floor_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A tall plant in a pot."""
    return _potted(size, str(rng.choice(species("floor"))), float(np.clip(0.24 * size[1], 0.2, 0.34)), 0.3, rng)


def cable(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A lamp's cable on the floor, from the lamp (its front, +Z) to the plug at the wall."""
    w, h, d = size
    radius = h / 2
    along = np.linspace(0.0, 1.0, max(8, int(d / 0.08)))
    bend = np.sin(np.pi * along) * np.sin(2 * np.pi * along * rng.uniform(0.6, 1.1) + rng.uniform(0, 3))
    x = bend / max(float(np.abs(bend).max()), 1e-6) * (w / 2 - radius)
    line = np.stack([x, np.full_like(x, radius), (along - 0.5) * (d - h)], 1)
    plug = box((-0.011, 0, -d / 2), (0.011, h, -d / 2 + 0.04), "screen", h * 0.3)
    return [tube(line, radius, "screen"), plug]
