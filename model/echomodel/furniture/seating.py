"""Seats, leaning backs, legs and slim arms of chairs and sofas."""

from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.furniture.bent import Bow
from echomodel.furniture.carpentry import Kind, base, both, box, leg, of_role, top
from echomodel.furniture.pads import cushion
from echomodel.furniture.solids import IDENTITY, Block, Solid, ball, rotation
from echomodel.furniture.style import Style


def seat_of(style: Style, w: float, d: float, y: float, thick: float, z: float = 0.0) -> Solid:
    """A seat whose upper face lies at y: a board, or a cushion in soft styles."""
    if style.softness > 0.4:
        return cushion((-w / 2, y - thick, z - d / 2), (w / 2, y, z + d / 2), style, "fabric")
    thin = min(thick, 0.03)
    board = top("corners", w, d, y, thin, style, "wood")
    return replace(board, centre=np.array([0, y - thin, z]), rounding=0.3 * thin, role="seat")


def leaning(
    low: tuple, high: tuple, rake: float, pivot_y: float, pivot_z: float, *, bow: float = 0.0, **look: Any
) -> Block:
    """A block that is `leaned`, bent by `bow` metres."""
    block = box(low, high, role="back", **look)
    if bow:
        block = Bow(block.centre, IDENTITY, block.material, "back", half=block.half, radius=block.radius, bow=bow)
    return leaned(block, rake, pivot_y, pivot_z)


def leaned(block: Kind, rake: float, pivot_y: float, pivot_z: float) -> Kind:
    """The block leaning back by `rake` about the horizontal line through (pivot_y, pivot_z)."""
    turn, pivot = rotation(x=-rake), np.array([0, pivot_y, pivot_z])
    return replace(block, centre=turn @ (block.centre - pivot) + pivot, turn=turn @ block.turn)


def back_rest(
    style: Style, kind: str, w: float, y0: float, y1: float, z: float, thick: float, rake: float
) -> list[Solid]:
    """The back of a chair from the seat's height y0 up to y1, its foot on the plane z, leaning back by `rake`."""
    length = (y1 - y0) / np.cos(rake)
    a = w / 2

    def lean(x0: float, x1: float, s0: float, s1: float, t: float, **kwargs) -> Block:
        return leaning((x0, y0 + s0 * length, z - t / 2), (x1, y0 + s1 * length, z + t / 2), rake, y0, z, **kwargs)

    post, bow = max(0.024, 0.03 * style.bulk), a * (0.2 + 0.14 * style.corner)
    if kind == "cushion":
        t = max(thick, 0.07 + 0.06 * style.softness)
        return [lean(-a, a, -0.05, 1, t, radius=0.05, material="fabric", bow=bow)]
    if kind == "panel":
        if style.softness > 0.5:
            soft = lean(-a, a, 0.12, 1, 0.05, radius=0.05, material="fabric", bow=bow)
            return [soft, *both(lean(a * 0.8 - post / 2, a * 0.8 + post / 2, -0.1, 0.4, post))]
        behind = max(0.0, post * 0.4 - 0.01)  # stiles thicker than the board stand out behind it, not before it
        stile = lean(a - post - post / 2, a - post + post / 2, -0.1, 0.5, post * 0.8)
        board = lean(-a, a, 0.2 if style.contrast < 0.5 else 0.4, 1, 0.025, radius=0.04, bow=bow)
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


def slim_arms(
    w: float, d: float, seat: float, h: float, style: Style, thick: float, rail: float | None = None
) -> list[Solid]:
    """Boards to lean on, each on a stay from beside the seat, or on two from the height of a `rail` that carries it."""
    y = seat + min(0.22, (h - seat) * 0.55)
    x, z0, z1 = w / 2 - thick, -d * 0.4, d * (0.34 if rail is None else 0.42)
    rest = box((x - thick * 0.8, y - thick * 0.7, z0), (x + thick * 0.8, y, z1), "wood", 0.008)
    foot, ends = (seat - 0.08, (z1,)) if rail is None else (rail, (z1, z0 + 2.5 * thick))
    stays = [leg((x, foot, z - thick), (x, y - thick * 0.4, z - thick), thick, style) for z in ends]
    return of_role("arm", both(rest, *stays))
