"""Plants in pots and television sets."""

from __future__ import annotations

import numpy as np

from echomodel.furniture.carpentry import Size, both, box, of_role
from echomodel.furniture.solids import Blade, Solid, ball, rotation, tube, turned
from echomodel.furniture.style import Choices, Style

PANEL = (16 / 9, 21 / 9)  # width over height of a screen with its bezel


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
            parts.append(tube([[x, 0, z], [x * 0.9, foot + pot_h * 0.5, z * 0.9]], 0.014, role="leg"))
    waist = 0.6 + 0.35 * style.taper
    parts.append(turned((0, foot, 0), pot_r * waist, pot_h, pot_r, power=power, material="ceramic", role="pot"))
    y0, level = foot + pot_h, (0, foot + pot_h * 0.98, 0)
    parts.append(turned(level, pot_r * 0.9, pot_h * 0.04, power=power, material="soil", role="soil"))
    kind = choices.pick("kind", ["tree", "blades", "leaves", "cactus"], [0.38, 0.22, 0.32, 0.08])
    grow = {"tree": _tree, "blades": _blades, "leaves": _leaves, "cactus": _cactus}[kind]
    return parts + grow(y0, h, w / 2, d / 2, choices)


def _tree(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """A trunk that forks into bent branches with leaves along them, a round crown altogether."""
    rng = choices.stream("detail")
    crown = (h - y0) * choices.between("split", 0.5, 0.7)
    middle, fork = h - crown / 2, max(y0 + 0.05, h - crown * 1.02)
    trunk = np.array([[0, y0 - 0.02, 0], [0.015, (y0 + fork) / 2, 0.01], [0, fork, 0]])
    parts: list[Solid] = [tube(trunk, 0.016, "stem", "stem")]
    count, reach = choices.whole("count", 8, 11), np.array([a, crown / 2, b])
    for i in range(count):
        around, level = 2 * np.pi * (i * 0.382 + rng.uniform(-0.05, 0.05)), 2 * (i + 0.5) / count - 0.9
        flat = np.sqrt(max(1 - level**2, 0.05))
        out = np.array([np.sin(around) * flat, min(level, 1.0), np.cos(around) * flat])
        start, tip = np.array([0, fork - 0.02, 0]), np.array([0, middle, 0]) + out * reach * rng.uniform(0.6, 0.75)
        bend = (start + tip) / 2 + np.array([out[0], -0.3, out[2]]) * 0.12 * crown
        branch = np.array([start, bend, tip])
        parts.append(tube(branch, 0.006, "stem", "stem"))
        length = float(np.clip(0.42 * min(a, b, crown / 2), 0.05, 0.16))
        for k in range(8):
            share = 0.35 + 0.65 * k / 7
            place = bend + (tip - bend) * (2 * share - 1) if share > 0.5 else start + (bend - start) * 2 * share
            yaw = around + (-1) ** k * rng.uniform(0.5, 1.5)
            parts.append(_leaf(place, yaw, rng.uniform(-0.3, 0.7), length, 0.5 * length, bend=0.7))
        parts.append(_leaf(tip, around, 0.4 + 0.6 * level, length, 0.5 * length, bend=0.7))
    return parts


def _leaf(base: np.ndarray, yaw: float, lift: float, length: float, wide: float, bend: float = 0.6) -> Blade:
    """A leaf that starts at `base`, points to `yaw` and rises by the angle `lift`, its tip bent down by `bend`."""
    turn, thick = rotation(y=yaw) @ rotation(x=-lift), max(0.003, 0.012 * length)
    return Blade(base, turn, "leaf", "leaf", length=length, width=wide, thick=thick, bend=bend)


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
        parts.append(tube(stem, 0.007, "leaf", "stem"))
        length = min(a, b) * rng.uniform(0.75, 0.95)
        parts.append(_leaf(end, yaw, rng.uniform(-0.1, 0.45), length, length * 0.68, bend=0.9))
    return parts


def _cactus(y0: float, h: float, a: float, b: float, choices: Choices) -> list[Solid]:
    """A column with bent arms."""
    rng = choices.stream("detail")
    r = min(a, b) * 0.26
    parts: list[Solid] = [tube([[0, y0 - 0.02, 0], [0, h - r, 0]], r, "leaf", "stem")]
    parts.append(ball((0, h - r, 0), r, "leaf", "stem"))
    for s in (-1, 1):
        y = y0 + (h - y0) * rng.uniform(0.3, 0.5)
        tip = y + (h - y0) * rng.uniform(0.2, 0.4)
        x = s * (a - r * 0.6)
        arm = np.array([[0, y, 0], [x * 0.75, y + r * 0.1, 0], [x, y + r * 0.8, 0], [x, tip, 0]])
        parts.append(tube(arm, r * 0.6, "leaf", "stem"))
        parts.append(ball(arm[-1], r * 0.6, "leaf", "stem"))
    return parts


def tv(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A thin panel with a bezel, its electronics in a lower box behind, on two feet, a foot plate, or none."""
    w, h, d = size
    kinds, odds = ["feet", "plate", "arc", "wall"], [0.4, 0.25, 0.15, 0.2]
    hung = d < 0.1 and w / h >= PANEL[0]
    kind = choices.pick("kind", kinds, odds) if hung else choices.pick("kind", kinds[:3], odds[:3])
    low = 0.0 if kind == "wall" else float(np.clip(0.08 * h, 0.03, 0.09))
    low = max(low, h - w / PANEL[0])  # a box that is too high has higher feet, no higher screen
    w = min(w, PANEL[1] * (h - low))
    back, face = (-d / 2, d / 2) if kind == "wall" else (-min(d, 0.07) / 2, min(d, 0.07) / 2)
    thin = max(face - 0.022, (back + face) / 2)  # the panel; what is behind it is lower and narrower
    edge, chin = 0.012, 0.02 + 0.02 * style.contrast
    body: list[Solid] = [
        box((-w / 2, low, thin), (w / 2, h, face), "metal", 0.004),
        box((-w * 0.38, low + 0.04 * h, back), (w * 0.38, low + 0.52 * (h - low), thin + 0.004), "metal", 0.012),
    ]
    glass = box((-w / 2 + edge, low + chin, thin + 0.004), (w / 2 - edge, h - edge, face + 0.0015), "screen")
    parts = [*of_role("housing", body), *of_role("screen", [glass])]
    feet: list[Solid] = []
    if kind == "feet":
        top = [w * 0.34, low + 0.03, (back + thin) / 2]
        for reach in (-d / 2 + 0.006, d / 2 - 0.006):
            feet.append(tube([top, [w * 0.35, low * 0.6, reach * 0.4], [w * 0.37, 0.008, reach]], 0.008))
        feet = both(*feet)
    elif kind == "plate":
        feet = [box((-w * 0.17, 0, -d / 2), (w * 0.17, 0.012, d / 2), radius=0.005)]
        feet.append(box((-w * 0.05, 0, back), (w * 0.05, low + 0.1 * h, back + 0.014)))
    elif kind == "arc":
        turn = np.linspace(-np.pi / 2, np.pi / 2, 9)
        bow = np.stack([0.24 * w * np.sin(turn), 0 * turn + 0.009, d / 2 - 0.009 - (d - 0.018) * np.cos(turn)], 1)
        feet = [tube(bow, 0.009), box((-0.03, 0, back - 0.004), (0.03, low + 0.1 * h, back + 0.012))]
        feet.append(box((-0.03, 0, -d / 2), (0.03, 0.012, back + 0.008)))
    return parts + of_role("foot", feet, material="metal")
