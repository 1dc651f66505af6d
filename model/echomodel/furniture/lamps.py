"""Lamps: hanging, on the ceiling, on the floor, on tables and on walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, both, box
from echomodel.furniture.solids import Lathe, Solid, Tube, Turned, ball, rotation, tube, turned, wall
from echomodel.furniture.style import Choices, Style

DOWN = rotation(x=np.pi)


def _disc(
    x: float, y: float, z: float, a: float, b: float, h: float, material: str = "metal", high: float = 1.0,
    role: str = "stem",
) -> Turned:  # fmt: skip
    """A disc or cone with its lower face at y: half widths a and b, `high` times that above."""
    low, up = (a, b), (a * high, b * high)
    return turned((x, y, z), low, h, up, material=material, role=role)


def shade(kind: str, x: float, y: float, z: float, a: float, b: float, h: float, style: Style) -> list[Solid]:
    """A shade between y and y + h, half widths a (x) and b (z), with what glows in it.

    Cones, drums and cylinders are open above and below, domes below; a sphere glows itself.
    """
    place = np.array([x, y, z])
    if kind == "sphere":
        half = np.minimum([a, min(a, b), b], h / 2)
        return [ball((x, y + h - half[1], z), half, "shade", "shade")]
    thick, squash = min(0.006, 0.1 * a), b / a
    if kind == "dome":
        turn = np.linspace(0, np.pi / 2, 8)
        outline = [(a * max(float(np.cos(t)), 0.05), h * float(np.sin(t))) for t in turn]
    else:
        narrow = {"cone": 0.35 + 0.25 * style.taper, "drum": 0.85, "cylinder": 1.0}.get(kind, 0.9)
        outline = [(a, 0.0), (a * narrow, h)]
    neck = outline[-1][0]
    inner = max(thick, neck - thick)
    reach = a + 0.9 * (neck - a) - 0.5 * thick
    high = 0.985 if kind == "dome" else 0.93
    bulb = min(0.045, 0.4 * inner, 0.3 * h)
    skin = Lathe(centre=place, profile=wall(outline, thick), squash=squash, hollow=True, material="shade", role="shade")
    body = replace(skin, profile=np.array(outline), hollow=False, core=True)  # a coarse grid sees a full shade
    light = ball((x, y + 0.45 * h, z), bulb, "shade", "bulb")
    low = y + 0.45 * h + 0.7 * bulb
    socket = _disc(x, low, z, 0.45 * bulb, 0.45 * bulb, y + high * h - low, role="bulb")
    arms: list[Solid] = []
    if kind != "dome":
        low, up = y + 0.9 * h, y + 0.9 * h + 0.005
        bars = (reach, 0.003), (0.003, reach * squash)
        arms = [box((x - i, low, z - k), (x + i, up, z + k), "metal", 0.0, "shade") for i, k in bars]
    return [skin, body, light, socket, *arms]


def _kind(style: Style, *without: str) -> str:
    return style.shade if style.shade not in ("ring", "arms", *without) else "drum"


def _one_shade(style: Style, wide: float, tall: float, most: float) -> tuple[str, float]:
    """Kind and height of a single shade of this width: a globe is as high as wide, where there is so much height."""
    kind = _kind(style, *(("sphere",) if wide > most else ()))
    return kind, wide if kind == "sphere" else tall


def pendant_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A canopy, a cord and a shade; a row of shades; a ring; or a chandelier with arms. The top is the ceiling."""
    w, h, d = size
    if d / w > 1.6:  # a long one along the depth
        about = rotation(y=np.pi / 2)
        along = pendant_lamp(np.array([d, h, w]), style, choices)
        return [replace(part, centre=about @ part.centre, turn=about @ part.turn) for part in along]
    canopy = min(0.06, w * 0.2, d * 0.3) if min(w, d) > 0.14 else min(w, d) * 0.35
    parts: list[Solid] = []
    if w / d > 1.6:
        return _row(size, style, choices)
    parts.append(_disc(0, h - 0.025, 0, canopy, canopy, 0.025, role="canopy"))
    if w > 0.45 and (style.shade == "arms" or choices.chance("kind", 0.25)):
        return parts + _chandelier(size, style, choices)
    if style.shade == "ring" and w > 0.4:
        return parts + _rings(size, style)
    tall = min(h * 0.55, max(w * (0.4 + 0.4 * style.taper), h * 0.22))
    kind, tall = _one_shade(style, min(w, d), tall, 0.75 * h)
    r = max(0.006, 0.012 * w)
    parts.append(tube([[0, tall * 0.9, 0], [0, h, 0]], r, "metal", "cord"))
    if kind == "drum" and style.tufting > 0.6:
        inner = _disc(0, tall * 0.15, 0, w * 0.34, d * 0.34, tall * 0.5, "shade", role="shade")
        return [*parts, *shade(kind, 0, tall * 0.35, 0, w / 2, d / 2, tall * 0.65, style), inner]
    return parts + shade(kind, 0, 0, 0, w / 2, d / 2, tall, style)


def _row(size: Size, style: Style, choices: Choices) -> list[Solid]:
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
        kind, high = _one_shade(style, 2 * each, tall, 0.7 * h)
        parts += shade(kind, x, y, 0, each, each, high, style)
        parts.append(tube([[x, y + high * 0.9, 0], [x, h - 0.01, 0]], 0.006, "metal"))
    return parts


def _chandelier(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Curved arms round a stem, a candle or a small shade on each."""
    w, h, d = size
    body = min(h * 0.55, w * 0.6)
    arms = choices.pick("count", [5, 6, 8])
    r = max(0.008, 0.012 * w)
    parts: list[Solid] = [tube([[0, body * 0.1, 0], [0, h, 0]], r, "metal")]
    parts.append(ball((0, body * 0.22, 0), (w * 0.07, body * 0.14, d * 0.07), "metal"))
    cup = min(0.07, w * 0.11)
    for angle in np.arange(arms) * 2 * np.pi / arms + np.pi / arms:
        c, s = np.cos(angle) * (w / 2 - cup), np.sin(angle) * (d / 2 - cup)
        heights = (0, 0.3), (0.45, 0.06), (0.85, 0.14), (1, 0.68 if style.taper > 0.55 else 0.42)
        parts.append(tube([[c * out, body * up, s * out] for out, up in heights], r * 0.9, "metal"))
        if style.taper > 0.55:
            parts += shade("cone", c, body * 0.5, s, cup, cup, body * 0.4, style)
        else:
            parts.append(ball((c, body * 0.55, s), (cup * 0.85, cup, cup * 0.85), "shade"))
    return parts


def _rings(size: Size, style: Style) -> list[Solid]:
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
    plate = _disc(0, h * 0.8, 0, w * 0.3, d * 0.3, h * 0.2)
    alike = max(w, d) / min(w, d) < 1.2
    if h > 0.35:
        stem = tube([[0, h * 0.45, 0], [0, h, 0]], 0.014, "metal")
        if choices.chance("form", 0.5):
            count = choices.pick("count", [3, 4, 6])
            parts: list[Solid] = [stem, _disc(0, h - 0.03, 0, w * 0.14, d * 0.14, 0.03)]
            r = min(0.09, w * 0.14, h * 0.25)
            kind, tall = _one_shade(replace(style, shade=_kind(style, "cylinder")), 2 * r, h * 0.45, h)
            for a in np.arange(count) * 2 * np.pi / count:
                x, z = np.cos(a) * (w / 2 - r), np.sin(a) * (d / 2 - r)
                parts.append(tube([[0, h * 0.5, 0], [x, tall, z]], 0.011, "metal"))
                parts += shade(kind, x, 0.0, z, r, r, tall, style)
            return parts
        one = shade(_kind(style, "sphere"), 0, 0, 0, w / 2, d / 2, h * 0.55, style)
        return [stem, _disc(0, h - 0.03, 0, w * 0.18, d * 0.18, 0.03), *one]
    kind = choices.pick("kind", ["panel", "bowl", "drum", "ring"], [0.3, 0.3, 0.25, 0.15])
    if not alike or (style.profile == "square" and kind == "panel"):
        glow = box((-w / 2, 0, -d / 2), (w / 2, h * 0.85, d / 2), "shade", min(0.03, h * 0.3) * style.softness)
        return [glow, box((-w * 0.42, h * 0.6, -d * 0.42), (w * 0.42, h, d * 0.42), "metal")]
    if kind == "ring":
        r = min(h * 0.3, w * 0.08)
        spokes = [box((-x, r, -z), (x, r + 0.03, z), "metal") for x, z in ((w / 2 - r, 0.012), (0.012, d / 2 - r))]
        return [_ring(w / 2 - r, d / 2 - r, r, r), *spokes, _disc(0, r, 0, w * 0.16, d * 0.16, h - r)]
    if kind == "bowl":
        high = w * 0.2, d * 0.2
        bowl = turned((0, h * 0.8, 0), (w / 2, d / 2), h * 0.8, high, rounding=0.02, turn=DOWN, material="shade")
        return [bowl, _disc(0, h * 0.78, 0, w * 0.42, d * 0.42, h * 0.22)]
    drum = _disc(0, 0, 0, w / 2, d / 2, h * 0.85, "shade")
    if style.tufting > 0.5:
        return [plate, drum, _disc(0, h * 0.3, 0, w * 0.515, d * 0.515, h * 0.15)]
    return [plate, drum]


def floor_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A foot, a straight pole, an arc, an angled arm or a tripod, and a shade."""
    w, h, d = size
    r = 0.012 * (0.8 + 0.4 * style.bulk)
    if max(w, d) / min(w, d) > 1.6 or w > 0.8:  # the shade of another would be a long oval
        return _arc(size, style, r)
    a, b = w / 2, d / 2
    kind, tall = _one_shade(style, min(w, d), h * (0.16 + 0.12 * style.taper), 0.4 * h)
    parts = shade(kind, 0, h - tall, 0, a, b, tall, style)
    if style.legs in ("splayed", "trestle", "tapered") and choices.chance("form", 0.6):
        hub = (h - tall) * 0.93
        for angle in np.arange(3) * 2 * np.pi / 3 + np.pi / 2:
            toe = [a * 0.95 * np.cos(angle), r, b * 0.95 * np.sin(angle)]
            parts.append(tube([toe, [0, hub, 0]], r * 1.3))
        return [*parts, tube([[0, hub, 0], [0, h - tall * 0.5, 0]], r, "metal")]
    parts.append(_disc(0, 0, 0, min(0.15, a * 0.8), min(0.15, b * 0.8), 0.025))
    pole = tube([[0, 0, 0], [0, h - tall * 0.5, 0]], r, "metal")
    if style.contrast > 0.75:
        parts.append(_disc(0, h * 0.32, 0, a * 0.7, b * 0.7, 0.02, "wood"))
    return [*parts, pole]


def _arc(size: Size, style: Style, r: float) -> list[Solid]:
    """A bow from a heavy foot to a hanging shade, from corner to corner of its box."""
    w, h, d = size
    long, short = max(w, d), min(w, d)
    head, foot = min(short * 0.5, long * 0.2, 0.22), min(0.15, short * 0.45, long * 0.3)
    start, end = np.array([-w / 2 + foot, -d / 2 + foot]), np.array([w / 2 - head, d / 2 - head])
    t = np.linspace(0, 1, 13)
    rise = 0.03 + (h - 0.03) * np.sin(np.pi * (0.5 * t**0.6 + 0.12 * t)) / np.sin(np.pi * 0.5)
    plan = start + (end - start) * t[:, None]
    sweep = np.insert(plan, 1, np.minimum(rise, h), axis=1)
    x, high, z = sweep[-1]
    tall = min(0.3, head * 1.3)
    return [
        _disc(start[0], 0, start[1], foot, foot, 0.03, role="foot"),
        tube(sweep, r, "metal", "stem"),
        tube([[x, high, z], [x, high - 0.5 * tall, z]], r, "metal", "stem"),
        *shade(_kind(style, "cylinder"), x, high - tall, z, head, head, tall, style),
    ]


def table_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A vase, a column, balls or a tripod under a shade; or a desk lamp with an elbow."""
    w, h, d = size
    a, b = w / 2, d / 2
    if style.family == "industrial" and choices.chance("form", 0.6):
        r = 0.008
        arm = tube([[0, 0.02, -b * 0.6], [0, h * 0.6, -b * 0.8], [0, h * 0.95, b * 0.3]], r, "metal")
        head = shade("cone", 0, h * 0.72, b * 0.5, a * 0.55, b * 0.5, h * 0.22, style)
        return [_disc(0, 0, -b * 0.5, a * 0.7, b * 0.5, 0.02), arm, *head]
    kind, tall = _one_shade(style, min(w, d), h * (0.36 + 0.12 * style.taper), 0.6 * h)
    parts = shade(kind, 0, h - tall, 0, a, b, tall, style)
    stem = h - tall
    body = choices.pick("kind", ["vase", "column", "balls", "cone"])
    if body == "vase":
        parts.append(ball((0, stem * 0.42, 0), (a * 0.5, stem * 0.42, b * 0.5), "ceramic", power=2.3))
        parts.append(_disc(0, 0, 0, a * 0.3, b * 0.3, stem * 0.1, "ceramic"))
    elif body == "balls":
        for y, s in ((0.22, 0.42), (0.55, 0.32), (0.82, 0.22)):
            parts.append(ball((0, stem * y, 0), (a * s, stem * 0.2, b * s), "ceramic"))
        parts.append(_disc(0, 0, 0, a * 0.4, b * 0.4, stem * 0.08))
    elif body == "cone":
        parts.append(_disc(0, 0, 0, a * 0.5, b * 0.5, stem, "ceramic", 0.2))
    else:
        parts.append(_disc(0, 0, 0, a * 0.5, b * 0.5, max(0.012, stem * 0.06)))
        parts.append(_disc(0, 0, 0, a * 0.12, b * 0.12, stem))
    parts.append(tube([[0, stem * 0.7, 0], [0, stem + tall * 0.5, 0]], 0.012, "metal"))
    return parts


def wall_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A plate at the wall (-z), an arm and a shade; or a half cylinder; or two shades on a bar."""
    w, h, d = size
    plate = box((-min(w, h) * 0.18, h * 0.3, -d / 2), (min(w, h) * 0.18, h * 0.7, -d / 2 + 0.02), "metal")
    if w > h * 1.1:
        r = min(w * 0.22, d * 0.4)
        bar = tube([[-w / 2 + r, h * 0.3, d / 2 - r], [w / 2 - r, h * 0.3, d / 2 - r]], 0.01, "metal")
        arm = tube([[0, h * 0.4, -d / 2 + 0.01], [0, h * 0.3, d / 2 - r]], 0.01, "metal")
        glow = shade(_kind(style), w / 2 - r, h * 0.3, d / 2 - r, r, r, h * 0.7, style)
        return [plate, bar, arm, *both(*glow)]
    if choices.chance("form", 0.3):
        body = turned((0, 0, d * 0.1), (w / 2, d * 0.4), h, material="shade")
        return [body, box((-w * 0.2, h * 0.2, -d / 2), (w * 0.2, h * 0.8, d * 0.1), "metal")]
    b = d * 0.36
    bend = np.array([[0, h * 0.45, -d / 2 + 0.01], [0, h * 0.3, 0], [0, h * 0.4, d / 2 - b], [0, h * 0.7, d / 2 - b]])
    return [plate, tube(bend, 0.009, "metal"), *shade(_kind(style), 0, h * 0.45, d / 2 - b, w / 2, b, h * 0.55, style)]
