"""Beds: a frame, a headboard, a mattress and bedding; for children cots, bunks, stilts, houses and rails."""

from dataclasses import replace
from itertools import product

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, core, of_role
from echomodel.furniture.cloth import cover, pillow
from echomodel.furniture.solids import Solid, ball, rotation, turned
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late

tufted, cushion = Late("echomodel.furniture.tufting:Tufted"), Late("echomodel.furniture.pads:cushion")
COVERS = ("blanket", "blanket", "blanket_striped", "blanket_checked", "linen_striped")  # of beds
SET_BACK = 0.006  # metres between two faces that would lie in one plane


def _padded(low: tuple, high: tuple, apart: float, *, channels: bool = False) -> Solid:
    """A panel that is drawn in every `apart` metres, between two corners (3,)."""
    block = box(low, high)
    return tufted(block.centre, material="fabric", half=block.half, apart=apart, channels=channels)


def _headboard(style: Style, w: float, h: float, z: float) -> list[Solid]:
    """The board at the head of a bed, its rear on the plane z, `w` wide and `h` high."""
    t = 0.05 + 0.04 * style.bulk
    kind = style.headboard
    if kind == "panel":
        parts: list[Solid] = [box((-w / 2, 0.02, z), (w / 2, h, z + t * 0.8), "wood", 0.015 * style.corner)]
        if style.softness > 0.45:
            low, high = (-w * 0.46, 0.35, z + t * 0.4), (w * 0.46, h - 0.06, z + t * 1.5)
            parts.append(_padded(low, high, 0.24) if style.tufting > 0.5 else box(low, high, "fabric", 0.025))
        return parts
    if kind == "low":
        return [box((-w / 2, 0.02, z), (w / 2, h, z + t * 0.7))]
    if kind == "channels":
        return [_padded((-w / 2, 0.1, z), (w / 2, h, z + t * 1.5), 2 * (w / int(4 + 6 * style.tufting)), channels=True)]
    if kind == "cushions":
        low, high = (w * 0.25 - w * 0.23, h * 0.4, z + t * 0.4), (w * 0.25 + w * 0.23, h, z + t * 1.9)
        frame = box((-w / 2, 0.02, z), (w / 2, h * 0.85, z + t * 0.6))
        return [frame, *both(cushion(low, high, style, turn=rotation(x=-0.1)))]
    if kind == "slats":
        parts = both(box((w / 2 - 0.03 - 0.03, 0, z), (w / 2 - 0.03 + 0.03, h, z + 0.06)))
        parts += [
            box((-w / 2, h - 0.1, z), (w / 2, h, z + 0.05)),
            box((-w / 2, h * 0.45, z), (w / 2, h * 0.45 + 0.06, z + 0.05)),
            box((-w / 2, 0.12, z), (w / 2, 0.3, z + 0.05)),
        ]
        count = int(5 + 9 * style.tufting)
        xs = np.linspace(-w / 2, w / 2, count + 2)[1:-1]
        return parts + [box((x - 0.025, h * 0.45, z + 0.01), (x + 0.025, h, z + 0.04)) for x in xs]
    if kind == "posts":
        r = 0.045 * style.bulk
        posts = both(turned((w / 2 - r, 0, z + r), r, h - r, r * 0.8))
        knobs = both(ball((w / 2 - r, h - r, z + r), r * 1.2))
        return [*posts, *knobs, box((-w / 2 + r, 0.3, z + r * 0.6), (w / 2 - r, h * 0.86, z + r * 1.3), "wood")]
    stuff = "fabric" if style.softness > 0.5 else "wood"
    arch = turned((0, h * 0.6, z), (w / 2, h * 0.4), t, power=2.4, turn=rotation(x=np.pi / 2), material=stuff)
    return [arch, box((-w / 2, 0.02, z + SET_BACK), (w / 2, h * 0.62, z + t - SET_BACK), stuff)]


def bedding(
    w: float, z0: float, z1: float, low: float, choices: Choices, style: Style, pillows: int, *, falls: bool
) -> list[Solid]:
    """Mattress, pillows and a cover from z0 (head) to z1, where it hangs over the frame or is tucked in."""
    thick = 0.2
    parts: list[Solid] = [box((-w / 2, low, z0), (w / 2, low + thick, z1), "linen", 0.05, "mattress")]
    each, rng = w / pillows, choices.stream("pattern")
    stacked = choices.chance("count", 0.5)  # fuller, the second row on the first; one row leans at the head
    rows = [(0.13, 0.27, -0.5), (0.24, 0.1, -1.25)] if stacked else [(0.115, 0.24, 0.35)]
    full, power = (0.13, 2.5) if stacked else (0.105, 3.2)
    for (high, off, lean), i in product(rows, range(pillows)):
        place = (-w / 2 + each * (i + 0.5), low + thick + high, z0 + off)
        turn = rotation(x=lean, y=rng.uniform(-0.08, 0.08))
        half = (min(each * 0.46, 0.38), full, 0.25)
        parts.append(replace(pillow(place, half, "linen", "pillow", turn), power=power))
    start = z0 + (z1 - z0) * choices.between("spread", 0.28, 0.42)
    x, y, top = w * 0.53 + 0.02 + 0.03 * style.softness, low - 0.11, low + thick + 0.09
    end = z1 + (0.1 + 0.02 * style.softness if falls else 0.03)
    cloth = str(choices.stream("cover").choice(COVERS))
    parts.append(cover((-x, y, start), (x, top, end), cloth, 0.12, 0.085, rng, falls=falls))
    fold = 0.16 + 0.1 * style.softness  # the sheet turned back over it
    x, y = x + 0.012, low + thick * 0.4
    parts.append(cover((-x, y, start - 0.01), (x, top + 0.02, start + fold), "linen", 0.06, 0.01, rng))
    return parts


def bed(size: Size, style: Style, choices: Choices, pillows: int) -> list[Solid]:
    """A frame on legs or a plinth, a headboard, bedding, perhaps a footboard."""
    w, h, d = size
    z0, z1 = -d / 2, d / 2
    wide = w - (0.0 if choices.chance("form", 0.75) else min(0.5, w * 0.2))
    frame = wide * 0.99
    foot = 0.06 if style.legs in ("plinth", "bun") else float(np.clip(style.leg_height + 0.06, 0.1, 0.25))
    rail = choices.between("share", 0.12, 0.24)
    deck = min(foot + rail, 0.42)
    head = 0.13
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled", "splayed") else "straight"
    near = z0 + 0.03  # the frame reaches into the headboard
    parts: list[Solid] = [
        replace(part, centre=part.centre + np.array([0, 0, 0.015]))
        for part in base(style, frame * 0.98, (d - 0.03) * 0.98, foot, 0.07 * style.bulk, kind)
    ]
    parts.append(box((-frame / 2, foot, near), (frame / 2, foot + 0.015, z1 - 0.03), role="rail"))
    board = style.headboard in ("slats", "posts", "arched") and choices.chance("second", 0.6)
    end = z1 - (0.052 if board else 0.0)  # a footboard stands before the frame, not in it
    upholstered = style.softness > 0.5
    stuff, radius = ("fabric", 0.025) if upholstered else ("wood", 0.004 + 0.008 * style.edge)
    t = 0.07 if upholstered else 0.04
    parts += both(box((frame / 2 - t, foot, near), (frame / 2, deck, end), stuff, radius, "rail"))
    parts += [box((-frame / 2, foot, z), (frame / 2, deck, z + t), stuff, radius, "rail") for z in (near, end - t)]
    inner = frame / 2 - t / 2
    parts.append(box((-inner, deck - 0.09, z0 + head), (inner, deck - 0.06, end - t / 2), role="rail"))
    parts.append(core((-frame / 2, foot, near), (frame / 2, deck, z1), stuff))
    parts += of_role("headboard", _headboard(style, w, h, z0))
    parts += bedding(frame * 0.95, z0 + head, end - 0.04, deck - 0.06, choices, style, pillows, falls=not board)
    if board:
        tall = deck + min(0.17, 0.35 * (h - deck))
        x, back = frame / 2, z1 - 0.055
        ends = both(box((x - 0.07, 0, back), (x, tall, z1), "wood", 0.01))
        bar = box((-x, tall - 0.07, back), (x, tall, z1), "wood", 0.01)
        panel = box((0.03 - x, foot, back + 0.01), (x - 0.03, tall - 0.05, z1 - 0.012))
        parts += of_role("footboard", [*ends, bar, panel])
    return parts


def double_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two pillows, or four in a broad bed."""
    return bed(size, style, choices, 2 if size[0] < 2.4 else 3)


def single_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """One pillow."""
    return bed(size, style, choices, 1)
