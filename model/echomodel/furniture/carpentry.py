"""What all furniture shares: boards, tops, legs and bases."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from echomodel.furniture.solids import Block, Solid, Turned, Vector, ball, rotation, tube, turned, upright
from echomodel.furniture.style import Style

Size = np.ndarray  # (3,) width x, height y, depth z, metres
Kind = TypeVar("Kind", bound=Block)


def between(kind: type[Kind], low: Vector, high: Vector, **form: Any) -> Kind:
    """The block of a kind between two corners (3,)."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    return kind(centre=(a + b) / 2, half=np.maximum((b - a) / 2, 1e-4), **form)


def box(low: Vector, high: Vector, material: str = "wood", radius: float = 0.0, role: str = "board") -> Block:
    """The block between two corners (3,)."""
    return between(Block, low, high, material=material, radius=radius, role=role)


def post(
    x: float, z: float, half: float, y0: float, y1: float, material: str = "wood", radius: float = 0.0,
    role: str = "board",
) -> Block:  # fmt: skip
    """An upright of square section about (x, z), from y0 to y1."""
    return box((x - half, y0, z - half), (x + half, y1, z + half), material, radius, role)


def both(*parts: Solid, axis: int = 0) -> list[Solid]:
    """Parts and before them what they are on the other side of the plane x = 0, or of z = 0 (axis 2)."""
    return [*(part.mirrored(axis) for part in parts), *parts]


def four(part: Solid) -> list[Solid]:
    """What stands at one corner, at all four: behind and in front at the left, then at the right."""
    return both(*both(part, axis=2))


def around(
    outer: tuple, inner: tuple, low: float, high: float, material: str, role: str, radius: float = 0.0
) -> list[Solid]:
    """Four bars from a height to another about a hole: two rectangles (x0, x1, z0, z1), the long bars along x."""
    (a, b, c, d), (x0, x1, z0, z1) = outer, inner
    bars = ((a, b, c, z0), (a, b, z1, d), (a, x0, z0 - radius, z1 + radius), (x1, b, z0 - radius, z1 + radius))
    return [box((p, low, r), (q, high, s), material, radius, role) for p, q, r, s in bars]


def framed(low: tuple, high: tuple, bar: float, material: str, role: str = "board") -> list[Solid]:
    """Four bars, `bar` wide, of a frame that stands upright between two corners (3,): left, right, below, above."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ends = (x0, x0 + bar, y0, y1), (x1 - bar, x1, y0, y1), (x0, x1, y0, y0 + bar), (x0, x1, y1 - bar, y1)
    return [box((a, c, z0), (b, d, z1), material, 0.002, role) for a, b, c, d in ends]


def core(low: tuple, high: tuple, material: str = "wood") -> Block:
    """What boards enclose between two corners (3,): a body for distances, without a mesh (`Solid.core`)."""
    return replace(box(low, high, material), core=True)


def of_role(role: str, parts: Sequence[Solid], **changes: Any) -> list[Solid]:
    """The parts with this role and other fields changed."""
    return [replace(part, role=role, **changes) for part in parts]


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
    bevelled = style.edge > 0.4 and material != "fabric"  # below, so that it looks less thick
    under = bevelled * min(0.5 * thick, 0.012 * min(width, depth))
    form = {"power": power, "rounding": rounding, "material": material, "role": "top"}
    return turned((0.0, y - thick, 0.0), (half[0] - under, half[1] - under), thick, half, **form)


def leg(foot: tuple, head: tuple, thick: float, style: Style, material: str = "wood", taper: float = 1.0) -> Turned:
    """A leg from the floor to `head` (both (3,)), `thick` at its head and `taper` times that at the foot."""
    bottom, above = np.asarray(foot, float), np.asarray(head, float)
    power = 2.0 if style.profile == "round" else np.inf
    half = thick / 2
    length, turn = float(np.linalg.norm(above - bottom)), upright(bottom, above)
    return turned(bottom, half * taper, length, half, power=power, turn=turn, material=material)


def turned_leg(x: float, z: float, height: float, thick: float) -> list[Solid]:
    """A leg off the lathe: a slim foot, a swelling shaft, a ring and a square head."""
    r = thick / 2

    def section(y0: float, y1: float, low: float, high: float, power: float = 2.0) -> Turned:
        return turned((x, y0 * height, z), low * r, (y1 - y0) * height, high * r, power=power)

    ring = ball((x, 0.68 * height, z), (1.25 * r, 0.45 * r, 1.25 * r))
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


def _stand(
    style: Style, width: float, depth: float, height: float, thick: float, kind: str, *, tie: bool
) -> list[Solid]:
    x, z, h = width / 2 - thick / 2, depth / 2 - thick / 2, height
    if kind == "plinth":
        return [box((-width / 2 * 0.94, 0, -depth / 2 * 0.94), (width / 2 * 0.94, h, depth / 2 * 0.9), "accent")]
    if kind == "bun":
        return four(ball((x, h / 2 + 0.004, z), (thick * 0.8, h / 2 + 0.004, thick * 0.8), power=2.5))
    if kind == "turned":
        return [part for sx in (-x, x) for sz in (-z, z) for part in turned_leg(sx, sz, h, thick * 1.15)]
    if kind == "sled":
        t = max(thick * 0.3, 0.008)
        low, high = (box((x - t, y, -z), (x + t, y + 2 * t, z), "metal") for y in (0, h - 2 * t))
        return both(low, *(post(x, end, t, 0, h, "metal") for end in (-z, z)), high)
    if kind == "trestle":
        t, side = thick / 2, x * 0.82
        slanted = turned((side, thick * 0.5, z * 0.25), t, h - thick, power=np.inf, turn=rotation(x=-0.12))
        trestles = both(
            box((side - t, 0, -z), (side + t, thick, z)),
            box((side - t, h - thick, -z * 0.9), (side + t, h, z * 0.9)),
            *both(slanted, axis=2),
            box((side - t * 0.8, h * 0.45, -z * 0.25), (side + t * 0.8, h * 0.45 + thick, z * 0.25)),
        )
        return [*trestles, box((-side, h * 0.45, -t), (side, h * 0.45 + thick, t))]
    if kind == "hairpin":
        r, d = max(0.006, thick * 0.16), min(0.12, width * 0.12)
        return four(tube([[x - d, h, z], [x, r, z], [x, h, z - d]], r, "metal"))
    spread = np.tan(style.splay) * h if kind == "splayed" else 0.0
    spread = min(spread, 0.3 * min(width, depth))
    taper = style.taper if kind in ("tapered", "splayed") else 1.0
    material = "metal" if style.family == "industrial" else "wood"
    parts = four(leg((x, 0, z), (x - spread, h, z - spread), thick, style, material, taper))
    if tie and h > 0.3:
        y, t = h * 0.35, thick * 0.35
        mx, mz = x - spread * 0.35, z - spread * 0.35
        parts += both(box((mx - t, y - t, -mz), (mx + t, y + t, mz), material))
        parts.append(box((-mx, y - t, -t), (mx, y + t, t), material))
    return parts
