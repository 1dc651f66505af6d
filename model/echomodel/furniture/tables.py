"""Tables of every height: dining, coffee, side, console and corner tables, desks and dressing tables."""

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, four, of_role, post, top, within
from echomodel.furniture.fronts import boards, drawers, hutch
from echomodel.furniture.solids import Block, Solid, ball, rotation, tube, turned
from echomodel.furniture.style import Choices, Style

KNEES, LAP = 0.5, 0.605  # metres between what stands on both sides of a seat, and below what is above the knees


def _leg(style: Style, width: float, height: float) -> float:
    return float(np.clip(0.045 * style.bulk * (0.6 + 0.3 * width + 0.3 * height), 0.025, 0.14))


def _outline(style: Style, size: Size) -> str:
    """Round where width and depth are alike and the style likes it, else with square or rounded corners."""
    alike = max(size[0], size[2]) / min(size[0], size[2]) < 1.12
    return "round" if style.round_tops > (0.35 if alike else 0.8) else "corners" if style.corner > 0.45 else "square"


def dining_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Four legs, a trestle, a sled or a pedestal under a plain, rounded or round top, with an apron or without."""
    w, h, d = size
    shape, thick = _outline(style, size), max(style.top * 1.1, 0.022)
    parts: list[Solid] = [top(shape, w, d, h, thick, style)]
    if shape == "round":
        inner = within(shape, style) if style.legs not in ("splayed", "hairpin") else 0.86
        if w / d < 1.3 and choices.chance("form", 0.65):
            return parts + pedestal(w, d, h - thick, style)
        kind = None if style.legs not in ("plinth", "bun", "trestle", "sled") else "straight"
        return parts + base(style, w * inner, d * inner, h - thick, _leg(style, w, h), kind)
    if style.legs == "plinth" and choices.chance("form", 0.5):
        panel = max(0.05, 0.06 * w)
        x, z = w / 2 * 0.72, d / 2 * 0.75
        return parts + both(box((x - panel / 2, 0, -z), (x + panel / 2, h - thick, z), role="leg"))
    kind = "straight" if style.legs in ("plinth", "bun") else None
    leg = _leg(style, w, h)
    share = within(shape, style)
    fw, fd = w * share - 1.5 * style.overhang, d * share - 1.5 * style.overhang
    parts += base(style, fw, fd, h - thick, leg, kind)
    return parts + _apron(style, fw, fd, h - thick, leg, 0.04 + 0.04 * style.contrast)


def _apron(style: Style, width: float, depth: float, y: float, leg: float, deep: float) -> list[Solid]:
    """Four boards `deep` metres high below a top at `y`, from leg to leg of a base; none where legs have no room."""
    if style.legs not in ("straight", "tapered", "turned", "bun") or style.contrast > 0.85 or width < 0.4:
        return []
    x, z = width / 2 - leg * 0.6, depth / 2 - leg * 0.6
    across = both(box((-x, y - deep, z - 0.01), (x, y, z + 0.01)), axis=2)
    return of_role("apron", across + both(box((x - 0.01, y - deep, -z), (x + 0.01, y, z))))


def coffee_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Low: legs, a shelf below, a solid block with drawers, a drum, a bowl or two nested tops."""
    w, h, d = size
    shape, thick = _outline(style, size), max(style.top, 0.025)
    kind = choices.pick("kind", ["legs", "shelf", "block", "drum", "nested"], [0.36, 0.24, 0.2, 0.12, 0.08])
    if kind == "drum" and shape == "round":
        drum = turned((0, 0, 0), (w * 0.4, d * 0.4), h - thick, (w * 0.47, d * 0.47), material="accent")
        return [top(shape, w, d, h, thick, style), *of_role("leg", [drum])]
    if kind == "block" and shape != "round":
        foot, x, z, y = max(0.07, h * 0.24), w * 0.48, d * 0.475, h - thick
        split = x - 2 * x * choices.between("split", 0.3, 0.45)  # drawers, and beside them an open cell
        parts = [top("square", w, d, h, thick, style), *boards((split, foot, -z), (x, y, z), 0.016, 0.008)]
        parts += drawers((-x, foot), (split, y), z, 1, choices.whole("columns", 1, 3), style)
        legs = style.legs if style.legs in ("straight", "tapered", "turned", "bun", "sled") else "tapered"
        return parts + base(style, w * 0.9, d * 0.88, foot, 0.045 * style.bulk, legs)
    if kind == "nested" and w > 0.7:
        low_top = turned((w * 0.28, h * 0.62, d * 0.1), w * 0.22, thick, material="accent", role="top")
        post = turned((w * 0.28, 0, d * 0.1), w * 0.14, h * 0.62, 0.03, role="leg")
        main = turned((-w * 0.14, h - thick, 0), (w * 0.36, d / 2), thick, role="top")
        stem = turned((-w * 0.14, 0, 0), (w * 0.2, d * 0.28), h - thick, (w * 0.05, d * 0.08), role="leg")
        return [main, stem, low_top, post]
    board = top(shape, w, d, h, thick, style, "glass" if style.contrast > 0.85 else "wood")
    return _on_legs(board, shape, size, thick, style, _leg(style, w * 0.7, h), 0.4 if kind == "shelf" else 0.0)


def side_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Beside a sofa: legs, a pedestal; a drum or an hourglass where it is round, else a cube or a C-shaped frame."""
    w, h, d = size
    shape, thick = _outline(style, size), max(style.top * 0.8, 0.018)
    kind = choices.pick("kind", ["legs", "pedestal", "drum", "cube", "c"], [0.45, 0.2, 0.12, 0.13, 0.1])
    parts: list[Solid] = [top(shape, w, d, h, thick, style)]
    if kind == "pedestal":
        return parts + pedestal(w, d, h - thick, style)
    if kind == "drum" and shape == "round":
        waist = 0.3 + 0.16 * style.taper
        lower = turned((0, 0, 0), (w * 0.42, d * 0.42), h / 2, (w * waist, d * waist), material="accent")
        upper = turned((0, h / 2, 0), (w * waist, d * waist), h / 2 - thick, (w * 0.45, d * 0.45), material="accent")
        return [*parts, *of_role("leg", [lower, upper])]
    if kind == "cube" and shape != "round":
        shelf = box((-w / 2, h * 0.5, -d / 2), (w / 2, h * 0.5 + 0.02, d / 2), role="shelf")
        return [*parts, *boards((-w / 2, 0, -d / 2), (w / 2, h - thick, d / 2), 0.02, 0.02), shelf]
    if kind == "c" and shape != "round":
        t = 0.014
        x, z = w / 2 * 0.9, d * 0.4
        bars = both(box((-x, 0, z - t), (x, 2 * t, z + t), "metal"), axis=2)
        posts = both(post(-x, z, t, 0, h, "metal"), axis=2)
        return [top("square", w, d, h, thick, style), *of_role("leg", bars + posts)]
    return _on_legs(
        parts[0], shape, size, thick, style, _leg(style, w * 0.6, h) * 0.8, choices.chance("extra", 0.4) * 0.35
    )


def _on_legs(
    board: Solid, shape: str, size: Size, thick: float, style: Style, leg: float, low: float = 0.0
) -> list[Solid]:
    """A top on legs that stand below it, and between them a shelf at a share `low` of its height, 0 = none."""
    w, h, d = size
    legs = style.legs if style.legs not in ("plinth", "bun", "trestle") else "straight"
    inner = within(shape, style)
    frame = w * inner, d * inner, h - thick
    shelf = [between_legs(shape, *frame, h * low, thick * 0.8, leg, style, legs)] if low else []
    apron = _apron(style, *frame, leg, 0.03 + 0.05 * h) if shape != "round" else []
    return [board, *base(style, *frame, leg, legs), *shelf, *apron]


def round_end_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A side table that is always round."""
    return side_table(size, replace(style, round_tops=1.0), choices)


def corner_side_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Fits a corner: a cabinet-like cube with a drawer and a shelf, or square legs with two tops."""
    w, h, d = size
    t = max(style.top * 0.8, 0.018)
    shape = "corners" if style.corner > 0.5 else "square"
    parts = _on_legs(top(shape, w, d, h, t, style), shape, size, t, style, 0.035 * style.bulk, 0.28)
    if choices.chance("extra", 0.6):
        x, z = (0.47 * side * within(shape, style) for side in (w, d))
        parts += drawers((-x, h * 0.68), (x, h - t), z, 1, 1, style)
    return parts


def console_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Narrow against a wall: legs with or without drawers below the top, perhaps a shelf near the floor."""
    w, h, d = size
    t = max(style.top, 0.02)
    shape = "corners" if style.corner > 0.7 else "square"
    parts = _on_legs(top(shape, w, d, h, t, style), shape, size, t, style, _leg(style, w * 0.5, h) * 0.85)
    w, d = w * within(shape, style), d * within(shape, style)
    if choices.chance("front", 0.55):
        columns = choices.whole("columns", 1, 4)
        parts += drawers((-w * 0.46, h - t - 0.14), (w * 0.46, h - t), d * 0.42, 1, columns, style)
    if choices.chance("extra", 0.5):
        parts.append(box((-w * 0.46, h * 0.18, -d * 0.42), (w * 0.46, h * 0.18 + t, d * 0.42), "accent", 0.0, "shelf"))
    return parts


def desk(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A writing top at 0.75 m on legs or side panels, with drawers at one side or both; tall ones carry a hutch."""
    w, h, d = size
    tall = h > 1.05
    desk_height = 0.75 if tall else h
    t = max(style.top, 0.022)
    shape = "square" if tall or style.corner < 0.6 else "corners"
    parts: list[Solid] = [top(shape, w, d, desk_height, t, style)]
    if shape == "corners":
        w, d = w * within(shape, style), d * within(shape, style)
    kind = choices.pick("kind", ["legs", "left", "both", "shallow"], [0.25, 0.35, 0.2, 0.2])
    unit = min(0.42, w * 0.3)
    legs = "straight" if style.legs in ("plinth", "bun", "trestle") else style.legs
    y1 = desk_height - t
    if kind in ("left", "both"):
        two = kind == "both" and 0.96 * w - 2 * unit >= KNEES
        sides = (-1, 1) if two else (-1 if choices.chance("side", 0.5) else 1,)
        for s in sides:
            x0, x1 = sorted((s * w * 0.48, s * (w * 0.48 - unit)))
            foot = 0.1 if style.contrast > 0.3 else 0.04
            parts += drawers((x0, foot), (x1, y1), d * 0.46, choices.whole("rows", 2, 4), 1, style)
            for x in (x0 + 0.04, x1 - 0.04):
                parts += both(post(x, d * 0.42, 0.02, 0, foot, role="leg"), axis=2)
        if len(sides) == 1:
            parts += both(post(-sides[0] * w * 0.47, d * 0.43, 0.025, 0, y1, role="leg"), axis=2)
    else:
        leg = _leg(style, w * 0.6, desk_height)
        parts += base(style, w * 0.96, d * 0.94, y1, leg, legs)
        if kind == "legs":
            parts += _apron(style, w * 0.96, d * 0.94, y1, leg, 0.06)
        else:
            low, high = (-w * 0.42, max(y1 - 0.12, LAP)), (w * 0.42, y1)
            parts += drawers(low, high, d * 0.42, 1, choices.whole("columns", 2, 4), style)
    if tall:
        columns, rows = choices.whole("second", 1, 4), int(np.clip(round((h - desk_height) / 0.38), 1, 6))
        parts += hutch(w, desk_height, h, -d / 2, -d / 2 + min(0.28, d * 0.45), columns, rows)
    return parts


def dressing_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A small desk with drawers and, when tall enough, a round, oval or square mirror."""
    w, h, d = size
    mirror = h > 0.95
    table = 0.76 if mirror else h
    t = max(style.top * 0.9, 0.02)
    shape = "corners" if style.corner > 0.5 else "square"
    parts: list[Solid] = [top(shape, w, d, table, t, style)]
    w, d = w * within(shape, style), d * within(shape, style)
    narrow = style.legs == "splayed" and w < 1.0  # they meet the case nearer to its middle
    legs = "tapered" if narrow or style.legs in ("plinth", "bun", "trestle") else style.legs
    y1, low = table - t, max(table - t - 0.14, LAP)
    widest = 0.48 * w - KNEES / 2  # of the cupboards, which leave room for knees
    if choices.chance("kind", 0.5) or widest < 0.15:
        parts += base(style, w * 0.95, d * 0.92, low, 0.045 * style.bulk, legs)
        parts += drawers((-w * 0.47, low), (w * 0.47, y1), d * 0.45, 1, choices.whole("columns", 1, 4), style)
    else:
        unit = min(w * choices.between("share", 0.26, 0.36), widest)
        for s in (-1, 1):
            x0, x1 = sorted((s * w * 0.48, s * (w * 0.48 - unit)))
            parts += drawers((x0, 0.06), (x1, y1), d * 0.45, choices.whole("rows", 2, 4), 1, style)
            parts.append(box((x0 + 0.02, 0, -d * 0.4), (x1 - 0.02, 0.06, d * 0.4), "accent", 0.0, "leg"))
    if mirror:
        parts += of_role("mirror", mirror_of(w, table, h, d, style, choices))
    return parts


WING = 0.35  # radians that wings are turned towards the middle


def mirror_of(w: float, low: float, high: float, d: float, style: Style, choices: Choices) -> list[Solid]:
    """A mirror at the rear of a table top at `low`, up to `high`; w and d are the table's, metres."""
    tall, z = high - low, -d / 2 + 0.03
    kind = choices.pick("form", ["round", "panel", "wings"])
    if kind == "round":  # in a ring of wood
        radius, up = min(w * 0.4, tall * 0.46), tall * 0.46
        ring = turned((0, high - up, z - 0.015), (radius, up), 0.024, turn=rotation(x=np.pi / 2))
        inner = (radius - 0.014, up - 0.014)
        face = replace(ring, centre=ring.centre + np.array([0, 0, 0.02]), low=inner, high=inner, height=0.008)
        foot = box((-0.06, low, z - 0.02), (0.06, low + tall * 0.15, z + 0.02))
        return [foot, ring, replace(face, material="mirror")]
    half = w * choices.between("spread", 0.28, 0.42)
    low -= 0.005  # let into the top: a foot on it would be stood on, as its collider is the top's
    if kind == "panel":
        return _framed(0.0, low, high, half, z, 0.0, style)
    wing = min(0.22, w / 2 - half * 0.6)
    half *= 0.6
    wings = []
    for s in (-1, 1):
        x = s * (half + wing * 0.47)
        wings += _framed(x, low, high - 0.03, wing / 2, z + wing * 0.16, -s * WING, style)
    return [*_framed(0.0, low, high, half, z, 0.0, style), *wings]


def _framed(x: float, low: float, high: float, half: float, z: float, turn: float, style: Style) -> list[Solid]:
    """A pane about (x, z) on a board that shows as its frame, turned by `turn` about the vertical."""
    edge = min(0.012 + 0.012 * style.contrast, 0.3 * half)
    middle, upright, about = np.array([x, (low + high) / 2, z]), (high - low) / 2, rotation(y=turn)
    board = Block(middle, about, half=np.array([half, upright, 0.011]), radius=0.003)
    before, inner = middle + about @ np.array([0, 0, 0.01]), np.array([half - edge, upright - edge, 0.003])
    return [board, Block(before, about, "mirror", half=inner)]


def between_legs(
    shape: str, width: float, depth: float, height: float, y: float, thick: float, leg: float, style: Style, kind: str
) -> Solid:
    """A shelf at `y` that the legs of a `base` of this width, depth, height and kind pass through."""
    spread = min(np.tan(style.splay) * height, 0.3 * min(width, depth)) if kind == "splayed" else 0.0
    x, z = width / 2 - leg / 2 - spread * y / height, depth / 2 - leg / 2 - spread * y / height
    wider = 2**0.5 if shape == "round" else 1.0
    board = top("round" if shape == "round" else "square", 2 * x * wider, 2 * z * wider, y, thick, style, "accent")
    return replace(board, role="shelf")


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
