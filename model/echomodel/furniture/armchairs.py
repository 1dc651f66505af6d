"""Armchairs and lounge chairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.furniture.backs import chair_legs, leaning, slim_arms
from echomodel.furniture.carpentry import Size, base, box, cushion, of_role
from echomodel.furniture.choices import Choices
from echomodel.furniture.solids import Solid, bent, rotation, turned
from echomodel.furniture.style import Style


def armchair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Upholstered: a tub with a curved wall, or a body with arms, a seat cushion and a back cushion."""
    w, h, d = size
    foot = min(style.leg_height * 0.9, 0.16) if style.legs not in ("plinth", "bun") else 0.05
    seat = 0.43 if h > 0.6 else h * 0.6
    kind = style.legs if style.legs not in ("trestle", "hairpin", "sled") else "tapered"
    curved = style.arms == "shell" or style.back == "shell"
    inside = 0.72 if curved else 0.86
    parts: list[Solid] = base(style, w * inside, d * inside, foot, 0.045 * style.bulk, kind)
    if curved:
        wall = 0.09 + 0.05 * style.softness
        arms = foot + (h - foot) * (0.6 + 0.3 * style.arm_height)
        power = 2.2 + 3 * style.corner
        parts.append(bent((0, foot, d * 0.42), (w / 2, d * 0.92), wall, h - foot, arms - foot, power=power, ease=2.5))
        low = turned(
            (0, foot, 0),
            (w / 2 - wall * 0.7, d * 0.45),
            (seat - foot) * 0.62,
            power=power + 1,
            material="fabric",
            role="base",
        )
        disc = turned(
            (0, foot + (seat - foot) * 0.6, d * 0.04),
            (w / 2 - wall, d * 0.44),
            (seat - foot) * 0.4,
            power=power + 1,
            rounding=0.05 * style.softness,
            material="fabric",
            role="seat",
        )
        return [*parts, low, disc]
    if style.arms in ("slim", "none"):
        arm = 0.035
        frame = style.arms == "slim"
        inner = w - (2 * arm + 0.02 if frame else 0)
        legs = chair_legs(style, w * 0.96, d * 0.9, seat - 0.12, 0.04 * style.bulk, tie=False)
        pad = cushion((-inner / 2, seat - 0.15, -d * 0.42), (inner / 2, seat, d / 2), style)
        z = -d * 0.42
        one, other = (-inner / 2, seat - 0.1, z - 0.06), (inner / 2, h * 0.99, z + 0.06)
        back = leaning(one, other, style.rake, seat, z, material="fabric", radius=0.05)
        frame_under = box((-w * 0.47, seat - 0.17, -d * 0.43), (w * 0.47, seat - 0.13, d * 0.45), "wood", 0.006, "rail")
        return [*legs, frame_under, pad, back, *(slim_arms(w, d, seat, h, style, arm) if frame else [])]
    arm = w * (0.13 + 0.06 * style.softness)
    y_arm = seat + (h - seat) * (0.2 + 0.5 * style.arm_height)
    one, other = (-w / 2 + 0.02, foot, -d / 2 + 0.02), (w / 2 - 0.02, seat - 0.12, d / 2 - 0.02)
    parts.append(box(one, other, "fabric", 0.02, "base"))
    parts += upholstered_arms(w, foot, y_arm, d, arm, style)
    one, other = (-w / 2 + arm * 0.5, foot + 0.05, -d / 2), (w / 2 - arm * 0.5, h, -d / 2 + 0.16)
    soft = 0.03 + 0.04 * style.softness
    back = leaning(one, other, style.rake * 0.6, seat, -d / 2 + 0.08, material="fabric", radius=soft)
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
            parts.append(
                box((x0 + arm * 0.14, foot, -d / 2 + 0.03), (x1 - arm * 0.14, y - r, d / 2 - 0.02), "fabric", 0.015)
            )
            parts.append(
                turned(
                    (x, y - r, -d / 2 + 0.03), r, d - 0.05, rounding=0.02, turn=rotation(x=np.pi / 2), material="fabric"
                )
            )
        else:
            parts.append(
                cushion(
                    (x0, foot, -d / 2 + 0.01), (x1, y, d / 2 - 0.01), replace(style, softness=min(style.softness, 0.8))
                )
            )
    return of_role("arm", parts)


def lounge_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Low and leaning: a raked seat and back on a frame, a shell on four legs or a swivel foot, or an egg."""
    w, h, d = size
    seat = min(0.4, h * 0.5)
    kind = choices.pick("kind", ["frame", "shell", "swivel"], [0.45, 0.35, 0.2])
    if kind == "frame":
        tilt, rake = 0.12, 0.2 + style.rake
        parts: list[Solid] = chair_legs(style, w * 0.96, d * 0.86, seat * 0.8, 0.04 * style.bulk, tie=False)
        pad = cushion((-w * 0.43, seat - 0.12, -d * 0.36), (w * 0.43, seat, d * 0.5), style, turn=rotation(x=-tilt))
        z = -d * 0.3
        one, other = (-w * 0.43, seat - 0.06, z - 0.05), (w * 0.43, seat + (h - seat) / np.cos(rake), z + 0.05)
        back = leaning(one, other, rake, seat, z, material="fabric", radius=0.045)
        x, y, t = w * 0.48, seat * 0.8, 0.04 * style.bulk
        rails: list[Solid] = [
            box((s * x - t * (s > 0), y - t, -d * 0.43), (s * x + t * (s < 0), y, d * 0.43), role="rail")
            for s in (-1, 1)
        ]
        rails += [box((-x, y - t, z - t / 2), (x, y, z + t / 2), role="rail") for z in (-d * 0.3, d * 0.36)]
        arms = slim_arms(w, d, seat, h, style, 0.035) if style.arms != "none" else []
        return [*parts, *rails, pad, back, *arms]
    wall = 0.05 + 0.05 * style.softness
    foot = seat * 0.5
    arms = foot + (h - foot) * (0.3 + 0.25 * style.arm_height)
    body: list[Solid] = [
        bent((0, foot, d * 0.32), (w / 2, d * 0.8), wall, h - foot, arms - foot, power=2.6 + style.corner, ease=2.6),
        turned(
            (0, foot, d * 0.02),
            (w * 0.42, d * 0.42),
            seat - foot,
            (w * 0.46, d * 0.46),
            power=2.6,
            rounding=0.05,
            material="fabric",
            role="seat",
        ),
    ]
    if kind == "swivel":
        stem = turned((0, 0, 0), 0.03, foot, material="metal")
        disc = turned((0, 0, 0), w * 0.34, 0.025, w * 0.3, material="metal")
        return [*body, *of_role("leg", [stem, disc])]
    legs = style.legs if style.legs in ("tapered", "splayed", "straight", "hairpin") else "splayed"
    return [*body, *base(style, w * 0.72, d * 0.7, foot + 0.02, 0.035 * style.bulk, legs)]
