"""Plants in pots and television sets."""

from __future__ import annotations

import numpy as np

from echomodel.furniture.carpentry import Size, both, box, of_role
from echomodel.furniture.solids import Solid, tube, turned
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late

grown, species = Late("echomodel.furniture.plants:grown"), Late("echomodel.furniture.plants:species")
SMALL = 0.55  # metres: lower plants are those of tables
PANEL = (16 / 9, 21 / 9)  # width over height of a screen with its bezel


def plant(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A pot, perhaps on a stand, with one of the species of `plants.toml`."""
    w, h, d = size
    reach = min(w, d) / 2
    pot_h = float(np.clip(h * choices.between("share", 0.18, 0.32), 0.12, 0.5))
    pot_r = float(np.clip(reach * choices.between("spread", 0.45, 0.7), 0.08, 0.28))
    power = 2.0 if style.profile == "round" or style.corner > 0.4 else 6.0
    foot = 0.0
    parts: list[Solid] = []
    if style.legs in ("tapered", "splayed", "hairpin") and choices.chance("raised", 0.45):
        foot = min(0.2, h * 0.15)
        for a in np.arange(4) * np.pi / 2 + np.pi / 4:
            x, z = pot_r * 1.05 * np.cos(a), pot_r * 1.05 * np.sin(a)
            parts.append(tube([[x, 0, z], [x * 0.9, foot + pot_h * 0.5, z * 0.9]], 0.014, role="leg"))
    waist = 0.6 + 0.35 * style.taper
    parts.append(turned((0, foot, 0), pot_r * waist, pot_h, pot_r, power=power, material="ceramic", role="pot"))
    level = (0, foot + pot_h * 0.98, 0)
    parts.append(turned(level, pot_r * 0.9, pot_h * 0.04, power=power, material="soil", role="soil"))
    kind = choices.pick("kind", species("floor" if h > SMALL else "table"))
    return parts + grown(kind, foot + 0.98 * pot_h, size, pot_r, choices.stream("detail"))


def tv(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A thin panel with a bezel, its electronics in a lower box behind, on two feet, a foot plate, or none."""
    w, h, d = size
    kinds, odds = ["feet", "plate", "wall"], [0.45, 0.35, 0.2]
    hung = d < 0.1 and w / h >= PANEL[0]
    kind = choices.pick("kind", kinds, odds) if hung else choices.pick("kind", kinds[:2], odds[:2])
    low = 0.0 if kind == "wall" else float(np.clip(0.08 * h, 0.03, 0.09))
    low = max(low, h - w / PANEL[0])  # a box that is too high has higher feet, no higher screen
    w = min(w, PANEL[1] * (h - low))
    back, face = (-d / 2, d / 2) if kind == "wall" else (-min(d, 0.07) / 2, min(d, 0.07) / 2)
    thin = max(face - 0.022, (back + face) / 2)  # the panel; what is behind it is lower and narrower
    edge, chin = 0.012, 0.02 + 0.02 * style.contrast
    body: list[Solid] = [
        box((-w / 2, low, thin), (w / 2, h, face), "metal", 0.004),
        box((-w * 0.38, low + 0.04 * h, back), (w * 0.38, low + 0.52 * (h - low), thin + 0.004), "metal", 0.012),
    ]
    glass = box((-w / 2 + edge, low + chin, thin + 0.004), (w / 2 - edge, h - edge, face + 0.0015), "screen")
    parts = [*of_role("housing", body), *of_role("screen", [glass])]
    feet: list[Solid] = []
    if kind == "feet":
        top = [w * 0.34, low + 0.03, (back + thin) / 2]
        for reach in (-d / 2 + 0.006, d / 2 - 0.006):
            feet.append(tube([top, [w * 0.35, low * 0.6, reach * 0.4], [w * 0.37, 0.008, reach]], 0.008))
        feet = both(*feet)
    elif kind == "plate":
        feet = [box((-w * 0.17, 0, -d / 2), (w * 0.17, 0.012, d / 2), radius=0.005)]
        feet.append(box((-w * 0.05, 0, back), (w * 0.05, low + 0.1 * h, back + 0.014)))
    return parts + of_role("foot", feet, material="metal")
