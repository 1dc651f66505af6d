"""Chairs of every kind, stools, benches and ottomans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.data.furniture.carpentry import Size, base, box, cushion, leg, top
from echomodel.data.furniture.solids import Ball, Block, Shell, Solid, Tube, Turned, rotation
from echomodel.data.furniture.style import Style


def _seat(style: Style, w: float, d: float, y: float, thick: float, z: float = 0.0, material: str | None = None) -> Solid:
    """A seat whose upper face lies at y: a board, or a cushion in soft styles."""
    soft = style.softness > 0.4
    low, high = (-w / 2, y - thick, z - d / 2), (w / 2, y, z + d / 2)
    if soft:
        return cushion(low, high, style, material or "fabric")
    shape = "corners" if style.corner > 0.35 else "square"
    return replace(top(shape, w, d, y, thick, style, material or "wood"), centre=np.array([0, y - thick, z]))


def _leaning(low: tuple, high: tuple, rake: float, pivot_y: float, pivot_z: float, **kwargs) -> Block:
    """A block that leans back by `rake` about the horizontal line through (pivot_y, pivot_z)."""
    block = box(low, high, kwargs.get("material", "wood"), kwargs.get("radius", 0.0))
    turn = rotation(x=-rake)
    pivot = np.array([0, pivot_y, pivot_z])
    return replace(block, centre=turn @ (block.centre - pivot) + pivot, turn=turn)


def back_rest(
    style: Style, kind: str, w: float, y0: float, y1: float, z: float, thick: float, rake: float, rng: np.random.Generator
) -> list[Solid]:
    """The back of a chair from the seat's height y0 up to y1, its foot on the plane z, leaning back by `rake`."""
    length = (y1 - y0) / np.cos(rake)
    a = w / 2

    def lean(x0: float, x1: float, s0: float, s1: float, t: float, **kwargs) -> Block:
        return _leaning((x0, y0 + s0 * length, z - t / 2), (x1, y0 + s1 * length, z + t / 2), rake, y0, z, **kwargs)

    post = max(0.024, 0.03 * style.bulk)
    if kind == "cushion":
        t = max(thick, 0.07 + 0.06 * style.softness)
        return [lean(-a, a, -0.05, 1, t, radius=t * 0.45 * (0.4 + 0.6 * style.softness), material="fabric")]
    if kind == "panel":
        if style.softness > 0.5:
            return [lean(-a, a, 0.12, 1, 0.05, radius=0.022, material="fabric"),
                    *[lean(s * a * 0.8 - post / 2, s * a * 0.8 + post / 2, -0.1, 0.4, post) for s in (-1, 1)]]  # fmt: skip
        return [lean(-a, a, 0.0 if style.contrast < 0.5 else 0.3, 1, 0.025, radius=0.01),
                *[lean(s * (a - post) - post / 2, s * (a - post) + post / 2, -0.1, 0.5, post * 0.8) for s in (-1, 1)]]  # fmt: skip
    if kind == "oval":
        t = 0.05
        stems: list[Solid] = [lean(s * a * 0.45 - post / 2, s * a * 0.45 + post / 2, -0.1, 0.4, post) for s in (-1, 1)]
        middle = y0 + length * 0.62
        turn = rotation(x=-rake)
        centre = turn @ np.array([0, middle - y0, 0]) + [0, y0, z]
        return [*stems, Ball(centre=centre, half=np.array([a * 0.95, length * 0.4, t / 2]), power=2.6, turn=turn, material="fabric")]
    posts: list[Solid] = [lean(s * (a - post / 2) - post / 2, s * (a - post / 2) + post / 2, -0.08, 1, post) for s in (-1, 1)]
    rail = 0.1 + 0.12 * style.contrast
    if kind == "frame":
        posts += [lean(-a, a, 1 - rail, 1, post * 0.8), lean(-a, a, 0.2, 0.2 + rail * 0.6, post * 0.8)]
        return [*posts, lean(-a * 0.82, a * 0.82, 0.24, 1 - rail * 0.7, post * 0.9, material="fabric", radius=0.01)]
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


def _chair_legs(style: Style, w: float, d: float, h: float, thick: float, *, tie: bool = True) -> list[Solid]:
    kind = style.legs if style.legs not in ("plinth", "bun", "trestle") else "straight"
    return base(style, w, d, h, thick, kind, tie=tie and style.contrast > 0.55 and kind not in ("sled", "hairpin"))


def dining_chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Four legs or a sled, a seat, and the style's back; sometimes slim arms."""
    w, h, d = size
    seat = float(np.clip(0.46, 0.4 * h, 0.62 * h))
    thick = 0.035 + 0.05 * style.softness
    rake = style.rake * 0.8
    leg_thick = 0.038 * style.bulk
    sw, sd = w * 0.94, d * 0.86
    parts: list[Solid] = [_seat(style, sw, sd, seat, thick, d * 0.05)]
    parts += _chair_legs(style, w * 0.96, d * 0.92, seat - thick * 0.6, leg_thick)
    if style.back == "shell":
        arms = seat + (h - seat) * (0.15 + 0.4 * style.arm_height)
        shell = Shell(centre=np.array([0, seat - thick * 0.6, d * 0.15]), half=(w / 2, d * 0.62), thickness=0.035 + 0.04 * style.softness,
                      back=h - seat, front=arms - seat, power=2.4 + style.corner, ease=2.5, material="fabric")  # fmt: skip
        return [*parts, shell]
    return parts + back_rest(style, style.back, w * 0.9, seat, h, -d * 0.38, 0.06, rake, rng)


def chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A plain chair, with arms more often than a dining chair."""
    parts = dining_chair(size, style, rng)
    w, h, d = size
    if h > 0.7 and style.back != "shell" and rng.random() < 0.45:
        parts += _slim_arms(w * 1.04, d, 0.46, h, style, 0.03)
    return parts


def _slim_arms(w: float, d: float, seat: float, h: float, style: Style, thick: float) -> list[Solid]:
    y = seat + min(0.22, (h - seat) * 0.55)
    z0, z1 = -d * 0.4, d * 0.34
    parts: list[Solid] = []
    for s in (-1, 1):
        x = s * (w / 2 - thick)
        parts.append(box((x - thick * 0.8, y - thick, z0), (x + thick * 0.8, y, z1), "wood", 0.008))
        parts.append(leg((x, seat - 0.08, z1 - thick), (x, y - thick * 0.5, z1 - thick), thick, style))
    return parts


def chinese_chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Ming style: round posts, a board seat, a splat in the middle, a yoke or a horseshoe arm, stretchers all round."""
    w, h, d = size
    r = 0.016 * (0.9 + 0.3 * style.bulk)
    seat = min(0.5, h * 0.52)
    x, z = w / 2 - r * 1.5, d / 2 - r * 1.5
    parts: list[Solid] = [box((-w / 2, seat - 0.04, -d / 2), (w / 2, seat, d / 2), "wood", 0.01)]
    corners = [(sx * x, sz * z) for sx in (-1, 1) for sz in (-1, 1)]
    parts += [Tube(points=np.array([[cx, 0, cz], [cx * 0.97, seat, cz * 0.97]]), radius=r) for cx, cz in corners]
    parts += [Tube(points=np.array([[-x, y, cz], [x, y, cz]]), radius=r * 0.7) for y, cz in ((0.1, z), (0.16, -z))]
    parts += [Tube(points=np.array([[cx, 0.13, -z], [cx, 0.13, z]]), radius=r * 0.7) for cx in (-x, x)]
    splat = w * rng.uniform(0.14, 0.24)
    parts.append(_leaning((-splat / 2, seat, -z - 0.012), (splat / 2, h - r, -z + 0.012), 0.1, seat, -z))
    arm = seat + (h - seat) * 0.48
    if rng.random() < 0.5:
        t = np.linspace(-np.pi / 2, np.pi / 2, 13)
        fall = np.abs(t) / (np.pi / 2)
        bow = np.stack([x * np.sin(t), h - r - (h - arm) * fall**1.5, z * 0.7 - (z * 1.7 + 0.05) * np.cos(t)], 1)
        parts.append(Tube(points=bow, radius=r * 1.1))
        parts += [Tube(points=np.array([[s * x, seat, z * 0.6], [s * x, arm, z * 0.68]]), radius=r * 0.8) for s in (-1, 1)]
        parts += [Tube(points=np.array([[s * x, seat, -z * 0.5], [s * x * 0.93, arm + (h - arm) * 0.45, -z * 0.5]]), radius=r * 0.8) for s in (-1, 1)]
        return parts
    yoke = np.array([[-w * 0.5, h - 0.03, -z - 0.07], [-w * 0.25, h - r, -z - 0.08], [w * 0.25, h - r, -z - 0.08], [w * 0.5, h - 0.03, -z - 0.07]])
    parts.append(Tube(points=yoke, radius=r * 1.2))
    parts += [Tube(points=np.array([[s * x, seat, -z], [s * x * 0.98, h - r, -z - 0.07]]), radius=r) for s in (-1, 1)]
    for s in (-1, 1):
        parts.append(Tube(points=np.array([[s * x, arm + 0.03, -z - 0.03], [s * x, arm, z * 0.7], [s * x * 1.02, arm - 0.02, z * 0.8]]), radius=r * 0.9))
        parts.append(Tube(points=np.array([[s * x, seat, z * 0.75], [s * x, arm, z * 0.75]]), radius=r * 0.8))
    return parts


def dressing_chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A vanity stool or a small chair with a low back."""
    w, h, d = size
    if h < 0.55:
        return stool(size, style, rng)
    seat = min(0.44, h * 0.7)
    thick = 0.06 + 0.04 * style.softness
    parts: list[Solid] = _chair_legs(style, w * 0.9, d * 0.9, seat - thick, 0.034 * style.bulk)
    parts.append(_seat(replace(style, softness=max(style.softness, 0.5)), w * 0.95, d * 0.92, seat, thick))
    if style.back in ("shell", "cushion", "oval"):
        return [*parts, Shell(centre=np.array([0, seat - thick * 0.5, d * 0.05]), half=(w / 2, d * 0.55), thickness=0.05,
                              back=h - seat, front=(h - seat) * 0.35, ease=2.0, material="fabric")]  # fmt: skip
    return parts + back_rest(style, style.back, w * 0.85, seat, h, -d * 0.4, 0.05, style.rake * 0.5, rng)


def armchair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Upholstered: a tub with a curved wall, or a body with arms, a seat cushion and a back cushion."""
    w, h, d = size
    foot = min(style.leg_height * 0.9, 0.16) if style.legs not in ("plinth", "bun") else 0.05
    seat = 0.43 if h > 0.6 else h * 0.6
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled") else "tapered"
    parts: list[Solid] = base(style, w * 0.86, d * 0.86, foot, 0.045 * style.bulk, kind)
    if style.arms == "shell" or style.back == "shell":
        wall = 0.09 + 0.05 * style.softness
        arms = foot + (h - foot) * (0.6 + 0.3 * style.arm_height)
        power = 2.2 + 3 * style.corner
        parts.append(Shell(centre=np.array([0, foot, d * 0.42]), half=(w / 2, d * 0.92), thickness=wall, back=h - foot, front=arms - foot,
                           power=power, ease=2.5, material="fabric"))  # fmt: skip
        low = Turned(centre=np.array([0, foot, 0]), low=(w / 2 - wall * 0.7, d * 0.45), high=(w / 2 - wall * 0.7, d * 0.45),
                     height=(seat - foot) * 0.62, power=power + 1, material="fabric")  # fmt: skip
        pad = Turned(centre=np.array([0, foot + (seat - foot) * 0.6, d * 0.04]), low=(w / 2 - wall, d * 0.44), high=(w / 2 - wall, d * 0.44),
                     height=(seat - foot) * 0.4, power=power + 1, rounding=0.05 * style.softness, material="fabric")  # fmt: skip
        return [*parts, low, pad]
    if style.arms in ("slim", "none"):
        arm = 0.035
        frame = style.arms == "slim"
        inner = w - (2 * arm + 0.02 if frame else 0)
        legs = _chair_legs(style, w * 0.96, d * 0.9, seat - 0.12, 0.04 * style.bulk, tie=False)
        pad = cushion((-inner / 2, seat - 0.15, -d * 0.42), (inner / 2, seat, d / 2), style)
        back = _leaning((-inner / 2, seat - 0.1, -d * 0.42 - 0.06), (inner / 2, h * 0.99, -d * 0.42 + 0.06), style.rake, seat,
                        -d * 0.42, material="fabric", radius=0.05)  # fmt: skip
        return [*legs, pad, back, *(_slim_arms(w, d, seat, h, style, arm) if frame else [])]
    arm = w * (0.13 + 0.06 * style.softness)
    y_arm = seat + (h - seat) * (0.2 + 0.5 * style.arm_height)
    parts.append(box((-w / 2 + 0.02, foot, -d / 2 + 0.02), (w / 2 - 0.02, seat - 0.12, d / 2 - 0.02), "fabric", 0.02))
    parts += upholstered_arms(w, foot, y_arm, d, arm, style)
    back = _leaning((-w / 2 + arm * 0.5, foot + 0.05, -d / 2), (w / 2 - arm * 0.5, h, -d / 2 + 0.16), style.rake * 0.6, seat, -d / 2 + 0.08,
                    material="fabric", radius=0.03 + 0.04 * style.softness)  # fmt: skip
    pad = cushion((-w / 2 + arm, seat - 0.15, -d / 2 + 0.14), (w / 2 - arm, seat, d / 2), style)
    return [*parts, back, pad]


def upholstered_arms(w: float, foot: float, y: float, d: float, arm: float, style: Style) -> list[Solid]:
    """Box arms, or arms with a roll along the top, at both ends of a seat `w` wide."""
    parts: list[Solid] = []
    for s in (-1, 1):
        x0, x1 = sorted((s * w / 2, s * (w / 2 - arm)))
        if style.arms == "rolled":
            r = arm * 0.6
            x = (x0 + x1) / 2 - s * (r - arm / 2) * 0.5
            parts.append(box((x0 + arm * 0.14, foot, -d / 2 + 0.03), (x1 - arm * 0.14, y - r, d / 2 - 0.02), "fabric", 0.015))
            parts.append(Turned(centre=np.array([x, y - r, -d / 2 + 0.03]), low=(r, r), high=(r, r), height=d - 0.05,
                                turn=rotation(x=np.pi / 2), rounding=0.02, material="fabric"))  # fmt: skip
        else:
            parts.append(cushion((x0, foot, -d / 2 + 0.01), (x1, y, d / 2 - 0.01), replace(style, softness=min(style.softness, 0.8))))
    return parts


def lounge_chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Low and leaning: a raked seat and back on a frame, a shell on four legs or a swivel foot, or an egg."""
    w, h, d = size
    seat = min(0.4, h * 0.5)
    kind = rng.choice(["frame", "shell", "swivel"], p=[0.45, 0.35, 0.2])
    if kind == "frame":
        tilt, rake = 0.12, 0.2 + style.rake
        parts: list[Solid] = _chair_legs(style, w * 0.96, d * 0.86, seat * 0.8, 0.04 * style.bulk, tie=False)
        pad = cushion((-w * 0.43, seat - 0.12, -d * 0.36), (w * 0.43, seat, d * 0.5), style, turn=rotation(x=-tilt))
        back = _leaning((-w * 0.43, seat - 0.06, -d * 0.3 - 0.05), (w * 0.43, seat + (h - seat) / np.cos(rake), -d * 0.3 + 0.05), rake,
                        seat, -d * 0.3, material="fabric", radius=0.045)  # fmt: skip
        return [*parts, pad, back, *(_slim_arms(w, d, seat, h, style, 0.035) if style.arms != "none" else [])]
    wall = 0.05 + 0.05 * style.softness
    foot = seat * 0.5
    arms = foot + (h - foot) * (0.3 + 0.25 * style.arm_height)
    body: list[Solid] = [
        Shell(centre=np.array([0, foot, d * 0.32]), half=(w / 2, d * 0.8), thickness=wall, back=h - foot, front=arms - foot,
              power=2.2, ease=1.6, material="fabric"),
        Turned(centre=np.array([0, foot, d * 0.02]), low=(w * 0.42, d * 0.42), high=(w * 0.46, d * 0.46), height=seat - foot, power=2.6,
               rounding=0.05, material="fabric"),
    ]  # fmt: skip
    if kind == "swivel":
        stem = Turned(low=(0.03, 0.03), high=(0.03, 0.03), height=foot, material="metal")
        disc = Turned(low=(w * 0.34, w * 0.34), high=(w * 0.3, w * 0.3), height=0.025, material="metal")
        return [*body, stem, disc]
    legs = style.legs if style.legs in ("tapered", "splayed", "straight", "hairpin") else "splayed"
    return [*body, *base(style, w * 0.85, d * 0.8, foot + 0.02, 0.035 * style.bulk, legs)]


def stool(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A round or square seat on legs, a drum, or an hourglass."""
    w, h, d = size
    alike = max(w, d) / min(w, d) < 1.15
    shape = "round" if alike and style.round_tops > 0.4 else "corners"
    if alike and rng.random() < 0.15:
        waist = 0.3 + 0.15 * style.taper
        return [Turned(low=(w * 0.48, d * 0.48), high=(w * waist, d * waist), height=h / 2),
                Turned(centre=np.array([0, h / 2, 0]), low=(w * waist, d * waist), high=(w / 2, d / 2), height=h / 2)]  # fmt: skip
    thick = min(0.03 + 0.07 * style.softness, h * 0.4)
    legs = style.legs if style.legs not in ("plinth", "bun", "trestle") else "tapered"
    seat = replace(top(shape, w, d, h, thick, style, "fabric" if style.softness > 0.4 else "wood"), rounding=thick * 0.4)
    inner = 0.78 if shape == "round" else 0.92
    return [seat, *base(style, w * inner, d * inner, h - thick * 0.8, 0.032 * style.bulk, legs, tie=style.contrast > 0.5)]


def bar_stool(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A high seat with a foot rest, with a low back or without, on four legs or a column."""
    w, h, d = size
    backed = h > 0.88 or rng.random() < 0.3
    seat = min(0.75, h * 0.78) if backed else h
    thick = 0.035 + 0.04 * style.softness
    parts: list[Solid] = []
    if rng.random() < 0.25:
        r = 0.026
        parts += [Turned(low=(r, r), high=(r, r), height=seat - thick, material="metal"),
                  Turned(low=(w * 0.46, w * 0.46), high=(w * 0.42, w * 0.42), height=0.03, material="metal"),
                  Turned(centre=np.array([0, seat * 0.35, 0]), low=(w * 0.28, w * 0.28), high=(w * 0.28, w * 0.28), height=0.022, material="metal")]  # fmt: skip
    else:
        legs = style.legs if style.legs in ("tapered", "splayed", "straight", "sled") else "splayed"
        parts += base(style, w * 0.98, d * 0.94, seat - thick * 0.6, 0.032 * style.bulk, legs)
        x, z, y, t = w * 0.42, d * 0.4, seat * 0.35, 0.011
        parts += [box((-x, y - t, s * z - t), (x, y + t, s * z + t), "metal") for s in (-1, 1)]
        parts += [box((s * x - t, y - t, -z), (s * x + t, y + t, z), "metal") for s in (-1, 1)]
    shape = "round" if style.round_tops > 0.5 else "corners"
    parts.append(replace(top(shape, w * 0.92, d * 0.88, seat, thick, style, "fabric"), rounding=thick * 0.4))
    if not backed:
        return parts
    if style.back in ("shell", "cushion", "oval"):
        return [*parts, Shell(centre=np.array([0, seat - thick * 0.5, 0]), half=(w * 0.48, d * 0.46), thickness=0.035,
                              back=h - seat, front=(h - seat) * 0.4, material="fabric")]  # fmt: skip
    return parts + back_rest(style, style.back, w * 0.84, seat, h, -d * 0.38, 0.04, style.rake * 0.5, rng)


def office_chair(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Five feet with casters, a column, a seat, a raked back, and arms."""
    w, h, d = size
    seat, reach = min(0.48, h * 0.52), min(w, d) * 0.48
    wheel = 0.028
    parts: list[Solid] = []
    for angle in np.arange(5) * 2 * np.pi / 5 + np.pi / 2:
        x, z = reach * np.cos(angle), reach * np.sin(angle)
        parts.append(Tube(points=np.array([[0, 0.1, 0], [x, wheel * 2 + 0.01, z]]), radius=0.018, material="metal"))
        parts.append(Ball(centre=np.array([x, wheel, z]), half=np.full(3, wheel), material="metal"))
    parts.append(Turned(centre=np.array([0, 0.08, 0]), low=(0.03, 0.03), high=(0.026, 0.026), height=seat - 0.1, material="metal"))
    sw, sd = w * 0.86, d * 0.8
    parts.append(_seat(replace(style, softness=max(style.softness, 0.5)), sw, sd, seat, 0.08, d * 0.04))
    rake = 0.1 + style.rake * 0.5
    y0 = seat + 0.08 * style.contrast
    if style.back == "shell":
        parts.append(Shell(centre=np.array([0, seat - 0.05, d * 0.05]), half=(sw / 2 + 0.02, d * 0.5), thickness=0.05, back=h - seat + 0.05,
                           front=0.12 + 0.1 * style.arm_height, material="fabric"))  # fmt: skip
        return parts
    parts.append(_leaning((-sw * 0.46, y0, -d * 0.4 - 0.03), (sw * 0.46, y0 + (h - y0) / np.cos(rake), -d * 0.4 + 0.03), rake, seat, -d * 0.4,
                          material="fabric", radius=0.028))  # fmt: skip
    parts.append(Tube(points=np.array([[0, seat - 0.05, -d * 0.1], [0, seat - 0.05, -d * 0.43], [0, y0 + 0.15, -d * 0.46]]), radius=0.02, material="metal"))
    if rng.random() < 0.75:
        y = seat + 0.2
        for s in (-1, 1):
            x = s * (w / 2 - 0.025)
            parts.append(Tube(points=np.array([[s * sw * 0.4, seat - 0.05, 0], [x, seat - 0.03, 0], [x, y, 0]]), radius=0.016, material="metal"))
            parts.append(box((x - 0.025, y - 0.015, -d * 0.22), (x + 0.025, y + 0.015, d * 0.22), "accent", 0.012))
    return parts


def bench(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Long, without a back: a board or an upholstered seat on legs, or a chest with a cushion."""
    w, h, d = size
    thick = 0.035 + 0.09 * style.softness
    if rng.random() < 0.2:
        return [box((-w / 2 * 0.98, 0.03, -d / 2 * 0.96), (w / 2 * 0.98, h - 0.08, d / 2 * 0.96), "fabric", 0.01),
                cushion((-w / 2, h - 0.1, -d / 2), (w / 2, h, d / 2), style), *base(style, w * 0.9, d * 0.9, 0.03, 0.05, "plinth")]  # fmt: skip
    legs = style.legs if style.legs not in ("plinth", "bun") else "straight"
    return [_seat(style, w, d, h, thick), *base(style, w * 0.94, d * 0.92, h - thick * 0.8, 0.045 * style.bulk, legs)]


def ottoman(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """An upholstered block, drum or pouf, on short legs or on the floor."""
    w, h, d = size
    alike = max(w, d) / min(w, d) < 1.15
    foot = min(style.leg_height, h * 0.4) if rng.random() < 0.65 else 0.0
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled", "plinth") else "tapered"
    parts: list[Solid] = base(style, w * 0.8, d * 0.8, foot, 0.04 * style.bulk, kind) if foot else []
    if alike and style.round_tops > 0.45:
        if foot == 0 and style.softness > 0.6:
            return [Ball(centre=np.array([0, h / 2, 0]), half=np.array([w / 2, h / 2, d / 2]), power=2.6, material="fabric")]
        return [*parts, Turned(centre=np.array([0, foot, 0]), low=(w / 2, d / 2), high=(w / 2, d / 2), height=h - foot,
                               rounding=0.1 * h + 0.15 * h * style.softness, material="fabric")]  # fmt: skip
    split = foot + (h - foot) * 0.5
    return [*parts, box((-w / 2 * 0.97, foot, -d / 2 * 0.97), (w / 2 * 0.97, split + 0.02, d / 2 * 0.97), "fabric", 0.012),
            cushion((-w / 2, split, -d / 2), (w / 2, h, d / 2), style)]  # fmt: skip
