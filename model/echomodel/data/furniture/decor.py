"""Plants in pots and television sets."""

from __future__ import annotations

import numpy as np

from echomodel.data.furniture.carpentry import Size, box
from echomodel.data.furniture.choices import Choices
from echomodel.data.furniture.solids import Ball, Solid, Tube, Turned, rotation
from echomodel.data.furniture.style import Style


def plant(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A pot, perhaps on a stand, with a tree crown, arching blades, broad leaves on stems or a cactus."""
    w, h, d = size
    reach = min(w, d) / 2
    pot_h = float(np.clip(h * choices.between("share", 0.18, 0.32), 0.12, 0.5))
    pot_r = float(np.clip(reach * choices.between("spread", 0.45, 0.7), 0.08, 0.28))
    power = 2.0 if style.profile == "round" or style.corner > 0.4 else 6.0
    foot = 0.0
    parts: list[Solid] = []
    if style.legs in ("tapered", "splayed", "hairpin") and choices.chance("raised", 0.45):
        foot = min(0.2, h * 0.15)
        for a in np.arange(4) * np.pi / 2 + np.pi / 4:
            x, z = pot_r * 1.05 * np.cos(a), pot_r * 1.05 * np.sin(a)
            parts.append(Tube(points=np.array([[x, 0, z], [x * 0.9, foot + pot_h * 0.5, z * 0.9]]), radius=0.014))
    waist = 0.6 + 0.35 * style.taper
    parts.append(
        Turned(
            centre=np.array([0, foot, 0]),
            low=(pot_r * waist, pot_r * waist),
            high=(pot_r, pot_r),
            height=pot_h,
            power=power,
            material="ceramic",
        )
    )
    parts.append(
        Turned(
            centre=np.array([0, foot + pot_h * 0.98, 0]),
            low=(pot_r * 0.9, pot_r * 0.9),
            high=(pot_r * 0.9, pot_r * 0.9),
            height=pot_h * 0.04,
            power=power,
            material="soil",
        )
    )
    y0 = foot + pot_h
    kind = choices.pick("kind", ["tree", "blades", "leaves", "cactus"], [0.38, 0.22, 0.32, 0.08])
    grow = {"tree": _tree, "blades": _blades, "leaves": _leaves, "cactus": _cactus}[kind]
    return parts + grow(y0, h, w / 2, d / 2, choices)


def _tree(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """A trunk and a crown of leaf clumps."""
    rng = choices.stream("detail")
    crown = (h - y0) * choices.between("split", 0.45, 0.65)
    top = h - crown / 2
    parts: list[Solid] = [Tube(points=np.array([[0, y0, 0], [0.02, (y0 + top) / 2, 0.01], [0, top, 0]]), radius=0.02)]
    for _ in range(choices.whole("count", 6, 11)):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        share = rng.uniform(0.45, 0.6)
        half = np.array([a, crown / 2, b]) * share
        centre = np.array([0, top, 0]) + direction * (np.array([a, crown / 2, b]) - half)
        parts.append(Ball(centre=centre, half=half, material="leaf"))
    return parts


def _leaf(base: np.ndarray, yaw: float, lift: float, length: float, wide: float) -> Ball:
    """A flat leaf that starts at `base`, points to `yaw` and rises by the angle `lift`."""
    turn = rotation(y=yaw) @ rotation(x=-lift)
    return Ball(
        centre=base + turn @ np.array([0, 0, length / 2]),
        half=np.array([wide / 2, max(0.008, 0.05 * length), length / 2]),
        turn=turn,
        material="leaf",
    )


def _blades(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """Long blades that rise from the pot and arch outward."""
    rng = choices.stream("detail")
    parts: list[Solid] = []
    count = choices.whole("count", 7, 10)
    for i in range(count):
        yaw = 2 * np.pi * (i + rng.uniform(-0.1, 0.1)) / count
        spread = np.array([np.sin(yaw) * a, 0, np.cos(yaw) * b]) * rng.uniform(0.8, 1.0)
        tall = (h - y0) * (1.0 if i % 2 else 0.75)
        knee = np.array([0, y0 + tall * 0.8, 0]) + spread * 0.4
        tip = np.array([0, y0 + tall * rng.uniform(0.8, 0.95), 0]) + spread
        root = np.array([0, y0, 0]) + spread * 0.06
        for start, end, wide in ((root, knee, 0.1), (knee, tip, 0.085)):
            step = end - start
            lift = np.arctan2(step[1], np.hypot(step[0], step[2]))
            parts.append(_leaf(start, np.arctan2(step[0], step[2]), lift, float(np.linalg.norm(step)) * 1.08, wide))
    return parts


def _leaves(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """Broad leaves at the ends of stems."""
    rng = choices.stream("detail")
    parts: list[Solid] = []
    count = choices.whole("count", 6, 9)
    for i in range(count):
        yaw = 2 * np.pi * (i * 0.382 + rng.uniform(-0.03, 0.03))
        tall = (h - y0) * (0.35 + 0.6 * i / count)
        spread = np.array([np.sin(yaw) * a, 0, np.cos(yaw) * b]) * rng.uniform(0.4, 0.5)
        end = np.array([0, y0 + tall, 0]) + spread
        parts.append(
            Tube(
                points=np.array([[0, y0 - 0.02, 0], [spread[0] * 0.4, y0 + tall * 0.65, spread[2] * 0.4], end]),
                radius=0.014,
                material="leaf",
            )
        )
        length = min(a, b) * rng.uniform(0.85, 1.0)
        parts.append(_leaf(end - np.array([0, 0.02, 0]), yaw, rng.uniform(-0.3, 0.2), length, length * 0.75))
    return parts


def _cactus(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """A column with bent arms."""
    rng = choices.stream("detail")
    r = min(a, b) * 0.26
    parts: list[Solid] = [
        Tube(points=np.array([[0, y0 - 0.02, 0], [0, h - r, 0]]), radius=r, material="leaf"),
        Ball(centre=np.array([0, h - r, 0]), half=np.full(3, r), material="leaf"),
    ]
    for s in (-1, 1):
        y = y0 + (h - y0) * rng.uniform(0.3, 0.5)
        tip = y + (h - y0) * rng.uniform(0.2, 0.4)
        x = s * (a - r * 0.6)
        parts.append(
            Tube(points=np.array([[0, y, 0], [x, y + r * 0.5, 0], [x, tip, 0]]), radius=r * 0.6, material="leaf")
        )
    return parts


def tv(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A flat screen with a bezel on two feet, a foot plate, or none."""
    w, h, d = size
    kind = (
        choices.pick("kind", ["feet", "plate", "wall"], [0.45, 0.35, 0.2])
        if d < 0.1
        else choices.pick("kind", ["feet", "plate"])
    )
    low = 0.0 if kind == "wall" else h * 0.08
    t = min(d, 0.05) if kind != "wall" else d
    parts: list[Solid] = [
        box((-w / 2, low, -t / 2), (w / 2, h, t / 2), "metal", min(0.008, t * 0.2)),
        box((-w / 2 + 0.015, low + 0.02, t * 0.3), (w / 2 - 0.015, h - 0.015, t / 2 + 0.002), "screen"),
    ]
    if kind == "feet":
        parts += [
            box((s * w * 0.36 - 0.015, 0, -d / 2), (s * w * 0.36 + 0.015, 0.015, d / 2), "metal") for s in (-1, 1)
        ]
        parts += [
            box((s * w * 0.36 - 0.012, 0, -t * 0.3), (s * w * 0.36 + 0.012, low + 0.02, t * 0.3), "metal")
            for s in (-1, 1)
        ]
    elif kind == "plate":
        parts += [
            box((-w * 0.2, 0, -d / 2), (w * 0.2, 0.015, d / 2), "metal"),
            box((-w * 0.06, 0, -t * 0.4), (w * 0.06, low + 0.05, t * 0.4), "metal"),
        ]
    elif d > 0.07:
        parts.append(box((-w * 0.3, h * 0.25, -d / 2), (w * 0.3, h * 0.7, 0), "metal", 0.01))
    return parts
