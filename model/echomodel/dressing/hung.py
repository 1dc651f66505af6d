"""What is screwed to walls and is no picture: shelves, clocks, coats on their rail, tall mirrors."""

from __future__ import annotations

import numpy as np

from echomodel.dressing import household
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import Block, Solid, ball, rotation, tube, turned


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
