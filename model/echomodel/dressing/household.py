"""What hangs on walls and stands about: pictures, mirrors, clocks."""

from collections.abc import Sequence

import numpy as np

from echomodel.dressing import any_of
from echomodel.furniture.carpentry import Size, box, framed
from echomodel.furniture.solids import Block, Solid, rotation, turned

FRAMES = ("frame", "frame", "ebony", "ebony", "enamel", "metal", "")  # of what; "" = canvas without a frame


def picture(size: Size, rng: np.random.Generator, shown: str = "") -> list[Solid]:
    """A picture, framed behind a mount or on canvas, with its back at the wall; `shown`: a row of `prints.toml`."""
    w, h, d = size
    of, slim, mounted = str(rng.choice(FRAMES)), float(rng.choice((0.6, 1.0))), rng.random() < 0.6
    shown = shown or any_of("picture", "wide" if w > h else "tall", rng)
    x, back, front = w / 2, -d / 2, d / 2
    if not of:
        return [box((-x, 0, back), (x, h, front - 0.001), "linen"), box((-x, 0, front - 0.001), (x, h, front), shown)]
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


def clock(size: Size, rng: np.random.Generator, marks: int = 0) -> list[Solid]:
    """A clock with its back at the wall, its case round or nearly square, its rim narrow or wide, at some time."""
    w, h, d = size
    face, middle = rotation(x=np.pi / 2), np.array([0.0, h / 2, -d / 2])
    power, rim = float(rng.choice((2.0, 2.0, 4.0, 8.0))), float(rng.choice((0.38, 0.42, 0.46)))
    case = str(rng.choice(("frame", "metal", "ceramic")))
    discs = (0.5, 0.9, case), (rim, 0.92, "paper")
    parts: list[Solid] = [
        turned(middle, (w * r, h * r), d * t, turn=face, power=power, material=m) for r, t, m in discs
    ]
    hour = float(rng.uniform(0, 12))
    hands = [(-hour / 12, 0.0, 0.24, 0.012 * w + 0.001), (-hour, 0.0, 0.36, 0.012 * w + 0.001)]
    for share, low, high, half in (*hands, *((number / marks, 0.342, 0.398, 0.008 * w) for number in range(marks))):
        turn = rotation(z=2 * np.pi * share)
        centre = np.array([0, h / 2, d * 0.45]) + turn @ np.array([0, (low + high) / 2 * h, 0])
        half3 = np.array([half, (high - low) / 2 * h, d * 0.02])
        parts.append(Block(centre=centre, half=half3, turn=turn, material="soil"))
    return parts
