"""What chairs are put together from: seats, leaning backs, legs and slim arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import base, both, box, cushion, leg, of_role, top
from echomodel.furniture.solids import Block, Solid, ball, rotation
from echomodel.furniture.style import Style


def seat_of(
    style: Style, w: float, d: float, y: float, thick: float, z: float = 0.0, material: str | None = None
) -> Solid:
    """A seat whose upper face lies at y: a board, or a cushion in soft styles."""
    soft = style.softness > 0.4
    low, high = (-w / 2, y - thick, z - d / 2), (w / 2, y, z + d / 2)
    if soft:
        return cushion(low, high, style, material or "fabric")
    shape = "corners" if style.corner > 0.35 else "square"
    board = top(shape, w, d, y, thick, style, material or "wood")
    return replace(board, centre=np.array([0, y - thick, z]), role="seat")


def leaning(low: tuple, high: tuple, rake: float, pivot_y: float, pivot_z: float, **kwargs) -> Block:
    """A block that leans back by `rake` about the horizontal line through (pivot_y, pivot_z)."""
    block = box(low, high, kwargs.get("material", "wood"), kwargs.get("radius", 0.0), "back")
    turn = rotation(x=-rake)
    pivot = np.array([0, pivot_y, pivot_z])
    return replace(block, centre=turn @ (block.centre - pivot) + pivot, turn=turn)


def back_rest(
    style: Style, kind: str, w: float, y0: float, y1: float, z: float, thick: float, rake: float
) -> list[Solid]:
    """The back of a chair from the seat's height y0 up to y1, its foot on the plane z, leaning back by `rake`."""
    return of_role("back", _back(style, kind, w, y0, y1, z, thick, rake))


def _back(style: Style, kind: str, w: float, y0: float, y1: float, z: float, thick: float, rake: float) -> list[Solid]:
    length = (y1 - y0) / np.cos(rake)
    a = w / 2

    def lean(x0: float, x1: float, s0: float, s1: float, t: float, **kwargs) -> Block:
        return leaning((x0, y0 + s0 * length, z - t / 2), (x1, y0 + s1 * length, z + t / 2), rake, y0, z, **kwargs)

    post = max(0.024, 0.03 * style.bulk)
    if kind == "cushion":
        t = max(thick, 0.07 + 0.06 * style.softness)
        return [lean(-a, a, -0.05, 1, t, radius=t * 0.45 * (0.4 + 0.6 * style.softness), material="fabric")]
    if kind == "panel":
        if style.softness > 0.5:
            soft = lean(-a, a, 0.12, 1, 0.05, radius=0.022, material="fabric")
            return [soft, *both(lean(a * 0.8 - post / 2, a * 0.8 + post / 2, -0.1, 0.4, post))]
        behind = max(0.0, post * 0.4 - 0.01)  # stiles thicker than the board stand out behind it, not before it
        stile = lean(a - post - post / 2, a - post + post / 2, -0.1, 0.5, post * 0.8)
        board = lean(-a, a, 0.0 if style.contrast < 0.5 else 0.3, 1, 0.025, radius=0.01)
        return [board, *both(replace(stile, centre=stile.centre - [0, 0, behind]))]
    if kind == "oval":
        t = 0.05
        stems = both(lean(a * 0.45 - post / 2, a * 0.45 + post / 2, -0.1, 0.4, post))
        middle = y0 + length * 0.62
        turn = rotation(x=-rake)
        centre = turn @ np.array([0, middle - y0, 0]) + [0, y0, z]
        return [*stems, ball(centre, (a * 0.95, length * 0.4, t / 2), "fabric", power=2.6, turn=turn)]
    posts = both(lean(a - post / 2 - post / 2, a - post / 2 + post / 2, -0.08, 1, post))
    rail = 0.1 + 0.12 * style.contrast
    if kind == "frame":
        posts += [lean(-a, a, 1 - rail, 1, post * 0.8), lean(-a, a, 0.2, 0.2 + rail * 0.6, post * 0.8)]
        inner, pad = a - post * 0.6, post * 1.3  # padded on both faces of the frame
        return [*posts, lean(-inner, inner, 0.2 + rail * 0.3, 1 - rail * 0.5, pad, material="fabric", radius=0.012)]
    if kind == "rails":
        count = int(2 + 2.99 * style.tufting)
        for i in range(count):
            s0 = 0.2 + (0.98 - 0.2) * i / count
            posts.append(lean(-a, a, s0 + 0.04, s0 + 0.78 / count * 0.72, post * 0.7))
        return posts
    posts.append(lean(-a, a, 1 - rail, 1, post * 0.9))
    count = int(3 + 4.99 * style.tufting)
    for x in np.linspace(-a * 0.78, a * 0.78, count):
        posts.append(lean(x - post * 0.3, x + post * 0.3, 0, 1 - rail / 2, post * 0.6))
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
