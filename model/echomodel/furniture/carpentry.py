"""What all furniture shares: boards, cushions, tops, legs and bases; seats, leaning backs and slim arms of chairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.furniture.solids import IDENTITY, Block, Bow, Pad, Solid, Turned, ball, rotation, tube, turned, upright
from echomodel.furniture.style import Style

Size = np.ndarray  # (3,) width x, height y, depth z, metres


def box(low: tuple, high: tuple, material: str = "wood", radius: float = 0.0, role: str = "board") -> Block:
    """The block between two corners (3,)."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    return Block(centre=(a + b) / 2, half=np.maximum((b - a) / 2, 1e-4), radius=radius, material=material, role=role)


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


def cushion(
    low: tuple, high: tuple, style: Style, material: str = "fabric", turn: np.ndarray = IDENTITY, role: str = "seat"
) -> Pad:
    """An upholstered body between two corners: its edges rounded as far as the style is soft, bulging at most."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    half = np.maximum((b - a) / 2, 1e-3)
    radius, crown = (float(half.min() * (low + more * style.softness)) for low, more in ((0.25, 0.55), (0.05, 0.2)))
    return Pad((a + b) / 2, turn, material, role, half=half, radius=radius, crown=crown)


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
        return _trestle(x, z, h, thick)
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


def _trestle(x: float, z: float, h: float, thick: float) -> list[Solid]:
    t, side = thick / 2, x * 0.82
    slanted = turned((side, thick * 0.5, z * 0.25), t, h - thick, power=np.inf, turn=rotation(x=-0.12))
    trestles = both(
        box((side - t, 0, -z), (side + t, thick, z)),
        box((side - t, h - thick, -z * 0.9), (side + t, h, z * 0.9)),
        *both(slanted, axis=2),
        box((side - t * 0.8, h * 0.45, -z * 0.25), (side + t * 0.8, h * 0.45 + thick, z * 0.25)),
    )
    return [*trestles, box((-side, h * 0.45, -t), (side, h * 0.45 + thick, t))]


def pedestal(width: float, depth: float, height: float, style: Style) -> list[Solid]:
    """A column on a disc or a cross of feet, from the floor to `height`."""
    r = max(0.025, 0.055 * style.bulk * min(width, depth) ** 0.5)
    material = "metal" if style.family in ("modern", "industrial") else "wood"
    spread = min(width, depth) * 0.32
    parts: list[Solid] = [turned((0, 0, 0), r, height, r * 0.8, material=material)]
    if style.family in ("classic", "rustic"):
        foot = [0.7 * spread, height * 0.14, 0.63 * spread], [0.91 * spread, r * 0.6, 0.91 * spread]
        parts += four(tube([[0, height * 0.3, 0], *foot], r * 0.6))
        parts.append(ball((0, height * 0.55, 0), (r * 1.5, height * 0.12, r * 1.5)))
    elif style.contrast > 0.6:
        parts.append(turned((0, 0, 0), spread * 0.95, height * 0.95, r, material=material))
    else:
        parts.append(turned((0, 0, 0), spread, max(0.015, height * 0.04), spread * 0.9, material=material))
    return of_role("leg", parts)


def seat_of(style: Style, w: float, d: float, y: float, thick: float, z: float = 0.0) -> Solid:
    """A seat whose upper face lies at y: a board, or a cushion in soft styles."""
    if style.softness > 0.4:
        return cushion((-w / 2, y - thick, z - d / 2), (w / 2, y, z + d / 2), style, "fabric")
    shape = "corners" if style.corner > 0.35 else "square"
    board = top(shape, w, d, y, thick, style, "wood")
    return replace(board, centre=np.array([0, y - thick, z]), role="seat")


def leaning(
    low: tuple, high: tuple, rake: float, pivot_y: float, pivot_z: float, *, bow: float = 0.0, **look: Any
) -> Block:
    """A block that leans back by `rake` about the horizontal line through (pivot_y, pivot_z), bent by `bow` metres."""
    block = box(low, high, role="back", **look)
    if bow:
        block = Bow(block.centre, IDENTITY, block.material, "back", half=block.half, radius=block.radius, bow=bow)
    turn = rotation(x=-rake)
    pivot = np.array([0, pivot_y, pivot_z])
    return replace(block, centre=turn @ (block.centre - pivot) + pivot, turn=turn)


def back_rest(
    style: Style, kind: str, w: float, y0: float, y1: float, z: float, thick: float, rake: float
) -> list[Solid]:
    """The back of a chair from the seat's height y0 up to y1, its foot on the plane z, leaning back by `rake`."""
    length = (y1 - y0) / np.cos(rake)
    a = w / 2

    def lean(x0: float, x1: float, s0: float, s1: float, t: float, **kwargs) -> Block:
        return leaning((x0, y0 + s0 * length, z - t / 2), (x1, y0 + s1 * length, z + t / 2), rake, y0, z, **kwargs)

    post, bow = max(0.024, 0.03 * style.bulk), a * (0.12 + 0.14 * style.corner)
    if kind == "cushion":
        t = max(thick, 0.07 + 0.06 * style.softness)
        return [lean(-a, a, -0.05, 1, t, radius=0.05, material="fabric", bow=bow)]
    if kind == "panel":
        if style.softness > 0.5:
            soft = lean(-a, a, 0.12, 1, 0.05, radius=0.05, material="fabric", bow=bow)
            return [soft, *both(lean(a * 0.8 - post / 2, a * 0.8 + post / 2, -0.1, 0.4, post))]
        behind = max(0.0, post * 0.4 - 0.01)  # stiles thicker than the board stand out behind it, not before it
        stile = lean(a - post - post / 2, a - post + post / 2, -0.1, 0.5, post * 0.8)
        board = lean(-a, a, 0.0 if style.contrast < 0.5 else 0.3, 1, 0.025, radius=0.04, bow=bow)
        return [board, *both(replace(stile, centre=stile.centre - [0, 0, behind]))]
    if kind == "oval":
        t = 0.05
        stems = both(lean(a * 0.45 - post / 2, a * 0.45 + post / 2, -0.1, 0.4, post))
        middle = y0 + length * 0.62
        turn = rotation(x=-rake)
        centre = turn @ np.array([0, middle - y0, 0]) + [0, y0, z]
        return [*stems, ball(centre, (a * 0.95, length * 0.4, t / 2), "fabric", "back", 2.6, turn)]
    posts = both(lean(a - post / 2 - post / 2, a - post / 2 + post / 2, -0.08, 1, post, radius=0.006))
    rail = 0.1 + 0.12 * style.contrast
    if kind == "frame":
        posts += [lean(-a, a, s, t, post * 0.8, bow=bow) for s, t in ((1 - rail, 1), (0.2, 0.2 + rail * 0.6))]
        inner, s, t = a - post * 0.6, 0.2 + rail * 0.3, 1 - rail * 0.5
        return [*posts, lean(-inner, inner, s, t, post * 1.3, material="fabric", radius=0.012, bow=bow)]  # padded
    if kind == "rails":
        count = int(2 + 2.99 * style.tufting)
        for i in range(count):
            s0 = 0.2 + (0.98 - 0.2) * i / count
            posts.append(lean(-a, a, s0 + 0.04, s0 + 0.78 / count * 0.72, post * 0.7, bow=bow))
        return posts
    posts.append(lean(-a, a, 1 - rail, 1, post * 0.9, bow=bow))
    count = int(3 + 4.99 * style.tufting)
    for x in np.linspace(-a * 0.78, a * 0.78, count):
        further = np.arctan(bow * (1 - (x / a) ** 2) / length)  # from the seat to the rail, which is bent
        t, tall = post * 0.3, (1 - rail / 2) * length
        low, high = (x - t, y0 - 0.03, z - t), (x + t, y0 + tall, z + t)
        posts.append(leaning(low, high, rake + further, y0, z, radius=0.004))
    return posts


def chair_legs(style: Style, w: float, d: float, h: float, thick: float, *, tie: bool = True) -> list[Solid]:
    kind = style.legs if style.legs not in ("plinth", "bun", "trestle") else "straight"
    return base(style, w, d, h, thick, kind, tie=tie and style.contrast > 0.55 and kind not in ("sled", "hairpin"))


def slim_arms(w: float, d: float, seat: float, h: float, style: Style, thick: float) -> list[Solid]:
    y = seat + min(0.22, (h - seat) * 0.55)
    x, z0, z1 = w / 2 - thick, -d * 0.4, d * 0.34
    rest = box((x - thick * 0.8, y - thick, z0), (x + thick * 0.8, y, z1), "wood", 0.008)
    stay = leg((x, seat - 0.08, z1 - thick), (x, y - thick * 0.5, z1 - thick), thick, style)
    return of_role("arm", both(rest, stay))
