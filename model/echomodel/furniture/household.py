"""What houses have besides: coats and shoes, toys, music, warmth, a table outdoors, plants in pots, television."""

from itertools import product

import numpy as np

from echomodel.furniture.carpentry import Size, both, box, four, of_role, post
from echomodel.furniture.cloth import cover
from echomodel.furniture.fronts import carcass, front
from echomodel.furniture.solids import Solid, ball, tube, turned
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late

SLAT = 0.09  # metres, width of a slat outdoors
GRIP = 0.03  # metres that handles stand out


def coat_rack(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A panel with hooks and a shelf for hats above a bench, or a rail of steel on two posts."""
    w, h, d = size
    hooks: list[Solid] = []
    y, count = min(1.65, 0.86 * h), max(3, round(w / 0.18))
    if choices.chance("kind", 0.4):
        x, z = w / 2 - 0.02, d / 2 - 0.014
        posts = both(tube([[x, 0.014, -z], [x, 0.014, z]], 0.014), tube([[x, 0.01, 0.0], [x, h - 0.014, 0.0]], 0.014))
        posts.append(tube([[-x, h - 0.014, 0.0], [x, h - 0.014, 0.0]], 0.014))
        shelf = box((-x, 0.16, -d / 2 + 0.03), (x, 0.18, d / 2 - 0.03), role="shelf")
        return [*of_role("post", posts, material="metal"), shelf]
    z = -d / 2 + 0.03
    parts: list[Solid] = [
        box((-w / 2, 0, -d / 2), (w / 2, h, z), "accent", 0.003, "panel"),
        box((-w / 2, h - 0.025, -d / 2), (w / 2, h, min(d / 2, z + 0.27)), "wood", 0.003, "shelf"),
        box((-w / 2, 0.43, z - 0.004), (w / 2, 0.47, d / 2), "wood", 0.004, "seat"),
    ]
    parts += both(box((w / 2 - 0.03, 0, z - 0.004), (w / 2, 0.432, d / 2 - 0.01), "wood", 0.0, "side"))
    for x in np.linspace(-w / 2 + 0.1, w / 2 - 0.1, count):
        bend = np.array([[x, y, z - 0.004], [x, y - 0.01, z + 0.05], [x, y + 0.03, z + 0.075]])
        hooks.append(tube(bend, 0.008, "metal", "hook"))
    return parts + hooks


def shoe_cabinet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A shallow case of flaps, one above the other, on a plinth."""
    w, h, d = size
    parts, (x0, y0, x1, y1, z) = carcass(np.array([w, h, d - GRIP]), style, 0.06, kind="plinth")
    return parts + front((x0, y0), (x1, y1), z, max(1, round((h - 0.06) / 0.38)), 1 if w < 0.8 else 2, "drawer", style)


def radiator(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A flat radiator with vertical ribs on two brackets, its valve at one side; or columns of tubes."""
    w, h, d = size
    parts: list[Solid] = []
    low = 0.1
    if choices.chance("kind", 0.35):
        columns = np.linspace(-w / 2 + 0.03, w / 2 - 0.03, max(3, round(w / 0.06)))
        for x, z in product(columns, (0.022 - d / 2, d / 2 - 0.022)):
            parts.append(tube([[x, low, z], [x, h - 0.022, z]], 0.022))
        for y in (low + 0.02, h - 0.04):
            parts.append(box((-w / 2, y - 0.02, 0.02 - d / 2), (w / 2, y + 0.02, d / 2 - 0.02)))
    else:
        parts.append(box((-w / 2, low, -d / 2 + 0.03), (w / 2, h, d / 2 - 0.012), radius=0.004))
        for x in np.arange(-w / 2 + 0.04, w / 2 - 0.02, 0.05):
            parts.append(box((x - 0.012, low + 0.03, d / 2 - 0.014), (x + 0.012, h - 0.03, d / 2), radius=0.004))
    feet = both(box((0.35 * w - 0.02, 0, -d / 2), (0.35 * w + 0.02, low + 0.05, 0.0)))
    return [*of_role("body", parts, material="enamel"), *of_role("foot", feet, material="metal")]


def fireplace(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A mantel on two piers about a dark hearth with logs, or a stove of steel behind a pane."""
    w, h, d = size
    if choices.chance("kind", 0.4):
        body = box((-w / 2, 0.08, -d / 2), (w / 2, h, d / 2 - 0.02), "screen", 0.01, "stove")
        pane = box((-0.36 * w, 0.4 * h, d / 2 - 0.024), (0.36 * w, 0.85 * h, d / 2), "glass", 0.0, "pane")
        return [body, pane, *four(post(0.4 * w, 0.35 * d, 0.02, 0, 0.084, "metal", 0.0, "leg"))]
    pier, top = 0.17 * w, h - 0.06
    inner = d / 2 - 0.05
    parts: list[Solid] = [
        box((-w / 2, top, -d / 2), (w / 2, h, d / 2), "ceramic", 0.006, "stone"),
        box((-w / 2 + 0.03, 0.7 * h, -d / 2), (w / 2 - 0.03, top + 0.004, inner), "ceramic", 0.004, "stone"),
        box((-w / 2 + 0.03, 0, -d / 2), (w / 2 - 0.03, 0.72 * h, -d / 2 + 0.06), "screen", 0.0, "hearth"),
        box((-w / 2 + 0.03, 0, -d / 2), (w / 2 - 0.03, 0.06, inner), "ceramic", 0.002, "stone"),
    ]
    parts += both(box((w / 2 - pier, 0, -d / 2), (w / 2 - 0.03, 0.72 * h, inner), "ceramic", 0.004, "stone"))
    places = (0.1, -0.05), (0.1, 0.03), (0.1 + 0.06, -0.01)
    logs = [tube([[-0.2 * w, y, z], [0.2 * w, y, z]], 0.042) for y, z in places]
    return parts + of_role("log", logs, material="stem")


def piano(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """An upright: its case, the keys on their bed before it, a lid, legs and pedals."""
    w, h, d = size
    z, keys, t = d / 2 - 0.3, 0.72, 0.035
    material = choices.pick("cover", ["screen", "wood"], [0.55, 0.45])
    parts: list[Solid] = [
        box((-w / 2, 0, -d / 2), (w / 2, h - 0.03, z), material, 0.004, "case"),
        box((-w / 2, h - 0.034, -d / 2), (w / 2, h, z + 0.02), material, 0.004, "lid"),
        box((-w / 2, keys - 0.1, z - 0.004), (w / 2, keys - 0.02, d / 2), material, 0.004, "bed"),
        box((-w / 2 + t, keys - 0.024, z), (w / 2 - t, keys, d / 2 - 0.03), "enamel", 0.001, "keys"),
        box((-0.45 * w, keys + 0.2, z - 0.004), (0.45 * w, keys + 0.22, z + 0.03), material, 0.0, "desk"),
    ]
    x = w / 2 - t / 2
    cheek = box((x - t / 2, keys - 0.03, z - 0.004), (x + t / 2, keys + 0.1, d / 2), material, 0.004, "cheek")
    leg = box((x - t / 2, 0, d / 2 - 0.07), (x + t / 2, keys - 0.09, d / 2 - 0.02), material, 0.004, "leg")
    parts += both(cheek, leg)
    pitch = (w - 2 * t) / 52
    half, y0, y1, z1 = 0.3 * pitch, keys - 0.004, keys + 0.01, d / 2 - 0.12
    for k in range(51):
        if k % 7 not in (1, 4):  # from A: no black key between B and C, E and F
            x = -w / 2 + t + (k + 1) * pitch
            parts.append(box((x - half, y0, z), (x + half, y1, z1), "screen", 0.0, "keys"))
    return parts + both(box((0.06 - 0.012, 0.03, z - 0.01), (0.06 + 0.012, 0.045, z + 0.09), "metal", 0.0, "pedal"))


def cot(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A child's bed behind bars on four posts, its mattress half way up."""
    w, h, d = size
    x, z, t = w / 2 - 0.02, d / 2 - 0.02, 0.02
    low, floor = 0.12, min(0.35, 0.4 * h)
    parts = four(post(x, z, t, 0, h, "wood", 0.004, "leg"))
    for y in (low, h - 0.05):
        parts += both(box((-x, y, z - 0.013), (x, y + 0.04, z + 0.013), role="rail"), axis=2)
        parts += both(box((x - 0.013, y, -z), (x + 0.013, y + 0.04, z), role="rail"))
    along, across = (np.arange(0.08 - half, half - 0.05, 0.075) for half in (z, x))
    for a, b in [*product((-x, x), along), *product(across, (-z, z))]:
        parts.append(tube([[a, low + 0.02, b], [a, h - 0.03, b]], 0.008, role="bar"))
    slab = box((-x, floor - 0.03, -z), (x, floor, z), role="slats")
    mattress = box((-x + 0.03, floor - 0.002, -z + 0.03), (x - 0.03, floor + 0.1, z - 0.03), "linen", 0.02, "mattress")
    one, other = (-x + 0.025, floor + 0.03, -0.2 * d), (x - 0.025, floor + 0.125, z - 0.028)
    return [*parts, slab, mattress, cover(one, other, "blanket", 0.02, 0.015, choices.stream("pattern"))]


def toy_box(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A chest with a lid and two holes to carry it by, on wheels or on the floor."""
    w, h, d = size
    foot = 0.05 if choices.chance("raised", 0.5) else 0.0
    parts: list[Solid] = [
        box((-w / 2 + 0.012, foot, -d / 2 + 0.012), (w / 2 - 0.012, h - 0.025, d / 2 - 0.012), "wood", 0.006, "body"),
        box((-w / 2, h - 0.028, -d / 2), (w / 2, h, d / 2), "accent", 0.01, "lid"),
        box((-0.08, 0.62 * h, d / 2 - 0.016), (0.08, 0.72 * h, d / 2 - 0.006), "accent", 0.0, "handle"),
    ]
    if foot:
        parts += of_role("foot", four(ball((w / 2 - 0.06, 0.027, d / 2 - 0.06), 0.027)), material="screen")
    return parts


def garden_table(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Slats on a frame and four legs, rain falls through."""
    w, h, d = size
    material = choices.pick("cover", ["wood", "metal"], [0.7, 0.3])
    t, x, z = 0.025, w / 2 - 0.05, d / 2 - 0.05
    parts: list[Solid] = [box((-w / 2, h - t, z0), (w / 2, h, z1), material, 0.003, "top") for z0, z1 in _slats(d)]
    parts += both(box((x - 0.02, h - t - 0.06, -z), (x + 0.02, h - t + 0.003, z), material, 0.0, "apron"))
    parts += both(box((-x, h - t - 0.06, z - 0.02), (x, h - t, z + 0.02), material, 0.0, "apron"), axis=2)
    return parts + four(post(x, z, 0.025, 0, h - t, material, 0.003, "leg"))


def garden_chair(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A slatted seat and back between two frames with arms."""
    w, h, d = size
    seat, t, x = 0.43, 0.02, w / 2 - 0.02
    slats = _slats(d - 0.08)
    parts: list[Solid] = [box((-x, seat - t, z0), (x, seat, z1), "wood", 0.003, "seat") for z0, z1 in slats]
    parts += both(
        box((x - t, 0, -d / 2), (x + t, h, -d / 2 + 0.04), "wood", 0.004, "leg"),
        box((x - t, 0, d / 2 - 0.04), (x + t, 0.64, d / 2), "wood", 0.004, "leg"),
        box((x - t, seat - 0.07, -d / 2), (x + t, seat - t + 0.003, d / 2), role="apron"),
        box((x - t, 0.635, -d / 2), (x + t, 0.665, d / 2), "wood", 0.006, "arm"),
    )
    for y in np.arange(seat + 0.08, h - 0.06, 0.1):
        parts.append(box((-x, y, -d / 2 + 0.008), (x, y + 0.07, -d / 2 + 0.03), "wood", 0.003, "back"))
    return parts


def _slats(depth: float) -> list[tuple[float, float]]:
    """Slats over a depth, with gaps of a centimetre."""
    count = max(2, round(depth / SLAT))
    pitch = (depth + 0.01) / count
    return [(-depth / 2 + k * pitch, -depth / 2 + (k + 1) * pitch - 0.01) for k in range(count)]


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
