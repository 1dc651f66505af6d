"""Lamps that stand on the floor or stand out from a wall."""

import numpy as np

from echomodel.furniture.carpentry import Size, both, box
from echomodel.furniture.shades import disc, kind_of, one_shade, shade
from echomodel.furniture.solids import Solid, tube, turned
from echomodel.furniture.style import Choices, Style


def floor_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A foot, a straight pole, an arc, an angled arm or a tripod, and a shade."""
    w, h, d = size
    r = 0.012 * (0.8 + 0.4 * style.bulk)
    if max(w, d) / min(w, d) > 1.6 or w > 0.8:  # the shade of another would be a long oval
        return _arc(size, style, r)
    a, b = w / 2, d / 2
    kind, tall = one_shade(style, min(w, d), h * (0.16 + 0.12 * style.taper), 0.4 * h)
    parts = shade(kind, 0, h - tall, 0, a, b, tall, style)
    if style.legs in ("splayed", "trestle", "tapered") and choices.chance("form", 0.6):
        hub = (h - tall) * 0.93
        for angle in np.arange(3) * 2 * np.pi / 3 + np.pi / 2:
            toe = [a * 0.95 * np.cos(angle), r, b * 0.95 * np.sin(angle)]
            parts.append(tube([toe, [0, hub, 0]], r * 1.3))
        return [*parts, tube([[0, hub, 0], [0, h - tall * 0.5, 0]], r, "metal")]
    parts.append(disc(0, 0, 0, min(0.15, a * 0.8), min(0.15, b * 0.8), 0.025))
    pole = tube([[0, 0, 0], [0, h - tall * 0.5, 0]], r, "metal")
    if style.contrast > 0.75:
        parts.append(disc(0, h * 0.32, 0, a * 0.7, b * 0.7, 0.02, "wood"))
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
        disc(start[0], 0, start[1], foot, foot, 0.03, role="foot"),
        tube(sweep, r, "metal", "stem"),
        tube([[x, high, z], [x, high - 0.5 * tall, z]], r, "metal", "stem"),
        *shade(kind_of(style, "cylinder"), x, high - tall, z, head, head, tall, style),
    ]


def wall_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A plate at the wall (-z), an arm and a shade; or a half cylinder; or two shades on a bar."""
    w, h, d = size
    plate = box((-min(w, h) * 0.18, h * 0.3, -d / 2), (min(w, h) * 0.18, h * 0.7, -d / 2 + 0.02), "metal")
    if w > h * 1.1:
        r = min(w * 0.22, d * 0.4)
        bar = tube([[-w / 2 + r, h * 0.3, d / 2 - r], [w / 2 - r, h * 0.3, d / 2 - r]], 0.01, "metal")
        arm = tube([[0, h * 0.4, -d / 2 + 0.01], [0, h * 0.3, d / 2 - r]], 0.01, "metal")
        return [plate, bar, arm, *both(*shade(kind_of(style), w / 2 - r, h * 0.3, d / 2 - r, r, r, h * 0.7, style))]
    if choices.chance("form", 0.3):
        body = turned((0, 0, d * 0.1), (w / 2, d * 0.4), h, material="shade")
        return [body, box((-w * 0.2, h * 0.2, -d / 2), (w * 0.2, h * 0.8, d * 0.1), "metal")]
    b = d * 0.36
    bend = np.array([[0, h * 0.45, -d / 2 + 0.01], [0, h * 0.3, 0], [0, h * 0.4, d / 2 - b], [0, h * 0.7, d / 2 - b]])
    return [
        plate,
        tube(bend, 0.009, "metal"),
        *shade(kind_of(style), 0, h * 0.45, d / 2 - b, w / 2, b, h * 0.55, style),
    ]
