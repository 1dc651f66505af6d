"""Lamps of one shade that hang or stand on tables, and chandeliers."""

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size
from echomodel.furniture.shades import disc, one_shade, shade
from echomodel.furniture.solids import Solid, ball, rotation, tube
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late

row, rings = (Late(f"echomodel.furniture.ceiling_lamps:{name}") for name in ("row", "rings"))


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
        return row(size, style, choices)
    parts.append(disc(0, h - 0.025, 0, canopy, canopy, 0.025, role="canopy"))
    if w > 0.45 and (style.shade == "arms" or choices.chance("kind", 0.25)):
        return parts + chandelier(size, style, choices)
    if style.shade == "ring" and w > 0.4:
        return parts + rings(size, style)
    tall = min(h * 0.55, max(w * (0.4 + 0.4 * style.taper), h * 0.22))
    kind, tall = one_shade(style, min(w, d), tall, 0.75 * h)
    r = max(0.006, 0.012 * w)
    parts.append(tube([[0, tall * 0.9, 0], [0, h, 0]], r, "metal", "cord"))
    if kind == "drum" and style.tufting > 0.6:
        inner = disc(0, tall * 0.15, 0, w * 0.34, d * 0.34, tall * 0.5, "shade", role="shade")
        return [*parts, *shade(kind, 0, tall * 0.35, 0, w / 2, d / 2, tall * 0.65, style), inner]
    return parts + shade(kind, 0, 0, 0, w / 2, d / 2, tall, style)


def table_lamp(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A vase, a column, balls or a tripod under a shade; or a desk lamp with an elbow."""
    w, h, d = size
    a, b = w / 2, d / 2
    if style.family == "industrial" and choices.chance("form", 0.6):
        r = 0.008
        arm = tube([[0, 0.02, -b * 0.6], [0, h * 0.6, -b * 0.8], [0, h * 0.95, b * 0.3]], r, "metal")
        head = shade("cone", 0, h * 0.72, b * 0.5, a * 0.55, b * 0.5, h * 0.22, style)
        return [disc(0, 0, -b * 0.5, a * 0.7, b * 0.5, 0.02), arm, *head]
    kind, tall = one_shade(style, min(w, d), h * (0.36 + 0.12 * style.taper), 0.6 * h)
    parts = shade(kind, 0, h - tall, 0, a, b, tall, style)
    stem = h - tall
    body = choices.pick("kind", ["vase", "column", "balls", "cone"])
    if body == "vase":
        parts.append(ball((0, stem * 0.42, 0), (a * 0.5, stem * 0.42, b * 0.5), "ceramic", power=2.3))
        parts.append(disc(0, 0, 0, a * 0.3, b * 0.3, stem * 0.1, "ceramic"))
    elif body == "balls":
        for y, s in ((0.22, 0.42), (0.55, 0.32), (0.82, 0.22)):
            parts.append(ball((0, stem * y, 0), (a * s, stem * 0.2, b * s), "ceramic"))
        parts.append(disc(0, 0, 0, a * 0.4, b * 0.4, stem * 0.08))
    elif body == "cone":
        parts.append(disc(0, 0, 0, a * 0.5, b * 0.5, stem, "ceramic", 0.2))
    else:
        parts.append(disc(0, 0, 0, a * 0.5, b * 0.5, max(0.012, stem * 0.06)))
        parts.append(disc(0, 0, 0, a * 0.12, b * 0.12, stem))
    parts.append(tube([[0, stem * 0.7, 0], [0, stem + tall * 0.5, 0]], 0.012, "metal"))
    return parts


def chandelier(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Curved arms round a stem, a candle or a small shade on each."""
    w, h, d = size
    body = min(h * 0.55, w * 0.6)
    arms = choices.pick("count", [5, 6, 8])
    r = max(0.008, 0.012 * w)
    parts: list[Solid] = [tube([[0, body * 0.1, 0], [0, h, 0]], r, "metal")]
    parts.append(ball((0, body * 0.22, 0), (w * 0.07, body * 0.14, d * 0.07), "metal"))
    cup = min(0.07, w * 0.11)
    bend = np.polyfit((0, 0.45, 0.85, 1), (0.3, 0.06, 0.14, 0.68 if style.taper > 0.55 else 0.42), 3)
    ups = np.polyval(bend, outs := np.linspace(0, 1, 9) ** 0.8)
    for angle in np.arange(arms) * 2 * np.pi / arms + np.pi / arms:
        c, s = np.cos(angle) * (w / 2 - cup), np.sin(angle) * (d / 2 - cup)
        parts.append(tube([[c * out, body * up, s * out] for out, up in zip(outs, ups, strict=True)], r * 0.9, "metal"))
        if style.taper > 0.55:
            parts += shade("cone", c, body * 0.5, s, cup, cup, body * 0.4, style)
        else:
            parts.append(ball((c, body * 0.55, s), (cup * 0.85, cup, cup * 0.85), "shade"))
    return parts
