"""Plants in pots and television sets."""

from __future__ import annotations

import numpy as np

from echomodel.data.furniture.carpentry import Size, box
from echomodel.data.furniture.choices import Choices
from echomodel.data.furniture.lathe import Blade
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
    """A trunk that forks, clumps of foliage at its ends, and leaves that stand out of them."""
    rng = choices.stream("detail")
    crown = (h - y0) * choices.between("split", 0.45, 0.65)
    middle, fork = h - crown / 2, max(y0 + 0.05, h - crown * 1.05)
    parts: list[Solid] = [
        Tube(points=np.array([[0, y0, 0], [0.015, (y0 + fork) / 2, 0.01], [0, fork, 0]]), radius=0.016, material="stem")
    ]
    count = choices.whole("count", 6, 10)
    for i in range(count):
        around, level = 2 * np.pi * (i * 0.382 + rng.uniform(-0.05, 0.05)), 2 * (i + 0.5) / count - 1
        flat = np.sqrt(1 - level**2)
        direction = np.array([np.sin(around) * flat, level, np.cos(around) * flat])
        half = np.array([a, crown / 2, b]) * rng.uniform(0.36, 0.48)
        centre = np.array([0, middle, 0]) + direction * (np.array([a, crown / 2, b]) - half) * rng.uniform(0.82, 1.0)
        parts.append(Ball(centre=centre, half=half * 0.82, material="leaf", role="leaf"))
        parts.append(Tube(points=np.array([[0, fork - 0.02, 0], centre]), radius=0.008, material="stem"))
        for _ in range(7):
            out = direction + 0.9 * rng.normal(size=3)
            out /= np.linalg.norm(out)
            yaw, lift = np.arctan2(out[0], out[2]), np.arcsin(out[1])
            length = float(half.min()) * rng.uniform(0.65, 0.95)
            parts.append(_leaf(centre + out * half * 0.6, yaw, lift + 0.2, length, 0.45 * length, bend=0.5))
    return parts


def _leaf(base: np.ndarray, yaw: float, lift: float, length: float, wide: float, bend: float = 0.6) -> Blade:
    """A leaf that starts at `base`, points to `yaw` and rises by the angle `lift`, its tip bent down by `bend`."""
    return Blade(
        centre=base,
        turn=rotation(y=yaw) @ rotation(x=-lift),
        length=length,
        width=wide,
        thick=max(0.003, 0.012 * length),
        bend=bend,
        material="leaf",
        role="leaf",
    )


def _blades(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """Long blades that rise from the pot and arch outward."""
    parts: list[Solid] = []
    rng = choices.stream("detail")
    count = 2 * choices.whole("count", 7, 11)
    for i in range(count):
        yaw = 2 * np.pi * (i * 0.382 + rng.uniform(-0.04, 0.04))
        inner = i / count  # the last ones stand in the middle, upright
        spread = float(np.hypot(np.sin(yaw) * a, np.cos(yaw) * b)) * (1.0 - 0.75 * inner)
        tall = (h - y0) * (0.72 + 0.28 * inner) * rng.uniform(0.85, 1.0)
        lift, length = np.pi / 2 - 0.35 * (1 - inner), float(np.hypot(spread, tall)) * 1.08
        start = np.array([np.sin(yaw), 0, np.cos(yaw)]) * 0.03 * (1 - inner) + [0, y0 - 0.02, 0]
        bend = 2.0 * float(np.arctan2(spread, tall)) * (1.2 - 0.4 * inner)
        wide = max(0.03, 0.085 * length)
        parts.append(_leaf(start, yaw, lift, length, wide, bend=bend))
    return parts


def _leaves(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """Broad leaves at the ends of stems."""
    parts: list[Solid] = []
    rng = choices.stream("detail")
    count = choices.whole("count", 8, 13)
    for i in range(count):
        yaw = 2 * np.pi * (i * 0.382 + rng.uniform(-0.03, 0.03))
        tall = (h - y0) * (0.3 + 0.65 * i / count)
        out = np.array([np.sin(yaw) * a, 0, np.cos(yaw) * b]) * rng.uniform(0.4, 0.5) * (1 - 0.35 * i / count)
        end = np.array([0, y0 + tall, 0]) + out
        stem = np.array([[0, y0 - 0.02, 0], [out[0] * 0.4, y0 + tall * 0.65, out[2] * 0.4], end])
        parts.append(Tube(points=stem, radius=0.007, material="leaf", role="stem"))
        length = min(a, b) * rng.uniform(0.75, 0.95)
        parts.append(_leaf(end, yaw, rng.uniform(-0.1, 0.45), length, length * 0.68, bend=0.9))
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
