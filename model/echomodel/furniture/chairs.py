"""Seats: dining, plain, Chinese, dressing, bar and office chairs; without a back stools, benches and ottomans."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from echomodel.furniture.carpentry import (
    Size,
    back_rest,
    base,
    both,
    box,
    chair_legs,
    cushion,
    four,
    leaning,
    of_role,
    seat_of,
    slim_arms,
    top,
    within,
)
from echomodel.furniture.solids import Block, Solid, ball, bent, rotation, tube, turned
from echomodel.furniture.style import Choices, Style


def stool(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A round or square seat on legs, a drum, or an hourglass."""
    w, h, d = size
    alike = max(w, d) / min(w, d) < 1.15
    shape = "round" if alike and style.round_tops > 0.4 else "corners"
    if alike and choices.chance("kind", 0.15):
        waist = 0.3 + 0.15 * style.taper
        return [
            turned((0, 0, 0), (w * 0.48, d * 0.48), h / 2, (w * waist, d * waist)),
            turned((0, h / 2, 0), (w * waist, d * waist), h / 2, (w / 2, d / 2)),
        ]
    thick = min(0.03 + 0.07 * style.softness, h * 0.4)
    legs = style.legs if style.legs not in ("plinth", "bun", "trestle") else "tapered"
    board = top(shape, w, d, h, thick, style, "fabric" if style.softness > 0.4 else "wood")
    outside = legs == "splayed"  # feet may reach beyond the seat, their heads do not
    inner = 0.8 if outside and shape == "round" else within(shape, style)
    stand = base(style, w * inner, d * inner, h - thick * 0.8, 0.032 * style.bulk, legs, tie=style.contrast > 0.5)
    return [replace(board, rounding=thick * 0.4, role="seat"), *stand]


def bench(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Long, without a back: a board or an upholstered seat on legs, or a chest with a cushion."""
    w, h, d = size
    thick = 0.035 + 0.09 * style.softness
    if choices.chance("kind", 0.2):
        return [
            box((-w / 2 * 0.98, 0.03, -d / 2 * 0.96), (w / 2 * 0.98, h - 0.08, d / 2 * 0.96), "fabric", 0.01, "base"),
            cushion((-w / 2, h - 0.1, -d / 2), (w / 2, h, d / 2), style),
            *base(style, w * 0.9, d * 0.9, 0.03, 0.05, "plinth"),
        ]
    legs = style.legs if style.legs not in ("plinth", "bun") else "straight"
    rounded = style.softness <= 0.4 and style.corner > 0.35
    share = within("corners", style) if rounded else 0.94
    stand = base(style, w * share, d * share * 0.98, h - thick * 0.8, 0.045 * style.bulk, legs)
    return [seat_of(style, w, d, h, thick), *stand]


def ottoman(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """An upholstered block, drum or pouf, on short legs or on the floor."""
    w, h, d = size
    alike = max(w, d) / min(w, d) < 1.15
    foot = min(style.leg_height, h * 0.4) if choices.chance("raised", 0.65) else 0.0
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled", "plinth") else "tapered"
    inner = 0.64 if alike and style.round_tops > 0.45 else 0.8
    tall = foot + min(0.03, h * 0.1)
    parts = base(style, w * inner, d * inner, tall, 0.04 * style.bulk, kind) if foot else []
    if alike and style.round_tops > 0.45:
        if foot == 0 and style.softness > 0.6:
            return [ball((0, h / 2, 0), (w / 2, h / 2, d / 2), "fabric", "seat", power=2.6)]
        soft = 0.1 * h + 0.15 * h * style.softness
        return [*parts, turned((0, foot, 0), (w / 2, d / 2), h - foot, rounding=soft, material="fabric", role="seat")]
    split = foot + (h - foot) * 0.5
    return [
        *parts,
        box((-w / 2 * 0.97, foot, -d / 2 * 0.97), (w / 2 * 0.97, split + 0.02, d / 2 * 0.97), "fabric", 0.012, "base"),
        cushion((-w / 2, split, -d / 2), (w / 2, h, d / 2), style),
    ]


def dining_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Four legs or a sled, a seat, and the style's back; sometimes slim arms."""
    w, h, d = size
    seat = float(np.clip(0.46, 0.4 * h, 0.62 * h))
    thick = 0.035 + 0.05 * style.softness
    rake = style.rake * 0.8
    leg_thick = 0.038 * style.bulk
    sw, sd = w * 0.94, d * 0.9
    parts: list[Solid] = [seat_of(style, sw, sd, seat, thick, d * 0.04)]
    parts += chair_legs(style, w * 0.86, d * 0.76, seat - thick * 0.5, leg_thick)
    if style.back == "shell":
        arms = seat + (h - seat) * (0.35 + 0.3 * style.arm_height)
        wall = 0.035 + 0.04 * style.softness
        low, power = (0, seat - wall, d * 0.15), 2.4 + style.corner  # its floor is what is sat on
        shell = bent(low, (w / 2, d * 0.62), wall, h - seat + wall, arms - seat + wall, power=power, ease=2.5)
        return [*parts, shell]
    return parts + back_rest(style, style.back, w * 0.9, seat, h, -d * 0.38, 0.06, rake)


def chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A plain chair, with arms more often than a dining chair."""
    parts = dining_chair(size, style, choices)
    w, h, d = size
    if h > 0.7 and style.back != "shell" and choices.chance("extra", 0.45):
        parts += slim_arms(w * 1.04, d, 0.46, h, style, 0.03)
    return parts


def chinese_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Ming style: round posts, a board seat, a splat in the middle, a yoke or a horseshoe arm, stretchers all round."""
    w, h, d = size
    r = 0.016 * (0.9 + 0.3 * style.bulk)
    seat = min(0.46, h * 0.56)
    x, z = w / 2 - r * 1.5, d / 2 - r * 1.5
    parts: list[Solid] = [box((-w / 2, seat - 0.04, -d / 2), (w / 2, seat, d / 2), "wood", 0.01, "seat")]
    legs = four(tube([[x, 0, z], [x * 0.97, seat, z * 0.97]], r))
    legs += [tube([[-x, y, cz], [x, y, cz]], r * 0.7) for y, cz in ((0.1, z), (0.16, -z))]
    legs += both(tube([[x, 0.13, -z], [x, 0.13, z]], r * 0.7))
    parts += of_role("leg", legs)
    splat = w * choices.between("share", 0.14, 0.24)
    parts.append(leaning((-splat / 2, seat, -z - 0.012), (splat / 2, h - r, -z + 0.012), 0.1, seat, -z))
    arm = seat + (h - seat) * 0.48
    if choices.chance("kind", 0.5):
        t = np.linspace(-np.pi / 2, np.pi / 2, 13)
        fall = np.abs(t) / (np.pi / 2)
        bow = np.stack([x * np.sin(t), h - r - (h - arm) * fall**1.5, z * 0.7 - (z * 1.7 + 0.05) * np.cos(t)], 1)
        arms: list[Solid] = [tube(bow, r * 1.1)]
        arms += both(tube([[x, seat, z * 0.6], [x, arm, z * 0.68]], r * 0.8))
        head = bow[int(np.abs(bow[:6, 2] + z * 0.5).argmin())]  # where the posts behind meet the bow
        arms += [tube([[s * head[0] * 1.05, seat, -z * 0.6], [s * head[0], *head[1:]]], r * 0.8) for s in (-1, 1)]
        return parts + of_role("arm", arms)
    heights = (-0.5, h - 0.03, -0.07), (-0.25, h - r, -0.08), (0.25, h - r, -0.08), (0.5, h - 0.03, -0.07)
    yoke = tube([[w * across, y, -z + back] for across, y, back in heights], r * 1.2)
    parts += of_role("back", [yoke, *both(tube([[x, seat, -z], [x * 0.98, h - r, -z - 0.07]], r))])
    rest = tube([[x, arm + 0.03, -z - 0.03], [x, arm, z * 0.7], [x * 1.02, arm - 0.02, z * 0.8]], r * 0.9)
    return parts + of_role("arm", both(rest, tube([[x, seat, z * 0.75], [x, arm, z * 0.75]], r * 0.8)))


def dressing_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A vanity stool or a small chair with a low back."""
    w, h, d = size
    if h < 0.55:
        return stool(size, style, choices)
    seat = min(0.44, h * 0.7)
    thick = 0.06 + 0.04 * style.softness
    parts: list[Solid] = chair_legs(style, w * 0.82, d * 0.8, seat - thick * 0.5, 0.034 * style.bulk)
    parts.append(seat_of(replace(style, softness=max(style.softness, 0.5)), w * 0.95, d * 0.92, seat, thick))
    if style.back in ("shell", "cushion", "oval"):
        low, half = (0, seat - thick * 0.5, d * 0.05), (w / 2, d * 0.55)
        return [*parts, bent(low, half, 0.05, h - seat, (h - seat) * 0.6, ease=2.0)]
    return parts + back_rest(style, style.back, w * 0.85, seat, h, -d * 0.4, 0.05, style.rake * 0.5)


def bar_stool(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A high seat with a foot rest, with a low back or without, on four legs or a column."""
    w, h, d = size
    backed = h > 0.88 or choices.chance("back", 0.3)
    seat = min(0.75, h * 0.78) if backed else h
    thick = 0.035 + 0.04 * style.softness
    parts: list[Solid] = []
    if choices.chance("form", 0.25):
        r = 0.026
        foot, rest = turned((0, 0, 0), w * 0.46, 0.03, w * 0.42), turned((0, seat * 0.35, 0), w * 0.28, 0.022)
        parts = of_role("leg", [turned((0, 0, 0), r, seat - thick), foot, rest], material="metal")
    else:
        legs = style.legs if style.legs in ("tapered", "splayed", "straight", "sled") else "splayed"
        upright_legs = legs != "splayed"
        share = (0.7 if style.round_tops > 0.5 else 0.86) if upright_legs else 0.98
        parts += base(style, w * share, d * share * 0.96, seat - thick * 0.6, 0.032 * style.bulk, legs)
        spread = min(np.tan(style.splay) * (seat - thick * 0.6), 0.3 * min(w, d * 0.96) * share)
        lean = 0.0 if upright_legs else spread * 0.35
        x, z, y, t = w * share / 2 - 0.02 - lean, d * share * 0.48 - 0.02 - lean, seat * 0.35, 0.011
        parts += both(box((-x, y - t, z - t), (x, y + t, z + t), "metal", 0.0, "rail"), axis=2)
        parts += both(box((x - t, y - t, -z), (x + t, y + t, z), "metal", 0.0, "rail"))
    shape = "round" if style.round_tops > 0.5 else "corners"
    board = top(shape, w * 0.92, d * 0.88, seat, thick, style, "fabric")
    parts.append(replace(board, rounding=thick * 0.4, role="seat"))
    if not backed:
        return parts
    wide = w * (0.5 if shape == "round" else 0.8)
    if style.back in ("shell", "cushion", "oval"):
        return [*parts, bent((0, seat - thick * 0.5, 0), (w * 0.48, d * 0.46), 0.035, h - seat, (h - seat) * 0.4)]
    return parts + back_rest(style, style.back, wide, seat, h, -d * 0.36, 0.04, style.rake * 0.5)


def office_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Five feet with casters, a column, a seat, a raked back, and arms."""
    w, h, d = size
    seat, reach = min(0.46, h * 0.56), min(w, d) * 0.48
    wheel = 0.028
    parts: list[Solid] = []
    for angle in np.arange(5) * 2 * np.pi / 5 + np.pi / 2:
        x, z = reach * np.cos(angle), reach * np.sin(angle)
        parts.append(tube([[0, 0.1, 0], [x, wheel * 2 + 0.01, z]], 0.018, "metal", "leg"))
        parts.append(ball((x, wheel, z), wheel, "metal", "caster"))
    parts.append(turned((0, 0.08, 0), 0.03, seat - 0.1, 0.026, material="metal", role="stem"))
    sw, sd = w * 0.86, d * 0.8
    parts.append(seat_of(replace(style, softness=max(style.softness, 0.5)), sw, sd, seat, 0.08, d * 0.04))
    rake = 0.1 + style.rake * 0.5
    y0 = seat + 0.08 * style.contrast

    def lean(x: float, low: float, high: float, rear: float, before: float, **look: Any) -> Block:
        z = -d * 0.4  # of the plane that the back leans from
        return leaning((-x, low, z + rear), (x, high, z + before), rake, seat, z, **look)

    if style.back == "shell":
        low, arms = (0, seat - 0.05, d * 0.05), 0.12 + 0.1 * style.arm_height
        return [*parts, bent(low, (sw / 2 + 0.02, d * 0.5), 0.05, h - seat + 0.05, arms)]
    if style.corner > 0.45 or style.back == "oval":
        tall, turn, power = (h - y0) / np.cos(rake), rotation(x=-rake), 2.6 + 2 * style.contrast
        centre = turn @ np.array([0, y0 - seat + tall / 2, 0]) + [0, seat, -d * 0.4]
        parts.append(ball(centre, (sw * 0.47, tall / 2, 0.04), "fabric", "back", power=power, turn=turn))
    elif style.tufting > 0.6:
        for a, b in pairwise(np.linspace(y0, h, 5)):
            parts.append(lean(sw * 0.44, a + 0.01, b, -0.02, 0.02, material="fabric", radius=0.018, bow=0.04))
        parts.append(lean(0.03, y0, h * 0.98, -0.04, -0.015, material="metal"))
    else:
        tall = (h - y0) / np.cos(rake)
        parts.append(lean(sw * 0.46, y0, y0 + tall, -0.03, 0.03, material="fabric", radius=0.06, bow=0.05))
    rise = y0 + 0.15 - seat  # the bracket ends in the middle of the back, which leans away from it
    rest = [0, y0 + 0.15, -d * 0.4 - rise * np.tan(rake) - 0.012]
    parts.append(tube([[0, seat - 0.05, -d * 0.1], [0, seat - 0.05, -d * 0.43], rest], 0.016, "metal", "stem"))
    if choices.chance("extra", 0.75):
        x, y = w / 2 - 0.025, seat + 0.2
        stay = tube([[sw * 0.4, seat - 0.05, 0], [x, seat - 0.03, 0], [x, y, 0]], 0.016, "metal", "arm")
        pad = box((x - 0.025, y - 0.015, -d * 0.22), (x + 0.025, y + 0.015, d * 0.22), "accent", 0.012, "arm")
        parts += both(stay, pad)
    return parts
