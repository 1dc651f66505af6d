"""Beds: double, single and for children, with a headboard and a mattress; bunks and cots."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from echomodel.data.furniture.carpentry import Size, base, box, core, cushion
from echomodel.data.furniture.choices import Choices
from echomodel.data.furniture.fronts import front
from echomodel.data.furniture.solids import Ball, Block, Solid, Turned, rotation
from echomodel.data.furniture.style import Style


def _headboard(style: Style, w: float, h: float, z: float, choices: Choices) -> list[Solid]:
    """The board at the head of a bed, its rear on the plane z, `w` wide and `h` high."""
    t = 0.05 + 0.04 * style.bulk
    kind = style.headboard
    if kind == "panel":
        parts: list[Solid] = [box((-w / 2, 0.02, z), (w / 2, h, z + t * 0.8), "wood", 0.015 * style.corner)]
        if style.softness > 0.45:
            parts.append(box((-w * 0.46, 0.35, z + t * 0.4), (w * 0.46, h - 0.06, z + t * 1.5), "fabric", 0.025))
        return parts
    if kind == "low":
        return [box((-w / 2, 0.02, z), (w / 2, h, z + t * 0.7))]
    if kind == "channels":
        count = int(4 + 6 * style.tufting)
        edges = np.linspace(-w / 2, w / 2, count + 1)
        return [
            Block(
                centre=np.array([(a + b) / 2, (0.1 + h) / 2, z + t * 0.75]),
                half=np.array([(b - a) / 2, (h - 0.1) / 2, t * 0.75]),
                radius=min((b - a) * 0.4, t * 0.7),
                material="fabric",
            )
            for a, b in pairwise(edges)
        ]
    if kind == "cushions":
        frame = box((-w / 2, 0.02, z), (w / 2, h * 0.85, z + t * 0.6))
        turn = rotation(x=-0.1)
        pads = [
            cushion(
                (s * w * 0.25 - w * 0.23, h * 0.4, z + t * 0.4),
                (s * w * 0.25 + w * 0.23, h, z + t * 1.9),
                style,
                turn=turn,
            )
            for s in (-1, 1)
        ]
        return [frame, *pads]
    if kind == "slats":
        parts = [box((s * (w / 2 - 0.03) - 0.03, 0, z), (s * (w / 2 - 0.03) + 0.03, h, z + 0.06)) for s in (-1, 1)]
        parts += [
            box((-w / 2, h - 0.1, z), (w / 2, h, z + 0.05)),
            box((-w / 2, h * 0.45, z), (w / 2, h * 0.45 + 0.06, z + 0.05)),
            box((-w / 2, 0.12, z), (w / 2, 0.3, z + 0.05)),
        ]
        count = int(5 + 9 * style.tufting)
        xs = np.linspace(-w / 2, w / 2, count + 2)[1:-1]
        return parts + [box((x - 0.025, h * 0.45, z + 0.01), (x + 0.025, h, z + 0.04)) for x in xs]
    if kind == "posts":
        r = 0.045 * style.bulk
        parts = [
            Turned(centre=np.array([s * (w / 2 - r), 0, z + r]), low=(r, r), high=(r * 0.8, r * 0.8), height=h - r)
            for s in (-1, 1)
        ]
        parts += [Ball(centre=np.array([s * (w / 2 - r), h - r, z + r]), half=np.full(3, r * 1.2)) for s in (-1, 1)]
        return [*parts, box((-w / 2 + r, 0.3, z + r * 0.6), (w / 2 - r, h * 0.86, z + r * 1.3), "wood")]
    arch = Turned(
        centre=np.array([0, h * 0.6, z + t * 0.5]),
        low=(w / 2, h * 0.4),
        high=(w / 2, h * 0.4),
        height=t,
        turn=rotation(x=np.pi / 2),
        power=2.4,
        material="fabric" if style.softness > 0.5 else "wood",
    )
    arch = replace(arch, centre=np.array([0, h * 0.6, z]))
    return [arch, box((-w / 2, 0.02, z), (w / 2, h * 0.62, z + t), "fabric" if style.softness > 0.5 else "wood")]


def _bedding(w: float, z0: float, z1: float, low: float, choices: Choices, style: Style, pillows: int) -> list[Solid]:
    """Mattress, pillows and a cover from z0 (head) to z1."""
    thick = 0.2
    parts: list[Solid] = [box((-w / 2, low, z0), (w / 2, low + thick, z1), "linen", 0.05, "mattress")]
    each = w / pillows
    for i in range(pillows):
        x = -w / 2 + each * (i + 0.5)
        parts.append(
            Ball(
                centre=np.array([x, low + thick + 0.06, z0 + 0.26]),
                half=np.array([min(each * 0.44, 0.38), 0.09, 0.22]),
                power=2.8,
                turn=rotation(x=-0.25),
                material="linen",
                role="pillow",
            )
        )
    if choices.chance("cover", 0.75):
        start = z0 + (z1 - z0) * choices.between("spread", 0.28, 0.55)
        over = 0.02 + 0.05 * style.softness
        parts.append(
            box(
                (-w / 2 - over, low + thick * 0.35, start),
                (w / 2 + over, low + thick + 0.045, z1 + over * 0.5),
                "blanket",
                0.035,
                "cover",
            )
        )
        fold = 0.1 + 0.08 * style.softness  # the sheet turned back over it
        parts.append(
            box(
                (-w / 2 - over - 0.004, low + thick * 0.4, start - 0.01),
                (w / 2 + over + 0.004, low + thick + 0.056, start + fold),
                "linen",
                0.03,
                "cover",
            )
        )
    return parts


def _bed(size: Size, style: Style, choices: Choices, pillows: int) -> list[Solid]:
    """A frame on legs or a plinth, a headboard, bedding, perhaps a footboard."""
    w, h, d = size
    z0, z1 = -d / 2, d / 2
    wide = w - (0.0 if choices.chance("form", 0.75) else min(0.5, w * 0.2))
    frame = wide * 0.99
    foot = 0.06 if style.legs in ("plinth", "bun") else float(np.clip(style.leg_height + 0.06, 0.1, 0.25))
    rail = choices.between("share", 0.12, 0.24)
    deck = min(foot + rail, 0.42)
    head = 0.13
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled", "splayed") else "straight"
    near = z0 + 0.03  # the frame reaches into the headboard
    parts: list[Solid] = [
        replace(part, centre=part.centre + np.array([0, 0, 0.015]))
        for part in base(style, frame * 0.98, (d - 0.03) * 0.98, foot, 0.07 * style.bulk, kind)
    ]
    parts.append(box((-frame / 2, foot, near), (frame / 2, foot + 0.015, z1)))
    upholstered = style.softness > 0.5
    stuff, radius = ("fabric", 0.025) if upholstered else ("wood", 0.004 + 0.008 * style.edge)
    t = 0.07 if upholstered else 0.04
    parts += [
        box(
            (s * frame / 2 - t * (s > 0), foot, near),
            (s * frame / 2 + t * (s < 0), deck, z1),
            stuff,
            radius,
            "rail",
        )
        for s in (-1, 1)
    ]
    parts += [box((-frame / 2, foot, z), (frame / 2, deck, z + t), stuff, radius, "rail") for z in (near, z1 - t)]
    parts.append(
        box((-frame / 2 + t / 2, deck - 0.09, z0 + head), (frame / 2 - t / 2, deck - 0.06, z1 - t / 2), "wood")
    )
    parts.append(core((-frame / 2, foot, near), (frame / 2, deck, z1), stuff))
    parts += _headboard(style, w, h, z0, choices)
    parts += _bedding(frame * 0.95, z0 + head, z1 - 0.04, deck - 0.06, choices, style, pillows)
    if style.headboard in ("slats", "posts", "arched") and choices.chance("second", 0.6):
        parts.append(box((-frame / 2, 0, z1 - 0.05), (frame / 2, deck + min(0.3, 0.35 * (h - deck)), z1), "wood", 0.01))
    return parts


def double_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two pillows, or four in a broad bed."""
    return _bed(size, style, choices, 2 if size[0] < 2.4 else 3)


def single_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """One pillow."""
    return _bed(size, style, choices, 1)


def kids_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A cot when small, a bunk when tall, otherwise a small bed with rails, drawers or a gabled headboard."""
    w, h, d = size
    if w < 0.85 or d < 1.4:
        return _cot(size, style)
    if h > 1.55:
        return _bunk(size, style, choices)
    if h > 1.2 and choices.chance("kind", 0.45):
        return _loft(size)
    house = h > 1.25 and choices.chance("extra", 0.7)
    parts = _bed(np.array([w, min(h, 1.0) if house else h, d]), style, choices, 1)
    if house:
        return parts + _house(w, h, d)
    y0, y1 = 0.3, min(h * 0.85, 0.72)
    side = -1 if choices.chance("side", 0.5) else 1
    for y in np.linspace(y0 + 0.12, y1, 2):
        parts.append(box((side * w / 2 - 0.02, y - 0.035, -d * 0.48), (side * w / 2 + 0.02, y + 0.035, d * 0.1)))
    parts += [
        box((side * w / 2 - 0.025, y0 - 0.1, z - 0.03), (side * w / 2 + 0.025, y1 + 0.04, z + 0.03))
        for z in (-d * 0.2, d * 0.08)
    ]
    return parts


def _house(w: float, h: float, d: float) -> list[Solid]:
    """Posts and rafters in the outline of a house."""
    t, eaves = 0.03, h * 0.72
    parts: list[Solid] = [
        box((sx * (w / 2 - t) - t, 0, sz * (d / 2 - t) - t), (sx * (w / 2 - t) + t, eaves, sz * (d / 2 - t) + t))
        for sx in (-1, 1)
        for sz in (-1, 1)
    ]
    slope, length = np.arctan2(h - eaves, w / 2), np.hypot(h - eaves, w / 2)
    for z in (-(d / 2 - t), d / 2 - t):
        for s in (-1, 1):
            rafter = box((-length / 2, -t, -t), (length / 2, t, t))
            parts.append(
                replace(rafter, centre=np.array([s * w / 4, (eaves + h) / 2 - t, z]), turn=rotation(z=-s * slope))
            )
    parts.append(box((-t, h - 2 * t, -d / 2), (t, h, d / 2)))
    return parts


def _loft(size: Size) -> list[Solid]:
    """One high deck on four posts with a rail round it, a ladder in front, and a chest of shelves below."""
    w, h, d = size
    t, deck = 0.035, h - 0.45
    posts = [(sx * (w / 2 - t), sz * (d / 2 - t)) for sx in (-1, 1) for sz in (-1, 1)]
    parts: list[Solid] = [box((x - t, 0, z - t), (x + t, h - 0.05, z + t)) for x, z in posts]
    parts.append(box((-w / 2, deck, -d / 2), (w / 2, deck + 0.1, d / 2)))
    parts.append(
        box(
            (-w / 2 + 0.05, deck + 0.08, -d / 2 + 0.05),
            (w / 2 - 0.05, deck + 0.22, d / 2 - 0.05),
            "linen",
            0.04,
            "mattress",
        )
    )
    for y in (deck + 0.26, h - 0.09):
        parts += [box((s * w / 2 - 0.018, y, -d / 2), (s * w / 2 + 0.018, y + 0.07, d / 2)) for s in (-1, 1)]
        parts.append(box((-w / 2, y, -d / 2), (w / 2, y + 0.07, -d / 2 + 0.03)))
        parts.append(box((-w / 2, y, d / 2 - 0.03), (w * 0.1, y + 0.07, d / 2)))
    parts += [box((x - 0.02, 0, d / 2 - 0.03), (x + 0.02, h - 0.05, d / 2 + 0.01)) for x in (w * 0.14, w * 0.42)]
    steps = np.linspace(0.2, deck, 4)
    parts += [box((w * 0.14, y, d / 2 - 0.03), (w * 0.42, y + 0.035, d / 2 + 0.01)) for y in steps]
    parts += [box((-w * 0.45, y, -d * 0.45), (-w * 0.1, y + 0.02, d * 0.2)) for y in (0.03, deck * 0.5)]
    parts += [box((x - 0.01, 0, -d * 0.45), (x + 0.01, deck, d * 0.2)) for x in (-w * 0.45, -w * 0.1)]
    return parts


def _cot(size: Size, style: Style) -> list[Solid]:
    """Bars on four sides round a small mattress."""
    w, h, d = size
    t, y0 = 0.025, min(0.2, h * 0.3)
    parts: list[Solid] = [
        box((sx * (w / 2 - t) - t, 0, sz * (d / 2 - t) - t), (sx * (w / 2 - t) + t, h, sz * (d / 2 - t) + t))
        for sx in (-1, 1)
        for sz in (-1, 1)
    ]
    for y in (y0, h - 0.05):
        parts += [
            box((s * (w / 2 - t) - t * 0.7, y, -d / 2), (s * (w / 2 - t) + t * 0.7, y + 0.045, d / 2)) for s in (-1, 1)
        ]
        parts += [
            box((-w / 2, y, s * (d / 2 - t) - t * 0.7), (w / 2, y + 0.045, s * (d / 2 - t) + t * 0.7)) for s in (-1, 1)
        ]
    r = 0.011
    for z in np.linspace(-d / 2, d / 2, int(np.clip(d / 0.13, 5, 24)))[1:-1]:
        parts += [box((s * (w / 2 - t) - r, y0, z - r), (s * (w / 2 - t) + r, h - 0.03, z + r)) for s in (-1, 1)]
    for x in np.linspace(-w / 2, w / 2, int(np.clip(w / 0.13, 4, 16)))[1:-1]:
        parts += [box((x - r, y0, s * (d / 2 - t) - r), (x + r, h - 0.03, s * (d / 2 - t) + r)) for s in (-1, 1)]
    parts.append(
        box((-w / 2 + 0.04, y0, -d / 2 + 0.04), (w / 2 - 0.04, y0 + 0.12, d / 2 - 0.04), "linen", 0.03, "mattress")
    )
    return parts


def _bunk(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two decks on four posts, a rail above and a ladder or stairs with drawers."""
    w, h, d = size
    stairs = w > 1.9
    bed = w - 0.5 if stairs else w
    x0 = -w / 2
    t = 0.04
    upper = h - 0.42
    parts: list[Solid] = []
    for x in (x0 + t, x0 + bed - t):
        parts += [box((x - t, 0, s * (d / 2 - t) - t), (x + t, h - 0.08, s * (d / 2 - t) + t)) for s in (-1, 1)]
    for y in (0.22, upper):
        parts.append(box((x0, y, -d / 2), (x0 + bed, y + 0.12, d / 2)))
        parts.append(
            box(
                (x0 + 0.05, y + 0.1, -d / 2 + 0.06),
                (x0 + bed - 0.05, y + 0.24, d / 2 - 0.06),
                "linen",
                0.04,
                "mattress",
            )
        )
        parts.append(
            Ball(
                centre=np.array([x0 + bed / 2, y + 0.28, -d / 2 + 0.28]),
                half=np.array([0.3, 0.07, 0.18]),
                power=2.8,
                material="linen",
                role="pillow",
            )
        )
    for x in (x0 + 0.015, x0 + bed - 0.015):
        parts += [
            box((x - 0.015, y, -d / 2), (x + 0.015, y + 0.08, d / 2 * (1 if x < x0 + bed / 2 else 0.55)))
            for y in (upper + 0.22, h - 0.08)
        ]
    parts += [
        box((x0, y, s * (d / 2 - 0.015) - 0.015), (x0 + bed, y + 0.08, s * (d / 2 - 0.015) + 0.015))
        for y in (upper + 0.22, h - 0.08)
        for s in (-1, 1)
    ]
    if stairs:
        steps = 4
        for i in range(steps):
            z = d / 2 - (i + 1) * 0.36
            y = upper * (i + 1) / (steps + 0.5)
            parts.append(box((x0 + bed, 0, z), (w / 2, y, z + 0.36)))
            parts += front((x0 + bed, 0.02), (w / 2, y), z + 0.36, 1, 1, "drawer", style) if i == 0 else []
        return parts
    for z in (d * 0.2, d * 0.42):
        parts.append(box((w / 2 - 0.02, 0, z - 0.025), (w / 2 + 0.02, h - 0.05, z + 0.025)))
    return parts + [
        box((w / 2 - 0.02, y, d * 0.2), (w / 2 + 0.02, y + 0.04, d * 0.42)) for y in np.linspace(0.3, upper, 5)
    ]
