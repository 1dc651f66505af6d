"""What stands and lies on floors: tall plants and vases, poufs, slippers, the cables of lamps."""

from __future__ import annotations

import numpy as np

from echomodel.dressing.vessels import Lathe, vessel
from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import Solid, ball, rotation, tube, turned


def floor_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A tall plant in a pot: large leaves on stems that lean outwards (rubber tree, bird of paradise)."""
    w, h, d = size
    wide = min(w, d)
    tall, radius = float(np.clip(0.24 * h, 0.2, 0.34)), 0.3 * wide
    pot = np.array([[0.74, 0.0], [0.86, 0.4], [1.0, 1.0]]) * (radius, tall)
    parts: list[Solid] = [
        vessel(pot, 0.012, "ceramic", 0.85),
        Lathe(profile=np.array([[radius * 0.92, tall * 0.7], [radius * 0.92, tall * 0.9]]), material="soil"),
    ]
    stems = int(rng.integers(4, 7))
    for number in range(stems):
        yaw = 2 * np.pi * (number + rng.uniform(-0.2, 0.2)) / stems
        out = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
        top = tall + (h - tall) * rng.uniform(0.6, 0.85)
        reach = wide * rng.uniform(0.1, 0.22)
        foot, knee, tip = out * 0.03 + (0, tall * 0.8, 0), out * reach * 0.4 + (0, 0.6 * top, 0), out * reach
        tip = tip + np.array([0, top, 0])
        parts.append(tube(np.stack([foot, knee, tip]), 0.007, "stem"))
        for at, side in ((0.45, -0.9), (0.7, 0.9), (1.0, 0.0)):
            place = knee + (tip - knee) * at
            lift = rng.uniform(0.35, 0.9)
            turn = rotation(y=yaw + side + rng.uniform(-0.25, 0.25)) @ rotation(x=-lift)
            length = min(0.26, wide * 0.3) * rng.uniform(0.8, 1.1)
            half = np.array([0.36 * length, 0.02 * length, 0.62 * length])
            parts.append(ball(place + turn @ (0, 0, 0.55 * length), half, "leaf", turn=turn))
    return parts


def floor_vase(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A floor vase with dry branches."""
    w, h, d = size
    radius, tall = min(w, d) / 2 * 0.72, 0.5 * h
    outline = np.array([[0.6, 0.0], [0.9, 0.25], [1.0, 0.5], [0.75, 0.8], [0.45, 0.93], [0.5, 1.0]]) * (radius, tall)
    parts: list[Solid] = [vessel(outline, 0.008, "ceramic", 0.05)]
    for number in range(6):
        yaw = 2 * np.pi * (number + rng.uniform(-0.3, 0.3)) / 6
        out = np.array([np.sin(yaw), 0.0, np.cos(yaw)]) * min(w, d) / 2
        knee = out * 0.3 + (0, h * 0.7, 0)
        tip = out * rng.uniform(0.55, 0.95) + (0, h * rng.uniform(0.85, 0.99), 0)
        parts.append(tube(np.stack([[0, 0.1 * tall, 0], knee, tip]), 0.003, "stem"))
        for at in (0.6, 0.8, 1.0):
            place = knee + (tip - knee) * at
            parts.append(ball(place, (0.012, 0.02, 0.012), "petal"))
    return parts


def pouf(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A round knitted pouf."""
    w, h, d = size
    return [ball((0, h / 2, 0), np.array([w, h, d]) / 2, "accent_cloth", power=2.8)]


def slippers(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A pair of open slippers, the toes to the front."""
    w, h, d = size
    parts: list[Solid] = []
    for side in (-1, 1):
        x, wide, slip = side * w * 0.27, w * 0.2, float(rng.uniform(-0.04, 0.04)) * d
        parts.append(turned((x, 0, slip), (wide, d * 0.45), h * 0.28, power=2.6, material="paper"))
        parts.append(ball((x, h * 0.45, slip + d * 0.18), (wide, h * 0.5, d * 0.25), "accent_plain", power=2.4))
    return parts


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


def toy_ball(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A ball with a band of another colour."""
    half = np.asarray(size, float) / 2
    rim = (1.01 * half[0], 1.01 * half[2])
    band = turned((0.0, 0.42 * size[1], 0.0), rim, 0.16 * size[1], material="linen")
    return [ball((0.0, half[1], 0.0), half, "accent_plain"), band]


def blocks(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Three blocks of wood and a fourth on top of them."""
    w, h, d = size
    side = min(h / 2, w / 3 - 0.006, d)
    at = [(-1.02 * side, 0.0), (0.0, 0.0), (1.02 * side, 0.0), (0.4 * side, side)]
    colours = rng.permutation(["accent_plain", "blanket", "frame", "fruit"])
    return [
        box((x - side / 2, y, -side / 2), (x + side / 2, y + side, side / 2), str(colour), 0.003)
        for (x, y), colour in zip(at, colours, strict=True)
    ]


def bear(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A bear that sits: a body, a head with a snout and ears, four paws."""
    w, h, d = size
    balls = [(0.0, 0.3, -0.1, 0.3), (0.0, 0.72, -0.05, 0.24), (0.0, 0.67, 0.2, 0.1)]  # x, y, z, radius: shares
    balls += [(s * x, y, z, r) for x, y, z, r in ((0.2, 0.93, -0.08, 0.07), (0.36, 0.42, 0.05, 0.12),
                                                  (0.24, 0.12, 0.3, 0.12)) for s in (-1, 1)]  # fmt: skip
    material = ("leather", "accent_cloth", "wicker")[int(rng.integers(3))]
    return [ball((x * w, y * h, z * d), np.full(3, r * h), material) for x, y, z, r in balls]
