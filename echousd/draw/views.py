"""Where a camera stands to see a room from inside, and what those of a stage see."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely
from pxr import Usd, UsdGeom

from echomodel.boxes2d import axes
from echomodel.files import tables
from echomodel.openings import inward_normal, rectangle
from echomodel.triangles import cross
from echousd.draw.scenery import Scenery
from echousd.draw.sight import ASPECT, RAYS, Furniture, filled
from echousd.naming import free_name
from echousd.stage.units import metres_per_unit, up_axis

APERTURE = 36.0  # mm, width of the picture in the camera
FOCAL_LENGTH = 30.0  # mm: 62 degrees across
# What cameras inside are chosen from. Where they stand: metres from a corner; shares of a wall's length, and metres
# from it, less than none behind it.
STEPS, ALONG, OFFS = (0.2, 0.5, 0.8, 1.6, 2.6, 3.8), (0.2, 0.35, 0.5, 0.65, 0.8), (0.4, -0.3, -0.7, -1.2, -1.9)
# Metres around the main piece; from the middle, where one stands further from its corner; from walls.
AROUND, APART, AWAY = (2.6, 3.4), 3.0, 0.12
# Radians by which they turn aside from the main piece; those that look straight at a wall have the middle of their
# picture so many metres aside for a metre ahead. Share of the height of the walls, where their eyes are; metres that
# the middle of their picture is lower.
PANS = (0.0, -0.15, 0.15, -0.35, 0.35)
ASIDES, EYES = (0.0, -0.1, 0.1, -0.2, 0.2, -0.35, 0.35), (0.42, 0.5, 0.62)
SLOPES, BENT = (0.0, 0.04, 0.08, 0.13, 0.18, 0.22, 0.27), (0.0, 0.0, 0.0, 0.0, 5.0, 15.0, 30.0)
# Metres ahead from where on they see: what is nearer as a whole is left out, and nothing is cut open. mm: 54, 65, 74,
# 81, 90 and 97 degrees across, of which so many where something is left out.
NEARS, LENSES, STRAIGHT = np.arange(0.5, 3.1, 0.25), (35.0, 31.0, 28.0, 26.0, 24.0, 21.0, 18.0, 16.0), 5
# Which heights and slopes all are tried at; how many of a place and of all, which cost least there, at every one; how
# many of those rays are run through; of a place, a way, a lens.
USUAL, TRIED, LOOKED, BEST = ((1,), (1, 4)), (16, 1000), (6, 250), 3
COSTS: dict[str, float] = tables("costs.toml", __file__)
# Of half the width; cosine; shares of the picture's width; metres over the floor from which on a lamp or what hangs is
# high; metres from the main piece within which one is missed.
ASIDE, SIDEWAYS, SIZES, HIGH, BESIDE = 0.33, 0.55, (0.36, 0.55), 0.25, 0.5
# Metres within which things, and walls and the main piece, are near; cosine from which on a back is seen, metres within
# which it is near, and the share that is free; metres within which walls at the sides are near.
BEFORE, WALLED, AVERTED, CLOSE, SOME, PASSED = 2.6, 1.4, 0.25, 3.5, 0.02, 2.5
FLOORED, BAREST, HANGING, MANY, ENOUGH, AHEAD = 0.27, 0.22, 0.4, 10.0, 0.012, 1.0
# And each lens, height and slope.
DISTORTED, CROUCHED = (0.0, 0.0, 0.0, 0.0, 0.0, 20.0, 50.0, 90.0), (10.0, 0.0, 5.0)
LOW, DEEP = 1.4, 0.02  # metres: over what is so high one looks; of rounding
SHADE, AT_CEILING = (0.55, 0.8), 0.15  # shares of a lamp's height and width over which it is cord; metres
MARGIN = 1.06


@dataclass(frozen=True, eq=False)
class Subject:
    """What a picture from inside is of: a floor (k, 2), walls of a height in metres, boxes of `count` pieces of
    furniture and of what hangs, the row of the main one, everything that hides something, at its end `doors` and the
    walls, and where (2,) the main piece and the middle of the floor are."""

    floor: np.ndarray
    height: float
    count: int
    things: Furniture
    main: int
    everything: Furniture
    aim: np.ndarray
    middle: np.ndarray
    doors: int = 0


class Shots(NamedTuple):
    """m pictures: what each costs at first sight; camera to world (m, 4, 4); mm; metres ahead from where on it sees;
    and which pieces (m, count) the border cuts."""

    cost: np.ndarray
    view: np.ndarray
    lens: np.ndarray
    near: np.ndarray
    cut: np.ndarray


def view_matrix(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(..., 4, 4) float camera to world, column vectors; the camera at (..., 3) looks along its -Z with +Y up."""
    back = eye - target
    back = back / np.linalg.norm(back, axis=-1, keepdims=True)
    right = cross(np.broadcast_to((0.0, 1.0, 0.0), back.shape), back)
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    matrix = np.broadcast_to(np.eye(4), (*back.shape[:-1], 4, 4)).copy()
    for column, axis in enumerate((right, cross(back, right), back, eye)):
        matrix[..., :3, column] = axis
    return matrix


def shifted(view: np.ndarray, slope: np.ndarray | float, side: np.ndarray | float = 0.0) -> np.ndarray:
    """(..., 4, 4) float: level views whose pictures are moved down by `slope` and right by `side` (...,) metres for a
    metre ahead.

    So a lens with a shift looks: the third column is no longer upright to the others, and walls stay upright in the
    picture, and the wall that one looks at level, as whoever photographs interiors has them.
    """
    view = np.array(view, float)
    down, right = (np.asarray(each, float)[..., None] for each in (slope, side))
    view[..., :3, 2] += down * view[..., :3, 1] - right * view[..., :3, 0]
    return view


def inside_view(
    floor: np.ndarray, furniture: Furniture, height: float, hung: Furniture | None = None,
    windows: Furniture | None = None, doors: Furniture | None = None, main: int | None = None,
) -> tuple[np.ndarray, float, float]:  # fmt: skip
    """Camera to world (4, 4) float, `shifted`, focal length in mm, and metres ahead from where on things are seen, of a
    view inside a room, its main piece whole.

    Of all places before and behind the walls, ways, heights, lenses and near planes the picture is taken that costs
    least: what hides, cuts off or turns away the main piece and others, lets them fill the foreground or shows bare
    walls, floor and ceiling costs, what is seen is worth something. A near plane leaves out what stands before the eye
    and the wall that it looks through, and cuts nothing open.

    Arguments:
        floor: (k, 2) float, x and z of the corners, metres.
        furniture: what shall be seen, its fronts rather than its backs.
        height: of the walls, metres.
        hung: what hangs or stands at the walls: none of it shall be right before the eye.
        windows, doors: as boxes in the walls: windows are not bare, doors are nothing to look at.
        main: row of the furniture that must be whole in the picture; None = the largest that one looks over.
    """
    floor = np.asarray(floor, float)
    middle = shapely.get_coordinates(shapely.Polygon(floor).representative_point())[0]
    if not len(furniture.size):
        furniture = Furniture(np.full((1, 3), 1e-3), np.insert(middle, 1, 0.0)[None], np.zeros(1))
    if main is None:  # the largest piece that one looks over, of all where there is none
        low = furniture.size[:, 1] + furniture.position[:, 1] < LOW
        main = int((furniture.size[:, [0, 2]].prod(1) * (low | ~low.any())).argmax())
    things = furniture.with_others(hung)
    everything, aim = things.with_others(windows, doors, _walls(floor, height)), furniture.position[main, [0, 2]]
    leaves = 0 if doors is None else len(doors.size)
    of = Subject(floor, height, len(furniture.size), things, main, everything, aim, middle, leaves)
    shots = _framed(of, *_eyes(of))
    best = int((shots.cost + sum(_composed(of, shots).values())).argmin())
    return shots.view[best], float(shots.lens[best]), float(shots.near[best])


def _eyes(of: Subject) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where a camera may stand and the ways it may look, x and z, (f, 2) each: in corners, along the walls and behind
    them, around what it sees; and how far aside the middle of its picture is, (f,)."""
    floor, spots, straight = of.floor, [], []
    for edge, corner in enumerate(floor):
        away = max(float(np.linalg.norm(of.middle - corner)), 1e-9)
        spots += [corner + step / away * (of.middle - corner) for step in STEPS if step < max(away - APART, 0.9)]
        along, inside = floor[(edge + 1) % len(floor)] - corner, inward_normal(floor, edge)
        opposite = float((of.aim - corner) @ along / max(float(along @ along), 1e-9))
        for share in (*ALONG, opposite):
            behind = [corner + share * along + off * inside for off in OFFS]
            straight += [(spot, inside) for spot in behind[1:]]
            spots += behind if share is not opposite else []
    turns = np.arange(8) * np.pi / 4
    spots += [of.aim + far * np.array([np.cos(turn), np.sin(turn)]) for far in AROUND for turn in turns]
    spot, cos, sin = np.array(spots), np.cos(PANS)[:, None], np.sin(PANS)[:, None]
    x, z = (of.aim - spot).T / np.maximum(np.linalg.norm(of.aim - spot, axis=1), 1e-9)
    ways = np.stack([cos * x - sin * z, sin * x + cos * z], -1).reshape(-1, 2)
    turned = np.concatenate([np.tile(spot, (len(PANS), 1)), ways, np.zeros((len(ways), 1))], 1)
    level = np.tile(np.reshape(straight, (-1, 4)), (len(ASIDES), 1))
    level = np.concatenate([level, np.repeat(ASIDES, len(straight))[:, None]], 1)
    spot, way, side = np.split(np.concatenate([turned, level]), (2, 4), axis=1)
    return spot, way, side[:, 0]


def _framed(of: Subject, spot: np.ndarray, way: np.ndarray, side: np.ndarray) -> Shots:
    """The pictures that cost least by what they have whole, of some places and ways, see `_eyes`."""
    count, main, front = of.count, of.main, axes(of.things.yaw[of.main])[1]
    corners = np.concatenate([of.things.corners, _shades(of.things.of(np.arange(count)), of.height)])
    right, (bottom, top) = np.stack([-way[:, 1], way[:, 0]], 1), corners[:, [0, 2], 1].T
    plan = corners[:, [0, 1, 4, 5]][..., [0, 2]].reshape(-1, 2)
    ahead, aside = ((plan @ to.T - (spot * to).sum(1)).T.reshape(len(spot), -1, 4) for to in (way, right))
    aside -= side[:, None, None] * ahead
    frame, near, lens = _uncut(of, spot, way + side[:, None] * right, right, ahead, aside)
    to, halves = of.aim - spot, APERTURE / 2 / np.array(LENSES)
    deep, last = np.maximum(ahead, 0.05), ahead.max(2)
    slant, nearest, farthest = aside / deep, deep.min(2), deep.max(2)
    begins, ends, aside_main, deep_main = slant.min(2), slant.max(2), np.abs(slant[:, main]), deep[:, main]
    far = np.maximum(np.linalg.norm(to, axis=1), 1e-9)
    off = np.abs((to * right).sum(1) / np.maximum((to * way).sum(1), 1e-9) - side)
    behind = COSTS["behind"] * np.maximum(0, (to @ front) / far + SIDEWAYS)
    plans = shapely.convex_hull(shapely.multipoints(corners[:count, :, [0, 2]]))
    missed = COSTS["left_out"] + COSTS["missed"] * np.clip(1 - shapely.distance(plans[main], plans) / BESIDE, 0, 1)
    high, kind = of.things.position[:, 1] > HIGH, np.zeros((len(corners), 2))
    kind[len(high) :], stands = (COSTS["cut_lamp"], COSTS["lamp_out"]), np.arange(len(high)) < count
    kind[: len(high), 0][high & ~stands], kind[: len(high), 0][~high & stands] = COSTS["cut_hung"], COSTS["cut"]

    def costs_at(rows: np.ndarray, ups: Sequence[int], downs: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """(m, eyes, slopes) what some pictures cost at some heights, and (m, eyes, slopes, count) what is cut."""
        of_frame, here, half = frame[rows], near[rows, None], halves[lens[rows]][:, None]
        begin, end, tall, limit = begins[of_frame], ends[of_frame], half / ASPECT, half / MARGIN
        left_out, ahead_of = last[of_frame] < here, last[of_frame] >= 0.05
        over, beside = (begin < half) & (end > -half) & ahead_of, (begin > -limit) & (end < limit)
        share = (np.minimum(end[:, [main]], half) - np.maximum(begin[:, [main]], -half)) / (2 * half)
        fixed = (
            COSTS["middle"] * np.clip(off[of_frame, None] / half - ASIDE, 0, 1)
            + COSTS["small"] * np.maximum(0, SIZES[0] - share) + COSTS["large"] * np.maximum(0, share - SIZES[1])
        )[:, 0]  # fmt: skip
        fixed += np.array(DISTORTED)[lens[rows]] + behind[of_frame] + (left_out & over)[:, :count] @ missed
        over, close, distant = over & ~left_out, nearest[of_frame], farthest[of_frame]
        costs = np.empty((len(rows), len(ups), len(downs)))
        cuts = np.empty((*costs.shape, count), bool)
        for n, up in enumerate(ups):
            eye = EYES[up] * of.height
            low = (bottom - eye) / np.where(bottom > eye, distant, close)
            rise = (top - eye) / np.where(top > eye, close, distant)
            ends_main = [(each[main] - eye) / deep_main[of_frame] for each in (bottom, top)]
            for m, down in enumerate(downs):
                slope = SLOPES[down]
                within = over & (low < tall - slope) & (rise > -tall - slope)
                cut = within & ~(beside & (low > -tall / MARGIN - slope) & (rise < tall / MARGIN - slope))
                reach = [np.maximum(aside_main[of_frame], ASPECT * np.abs(each + slope)) for each in ends_main]
                starts = eye - slope * here
                outside = (starts - tall * here < DEEP) | (starts + tall * here > of.height - DEEP)
                costs[:, n, m] = (
                    fixed + CROUCHED[up] + BENT[down] + cut @ kind[:, 0] + ~within @ kind[:, 1]
                    + COSTS["whole"] * ((np.concatenate(reach, 1) > limit).mean(1) + (outside & (here > 0))[:, 0])
                )  # fmt: skip
                cuts[:, n, m] = cut[:, :count]
        return costs, cuts

    place = 2 * np.unique(spot.round(3), axis=0, return_inverse=True)[1].ravel()[frame] + (near > 0)
    some = _cheapest(costs_at(np.arange(len(frame)), *USUAL)[0].min((1, 2)), place, *TRIED)
    costs, cuts = costs_at(some, range(len(EYES)), range(len(SLOPES)))
    frame, near, lens, place, shape = frame[some], near[some], lens[some], place[some], costs.shape
    flat = costs.reshape(len(frame), -1)
    found = np.argsort(flat, axis=1, kind="stable")[:, :BEST] + np.arange(len(flat))[:, None] * flat.shape[1]
    rows = found.ravel()[_cheapest(flat.ravel()[found.ravel()], place.repeat(found.shape[1]), *LOOKED)]
    one, up, down = np.unravel_index(rows, shape)
    eye = np.insert(spot[frame[one]], 1, np.array(EYES)[up] * of.height, axis=1)
    level = view_matrix(eye, eye + np.insert(way[frame[one]], 1, 0.0, axis=1))
    view = shifted(level, np.array(SLOPES)[down], side[frame[one]])
    return Shots(flat.ravel()[rows], view, np.array(LENSES)[lens[one]], near[one], cuts[one, up, down])


def _cheapest(cost: np.ndarray, place: np.ndarray, each: int, most: int) -> np.ndarray:
    """(m,) rows of the least costs, at most so many of each place and of all."""
    order = np.lexsort((cost, place))
    kept = order[np.arange(len(order)) - np.searchsorted(place[order], place[order]) < each]
    return np.asarray(kept[np.argsort(cost[kept], kind="stable")][:most])


def _uncut(
    of: Subject, spot: np.ndarray, way: np.ndarray, right: np.ndarray, ahead: np.ndarray, aside: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which places and ways, metres ahead from where on things are seen, and which lens, (m,) each: where the camera or
    all of where it begins to see is in the room, and cuts nothing open.

    `way`, `right`: (f, 2) to the middle of the picture, and to its right. `ahead`, `aside`: (f, n, 4) metres of the
    things' corners from there.
    """
    room, many, wide = shapely.Polygon(of.floor), len(LENSES), APERTURE / 2 / np.array(LENSES[:STRAIGHT])
    free = np.flatnonzero(shapely.contains_xy(room.buffer(-AWAY), spot))
    free = free if len(free) else np.arange(len(spot))  # of what is hardly a room
    found = [(free.repeat(many), np.zeros(len(free) * many), np.tile(np.arange(many), len(free)))]
    ahead, aside = ahead[:, : len(of.things.size)], aside[:, : len(of.things.size)]
    first, last, apart = ahead.min(2), ahead.max(2), np.maximum(0, np.maximum(aside.min(2), -aside.max(2)))
    shapely.prepare(room)
    for near in NEARS:
        met = np.where((first < near + DEEP) & (last > near - DEEP), apart, np.inf).min(1)
        fits = (met[:, None] > near * wide + DEEP) & (first[:, [of.main]] > near)
        rows, lens = np.nonzero(fits & shapely.contains_xy(room, spot + near * way)[:, None])
        ends = near * (way[rows, None] + np.array([[-1], [1]]) * wide[lens, None, None] * right[rows, None])
        inside = shapely.covers(room, shapely.linestrings(spot[rows, None] + ends))
        found.append((rows[inside], np.full(inside.sum(), near), lens[inside]))
    frame, near, lens = (np.concatenate(each) for each in zip(*found, strict=True))
    return frame, near, lens


def _composed(of: Subject, shots: Shots) -> dict[str, np.ndarray]:
    """What each thing costs (m,) by what rays meet in some pictures."""
    half, row = APERTURE / 2 / shots.lens, np.arange(len(of.everything.size))
    which, away, along, shares, alone = of.everything.met(shots.view, half, shots.near)
    walls = len(row) - len(of.floor)
    leaves = walls - of.doors
    hangs = (row >= of.count) & (row < len(of.things.size))
    reach = np.where(((row < of.count) | hangs) & (row != of.main), BEFORE, WALLED)
    shown, above = np.isfinite(away) & (which < of.count), RAYS[:, 1] * half[:, None] > shots.view[:, 1, 2, None]
    wall, averted = which >= leaves, shown & (along > AVERTED)
    towards = (shots.view[:, [0, 2], 3] - of.middle) @ of.things.of(np.arange(of.count)).facing
    worth = np.where(hangs, HANGING, row < leaves)  # windows as much as furniture
    seen = np.minimum(shares / ENOUGH, 1) @ worth
    found = {
        "hidden": 1 - shares[:, of.main] / np.maximum(alone[:, of.main], 1e-9),
        "severed": (shares[:, : of.count] * shots.cut).sum(1), "filled": filled(away, reach[which]),
        "backs": averted.mean(1), "turned": np.maximum(0, (averted & (away < CLOSE)).mean(1) - SOME),
        "bare": np.maximum(0, shares[:, walls:].max(1) - BAREST), "doors": shares[:, leaves:walls].sum(1),
        "walls": (wall & (away < PASSED)).mean(1), "ceiling": (above & np.isinf(away)).mean(1),
        "floor": np.maximum(0, (~above & np.isinf(away)).mean(1) - FLOORED),
        "shown": shown.mean(1), "seen": np.minimum(seen, MANY), "faced": np.minimum(towards, AHEAD),
    }  # fmt: skip
    return {name: COSTS[name] * value for name, value in found.items()}


def _shades(furniture: Furniture, height: float) -> np.ndarray:
    """(n, 8, 3) float: corners of what hangs from a ceiling at this height, without its cords, metres."""
    tall, wide = furniture.size[:, 1], furniture.size[:, [0, 2]].max(1)
    hangs = (furniture.position[:, 1] > LOW - DEEP) & (furniture.position[:, 1] + tall > height - AT_CEILING)
    size = np.insert(furniture.size[:, [0, 2]], 1, np.minimum(SHADE[0] * tall, SHADE[1] * wide), axis=1)
    return replace(furniture, size=size).corners[hangs]


def _walls(floor: np.ndarray, height: float) -> Furniture:
    """The walls as thin boxes that stand outside of a floor (k, 2)."""
    way = np.roll(floor, -1, 0) - floor
    outwards = -np.array([inward_normal(floor, edge) for edge in range(len(floor))])
    middle = floor + way / 2 + 0.05 * outwards
    size = np.stack([np.linalg.norm(way, axis=1), np.full(len(floor), height), np.full(len(floor), 0.1)], 1)
    return Furniture(size, np.insert(middle, 1, 0.0, axis=1), np.arctan2(outwards[:, 0], outwards[:, 1]))


WIDEST = 4.0  # width of a picture over its height, and the other way round


@dataclass(frozen=True)
class View:
    """A camera: (4, 4) camera to world, sheared where its lens is shifted, and half the picture's width, in metres
    (top) or as a tangent (perspective); its width over its height; whether it is inside a closed room; metres ahead
    from where on it sees."""

    matrix: np.ndarray
    half: float
    orthographic: bool
    aspect: float = 1.0
    inside: bool = False
    near: float = 0.0

    @property
    def start(self) -> np.ndarray:
        """(3,) float, the middle of where it begins to see."""
        return np.asarray(self.matrix[:3, 3] - self.near * self.matrix[:3, 2])


def stage_views(stage: Usd.Stage) -> dict[str, View]:
    """What every camera of a stage sees, by its name, in a y-up world in metres."""
    unit, turn = metres_per_unit(stage), np.eye(4)
    if up_axis(stage) == "Z":
        turn[1:3, 1:3] = ((0, 1), (-1, 0))
    views: dict[str, View] = {}
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Camera):
            continue
        camera = UsdGeom.Camera(prim).GetCamera(0)
        matrix = turn @ np.array(camera.transform).T
        matrix[:3, 3] *= unit
        matrix[:3, :3] /= np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
        flat = camera.projection == camera.Orthographic
        wide = camera.horizontalAperture
        of_film = camera.APERTURE_UNIT * unit if flat else 1 / max(camera.focalLength, 1e-6)
        shift = matrix[:3, :2] @ (camera.horizontalApertureOffset * of_film, camera.verticalApertureOffset * of_film)
        matrix[:3, 3 if flat else 2] += shift if flat else -shift
        half = wide / 2 * of_film
        aspect = float(np.clip(wide / max(camera.verticalAperture, 1e-6), 1 / WIDEST, WIDEST))
        told = UsdGeom.Camera(prim).GetClippingRangeAttr().HasAuthoredValue() and not flat
        near = max(camera.clippingRange.min, 0.0) * unit if told else 0.0
        views[free_name(prim.GetName(), views)] = View(matrix, float(half), flat, aspect, near=near)
    return views


def hero_view(stage: Usd.Stage, scenery: Scenery) -> View:
    """Into a room from inside: through the stage's first camera that stands between its walls, else from a corner
    where least is hidden, at the height of a standing person's eyes."""
    lower, upper = scenery.bounds
    for view in stage_views(stage).values() if scenery.closed else ():
        if not view.orthographic and (lower < view.start).all() and (view.start < upper).all():
            return replace(view, aspect=ASPECT, inside=True)
    floor = rectangle(*(upper - lower - 0.3)[[0, 2]]) + (lower + upper)[[0, 2]] / 2  # inside the walls
    room = floor, scenery.furniture(), float(upper[1] - lower[1]), scenery.furniture(hung=True)
    matrix, lens, near = inside_view(*room)
    return View(matrix, APERTURE / 2 / lens, False, ASPECT, scenery.closed, near)
