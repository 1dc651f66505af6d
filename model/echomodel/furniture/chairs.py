"""Seats: dining, plain, Chinese, dressing, bar and office chairs; without a back stools, benches and ottomans."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.furniture.bent import bent
from echomodel.furniture.carpentry import Size, base, both, box, four, leg, of_role, top, within
from echomodel.furniture.cloth import seam
from echomodel.furniture.pads import cushion
from echomodel.furniture.seating import back_rest, chair_legs, leaning, seat_of, slim_arms
from echomodel.furniture.solids import Block, Solid, ball, rotation, superellipse, tube, turned
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
        box((-w / 2 * 0.91, foot, -d / 2 * 0.91), (w / 2 * 0.91, split + 0.02, d / 2 * 0.91), "fabric", 0.012, "base"),
        cushion((-w / 2, split, -d / 2), (w / 2, h, d / 2), style),
    ]


def dining_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Four legs or a sled, a seat, and the style's back; or another body with such a back, see `BODIES`."""
    w, h, d = size
    seat = float(np.clip(0.46, 0.4 * h, 0.7 * h))
    other = choices.chance("form", OTHER)
    if other and style.back in BODIES:
        return BODIES[style.back](size, style, choices, seat)
    winged = other and style.back == "cushion"
    style = replace(style, softness=max(style.softness, 0.5 * winged))
    thick = 0.035 + 0.05 * style.softness
    parts: list[Solid] = [seat_of(style, w * 0.94, d * 0.9, seat, thick, d * 0.04)]
    parts += chair_legs(style, w * 0.86, d * 0.76, seat - thick * 0.5, 0.038 * style.bulk)
    if winged or style.back == "shell":
        arms, wall = (h - seat) * (0.35 + 0.3 * style.arm_height), 0.035 + 0.04 * style.softness
        low, deep, power = (-0.05, 0.42, 4.4) if winged else (0.15, 0.62, 2.4)  # a shell's floor is what is sat on
        form = {"power": power + style.corner, "ease": 2.5}
        return [*parts, bent((0, seat - wall, d * low), (w / 2, d * deep), wall, h - seat + wall, arms + wall, **form)]
    return parts + back_rest(style, style.back, w * 0.9, seat, h, -d * 0.38, 0.06, style.rake * 0.8)


def _windsor(size: Size, style: Style, choices: Choices, seat: float) -> list[Solid]:
    """A round board on splayed legs with stretchers; spindles below a hoop, or below a comb."""
    w, h, d = size
    r, tall, bow, lean = 0.013 * style.bulk, h - seat, 0.09 * d, 0.08 + 0.3 * style.rake
    board = turned((0, seat - 0.04, d * 0.03), (w * 0.48, d * 0.47), 0.04, power=2.8, rounding=0.018, role="seat")
    foot, head = (w * 0.47, 0, d * 0.47), (w * 0.3, seat - 0.02, d * 0.3)
    x, y, z = 0.6 * np.array(foot) + 0.4 * np.array(head)
    legs = four(leg(foot, head, 2.6 * r, replace(style, profile="round"), taper=0.65))
    legs += [*both(tube([[x, y, -z], [x, y, z]], 0.7 * r)), tube([[-x, y, 0], [x, y, 0]], 0.7 * r)]
    comb, share = choices.chance("second", 0.4), np.linspace(-1, 1, 7 + int(2.99 * style.tufting))

    def behind(u: np.ndarray, up: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the back, at shares of its half width and metres over the seat; it widens upwards."""
        wide, rear = w * (0.36 + 0.1 * np.clip(1.6 * up / tall, 0, 1)), lean * up + bow * (1 - u**2)
        return np.stack([u * wide, seat + up, -d * 0.36 - rear], 1)

    high = (tall - r) * (1 - np.abs(share) ** 2.6) ** (1 / 2.6) if not comb else 0 * share + tall - 0.06
    ends = np.stack([behind(share, 0 * share - 0.02), behind(share, high)], 1)
    back: list[Solid] = [tube(each, 0.55 * r) for each in (ends if comb else ends[1:-1])]
    if comb:
        low, top = (-w * 0.48, h - 0.1, -d * 0.36 - 0.012), (w * 0.48, h, -d * 0.36 + 0.012)
        back.append(leaning(low, top, np.arctan(lean), seat, -d * 0.36, radius=0.03, bow=bow))
    else:
        u, v = (superellipse(2.6, 28)[:15] * (1, r - tall)).T
        back.append(tube(behind(u, v - 0.02 * (v < r)), r))
    return [board, *of_role("leg", legs), *of_role("back", back)]


def _wishbone(size: Size, style: Style, choices: Choices, seat: float) -> list[Solid]:
    """A woven seat between round legs; a bow that is back and arms on the rear ones and on a forked splat."""
    w, h, d = size
    r, x, z, arm = 0.017 * style.bulk, w * 0.44, d * 0.42, seat + 0.78 * (h - seat)
    woven = turned((0, seat - 0.03, 0), (x, z), 0.03, power=7.0, rounding=0.012, material="linen", role="seat")
    near = leg((x, 0, z), (x, seat, z), 2.2 * r, replace(style, profile="round"), taper=0.7)
    far = [[x, 0, -z], [x * 0.96, seat * 0.6, -z * 0.88], [x * 0.94, seat, -z * 0.8], [x * 1.02, arm - r, -z * 0.3]]
    y, low = seat - 0.02, seat * 0.4
    sides = [[x, y, z], [x * 0.94, y, -z * 0.8]], [[x, low, z], [x * 0.97, low, -z * 0.9]]
    legs = both(near, tube(far, r), *(tube(side, 0.75 * r) for side in sides))
    legs += [tube([[-x, y, end], [x, y, end]], 0.8 * r) for end in (z, -z * 0.8)]
    t = np.linspace(-1, 1, 13) * np.pi / 2
    rise, rear = arm + (h - r - arm) * np.cos(t) ** 1.5, z * 0.2 - (d / 2 + z * 0.2) * np.cos(t)
    fork = [[0.006, seat - 0.02, -z * 0.8], [0.008, seat + 0.5 * (h - seat), -d * 0.44], [w * 0.15, h - r, -d * 0.47]]
    back = [tube(np.stack([w / 2 * np.sin(t), rise, rear], 1), 1.1 * r), *both(tube(fork, 0.6 * r))]
    return [woven, *of_role("leg", legs), *of_role("back", back)]


def _bent_tube(points: list[list[float]], r: float, bend: float) -> Solid:
    """A metal tube along a polyline, its corners bent over `bend` metres."""
    path = np.array(points, float)
    line = [path[0]]
    for before, here, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        ways = [end - here for end in (before, after)]
        one, other = (way * min(bend / max(float(np.linalg.norm(way)), 1e-9), 0.45) for way in ways)
        line += [here + one * (1 - s) ** 2 + other * s**2 for s in (0.0, 0.3, 0.7, 1.0)]
    return tube([*line, path[-1]], r, "metal", "leg")


def _tubular(size: Size, style: Style, choices: Choices, seat: float) -> list[Solid]:
    """A seat and a back on two bent tubes: of wood or metal on four legs, or of cane in frames on one that springs."""
    w, h, d = size
    cane, stuff = style.back == "frame", "metal" if style.family == "industrial" else "wood"
    r, x, z, y, up = 0.012, w / 2 - 0.012, d / 2 - 0.012, seat - 0.028, h - seat
    lean, bow = 0.05 + 0.3 * style.rake, 0.02 if cane else 0.02 + 0.02 * d
    rear, layers = lean * up - z, [(1.0, 0.022, "wood"), (0.8, 0.027, "linen")]
    if cane:
        parts = both(_bent_tube([[x, r, -z], [x, r, z], [x, y, z], [x, y, rear], [x, h - r, -z]], r, 0.09))
        parts.append(tube([[-x, r, -z], [x, r, -z]], r, "metal", "leg"))
    else:
        inner, high, layers = 0.85 * x, h - 0.1 * up, [(1.0, 0.016, stuff)]
        front = [[x, 0, z], [inner, y, 0.7 * z], [inner, y, rear], [inner, high, rear - lean * (high - seat)]]
        parts = both(_bent_tube(front, r, 0.06), tube([[x, 0, -z], [inner, y, -0.6 * z]], r, "metal", "leg"))
    for share, thick, of in layers:
        place, half = (0, seat - 0.012 - thick / 2, (z + rear) / 2), (x * share, (z - rear) / 2 * share)
        parts.append(turned(place, half, thick, power=9.0 if cane else 5.0, rounding=0.004, material=of, role="seat"))
        back = rear - bow * (1 - share**2)  # the cane is bent as its frame is there
        low, high = (seat + (0.62 + side * 0.36 * share) * up for side in (-1, 1))
        corner, other = (-x * share, low, back - thick / 2), (x * share, high, back + thick / 2)
        parts.append(leaning(corner, other, np.arctan(lean), seat, rear, material=of, radius=0.04, bow=bow * share**2))
    return parts


OTHER = 0.6  # share of chairs whose body is not four legs under a seat and a back
BODIES: dict[str, Callable[[Size, Style, Choices, float], list[Solid]]] = {
    "spindles": _windsor, "rails": _wishbone, "panel": _tubular, "frame": _tubular,
}  # fmt: skip


def chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A plain chair; with four legs it has arms more often than a dining chair."""
    parts = dining_chair(size, style, choices)
    w, h, d = size
    framed = style.back in ("oval", *BODIES) and not choices.chance("form", OTHER)
    if h > 0.7 and framed and choices.chance("extra", 0.45):
        parts += slim_arms(w * 1.04, d, 0.46, h, style, 0.03)
    return parts


def chinese_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Ming style: round posts, a board seat, a splat below a yoke, arms, stretchers all round; or with a bow."""
    w, h, d = size
    r, seat = 0.016 * (0.9 + 0.3 * style.bulk), min(0.46, h * 0.56)
    if choices.chance("kind", 0.4):
        return _wishbone(size, replace(style, bulk=max(style.bulk, 1.3)), choices, seat)
    x, z = w / 2 - r * 1.5, d / 2 - r * 1.5
    parts: list[Solid] = [box((-w / 2, seat - 0.04, -d / 2), (w / 2, seat, d / 2), "wood", 0.01, "seat")]
    legs = four(tube([[x, 0, z], [x * 0.97, seat, z * 0.97]], r))
    legs += [tube([[-x, y, cz], [x, y, cz]], r * 0.7) for y, cz in ((0.1, z), (0.16, -z))]
    legs += both(tube([[x, 0.13, -z], [x, 0.13, z]], r * 0.7))
    parts += of_role("leg", legs)
    splat, arm = w * choices.between("share", 0.14, 0.24), seat + (h - seat) * 0.48
    parts.append(leaning((-splat / 2, seat, -z - 0.012), (splat / 2, h - r, -z + 0.012), 0.1, seat, -z))
    heights = (-0.5, h - 0.03, -0.07), (-0.25, h - r, -0.08), (0.25, h - r, -0.08), (0.5, h - 0.03, -0.07)
    yoke = tube([[w * across, y, -z + back] for across, y, back in heights], r * 1.2)
    parts += of_role("back", [yoke, *both(tube([[x, seat, -z], [x * 0.98, h - r, -z - 0.07]], r))])
    rest = tube([[x, arm + 0.03, -z - 0.03], [x, arm, z * 0.7], [x * 1.02, arm - 0.02, z * 0.8]], r * 0.9)
    return parts + of_role("arm", both(rest, tube([[x, seat, z * 0.75], [x, arm, z * 0.75]], r * 0.8)))


def dressing_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A vanity stool, or a chair with a soft seat."""
    if size[1] < 0.55:
        return stool(size, style, choices)
    return dining_chair(size, replace(style, softness=max(style.softness, 0.5)), choices)


def bar_stool(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A high seat with a foot rest, with a low back or without, on four legs or a column."""
    w, h, d = size
    backed = h > 0.88 or choices.chance("back", 0.3)
    seat = min(0.75, h * 0.78) if backed else h
    thick = 0.035 + 0.04 * style.softness
    if choices.chance("form", 0.25):
        r = 0.026
        foot, rest = turned((0, 0, 0), w * 0.46, 0.03, w * 0.42), turned((0, seat * 0.35, 0), w * 0.28, 0.022)
        parts = of_role("leg", [turned((0, 0, 0), r, seat - thick), foot, rest], material="metal")
    else:
        legs = style.legs if style.legs in ("tapered", "splayed", "straight", "sled") else "splayed"
        share = 0.98 if legs == "splayed" else 0.7 if style.round_tops > 0.5 else 0.86
        parts = base(style, w * share, d * share * 0.96, seat - thick * 0.6, 0.032 * style.bulk, legs, tie=True)
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
    seat, reach, wheel = min(0.46, h * 0.56), min(w, d) * 0.48, 0.028
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
    tall, turn, foot = (h - y0) / np.cos(rake), rotation(x=-rake), np.array([0.0, seat, -d * 0.4])
    if style.tufting > 0.6:  # a net in a frame, and a pad for the head
        frame = (seam((sw * 0.46, 0.4 * tall, 0.0)) + np.array([0, y0 - seat + 0.41 * tall, 0])) @ turn.T + foot
        parts.append(tube(frame, 0.022, "metal", "back"))
        parts.append(lean(sw * 0.43, y0 + 0.03, y0 + 0.8 * tall, -0.005, 0.005, material="fabric", bow=0.02))
        parts.append(lean(0.03, y0 + 0.1, y0 + 0.95 * tall, -0.055, -0.02, material="metal", radius=0.01))
        parts.append(lean(sw * 0.27, y0 + 0.86 * tall, y0 + tall, -0.035, 0.03, material="fabric", radius=0.028))
    elif style.corner > 0.45 or style.back == "oval":
        centre, half = turn @ np.array([0, y0 - seat + tall / 2, 0]) + foot, (sw * 0.47, tall / 2, 0.04)
        parts.append(ball(centre, half, "fabric", "back", power=2.6 + 2 * style.contrast, turn=turn))
    else:
        parts.append(lean(sw * 0.46, y0, y0 + tall, -0.03, 0.03, material="fabric", radius=0.06, bow=0.05))
    rise = y0 + 0.15 - seat  # the bracket ends in the middle of the back, which leans away from it
    rest = [0, y0 + 0.15, -d * 0.4 - rise * np.tan(rake) - 0.05]
    parts.append(tube([[0, seat - 0.05, -d * 0.1], [0, seat - 0.05, -d * 0.43], rest], 0.016, "metal", "stem"))
    if choices.chance("extra", 0.75):
        x, y = w / 2 - 0.025, seat + 0.2
        stay = tube([[sw * 0.4, seat - 0.05, 0], [x, seat - 0.03, 0], [x, y, 0]], 0.016, "metal", "arm")
        pad = box((x - 0.025, y - 0.015, -d * 0.22), (x + 0.025, y + 0.015, d * 0.22), "accent", 0.012, "arm")
        parts += both(stay, pad)
    return parts
