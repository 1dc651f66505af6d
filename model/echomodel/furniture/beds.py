"""Beds: a frame, a headboard, a mattress and bedding; for children cots, bunks, stilts, houses and rails."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from echomodel.furniture.carpentry import Size, base, box, core, cushion, of_role, post
from echomodel.furniture.fronts import front
from echomodel.furniture.solids import Block, Solid, ball, rotation, turned
from echomodel.furniture.style import Choices, Style

SET_BACK = 0.006  # metres between two faces that would lie in one plane


def _headboard(style: Style, w: float, h: float, z: float) -> list[Solid]:
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
        parts = [turned((s * (w / 2 - r), 0, z + r), r, h - r, r * 0.8) for s in (-1, 1)]
        parts += [ball((s * (w / 2 - r), h - r, z + r), r * 1.2) for s in (-1, 1)]
        return [*parts, box((-w / 2 + r, 0.3, z + r * 0.6), (w / 2 - r, h * 0.86, z + r * 1.3), "wood")]
    stuff = "fabric" if style.softness > 0.5 else "wood"
    arch = turned((0, h * 0.6, z), (w / 2, h * 0.4), t, power=2.4, turn=rotation(x=np.pi / 2), material=stuff)
    return [arch, box((-w / 2, 0.02, z + SET_BACK), (w / 2, h * 0.62, z + t - SET_BACK), stuff)]


def bedding(w: float, z0: float, z1: float, low: float, choices: Choices, style: Style, pillows: int) -> list[Solid]:
    """Mattress, pillows and a cover from z0 (head) to z1."""
    thick = 0.2
    parts: list[Solid] = [box((-w / 2, low, z0), (w / 2, low + thick, z1), "linen", 0.05, "mattress")]
    each = w / pillows
    for i in range(pillows):
        x = -w / 2 + each * (i + 0.5)
        parts.append(
            ball(
                (x, low + thick + 0.06, z0 + 0.26),
                (min(each * 0.44, 0.38), 0.09, 0.22),
                "linen",
                "pillow",
                power=2.8,
                turn=rotation(x=-0.25),
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


def bed(size: Size, style: Style, choices: Choices, pillows: int) -> list[Solid]:
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
    parts.append(box((-frame / 2, foot, near), (frame / 2, foot + 0.015, z1 - 0.03), role="rail"))
    board = style.headboard in ("slats", "posts", "arched") and choices.chance("second", 0.6)
    end = z1 - (0.052 if board else 0.0)  # a footboard stands before the frame, not in it
    upholstered = style.softness > 0.5
    stuff, radius = ("fabric", 0.025) if upholstered else ("wood", 0.004 + 0.008 * style.edge)
    t = 0.07 if upholstered else 0.04
    parts += [
        box(
            (s * frame / 2 - t * (s > 0), foot, near),
            (s * frame / 2 + t * (s < 0), deck, end),
            stuff,
            radius,
            "rail",
        )
        for s in (-1, 1)
    ]
    parts += [box((-frame / 2, foot, z), (frame / 2, deck, z + t), stuff, radius, "rail") for z in (near, end - t)]
    parts.append(
        box((-frame / 2 + t / 2, deck - 0.09, z0 + head), (frame / 2 - t / 2, deck - 0.06, end - t / 2), role="rail")
    )
    parts.append(core((-frame / 2, foot, near), (frame / 2, deck, z1), stuff))
    parts += of_role("headboard", _headboard(style, w, h, z0))
    parts += bedding(frame * 0.95, z0 + head, end - 0.04, deck - 0.06, choices, style, pillows)
    if board:
        tall = deck + min(0.3, 0.35 * (h - deck))
        parts.append(box((-frame / 2, 0, z1 - 0.055), (frame / 2, tall, z1), "wood", 0.01, "footboard"))
    return parts


def double_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two pillows, or four in a broad bed."""
    return bed(size, style, choices, 2 if size[0] < 2.4 else 3)


def single_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """One pillow."""
    return bed(size, style, choices, 1)


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
    parts = bed(np.array([w, min(h, 1.0) if house else h, d]), style, choices, 1)
    if house:
        return parts + _house(w, h, d)
    y0, y1 = 0.3, min(h * 0.85, 0.72)
    side = -1 if choices.chance("side", 0.5) else 1
    guard: list[Solid] = [
        box((side * w / 2 - 0.02, y - 0.035, -d * 0.48), (side * w / 2 + 0.02, y + 0.035, d * 0.1))
        for y in np.linspace(y0 + 0.12, y1, 2)
    ]
    guard += [
        box((side * w / 2 - 0.025, y0 - 0.1, z - 0.03), (side * w / 2 + 0.025, y1 + 0.04, z + 0.03))
        for z in (-d * 0.2, d * 0.08)
    ]
    return parts + of_role("guard", guard)


def _made_up(x0: float, x1: float, y: float, d: float, inset: float) -> list[Solid]:
    """A thin mattress on a deck at y from x0 to x1, a pillow at its rear end and a blanket over the rest."""
    thick = 0.14
    middle, wide = (x0 + x1) / 2, x1 - x0
    rear, near = -d / 2 + inset, d / 2 - inset
    return [
        box((x0 + 0.05, y, rear), (x1 - 0.05, y + thick, near), "linen", 0.04, "mattress"),
        ball(
            (middle, y + thick + 0.045, rear + 0.22),
            (min(0.32, 0.36 * wide), 0.075, 0.18),
            "linen",
            "pillow",
            power=2.8,
        ),
        box((x0 + 0.045, y + 0.05, -d * 0.12), (x1 - 0.045, y + thick + 0.03, near + 0.01), "blanket", 0.03, "cover"),
    ]


def _house(w: float, h: float, d: float) -> list[Solid]:
    """Posts and rafters in the outline of a house."""
    t, eaves = 0.03, h * 0.72
    parts: list[Solid] = [post(sx * (w / 2 - t), sz * (d / 2 - t), t, 0, eaves) for sx in (-1, 1) for sz in (-1, 1)]
    slope, length = np.arctan2(h - eaves, w / 2), np.hypot(h - eaves, w / 2)
    for z in (-(d / 2 - t), d / 2 - t):
        for s in (-1, 1):
            rafter = box((-length / 2, -t, -t), (length / 2, t, t))
            parts.append(
                replace(rafter, centre=np.array([s * w / 4, (eaves + h) / 2 - t, z]), turn=rotation(z=-s * slope))
            )
    parts.append(box((-t, h - 2 * t, -d / 2), (t, h, d / 2)))
    return of_role("house", parts)


def _loft(size: Size) -> list[Solid]:
    """One high deck on four posts with a rail round it, a ladder in front, and a chest of shelves below."""
    w, h, d = size
    t, deck = 0.035, h - 0.45
    posts = [(sx * (w / 2 - t), sz * (d / 2 - t)) for sx in (-1, 1) for sz in (-1, 1)]
    parts: list[Solid] = [post(x, z, t, 0, h - 0.05, role="leg") for x, z in posts]
    parts.append(box((-w / 2, deck, -d / 2), (w / 2, deck + 0.1, d / 2), role="rail"))
    parts += _made_up(-w / 2, w / 2, deck + 0.08, d, 0.05)
    guard: list[Solid] = []
    for y in (deck + 0.26, h - 0.09):
        guard += [box((s * w / 2 - 0.018, y, -d / 2), (s * w / 2 + 0.018, y + 0.07, d / 2)) for s in (-1, 1)]
        guard.append(box((-w / 2, y, -d / 2), (w / 2, y + 0.07, -d / 2 + 0.03)))
        guard.append(box((-w / 2, y, d / 2 - 0.03), (w * 0.1, y + 0.07, d / 2)))
    parts += of_role("guard", guard)
    ladder: list[Solid] = [
        box((x - 0.02, 0, d / 2 - 0.03), (x + 0.02, h - 0.05, d / 2 + 0.01)) for x in (w * 0.14, w * 0.42)
    ]
    steps = np.linspace(0.2, deck, max(4, round(deck / 0.26)))
    ladder += [box((w * 0.14, y, d / 2 - 0.03), (w * 0.42, y + 0.035, d / 2 + 0.01)) for y in steps]
    chest: list[Solid] = [
        box((-w * 0.45, y, -d * 0.45), (-w * 0.1, y + 0.02, d * 0.2)) for y in (0.03, deck * 0.36, deck * 0.7)
    ]
    chest += [box((x - 0.01, 0, -d * 0.45), (x + 0.01, deck, d * 0.2)) for x in (-w * 0.45, -w * 0.1)]
    return parts + of_role("ladder", ladder) + of_role("shelf", chest)


def _cot(size: Size, style: Style) -> list[Solid]:
    """Bars on four sides round a small mattress."""
    w, h, d = size
    t, y0 = 0.025, min(0.2, h * 0.3)
    posts: list[Solid] = [post(sx * (w / 2 - t), sz * (d / 2 - t), t, 0, h) for sx in (-1, 1) for sz in (-1, 1)]
    parts: list[Solid] = []
    for y in (y0, h - 0.05):
        parts += [
            box((s * (w / 2 - t) - t * 0.7, y, -d / 2), (s * (w / 2 - t) + t * 0.7, y + 0.045, d / 2)) for s in (-1, 1)
        ]
        parts += [
            box((-w / 2, y, s * (d / 2 - t) - t * 0.7), (w / 2, y + 0.045, s * (d / 2 - t) + t * 0.7)) for s in (-1, 1)
        ]
    r = 0.011
    for z in np.linspace(-d / 2, d / 2, int(np.clip(d / 0.13, 5, 24)))[1:-1]:
        parts += [post(s * (w / 2 - t), z, r, y0, h - 0.03) for s in (-1, 1)]
    for x in np.linspace(-w / 2, w / 2, int(np.clip(w / 0.13, 4, 16)))[1:-1]:
        parts += [post(x, s * (d / 2 - t), r, y0, h - 0.03) for s in (-1, 1)]
    low, high = (-w / 2 + 0.04, y0, -d / 2 + 0.04), (w / 2 - 0.04, y0 + 0.12, d / 2 - 0.04)
    mattress = box(low, high, "linen", 0.03, "mattress")
    return [*of_role("leg", posts), *of_role("guard", parts), mattress]


def _bunk(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two decks on four posts, a rail above and a ladder or stairs with drawers."""
    w, h, d = size
    stairs = w > 1.9
    wide = w - 0.5 if stairs else w
    x0 = -w / 2
    t = 0.04
    upper = h - 0.42
    parts: list[Solid] = []
    for x in (x0 + t, x0 + wide - t):
        parts += [post(x, s * (d / 2 - t), t, 0, h - 0.08, role="leg") for s in (-1, 1)]
    for y in (0.22, upper):
        parts.append(box((x0, y, -d / 2), (x0 + wide, y + 0.12, d / 2), role="rail"))
        parts += _made_up(x0, x0 + wide, y + 0.1, d, 0.06)
    guard: list[Solid] = []
    for x in (x0 + 0.015, x0 + wide - 0.015):
        guard += [
            box((x - 0.015, y, -d / 2), (x + 0.015, y + 0.08, d / 2 * (1 if x < x0 + wide / 2 else 0.55)))
            for y in (upper + 0.22, h - 0.08)
        ]
    guard += [
        box((x0, y, s * (d / 2 - 0.015) - 0.015), (x0 + wide, y + 0.08, s * (d / 2 - 0.015) + 0.015))
        for y in (upper + 0.22, h - 0.08)
        for s in (-1, 1)
    ]
    parts += of_role("guard", guard)
    if stairs:
        steps = 4
        for i in range(steps):
            z = d / 2 - (i + 1) * 0.36
            y = upper * (i + 1) / (steps + 0.5)
            parts.append(box((x0 + wide, 0, z), (w / 2, y, z + 0.36), role="stairs"))
            parts += front((x0 + wide, 0.02), (w / 2, y), z + 0.36, 1, 1, "drawer", style) if i == 0 else []
        return parts
    ladder: list[Solid] = [
        box((w / 2 - 0.02, 0, z - 0.025), (w / 2 + 0.02, h - 0.05, z + 0.025)) for z in (d * 0.2, d * 0.42)
    ]
    heights = np.linspace(0.3, upper, max(3, round(upper / 0.27)))
    ladder += [box((w / 2 - 0.02, y, d * 0.2), (w / 2 + 0.02, y + 0.04, d * 0.42)) for y in heights]
    return parts + of_role("ladder", ladder)
