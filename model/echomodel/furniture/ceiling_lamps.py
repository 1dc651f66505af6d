"""Lamps of many parts at the ceiling: rows of shades, rings, and what is flush with it."""

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, both, box
from echomodel.furniture.shades import disc, kind_of, one_shade, shade
from echomodel.furniture.solids import Solid, Tube, rotation, tube, turned
from echomodel.furniture.style import Choices, Style

DOWN = rotation(x=np.pi)


def row(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Several shades under one bar."""
    w, h, d = size
    bar = box((-w * 0.42, h - 0.03, -d * 0.15), (w * 0.42, h, d * 0.15), "metal", 0.0, "canopy")
    if d < 0.25 and (style.shade == "ring" or choices.chance("form", 0.3)):
        beam = box((-w / 2, 0, -d * 0.4), (w / 2, min(0.08, h * 0.15), d * 0.4), "shade", 0.01, "shade")
        return [bar, beam, *both(tube([[w * 0.35, 0.05, 0], [w * 0.35, h, 0]], 0.006, "metal"))]
    count = int(np.clip(round(w / max(d * 1.35, 0.16)), 2, 6))
    each = min(w / count * 0.46, d / 2)
    xs = np.linspace(-w / 2 + each, w / 2 - each, count)
    parts: list[Solid] = [bar]
    tall = min(h * 0.5, each * 2 * (0.8 + 0.5 * style.taper))
    stagger = h * 0.15 * (style.tufting > 0.6)
    for i, x in enumerate(xs):
        y = stagger * (i % 2)
        kind, high = one_shade(style, 2 * each, tall, 0.7 * h)
        parts += shade(kind, x, y, 0, each, each, high, style)
        parts.append(tube([[x, y + high * 0.9, 0], [x, h - 0.01, 0]], 0.006, "metal"))
    return parts


def rings(size: Size, style: Style) -> list[Solid]:
    """One to three glowing rings on thin wires."""
    w, h, d = size
    parts: list[Solid] = []
    for i in range(1 if style.tufting < 0.4 else 2 if style.tufting < 0.75 else 3):
        share, y = 1 - 0.28 * i, 0.02 + i * min(0.25, h * 0.22)
        ring = _ring((w / 2 - 0.02) * share, (d / 2 - 0.02) * share, y, 0.02)
        wires = (tube([foot, [0, h - 0.02, 0]], 0.004, "metal") for foot in ring.points[:-1:11])
        parts += [ring, *wires]
    return parts


def _ring(a: float, b: float, y: float, r: float) -> Tube:
    """A tube that glows, about an ellipse of half axes a (x) and b (z)."""
    angle = np.linspace(0, 2 * np.pi, 34)
    return tube(np.stack([np.cos(angle) * a, np.full(34, y), np.sin(angle) * b], 1), r, "shade")


def ceiling_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Flush with the ceiling: a drum, a bowl, a square panel, rings, or arms with spheres when tall."""
    w, h, d = size
    plate = disc(0, h * 0.8, 0, w * 0.3, d * 0.3, h * 0.2)
    alike = max(w, d) / min(w, d) < 1.2
    if h > 0.35:
        stem = tube([[0, h * 0.45, 0], [0, h, 0]], 0.014, "metal")
        if choices.chance("form", 0.5):
            count = choices.pick("count", [3, 4, 6])
            parts: list[Solid] = [stem, disc(0, h - 0.03, 0, w * 0.14, d * 0.14, 0.03)]
            r = min(0.09, w * 0.14, h * 0.25)
            kind, tall = one_shade(replace(style, shade=kind_of(style, "cylinder")), 2 * r, h * 0.45, h)
            for a in np.arange(count) * 2 * np.pi / count:
                x, z = np.cos(a) * (w / 2 - r), np.sin(a) * (d / 2 - r)
                parts.append(tube([[0, h * 0.5, 0], [x, tall, z]], 0.011, "metal"))
                parts += shade(kind, x, 0.0, z, r, r, tall, style)
            return parts
        one = shade(kind_of(style, "sphere"), 0, 0, 0, w / 2, d / 2, h * 0.55, style)
        return [stem, disc(0, h - 0.03, 0, w * 0.18, d * 0.18, 0.03), *one]
    kind = choices.pick("kind", ["panel", "bowl", "drum", "ring"], [0.3, 0.3, 0.25, 0.15])
    if not alike or (style.profile == "square" and kind == "panel"):
        glow = box((-w / 2, 0, -d / 2), (w / 2, h * 0.85, d / 2), "shade", min(0.03, h * 0.3) * style.softness)
        return [glow, box((-w * 0.42, h * 0.6, -d * 0.42), (w * 0.42, h, d * 0.42), "metal")]
    if kind == "ring":
        r = min(h * 0.3, w * 0.08)
        spokes = [box((-x, r, -z), (x, r + 0.03, z), "metal") for x, z in ((w / 2 - r, 0.012), (0.012, d / 2 - r))]
        return [_ring(w / 2 - r, d / 2 - r, r, r), *spokes, disc(0, r, 0, w * 0.16, d * 0.16, h - r)]
    if kind == "bowl":
        high = w * 0.2, d * 0.2
        bowl = turned((0, h * 0.8, 0), (w / 2, d / 2), h * 0.8, high, rounding=0.02, turn=DOWN, material="shade")
        return [bowl, disc(0, h * 0.78, 0, w * 0.42, d * 0.42, h * 0.22)]
    drum = disc(0, 0, 0, w / 2, d / 2, h * 0.85, "shade")
    if style.tufting > 0.5:
        return [plate, drum, disc(0, h * 0.3, 0, w * 0.515, d * 0.515, h * 0.15)]
    return [plate, drum]
