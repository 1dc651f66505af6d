"""Seats without a back: stools, benches and ottomans."""

from __future__ import annotations

from dataclasses import replace

from echomodel.furniture.backs import seat_of
from echomodel.furniture.carpentry import Size, base, box, cushion, top, within
from echomodel.furniture.choices import Choices
from echomodel.furniture.solids import Solid, ball, turned
from echomodel.furniture.style import Style


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
    seat = replace(
        top(shape, w, d, h, thick, style, "fabric" if style.softness > 0.4 else "wood"), rounding=thick * 0.4,
        role="seat",
    )  # fmt: skip
    outside = legs == "splayed"  # feet may reach beyond the seat, their heads do not
    inner = 0.8 if outside and shape == "round" else within(shape, style)
    return [
        seat,
        *base(style, w * inner, d * inner, h - thick * 0.8, 0.032 * style.bulk, legs, tie=style.contrast > 0.5),
    ]


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
    parts: list[Solid] = (
        base(style, w * inner, d * inner, foot + min(0.03, h * 0.1), 0.04 * style.bulk, kind) if foot else []
    )
    if alike and style.round_tops > 0.45:
        if foot == 0 and style.softness > 0.6:
            return [ball((0, h / 2, 0), (w / 2, h / 2, d / 2), "fabric", "seat", power=2.6)]
        return [
            *parts,
            turned(
                (0, foot, 0),
                (w / 2, d / 2),
                h - foot,
                rounding=0.1 * h + 0.15 * h * style.softness,
                material="fabric",
                role="seat",
            ),
        ]
    split = foot + (h - foot) * 0.5
    return [
        *parts,
        box((-w / 2 * 0.97, foot, -d / 2 * 0.97), (w / 2 * 0.97, split + 0.02, d / 2 * 0.97), "fabric", 0.012, "base"),
        cushion((-w / 2, split, -d / 2), (w / 2, h, d / 2), style),
    ]
