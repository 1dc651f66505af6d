"""What all furniture shares: boards, cushions, tops, legs and bases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.furniture.solids import IDENTITY, Block, Solid, Turned, ball, rotation, tube, turned, upright
from echomodel.furniture.style import Style

Size = np.ndarray  # (3,) width x, height y, depth z, metres


def box(low: tuple, high: tuple, material: str = "wood", radius: float = 0.0, role: str = "board") -> Block:
    """The block between two corners (3,)."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    return Block(centre=(a + b) / 2, half=np.maximum((b - a) / 2, 1e-4), radius=radius, material=material, role=role)


def post(
    x: float,
    z: float,
    half: float,
    y0: float,
    y1: float,
    material: str = "wood",
    radius: float = 0.0,
    role: str = "board",
) -> Block:
    """An upright of square section about (x, z), from y0 to y1."""
    return box((x - half, y0, z - half), (x + half, y1, z + half), material, radius, role)


def around(
    outer: tuple, inner: tuple, low: float, high: float, material: str, role: str, radius: float = 0.0
) -> list[Solid]:
    """Four bars from a height to another about a hole: two rectangles (x0, x1, z0, z1), the long bars along x."""
    (a, b, c, d), (x0, x1, z0, z1) = outer, inner
    bars = ((a, b, c, z0), (a, b, z1, d), (a, x0, z0 - radius, z1 + radius), (x1, b, z0 - radius, z1 + radius))
    return [box((p, low, r), (q, high, s), material, radius, role) for p, q, r, s in bars]


def core(low: tuple, high: tuple, material: str = "wood") -> Block:
    """What boards enclose between two corners (3,): a body for distances, without a mesh (`Solid.core`)."""
    return replace(box(low, high, material), core=True)


def of_role(role: str, parts: Sequence[Solid], **changes: Any) -> list[Solid]:
    """The parts with this role and other fields changed."""
    return [replace(part, role=role, **changes) for part in parts]


def cushion(
    low: tuple, high: tuple, style: Style, material: str = "fabric", turn: np.ndarray = IDENTITY, role: str = "seat"
) -> Solid:
    """An upholstered body between two corners: its edges rounded as far as the style is soft, bulging at most."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    centre, half = (a + b) / 2, np.maximum((b - a) / 2, 1e-3)
    if style.softness > 0.85 and half.min() / half.max() > 0.12:
        return ball(centre, half * 1.02, material, role, power=5.0, turn=turn)
    radius = float(half.min() * (0.25 + 0.7 * style.softness))
    return Block(centre=centre, half=half, radius=radius, turn=turn, material=material, role=role)


def corner_power(style: Style) -> float:
    """Exponent of a superellipse with corners as round as the style has them."""
    return 5.0 + 6 * (1 - style.corner)


def within(shape: str, style: Style) -> float:
    """Share of a top's width and depth inside which legs at the four corners stay below it."""
    return {"square": 0.97, "corners": 0.98 * 2 ** (-1 / corner_power(style)), "round": 0.68}[shape]


def top(shape: str, width: float, depth: float, y: float, thick: float, style: Style, material: str = "wood") -> Turned:
    """A table top whose upper face lies at `y`: `square`, `corners` (rounded) or `round` (circle or oval)."""
    half = (width / 2, depth / 2)
    power = {"square": np.inf, "corners": corner_power(style), "round": 2.0}[shape]
    rounding = 0.0 if shape == "square" else thick * 0.3 * style.softness
    return turned((0.0, y - thick, 0.0), half, thick, power=power, rounding=rounding, material=material, role="top")


def leg(foot: tuple, head: tuple, thick: float, style: Style, material: str = "wood", taper: float = 1.0) -> Turned:
    """A leg from the floor to `head` (both (3,)), `thick` at its head and `taper` times that at the foot."""
    bottom, above = np.asarray(foot, float), np.asarray(head, float)
    power = 2.0 if style.profile == "round" else np.inf
    half = thick / 2
    return turned(
        bottom,
        half * taper,
        float(np.linalg.norm(above - bottom)),
        half,
        power=power,
        turn=upright(bottom, above),
        material=material,
    )


def turned_leg(x: float, z: float, height: float, thick: float, material: str = "wood") -> list[Solid]:
    """A leg off the lathe: a slim foot, a swelling shaft, a ring and a square head."""
    r = thick / 2

    def section(y0: float, y1: float, low: float, high: float, power: float = 2.0) -> Turned:
        return turned((x, y0 * height, z), low * r, (y1 - y0) * height, high * r, power=power, material=material)

    ring = ball((x, 0.68 * height, z), (1.25 * r, 0.45 * r, 1.25 * r), material)
    return [section(0, 0.08, 0.9, 0.55), section(0.08, 0.7, 0.55, 1.0), ring, section(0.7, 1, 1.05, 1.05, np.inf)]


def base(
    style: Style, width: float, depth: float, height: float, thick: float, kind: str | None = None, *, tie: bool = False
) -> list[Solid]:
    """What a top, seat or carcass stands on, from the floor to `height`, inside a footprint `width` by `depth`.

    Arguments:
        thick: thickness of a leg, metres.
        kind: a kind of `Style.legs` instead of the style's own.
        tie: stretchers between the legs where the kind allows them.
    """
    return of_role("leg", _stand(style, width, depth, height, thick, kind or style.legs, tie=tie))


def between_legs(
    shape: str, width: float, depth: float, height: float, y: float, thick: float, leg: float, style: Style, kind: str
) -> Solid:
    """A shelf at `y` that the legs of a `base` of this width, depth, height and kind pass through."""
    spread = min(np.tan(style.splay) * height, 0.3 * min(width, depth)) if kind == "splayed" else 0.0
    x, z = width / 2 - leg / 2 - spread * y / height, depth / 2 - leg / 2 - spread * y / height
    wider = 2**0.5 if shape == "round" else 1.0
    board = top("round" if shape == "round" else "square", 2 * x * wider, 2 * z * wider, y, thick, style, "accent")
    return replace(board, role="shelf")


def _stand(
    style: Style, width: float, depth: float, height: float, thick: float, kind: str, *, tie: bool
) -> list[Solid]:
    x, z, h = width / 2 - thick / 2, depth / 2 - thick / 2, height
    corners = [(sx * x, sz * z) for sx in (-1, 1) for sz in (-1, 1)]
    if kind == "plinth":
        return [box((-width / 2 * 0.94, 0, -depth / 2 * 0.94), (width / 2 * 0.94, h, depth / 2 * 0.9), "accent")]
    if kind == "bun":
        return [
            ball((cx, h / 2 + 0.004, cz), (thick * 0.8, h / 2 + 0.004, thick * 0.8), power=2.5) for cx, cz in corners
        ]
    if kind == "turned":
        return [part for cx, cz in corners for part in turned_leg(cx, cz, h, thick * 1.15)]
    if kind == "sled":
        return _sled(x, z, h, thick)
    if kind == "trestle":
        return _trestle(x, z, h, thick)
    if kind == "hairpin":
        r = max(0.006, thick * 0.16)
        return [
            tube([[cx - np.sign(cx) * d, h, cz], [cx, r, cz], [cx, h, cz - np.sign(cz) * d]], r, "metal")
            for cx, cz in corners
            for d in (min(0.12, width * 0.12),)
        ]
    spread = np.tan(style.splay) * h if kind == "splayed" else 0.0
    spread = min(spread, 0.3 * min(width, depth))
    taper = style.taper if kind in ("tapered", "splayed") else 1.0
    material = "metal" if style.family == "industrial" else "wood"
    inner = [(np.sign(cx) * (x - spread), np.sign(cz) * (z - spread)) for cx, cz in corners]
    parts: list[Solid] = [
        leg((cx, 0, cz), (ix, h, iz), thick, style, material, taper)
        for (cx, cz), (ix, iz) in zip(corners, inner, strict=True)
    ]
    if tie and h > 0.3:
        y, t = h * 0.35, thick * 0.35
        mx, mz = x - spread * 0.35, z - spread * 0.35
        parts += [box((s * mx - t, y - t, -mz), (s * mx + t, y + t, mz), material) for s in (-1, 1)]
        parts.append(box((-mx, y - t, -t), (mx, y + t, t), material))
    return parts


def _sled(x: float, z: float, h: float, thick: float) -> list[Solid]:
    t = max(thick * 0.3, 0.008)
    parts: list[Solid] = []
    for side in (-x, x):
        parts.append(box((side - t, 0, -z), (side + t, 2 * t, z), "metal"))
        parts += [post(side, end, t, 0, h, "metal") for end in (-z, z)]
        parts.append(box((side - t, h - 2 * t, -z), (side + t, h, z), "metal"))
    return parts


def _trestle(x: float, z: float, h: float, thick: float) -> list[Solid]:
    t = thick / 2
    parts: list[Solid] = []
    for side in (-x * 0.82, x * 0.82):
        parts.append(box((side - t, 0, -z), (side + t, thick, z)))
        parts.append(box((side - t, h - thick, -z * 0.9), (side + t, h, z * 0.9)))
        parts += [
            turned((side, thick * 0.5, s * z * 0.25), t, h - thick, power=np.inf, turn=rotation(x=-s * 0.12))
            for s in (-1, 1)
        ]
        parts.append(box((side - t * 0.8, h * 0.45, -z * 0.25), (side + t * 0.8, h * 0.45 + thick, z * 0.25)))
    parts.append(box((-x * 0.82, h * 0.45, -t), (x * 0.82, h * 0.45 + thick, t)))
    return parts


def pedestal(width: float, depth: float, height: float, style: Style) -> list[Solid]:
    """A column on a disc or a cross of feet, from the floor to `height`."""
    return of_role("leg", _column(width, depth, height, style))


def _column(width: float, depth: float, height: float, style: Style) -> list[Solid]:
    r = max(0.025, 0.055 * style.bulk * min(width, depth) ** 0.5)
    material = "metal" if style.family in ("modern", "industrial") else "wood"
    spread = min(width, depth) * 0.32
    column = turned((0, 0, 0), r, height, r * 0.8, material=material)
    if style.family in ("classic", "rustic"):
        feet: list[Solid] = [
            tube(
                [
                    [0, height * 0.3, 0],
                    [s * spread * c, height * 0.14, s * spread * d * 0.9],
                    [s * spread * 1.3 * c, r * 0.6, s * spread * 1.3 * d],
                ],
                r * 0.6,
            )
            for s in (-1, 1)
            for c, d in ((0.7, 0.7), (0.7, -0.7))
        ]
        bulb = ball((0, height * 0.55, 0), (r * 1.5, height * 0.12, r * 1.5))
        return [column, bulb, *feet]
    if style.contrast > 0.6:
        cone = turned((0, 0, 0), spread * 0.95, height * 0.95, r, material=material)
        return [cone, replace(column, height=height)]
    disc = turned((0, 0, 0), spread, max(0.015, height * 0.04), spread * 0.9, material=material)
    return [disc, column]
