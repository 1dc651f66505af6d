"""Upholstered: armchairs and lounge chairs; sofas of two, three and more seats, chaises longues and bean bags."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from echomodel.files import tables
from echomodel.furniture.bent import bent
from echomodel.furniture.carpentry import Size, base, between, both, box, of_role
from echomodel.furniture.pads import CORD, Wrapped, corded, cushion
from echomodel.furniture.seating import chair_legs, leaned, leaning, slim_arms
from echomodel.furniture.solids import Lathe, Solid, ball, rotation, tube, turned
from echomodel.furniture.style import Choices, Style
from echomodel.furniture.tufting import Tufted

BODIES: list[dict[str, Any]] = list(tables("bodies.toml", __file__).values())
padded = partial(turned, material="fabric")
TOUCH = {"seat": 0.01, "back": 0.012}  # metres that cushions side by side press into one another, by their role
CLOSED = 0.016  # metres that what seats lie on reaches up into them, so that no gap is below their edges
FLARED = 0.4  # softness up to which arms have no pad and flare


def armchair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Upholstered: a tub with a curved wall, a frame with cushions, or a body like a sofa's."""
    if style.arms == "shell" or style.back == "shell":
        return _curved(size, style)
    if style.arms in ("slim", "none"):
        return _framed(size, style, min(0.43, 0.6 * float(size[1])), style.rake)
    return _couch(size, style, choices, 1)


def _framed(size: Size, style: Style, seat: float, rake: float) -> list[Solid]:
    """A seat cushion and a leaning back cushion in a wooden frame on legs: rails below the seat, uprights and slats
    behind the back, slim arms on the rails or none; raked seats tilt with their rails.
    """
    w, h, d = size
    tilt, deep, inner = 0.25 * rake, 0.12, w / 2 - 0.035 * (style.arms != "none")
    x, y, t = w * 0.48, seat - deep, 0.04 * style.bulk
    parts = chair_legs(style, w * 0.96, d * 0.88, y - 0.03, t, tie=False)
    low, high = (-inner, y - 0.01, -d * 0.4), (inner, seat, d / 2)
    parts.append(cushion(low, high, style, turn=rotation(x=-tilt)))
    z, tall = -d * 0.36, (h - seat) / np.cos(rake)
    low, high = (-inner, seat - 0.08, z - 0.05), (inner, seat + tall, z + 0.05)
    parts.append(leaned(cushion(low, high, style, role="back"), rake, seat, z))
    rails = both(leaning((x - t, y - 0.06, -d * 0.44), (x, y + 0.005, d * 0.44), tilt, y, 0.0, radius=0.006))
    rails += [leaning((-x, y - 0.055, e - t / 2), (x, y, e + t / 2), tilt, y, 0.0) for e in (-d * 0.3, d * 0.4)]
    (b, c), a, up = (z - 0.05 - 0.7 * t, z - 0.046), x - 1.5 * t, seat + 0.78 * tall
    post = leaning((x - 1.9 * t, y - 0.03, b), (x - 1.1 * t, up, c), rake, seat, z, radius=0.006)
    levels = up - 0.035, seat + 0.42 * tall, seat + 0.1 * tall
    slats = [leaning((-a, at - 0.03, b + 0.006), (a, at + 0.03, c), rake, seat, z) for at in levels]
    parts += of_role("rail", [*rails, *both(post), *slats])
    return parts + (slim_arms(w, d, seat, h, style, 0.035, y - 0.04) if style.arms != "none" else [])


def upholstered_arms(w: float, foot: float, y: float, d: float, arm: float, style: Style) -> list[Solid]:
    """Arms at both ends of a seat `w` wide: rolled along the top, with a pad on them, or firm ones that flare."""
    x, half, z, rolled = w / 2 - 0.5 * arm, 0.5 * arm, d / 2 - 0.015, style.arms == "rolled"
    form: dict[str, Any] = {"head": 0.03 + 0.035 * style.softness, "power": 3.4, "stem": 1 - 0.036 / arm}
    if rolled:
        x, half, form = x - 0.05 * arm, 0.6 * arm, {"head": 0.6 * arm, "power": 2.0, "stem": 0.6}
    elif style.arms == "slim" or style.softness < FLARED:
        x, form = x - 0.2 * arm, {"head": 0.25 * arm, "power": 3.0, "turn": rotation(z=-0.4 * arm / (y - foot))}
    made = between(Wrapped, (x - half, foot, -z), (x + half, y, z), **form)
    low, high = (x - 0.8 * half, foot + 0.03, z - 0.014), (x + 0.8 * half, y - 0.2 * half, z + 0.014)
    panel = between(Wrapped, low, high, **form | {"head": 0.8 * form["head"]})
    return both(made, panel, *corded(style, panel))


def lounge_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Low and leaning: a raked seat and back on a frame, a shell on four legs or a swivel foot, or an egg."""
    w, h, d = size
    seat = min(0.4, h * 0.5)
    kind = choices.pick("kind", ["frame", "shell", "swivel"], [0.45, 0.35, 0.2])
    if kind == "frame":
        return _framed(size, style, seat, 0.2 + style.rake)
    foot = seat * 0.5
    if kind == "swivel":
        stem = turned((0, 0, 0), 0.03, foot, material="metal")
        disc = turned((0, 0, 0), w * 0.34, 0.025, w * 0.3, material="metal")
        return _curved(size, style, of_role("leg", [stem, disc]), seat)
    legs = style.legs if style.legs in ("tapered", "splayed", "straight", "hairpin") else "splayed"
    return _curved(size, style, base(style, w * 0.72, d * 0.7, foot + 0.02, 0.035 * style.bulk, legs), seat)


def _foot(style: Style) -> float:
    return {"plinth": 0.03, "bun": 0.06, "turned": 0.12}.get(style.legs, min(style.leg_height, 0.17))


def _legs(style: Style, w: float, d: float, foot: float) -> list[Solid]:
    kind = style.legs if style.legs not in ("trestle", "hairpin") else "straight"
    return base(style, w * 0.94, d * 0.88, foot, 0.05 * style.bulk, kind)


def _rails(low: tuple, high: tuple, count: int) -> list[Solid]:
    """What seats lie on: a body whose front is of so many firm panels, sewn together."""
    (x0, y0, _), (x1, y1, z1) = low, high
    half, turn = np.array([y1 + CLOSED - y0, 0.09, (x1 - x0) / count]) / 2, np.roll(np.eye(3), 1, axis=0)
    middles = ((x0 + (2 * k + 1) * half[2], y0 + half[0], z1 - 0.045) for k in range(count))
    panels = [Wrapped(np.array(at), turn, role="base", half=half, head=0.03, power=3.0) for at in middles]
    return [box(low, (x1, y1, z1 - 0.045), "fabric", 0.015, "base"), *panels]


def _cushions(
    x0: float, x1: float, y0: float, y1: float, z0: float, z1: float, count: int, style: Style, **form: Any
) -> list[Solid]:
    """A row of cushions from x0 to x1."""
    edges = pairwise(np.linspace(x0, x1, count + 1))
    touch = TOUCH[form.get("role", "seat")]
    pads = [cushion((a - touch, y0, z0), (b + touch, y1, z1), style, **form) for a, b in edges]
    return [*pads, *corded(style, *(pad for pad in pads if pad.role == "seat"))]


def _couch(
    size: Size, style: Style, choices: Choices, seats: int, *, chaise: int = 0, chaise_depth: float = 0.0
) -> list[Solid]:
    """A sofa along x whose back stands at -z; with `chaise` -1 or +1 its last seat at that side reaches forward.

    `chaise_depth` is the full depth there; size[2] is the depth of the rest. Its body is one of `BODIES`.
    """
    w, h, d = size
    body = choices.pick("cover", BODIES, [row["odds"].get(style.family, 0) for row in BODIES])
    style = replace(style, **body["style"])
    foot = _foot(style)
    seat = float(np.clip(0.43, 0.4 * h, 0.62 * h))
    arm = float(np.clip((0.07 + 0.042 * w) * (0.7 + 0.7 * style.softness), 0.07, 0.26))
    arm = {"none": 0.0, "slim": 0.06}.get(style.arms, arm)
    y_arm = seat + (h - seat) * body.get("level", 0.2 + 0.55 * style.arm_height)
    frame = 0.1 + 0.06 * style.softness
    pad = 0.12 + 0.06 * style.softness
    z0, z1 = -d / 2, d / 2
    parts: list[Solid] = _legs(style, w, d, foot)
    if body.get("frame"):
        low, foot = (-w / 2 + 0.02, foot, z0 + 0.04), foot + 0.04
        parts.append(box(low, (w / 2 - 0.02, foot, z1 - 0.035), "wood", 0.006, "leg"))
    inset, under = (0.13 * arm, 0.006) if body.get("skirt") else (arm * 0.5, foot)
    parts += _rails((-w / 2 + inset, under, z0 + 0.02), (w / 2 - inset, seat - pad, z1 - 0.035), seats)
    tall = h - (0.06 if seats > 1 and style.contrast < 0.6 else 0.0)
    x = w / 2 - max(0.4 * arm, 0.012)
    low, high, across = (-z0 - frame, foot + 0.02, -x), (-z0, tall, x), rotation(y=np.pi / 2)
    board = between(Wrapped, low, high, head=min(0.3 * frame, 0.045), power=3.0, role="back")
    board = replace(board, centre=across @ board.centre, turn=across)
    parts.append(leaned(board, 0.5 * style.rake, seat, z0 + frame / 2))
    if arm:
        parts += upholstered_arms(w, foot, y_arm, d, arm, style)
    inner = w / 2 - arm
    front_z = z1 + 0.015
    xs = np.linspace(-inner, inner, seats + 1)
    pads = 1 if body.get("seat") == "one" and not chaise else seats
    parts += _cushions(-inner, inner, seat - pad, seat, z0 + frame * 0.9, front_z, pads, style)
    back = body.get("back", "pads")
    if back in ("tufted", "channels"):
        middle, half = (0.0, (seat + tall) / 2, z0 + frame + 0.03), (inner, (tall - seat) / 2, 0.06)
        turn = rotation(x=-0.08 - 0.2 * style.rake)
        form = {"channels": back == "channels", "apart": (tall - seat) / 1.5}
        parts.append(Tufted(np.array(middle), turn, "fabric", "back", half=np.array(half), **form))
    else:
        thick, turn = 0.12 + 0.08 * style.softness, rotation(x=-0.12 - 0.3 * style.rake)
        far, near, high = z0 + frame - 0.2 * thick, z0 + frame + 0.8 * thick, h if back == "pads" else 0.94 * h
        loose = max(seats, round(inner / 0.5))  # behind one long seat, too
        parts += _cushions(-inner, inner, seat - 0.045, high, far, near, loose, style, turn=turn, role="back")
    if back == "roll" and seats > 1 and not chaise:
        place, turn = (inner - 0.085, seat + 0.08, z0 + 0.7 * frame), rotation(x=np.pi / 2)
        parts += both(padded(place, 0.08, min(0.52, 0.6 * d), rounding=0.02, turn=turn, role="cushion"))
    if chaise:
        x0, x1 = (xs[0] - arm, xs[1]) if chaise < 0 else (xs[-2], xs[-1] + arm)
        reach = z0 + chaise_depth
        parts += _rails((x0 + 0.02, foot, z1 - 0.1), (x1 - 0.02, seat - pad, reach - 0.03), 1)
        parts.append(cushion((x0, seat - pad, z1 - 0.04), (x1, seat, reach), style))
        t = 0.05 * style.bulk
        z = reach - 0.12
        parts += [box((x - t / 2, 0, z), (x + t / 2, foot, z + t), role="leg") for x in (x0 + 0.08, x1 - 0.08)]
    return parts


def sofa(
    size: Size, style: Style, choices: Choices, most: int = 4, extra: float = 0.15, shell: float = 0.5
) -> list[Solid]:
    """A row of two to `most` seat cushions, or one long one, or shares of curved ones, more of a style of shells."""
    if choices.chance("extra", extra) or (style.back == "shell" and choices.chance("kind", shell)):
        return _curved(size, style)
    count = int(np.clip(round(size[0] / choices.between("count", 0.6, 0.85)), 2, most))
    alone = choices.chance("form", 0.12 if most > 2 else 0.2) or (most == 2 and size[0] < 1.0)
    return _couch(size, style, choices, 1 if alone else count)


multi_seat_sofa, loveseat_sofa = partial(sofa, extra=0.0, shell=0.0), partial(sofa, most=2, extra=0.0)


def _curved(size: Size, style: Style, stand: Sequence[Solid] = (), seat: float = 0.43) -> list[Solid]:
    """An armchair or a sofa with one wall bent round the back, and a seat as round as that, on low legs or on `stand`,
    which is half as high as the seat.
    """
    w, h, d = size
    foot = 0.5 * seat if stand else _foot(style)
    wall, power = 0.09 + 0.05 * style.softness, 2.4 + 2.5 * style.corner
    seat, arms = min(seat, h * 0.6), (h - foot) * (0.58 + 0.3 * style.arm_height)
    parts = [*(stand or _legs(style, w * 0.78, d * 0.8, foot))]
    parts.append(bent((0, foot, d * 0.4), (w / 2, d * 0.9), wall, h - foot, arms, power=power, ease=2.8))
    # as round as the wall, or their corners come out behind it
    level, x, z, middle = foot + 0.62 * (seat - foot), w / 2 - wall, d * 0.42, d * 0.06
    parts.append(padded((0, foot, middle), (x, z - d * 0.03), level - foot, role="base", power=power))
    cushioned = cushion((-x, level, middle - z), (x, seat, middle + z), style, power=power)
    return [*parts, cushioned, *corded(style, cushioned)]


def l_shaped_sofa(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A sofa whose end seat reaches forward as a chaise, left or right; or two sofas that meet in a corner."""
    w, h, depth = size
    d = float(np.clip(0.95, 0.5 * depth, 0.7 * depth))
    side = -1 if choices.chance("side", 0.5) else 1
    count = int(np.clip(round(w / 0.85), 3, 5))
    parts = _couch(np.array([w, h, d]), style, choices, count, chaise=side, chaise_depth=depth)
    if choices.chance("extra", 0.35):
        foot, seat, frame, y1 = _foot(style), 0.43, 0.14, h - 0.06
        x0, x1 = sorted((side * w / 2, side * (w / 2 - frame)))
        parts.append(box((x0, foot, -d / 2 + 0.05), (x1, y1, -d / 2 + depth - 0.05), "fabric", 0.04, "back"))
        x0, x1 = sorted((side * (w / 2 - frame), side * (w / 2 - frame - 0.15)))
        low, high = (x0, seat, d * 0.05), (x1, y1, -d / 2 + depth - 0.12)
        parts.append(cushion(low, high, style, turn=rotation(z=-side * 0.15), role="back"))
    return parts


def chaise_longue_sofa(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """One long seat with a back at its end, and an arm at one side or none."""
    w, h, d = size
    foot = max(0.05, _foot(style))
    seat, pad = min(0.43, h * 0.55), 0.14
    parts: list[Solid] = _legs(style, w, d, foot)
    parts += _rails((-w / 2 + 0.015, foot, -d / 2 + 0.03), (w / 2 - 0.015, seat - pad, d / 2 - 0.03), 2)
    parts.append(cushion((-w / 2, seat - pad, -d / 2 + 0.1), (w / 2, seat, d / 2), style))
    low, high, pivot = (-w / 2, seat - pad, -d / 2), (w / 2, h, -d / 2 + 0.15), (seat - pad, -d / 2 + 0.08)
    parts.append(leaned(cushion(low, high, style, role="back"), 0.15 + style.rake, *pivot))
    if choices.chance("extra", 0.6):
        s = -1 if choices.chance("side", 0.5) else 1
        x0, x1 = sorted((s * w / 2, s * (w / 2 - 0.13)))
        reach = -d / 2 + d * choices.between("share", 0.35, 0.6)
        parts.append(cushion((x0, foot, -d / 2 + 0.02), (x1, seat + (h - seat) * 0.5, reach), style, role="arm"))
    if style.arms == "rolled":
        place, turn = (-w * 0.46, seat + 0.09, -d / 2 + 0.28), rotation(z=-np.pi / 2)
        parts.append(turned(place, 0.09, w * 0.92, rounding=0.02, turn=turn, material="accent", role="cushion"))
    return parts


def lazy_sofa(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A bean bag: pear-shaped, a bag with a back, or a low folded chair."""
    w, h, d = size
    kind = choices.pick("kind", ["pear", "lounger", "folded"])
    if kind == "pear":
        outline = [(0.3, 0), (0.44, 0.05), (0.5, 0.2), (0.47, 0.38), (0.38, 0.58), (0.28, 0.76), (0.18, 0.9), (0.07, 1)]
        profile = np.array(outline) * [w, h]
        bag = Lathe(profile=profile, squash=d / w, material="fabric", role="seat")
        seams: list[Solid] = []
        for turn in np.arange(6) * np.pi / 3 + 0.3:
            around = np.array([np.cos(turn), np.sin(turn) * d / w])
            line = np.insert(profile[1:, :1] * around, 1, profile[1:, 1], axis=1)
            seams.append(tube(line, CORD, "cushion", "seam"))
        return [bag, *seams]
    if kind == "lounger":
        lounger: list[Solid] = [
            turned((0, 0, d * 0.04), (w / 2, d * 0.46), h * 0.54, rounding=h * 0.2, power=2.4, material="fabric"),
            ball((0, h * 0.55, -d * 0.27), (w * 0.46, h * 0.46, d * 0.2), "fabric", power=2.6, turn=rotation(x=-0.25)),
        ]
        return of_role("seat", lounger)
    turn = rotation(x=-0.2 - style.rake)
    return [
        cushion((-w / 2, 0, -d * 0.4), (w / 2, h * 0.4, d / 2), replace(style, softness=0.8)),
        cushion((-w / 2, h * 0.3, -d * 0.5), (w / 2, h, -d * 0.22), replace(style, softness=0.8), turn=turn),
    ]
