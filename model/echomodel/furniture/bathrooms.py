"""Bathrooms and laundries: porcelain and enamel, taps, glass, and what washes.

Heights and places after VDI 6000: seats at 0.42 m, basins at 0.85 m, showers from 0.8 x 0.8 m.
"""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from echomodel.furniture.bent import bent
from echomodel.furniture.carpentry import Size, around, both, box, of_role, post
from echomodel.furniture.fronts import front
from echomodel.furniture.kitchens import spout
from echomodel.furniture.solids import Solid, rotation, tube, turned
from echomodel.furniture.style import Choices, Style

SEAT = 0.42  # metres
GLASS = 0.008  # metres
TAP = 0.13  # metres over a rim
enamelled = partial(turned, power=2.6, material="enamel")


def toilet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A bowl with seat and lid before a cistern, standing on a foot or hung on a cased frame."""
    w, h, d = size
    hung = choices.chance("kind", 0.5)
    seat = min(SEAT, 0.62 * h)
    back = 0.16 if hung else 0.19
    z0 = -d / 2 + back
    middle, half = (z0 + d / 2) / 2, (d / 2 - z0) / 2
    tank = (w / 2, h) if hung else (0.46 * w, h)
    low = 0.1 if hung else 0.0
    bowl = enamelled((0, low, middle - 0.02), (0.27 * w, 0.6 * half), seat - 0.03 - low, (0.46 * w, half - 0.01),
                     role="bowl")  # fmt: skip
    lid = enamelled((0, seat - 0.032, middle), (0.48 * w, half), 0.032, (0.47 * w, half), rounding=0.008, role="lid")
    plate = box((-0.1, h - 0.1, z0 - 0.003), (0.1, h - 0.03, z0 + 0.008), "metal", 0.003, "plate")
    if not hung:
        plate = box((-0.03, h - 0.004, -d / 2 + 0.06), (0.03, h + 0.006, -d / 2 + 0.12), "metal", 0.003, "button")
    case = box((-tank[0], 0 if hung else seat - 0.05, -d / 2), (tank[0], h, z0), "enamel", 0.008, "cistern")
    joined = box((-0.3 * w, low + 0.02, z0 - 0.02), (0.3 * w, seat - 0.035, middle), "enamel", 0.0, "bowl")
    return [bowl, lid, case, plate, joined]


def washbasin(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A basin on a cabinet of drawers or doors, or on a slim column."""
    w, _, d = size
    h = float(size[1]) - TAP
    half, z0, z1 = min(0.38 * w, 0.3), -d / 2 + 0.13, d / 2 - 0.05
    thick = 0.13
    rim = around((-w / 2, w / 2, -d / 2, d / 2), (-half, half, z0, z1), h - thick, h, "enamel", "basin", 0.006)
    bottom = (-half - 0.006, h - thick, z0 - 0.006), (half + 0.006, h - thick + 0.012, z1 + 0.006)
    rim.append(box(*bottom, "enamel", 0.0, "basin"))
    rim += spout(0.0, h, (z0 - d / 2) / 2, TAP, 0.1)
    if w < 0.62 and choices.chance("kind", 0.35):
        column = turned((0, 0, -0.05), (0.11, 0.1), h - thick + 0.004, 0.085, power=2.8, material="enamel", role="foot")
        return [*rim, column]
    foot = 0.25 if choices.chance("raised", 0.6) else 0.08
    x, z = w / 2 - 0.02, d / 2 - 0.05
    body = box((-x, foot, -d / 2), (x, h - thick + 0.004, z), "wood", 0.0, "body")
    ends = 0.06 - d / 2, z - 0.05
    legs = both(*(post(x - 0.05, end, 0.015, 0, foot + 0.004, "metal", 0.0, "leg") for end in ends))
    kind, rows, columns = ("drawer", 2, 1) if choices.chance("front", 0.6) else ("door", 1, 2 if w > 0.6 else 1)
    return [*rim, body, *legs, *front((-x, foot), (x, h - thick), z, rows, columns, kind, style)]


def shower(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A flat tray in a corner behind two panes, one of which is a door, with a rain head on its rail."""
    w, h, d = size
    tray = 0.05
    x, z = w / 2, d / 2
    parts: list[Solid] = [box((-x, 0, -z), (x, tray, z), "enamel", 0.006, "tray")]
    parts.append(turned((0, tray - 0.002, 0), 0.05, 0.006, material="metal", role="drain"))
    parts.append(box((x - 0.02, tray - 0.002, -z), (x - 0.02 + GLASS, h, z - 0.012), "glass", 0.0, "pane"))
    if not choices.chance("kind", 0.3):  # else one walks in at its front
        parts.append(box((-x + 0.02, tray - 0.002, z - 0.02), (x - 0.02, h, z - 0.02 + GLASS), "glass", 0.0, "pane"))
        grip = [[-x + 0.12, y, at] for y, at in ((0.95, z - 0.015), (0.95, z), (1.2, z), (1.2, z - 0.015))]
        parts.append(tube(grip, 0.007, "metal", "handle"))
    top = h - 0.08
    rail = np.array([[0, 0.95, -z + 0.03], [0, top, -z + 0.03], [0, top + 0.03, -z + 0.1], [0, top + 0.02, -0.1 * d]])
    head = turned((0, top - 0.005, -0.1 * d), 0.11, 0.02, 0.1)
    mixer = box((-0.12, 1.0, -z), (0.12, 1.05, -z + 0.055), radius=0.008)
    wall = box((-0.012, 0.95, -z), (0.012, 0.975, -z + 0.035))
    foot = box((-0.012, tray - 0.002, -z), (0.012, 1.0, -z + 0.012))  # pipes, up the wall
    return parts + of_role("shower_head", [tube(rail, 0.01), head, mixer, wall, foot], material="metal")


def bathtub(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A trough behind an apron, or a free shell that swells to its rim."""
    w, _, d = size
    h = float(size[1]) - TAP
    wall, floor = 0.06, 0.1
    x, z = w / 2 - wall, d / 2 - wall
    taps = spout(0.42 * w - wall, h, -d / 2 + 0.035, TAP, 0.14)
    if choices.chance("kind", 0.3):
        shell = enamelled((0, 0, 0), (0.42 * w, 0.4 * d), floor, (w / 2, d / 2), role="shell")
        half = bent((0, floor - 0.004, 0), (w / 2, d / 2), wall, h - floor, h - floor, power=2.6, material="enamel",
                    role="shell")  # fmt: skip
        return [shell, half, replace(half, turn=rotation(y=np.pi)), *spout(0.0, h, wall / 2 - d / 2, TAP, 0.14)]
    base = box((-w / 2, 0, -d / 2), (w / 2, floor, d / 2), "enamel", 0.0, "shell")
    rim = around((-w / 2, w / 2, -d / 2, d / 2), (-x, x, -z, z), floor - 0.004, h, "enamel", "shell", 0.012)
    return [base, *rim, *taps]


def mirror_cabinet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A shallow cupboard whose doors are mirrors, a light above."""
    w, h, d = size
    top = h - 0.03
    body = box((-w / 2, 0, -d / 2), (w / 2, top, d / 2 - 0.02), "wood", 0.0, "body")
    edges = np.linspace(-w / 2, w / 2, (3 if w > 0.9 else 2 if w > 0.5 else 1) + 1).tolist()
    doors = [
        box((low + 0.002, 0.002, d / 2 - 0.024), (high - 0.002, top - 0.002, d / 2), "mirror", 0.002, "door")
        for low, high in pairwise(edges)
    ]
    return [body, *doors, box((-0.35 * w, top - 0.004, -0.02), (0.35 * w, h, d / 2), "shade", 0.004, "light")]


def towel_radiator(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Two uprights and rungs in groups, on brackets at the wall."""
    w, h, d = size
    x, z, rungs = w / 2 - 0.02, d / 2 - 0.02, max(6, round(h / 0.07))
    parts = both(post(x, z, 0.02, 0, h, "enamel", 0.006, "upright"))
    for number, y in enumerate(np.linspace(0.05, h - 0.05, rungs).tolist()):
        if number % 6 != 5:
            parts.append(tube([[-x, y, z], [x, y, z]], 0.011, "enamel", "rung"))
    for y in (0.12 * h, 0.88 * h):
        parts += both(box((x - 0.012, y, -d / 2), (x + 0.012, y + 0.024, z), "metal", 0.0, "bracket"))
    return parts


def washing_machine(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """An enamelled cube with a round door of glass and a row of switches."""
    w, h, d = size
    z = d / 2 - 0.035
    centre, ahead = np.array([0, 0.45 * h, z - 0.004]), rotation(x=np.pi / 2)

    def disc(radius: float, deep: float, material: str, role: str) -> Solid:
        return turned(centre, radius, deep, turn=ahead, material=material, role=role)

    knob = turned((0.12, h - 0.075, z), 0.025, 0.025, 0.022, turn=ahead)
    return [
        box((-w / 2, 0, -d / 2), (w / 2, h, z), "enamel", 0.006, "machine"),
        box((-w / 2 + 0.02, h - 0.12, z - 0.004), (w / 2 - 0.02, h - 0.03, z + 0.004), "screen", 0.0, "switches"),
        box((-w / 2 + 0.03, h - 0.115, z), (-w / 2 + 0.2, h - 0.035, z + 0.012), "enamel", 0.002, "drawer_front"),
        *of_role("knob", [knob], material="metal"),
        disc(0.19, 0.022, "metal", "door"),
        disc(0.155, 0.032, "screen", "door"),
        box((0.16, 0.43 * h, z), (0.19, 0.47 * h, z + 0.035), "metal", 0.004, "handle"),
    ]
