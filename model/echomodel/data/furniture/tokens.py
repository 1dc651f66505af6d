"""One solid of a piece of furniture as a vector, its part token: words of its making and numbers relative to the box.

A kind, role, material, joint or mirror flag is told by one number per word, +1 for the one that holds; every number
lies in [-1, 1]. Positions are relative to the box (width 2, height 2, depth 2 about its middle), extents the square
root of their share of it, so that what spans the box says 1 and what is thin is said finely.
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from echomodel.data.furniture.assembly import MATERIALS
from echomodel.data.furniture.lathe import Blade, Lathe, wall
from echomodel.data.furniture.solids import IDENTITY, Array, Ball, Block, Shell, Solid, Tube, Turned
from echomodel.triangles import cross

RODS = {2: "rod", 3: "bent", 4: "double"}  # tubes by their points; others are curves, or rings where they close
PROFILES = {(2, True): "shade", (5, False): "bottle", (8, False): "sack", (8, True): "bell"}
KINDS = ("block", "turned", "ball", *RODS.values(), "curve", "ring", *PROFILES.values(), "blade", "shell")
ROLES = (
    "body", "leg", "seat", "back", "arm", "top", "bottom", "side", "shelf", "rail", "drawer", "door", "handle", "apron",
    "foot", "base", "caster", "stem", "shade", "bulb", "cord", "housing", "mattress", "cover", "pillow", "cushion",
    "headboard", "footboard", "guard", "ladder", "stairs", "house", "roof", "canopy", "seam", "upholstery", "mirror",
    "screen", "leaf", "pot", "soil", "book", "bottle",
)  # fmt: skip
JOINTS = ("fixed", "slides", "slides across", "turns")
MIRRORS = ("none", "x", "z", "both")
WORDS = {"kind": KINDS, "role": ROLES, "material": MATERIALS, "joint": JOINTS, "mirror": MIRRORS}
GROUPS = tuple(len(words) for words in WORDS.values())
HOT = sum(GROUPS)
STARTS = dict(zip(WORDS, accumulate(GROUPS, initial=0), strict=False))
CENTRE, TURN, EXTENT = slice(HOT, HOT + 3), slice(HOT + 3, HOT + 9), slice(HOT + 9, HOT + 12)
BODY = slice(HOT + 12, HOT + 17)  # centre of the moving body, the side it opens to, how far
SHAPE = slice(HOT + 17, HOT + 39)  # what the kind makes of these: radii, tapers, points of a tube or a profile
WIDTH = HOT + 39
KNOTS = 7  # points that stand for a tube
SPACING = 1e-3  # metres between points of a tube
THICKEST = 0.1  # metres: radius of a tube that is said as 1
USED = {  # numbers of SHAPE that a kind uses
    "block": 1, "turned": 6, "ball": 1, "blade": 2, "shell": 4, "shade": 5, "bottle": 10, "sack": 16, "bell": 17,
    **{name: 1 + 3 * KNOTS for name in (*RODS.values(), "curve")}, "ring": 2,
}  # fmt: skip


def word(token: Array, name: str) -> str:
    """The word of a kind of `WORDS` that a token (WIDTH,) says."""
    start = STARTS[name]
    return WORDS[name][int(token[start : start + len(WORDS[name])].argmax())]


def say(token: Array, name: str, said: str) -> None:
    """Write a word into a token (WIDTH,), in place; one that no token knows becomes the first."""
    start, words = STARTS[name], WORDS[name]
    token[start : start + len(words)] = -1.0
    token[start + (words.index(said) if said in words else 0)] = 1.0


def token_of(solid: Solid, size: Array) -> Array:
    """(WIDTH,) float64: a solid of a piece that stands in the box `size` (3,), metres; its joint is not told."""
    size = np.asarray(size, float)
    kind, centre, turn, extent, shape = _measured(solid)
    token = np.zeros(WIDTH)
    for name, said in (("kind", kind), ("role", solid.role), ("material", solid.material)):
        say(token, name, said)
    say(token, "joint", "fixed")
    say(token, "mirror", "none")
    token[CENTRE] = centre / size * 2 - [0, 1, 0]
    token[TURN] = turn[:, :2].T.ravel()
    token[EXTENT] = root_of(np.asarray(extent) / reach_of(turn, size))
    token[SHAPE][: len(shape)] = shape
    return token


def reach_of(turn: Array, size: Array) -> Array:
    """(3,) half of the box along the local axes of a turn (3, 3), metres."""
    return np.abs(turn.T) @ np.asarray(size, float) / 2


def turn_of(token: Array) -> Array:
    """The rotation matrix (3, 3) nearest to what a token says, by Gram and Schmidt."""
    x, y = token[TURN].reshape(2, 3)
    x = x / max(np.linalg.norm(x), 1e-6) if np.linalg.norm(x) > 1e-6 else IDENTITY[0]
    y = y - x * (x @ y)
    if np.linalg.norm(y) < 1e-6:
        y = IDENTITY[int(np.abs(x).argmin())]
        y = y - x * (x @ y)
    y = y / np.linalg.norm(y)
    return np.stack([x, y, cross(x, y)], axis=1)


def solid_of(token: Array, size: Array) -> Solid:
    """The solid that a token (WIDTH,) says, in the frame of the box `size` (3,), metres; without its joint."""
    size, token = np.asarray(size, float), np.asarray(token, float)
    kind, turn = word(token, "kind"), turn_of(token)
    look: dict[str, Any] = {"material": word(token, "material"), "role": word(token, "role")}
    centre = (token[CENTRE] + [0, 1, 0]) * size / 2
    half = np.maximum(share_of(token[EXTENT]) * reach_of(turn, size), 5e-4)
    shape = token[SHAPE]
    unit = (shape.clip(-1, 1) + 1) / 2
    if kind == "block":
        return Block(centre, turn, half=half, radius=float(unit[0] ** 2 * half.min()), **look)
    if kind == "ball":
        return Ball(centre, turn, half=half, power=_power(unit[0]), **look)
    if kind == "turned":
        low, high = (np.maximum(unit[i : i + 2], 0.02) * half[[0, 2]] for i in (0, 2))
        return Turned(
            centre - turn[:, 1] * half[1], turn, low=_two(low), high=_two(high), height=float(2 * half[1]),
            power=np.inf if unit[4] < 0.1 else _power(unit[4]), rounding=float(unit[5] ** 2 * half.min()), **look,
        )  # fmt: skip
    if kind == "blade":
        return Blade(
            centre - turn[:, 2] * half[2], turn, length=float(2 * half[2]), width=float(2 * half[0]),
            thick=float(max(2 * half[1], 0.002)), bend=float(2 * unit[0]), full=float(np.clip(unit[1], 0.1, 0.9)),
            **look,
        )  # fmt: skip
    if kind == "shell":
        thick = float(np.clip(unit[0], 0.03, 0.9) * min(half[0], 2 * half[2]))
        return Shell(
            centre + turn @ (half * [0, -1, 1]), turn, half=(float(half[0]), float(2 * half[2])), thickness=thick,
            back=float(2 * half[1]), front=float(max(unit[1], 0.05) * 2 * half[1]), power=_power(unit[2]),
            ease=float(0.5 + 7.5 * unit[3]), **look,
        )  # fmt: skip
    if kind in PROFILES.values():
        return _lathe(kind, centre, turn, half, unit, look)
    radius = float(max(unit[0] ** 2 * THICKEST, 0.002))
    if kind == "ring":
        return Tube(points=_loop(half, float(unit[1])) @ turn.T + centre, radius=radius, **look)
    points = shape[1:].reshape(KNOTS, 3) * half + centre
    return Tube(points=_run(kind, points, radius), radius=radius, **look)


def _measured(solid: Solid) -> tuple[str, Array, Array, Array, Array]:
    """Kind, centre (3,), turn (3, 3), half extents (3,) in metres and numbers of the shape."""
    centre, turn = np.asarray(solid.centre, float), np.asarray(solid.turn, float)
    if isinstance(solid, Block):
        return "block", centre, turn, solid.half, root_of(np.array([min(1.0, solid.radius / solid.half.min())]))
    if isinstance(solid, Ball):
        return "ball", centre, turn, solid.half, np.array([_bluntness(solid.power)])
    if isinstance(solid, Turned):
        low, high = np.array(solid.low), np.array(solid.high)
        most = np.maximum(np.maximum(low, high), 1e-6)
        half = np.array([most[0], solid.height / 2, most[1]])
        rim = root_of(np.array([min(1.0, solid.rounding / half.min())]))
        shape = np.concatenate([2 * low / most - 1, 2 * high / most - 1, [_bluntness(solid.power)], rim])
        return "turned", centre + turn[:, 1] * solid.height / 2, turn, half, shape
    if isinstance(solid, Blade):
        half = np.array([solid.width, solid.thick, solid.length]) / 2
        return "blade", centre + turn[:, 2] * half[2], turn, half, np.array([solid.bend - 1, 2 * solid.full - 1])
    if isinstance(solid, Shell):
        half = np.array([solid.half[0], solid.back / 2, solid.half[1] / 2])
        share = [solid.thickness / min(solid.half), solid.front / solid.back]
        shape = np.array([2 * share[0] - 1, 2 * share[1] - 1, _bluntness(solid.power), (solid.ease - 0.5) / 3.75 - 1])
        return "shell", centre + turn @ (half * [0, 1, -1]), turn, half, shape
    if isinstance(solid, Lathe):
        return _profiled(solid, centre, turn)
    if isinstance(solid, Tube):
        return _tube(solid, centre, turn)
    raise ValueError(f"{type(solid).__name__} is no kind of solid that a token says, allowed: {', '.join(KINDS)}")


def _profiled(solid: Lathe, centre: Array, turn: Array) -> tuple[str, Array, Array, Array, Array]:
    outer = solid.profile[: len(solid.profile) // 2] if solid.hollow else solid.profile
    count = min((k for k, hollow in PROFILES if hollow == solid.hollow), key=lambda k: (abs(k - len(outer)), k))
    if count != len(outer):
        outer = _resampled(outer, count)
    low, high, widest = outer[:, 1].min(), outer[:, 1].max(), outer[:, 0].max()
    half = np.array([widest, max((high - low) / 2, 1e-4), widest * solid.squash])
    across, up = outer[:, 0] / widest * 2 - 1, (outer[:, 1] - (low + high) / 2) / half[1]
    shape = np.stack([across, up], 1).ravel()
    if solid.hollow:
        thick = float(np.abs(solid.profile[0] - solid.profile[-1]).max())
        shape = np.append(shape, root_of(np.array([thick / widest])))
    return PROFILES[count, solid.hollow], centre + turn[:, 1] * (low + high) / 2, turn, half, shape


def _lathe(kind: str, centre: Array, turn: Array, half: Array, unit: Array, look: dict[str, Any]) -> Lathe:
    count, hollow = next(key for key, name in PROFILES.items() if name == kind)
    outline = unit[: 2 * count].reshape(count, 2) * [half[0], 2 * half[1]] - [0, half[1]]
    outline[:, 0] = np.maximum(outline[:, 0], 1e-3)
    outline[:, 1] = np.maximum.accumulate(outline[:, 1]) if outline[-1, 1] >= outline[0, 1] else outline[:, 1]
    squash = float(half[2] / half[0])
    if not hollow:
        return Lathe(centre, turn, profile=outline, squash=squash, **look)
    thick = float(max(unit[2 * count] ** 2 * half[0], 0.001))
    return Lathe(centre, turn, profile=wall(outline.tolist(), thick), squash=squash, hollow=True, **look)


def _tube(solid: Tube, centre: Array, turn: Array) -> tuple[str, Array, Array, Array, Array]:
    points = solid.points @ turn.T + centre
    closed = len(points) > 4 and np.linalg.norm(points[0] - points[-1]) < 0.02
    thick = root_of(np.array([min(1.0, solid.radius / THICKEST)]))
    if closed:
        return _ring(points, thick)
    kind = RODS.get(len(points), "curve")
    knots = _resampled(points, KNOTS)
    if kind in RODS.values() and tuple(knots[-1]) < tuple(knots[0]):
        knots = knots[::-1]
    middle = (knots.min(0) + knots.max(0)) / 2
    half = np.maximum((knots.max(0) - knots.min(0)) / 2, 1e-3)
    return kind, middle, IDENTITY, half, np.concatenate([thick, ((knots - middle) / half).ravel()])


def _ring(points: Array, thick: Array) -> tuple[str, Array, Array, Array, Array]:
    """A closed tube as a rounded rectangle in its own plane; corners as round as the first straight side is short."""
    middle = points[:-1].mean(0)
    quarter = (len(points) - 1) // 4
    x, z = points[quarter - 1] - points[quarter], points[2 * quarter - 1] - points[2 * quarter]
    if len(points) != 17:  # a circle
        x, z = points[0] - middle, points[quarter] - middle
    z = z - x * (x @ z) / max(x @ x, 1e-12)
    x, z = (axis / max(np.linalg.norm(axis), 1e-9) for axis in (x, z))
    turn = np.stack([x, cross(z, x), z], axis=1)
    local = np.abs((points - middle) @ turn).max(0)
    half = np.array([local[0], 1e-3, local[2]])
    straight = np.linalg.norm(points[quarter - 1] - points[quarter]) / 2 if len(points) == 17 else 0.0
    corner = float(np.clip((local[0] - straight) / min(local[0], local[2]), 0, 1))
    return "ring", middle, turn, half, np.append(thick, 2 * corner - 1)


def _loop(half: Array, corner: float) -> Array:
    """(17, 3) points of a rounded rectangle of half width and depth `half` [0], [2] in the plane y = 0."""
    a, b = half[0], half[2]
    c = max(corner, 0.05) * min(a, b)
    turn = np.linspace(0, np.pi / 2, 4)
    corners = [(a - c, b - c, 0.0), (-a + c, b - c, 0.5), (-a + c, -b + c, 1.0), (a - c, -b + c, 1.5)]
    plan = [(x + c * np.cos(t + s * np.pi), 0.0, z + c * np.sin(t + s * np.pi)) for x, z, s in corners for t in turn]
    return _apart(np.array([*plan, plan[0]]), half.max())


def _run(kind: str, knots: Array, radius: float) -> Array:
    """Points of a tube through its knots (KNOTS, 3); no two behind one another are one."""
    counts = {name: count for count, name in RODS.items()}
    if kind in counts:
        points = knots[np.round(np.linspace(0, KNOTS - 1, counts[kind])).astype(int)]
    else:
        points = CubicSpline(np.linspace(0, 1, KNOTS), knots, bc_type="natural")(np.linspace(0, 1, 13))
    return _apart(points, radius)


def _apart(points: Array, length: float) -> Array:
    """The points of a polyline that lie apart and do not turn back upon themselves; a stub of `length` if none do."""
    keep = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - keep[-1]) > SPACING and (len(keep) < 2 or np.linalg.norm(point - keep[-2]) > SPACING):
            keep.append(point)
    return np.array(keep) if len(keep) > 1 else np.array([keep[0], keep[0] + [0, max(length, 2 * SPACING), 0]])


def _resampled(points: Array, count: int) -> Array:
    """(count, d) points at equal steps of the index of (k, d) points."""
    where = np.linspace(0, len(points) - 1, count)
    return np.stack([np.interp(where, np.arange(len(points)), column) for column in points.T], axis=1)


def root_of(share: Array) -> Array:
    """How shares (...) are said: their square roots on [-1, 1]."""
    return 2 * np.sqrt(np.clip(share, 0, None)) - 1


def share_of(said: Array) -> Array:
    """What a number that was said as its square root stands for, 0 to 1 and a little more."""
    return ((said.clip(-1, 1.2) + 1) / 2) ** 2


def _bluntness(power: float) -> float:
    """1 for a circle, -1 for a square."""
    return float(np.clip(4 / power - 1, -1, 1))


def _power(unit: float) -> float:
    return float(2 / np.clip(unit, 0.1, 1.0))


def _two(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])
