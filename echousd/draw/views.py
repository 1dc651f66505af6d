"""Where a camera stands to see a room from inside, and what those of a stage see."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import shapely
from pxr import Usd, UsdGeom

from echomodel.boxes2d import axes
from echomodel.openings import direction, edge_lengths, inward_normal, rectangle
from echomodel.triangles import cross
from echousd.draw.scenery import Scenery
from echousd.draw.sight import ASPECT, RAYS, Furniture, filled
from echousd.naming import free_name
from echousd.stage.units import metres_per_unit, up_axis

APERTURE = 36.0  # mm, width of the picture in the camera
FOCAL_LENGTH = 30.0  # mm: 62 degrees across
# mm of a camera inside: 74, 81, 90 and 97 degrees across; metres of depth that each costs: wide ones distort
LENSES, DISTORTED = (24.0, 21.0, 18.0, 16.0), (0.0, 20.0, 50.0, 90.0)
EYES, RAISED = (0.5, 0.62), 12  # of the height of the walls: where a camera inside is; so many eyes are raised, too
SLOPES = (0.05, 0.13, 0.22, 0.32)  # metres that the middle of its picture is lower for a metre ahead
PANS = (0.0, -0.15, 0.15, -0.35, 0.35)  # radians that it may turn aside from what it looks at
WHOLE, CLEAR = 1000.0, 80.0  # metres of depth that the whole main piece in the picture is worth, and nothing before it
LOOKED, CHOSEN, TRIED = 64, 6, 16  # eyes of which one view is looked at closely; eyes, and of each so many views
LOW = 1.4  # metres: over what is so high one looks
# one bare wall: what all of a picture costs, from which share on, metres of rounding
BARE, BAREST, DEEP = 650.0, 0.22, 0.02
MIDDLE, ASIDE = 60.0, 0.33  # what the main piece at the border costs, from which share of half the width on
SMALL, LARGE = 20.0, 5.0  # what a metre costs that the main piece is further away, and from where on
BEFORE, WALLED = 2.6, 1.4  # metres: what is nearer to the eye fills the picture, and which walls do
FILLED, BEHIND = 650.0, 90.0  # metres of depth that a picture full of what is near costs, and the main piece's back
# Metres of depth that each thing costs which the border cuts, and which is beyond it: lamps, what hangs from `HIGH`
# metres on, and furniture.
CUTS, HIGH = ((90.0, 40.0), (25.0, 0.0), (25.0, 0.0)), 0.25
SHADE, AT_CEILING = (0.55, 0.8), 0.15  # shares of a lamp's height and width over which it is cord; metres
UNSEEN, MANY = 6.0, 8.0  # metres of depth that each of so many pieces in the picture is worth
# And a picture full of furniture; a metre towards where it looks, up to so many; of what each loses a picture full: of
# backs, seen where the cosine is larger, and of ceiling. By choices of 40 pictures among eight each.
SHOWN, FACED, AHEAD, BACKS, AVERTED, OVERHEAD = 30.0, 20.0, 1.0, 320.0, 0.25, 100.0
UNDER, FLOORED = 200.0, 0.32  # and a picture full of bare floor, and the share of it from which on that costs
# And a picture full of pieces that its border cuts, and of backs nearer than so many metres, from a share of it on.
SEVERED, TURNED, CLOSE, SOME = 250.0, 1000.0, 3.5, 0.03
MOST = SHOWN + FACED * AHEAD + UNSEEN * MANY + 1e-6  # that a view is worth which costs nothing
STEPS = (0.2, 0.5, 0.8, 1.6, 2.6, 3.8)  # metres from a corner that a camera inside may stand
# Or so far behind a wall, which its near plane cuts away, and so much of the room with what hangs and stands there.
BEYOND, THROUGH = (0.6, 1.2, 2.0), (0.3, 0.5, 0.7, 0.9)
APART = 3.0  # metres from the middle that it keeps where it stands further from its corner
ALONG, OFF = (0.2, 0.35, 0.5, 0.65, 0.8), 0.4  # or along a wall, as shares of its length, and metres from it
BEFORE_IT, TURNS = 3.4, np.arange(8) * np.pi / 4  # or so many metres around the main piece, where the room is so large
MARGIN = 1.06


class Eye(NamedTuple):
    """Where a camera may stand, before the walls, or beyond one that it looks straight through."""

    spot: np.ndarray  # (2,) x and z, metres
    near: float = 0.0  # metres ahead from where on things are seen: beyond the wall and what hangs there
    way: np.ndarray | None = None  # (2,) in which it must look
    aside: float = np.inf  # metres to the nearer end of the wall


class Shot(NamedTuple):
    """A camera inside: what it costs at first sight, camera to world (4, 4), mm, metres ahead from where on it sees;
    and what `Furniture.blocked` says."""

    cost: float
    view: np.ndarray
    lens: float
    near: float
    points: np.ndarray
    blocked: np.ndarray


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


def shifted(view: np.ndarray, slope: np.ndarray | float) -> np.ndarray:
    """(..., 4, 4) float: level views whose pictures are moved down by `slope` (...,) metres for a metre ahead.

    So a lens with a shift looks: the third column is no longer upright to the others, and walls stay upright in the
    picture, as whoever photographs interiors has them.
    """
    view = np.array(view, float)
    down: np.ndarray = np.asarray(slope, float)[..., None]
    view[..., :3, 2] += down * view[..., :3, 1]
    return view


def inside_view(
    floor: np.ndarray, furniture: Furniture, height: float, hung: Furniture | None = None,
    windows: Furniture | None = None, main: int | None = None,
) -> tuple[np.ndarray, float, float]:  # fmt: skip
    """Camera to world (4, 4) float, `shifted`, focal length in mm, and metres ahead from where on things are seen, of a
    view inside a room, its main piece whole.

    Of all eyes, headings and lenses those count that have the main piece whole in the picture; of these the one that
    hides and cuts off least of what stands and hangs, has most furniture in its picture, not its backs, little ceiling
    and little that is near, the main piece in its middle third, and no bare wall over a third of it. Where there is no
    room for a lens that draws things as they are, the camera stands behind a wall and looks straight through it.

    Arguments:
        floor: (k, 2) float, x and z of the corners, metres.
        furniture: what shall be seen, its fronts rather than its backs.
        height: of the walls, metres.
        hung: what hangs or stands at the walls: none of it shall be right before the eye.
        windows: as boxes in the walls, which are then not bare.
        main: row of the furniture that must be whole in the picture; None = the largest that one looks over.
    """
    floor = np.asarray(floor, float)
    room = shapely.Polygon(floor)
    middle = np.asarray(room.representative_point().coords[0])
    if not (count := len(furniture.size)):
        furniture = Furniture(np.full((1, 3), 1e-3), np.insert(middle, 1, 0.0)[None], np.zeros(1))
    things = furniture.with_others(hung)
    everything = things.with_others(windows, _walls(floor, height))
    if main is None:  # the largest piece that one looks over, of all where there is none
        low = furniture.size[:, 1] + furniture.position[:, 1] < LOW
        main = int((furniture.size[:, [0, 2]].prod(1) * (low | ~low.any())).argmax())
    row = np.arange(len(everything.size))
    reach = np.where((row < len(things.size)) & (row != main), BEFORE, WALLED)
    aim, front = furniture.position[main, [0, 2]], axes(furniture.yaw[main])[1]
    high, stands = things.position[:, 1] > HIGH, np.arange(len(things.size)) < count
    shades, lying = _shades(furniture, height), things.corners[stands & ~high]

    def merit(shot: Shot) -> float:
        """Metres of depth that a view is worth."""
        eye, half = shot.view[:3, 3], APERTURE / 2 / shot.lens
        which, away, along = everything.met(shot.view, half, shot.near)
        shown, above = np.isfinite(away) & (which < count), RAYS[:, 1] * half > shot.view[1, 2]
        seen = (~shot.blocked & (_aside(shot.points, shot.view) <= half)).mean(-1).sum()
        shares = np.bincount(which[shown], minlength=count) / len(RAYS)
        cut = (_aside(furniture.corners, shot.view) > half / MARGIN).any(-1) & (np.arange(count) != main)
        averted = shown & (along > AVERTED) & (away < CLOSE)
        bare = barest_share(which, np.where(row[which] < len(row) - len(floor), np.inf, away), height, shot.view, half)
        return (
            FACED * min(float((eye[[0, 2]] - middle) @ furniture.facing), AHEAD) + UNSEEN * min(seen, MANY)
            + float((SHOWN * shown - BACKS * (shown & (along > AVERTED)) - OVERHEAD * (above & np.isinf(away))).mean())
            - UNDER * max(0.0, float((~above & np.isinf(away)).mean()) - FLOORED)
            - SEVERED * float(shares[cut].sum()) - TURNED * max(0.0, float(averted.mean()) - SOME)
            - FILLED * filled(away, reach[which]) - BARE * max(0.0, bare - BAREST) - shot.cost
        )  # fmt: skip

    halves = APERTURE / 2 / np.array(LENSES)

    def shots(at: Eye, up: float) -> list[Shot]:
        """The views that cost least of an eye at a height."""
        spot, seen, wider, way = at.spot, np.full(len(things.size), True), room.buffer(0.05), aim - at.spot
        if at.way is not None:
            seen = ((things.corners[..., [0, 2]] - spot) @ at.way).max(1) > at.near
            wider, way = wider.union(shapely.Point(spot).buffer(1.4 * at.near)), at.way
        eye = np.array([spot[0], up, spot[1]])
        points, blocked = furniture.blocked(eye, things.of(seen & ~stands))
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(eye, points[main]), 1)[..., [0, 2]])
        hidden = CLEAR * float((blocked[main] | ~shapely.covers(wider, lines)).mean())  # by pieces, or by a corner
        views = _turned(eye, way)
        cut = (_aside(furniture.corners[main], views)[..., None] > halves / MARGIN).mean(-2)
        aside, back = (np.abs(views[..., [0, 2], axis] @ (aim - spot)) for axis in (0, 2))
        off = MIDDLE * np.clip((aside / np.maximum(back, 1e-9))[..., None] / halves - ASIDE, 0.0, 1.0)
        far = max(float(np.linalg.norm(aim - spot)), 1e-9)
        behind = BEHIND * max(0.0, float((aim - spot) @ front)) / far + SMALL * max(0.0, far - LARGE)
        fragile = [shades, things.corners[high & ~stands & seen], lying]
        cost = WHOLE * cut + off + _shown(fragile, views, halves) + hidden + behind
        cost = cost + np.abs(PANS)[:, None, None] + DISTORTED
        if at.way is not None:  # upright to the wall, and within it where it begins to see
            low, wide = up - np.array(SLOPES)[:, None] * at.near, halves * at.near
            beside = (wide > at.aside) | (low < wide / ASPECT) | (low + wide / ASPECT > height)
            cost = cost + WHOLE * (beside | (np.abs(PANS) > 0)[:, None, None] | (np.array(LENSES) < LENSES[0]))
        cost = cost.ravel()
        return [
            Shot(float(cost[n]), views.reshape(-1, 4, 4)[n // len(LENSES)], LENSES[n % len(LENSES)], at.near, points,
                 blocked) for n in np.argsort(cost, kind="stable")[:TRIED]
        ]  # fmt: skip

    every = [(shots(at, EYES[0] * height), at) for at in (*_spots(room, middle, aim), *_beyond(floor, things, main))]
    every = sorted(every, key=lambda one: one[0][0].cost)[:LOOKED]
    before_walls = [at for _, at in every if at.way is None]
    eyes = [views for views, _ in every] + [shots(at, EYES[1] * height) for at in before_walls[:RAISED]]
    worth: dict[int, float] = {}  # of each eye by the view that costs least
    for n in sorted(range(len(eyes)), key=lambda n: eyes[n][0].cost):
        if len(worth) >= CHOSEN and MOST - eyes[n][0].cost < sorted(worth.values())[-CHOSEN]:
            break  # neither this one nor any dearer one can be among the best
        worth[n] = merit(eyes[n][0])
    best, most = eyes[0][0], -np.inf
    for shot in (shot for n in sorted(worth, key=lambda n: (-worth[n], n))[:CHOSEN] for shot in eyes[n]):
        if MOST - shot.cost > most and (value := merit(shot)) > most:
            best, most = shot, value
    return best.view, best.lens, best.near


def barest_share(which: np.ndarray, wall: np.ndarray, height: float, view: np.ndarray, half: float) -> float:
    """Share of a picture inside a room that one wall takes where nothing is at or before it, of all the greatest.

    `which`, `wall`: (169,) int walls along `RAYS` and metres to them, inf where there is none or it is not bare.
    `height`: of the walls, metres. `view`, `half`: as `Furniture.met`.
    """
    way = RAYS[:, 1] * half * view[1, 1] - view[1, 2]  # up, over the length of the ray
    way = way / np.linalg.norm(RAYS * (half, half, 1.0), axis=1)
    with np.errstate(divide="ignore"):
        level = np.where(way < 0, -view[1, 3] / way, (height - view[1, 3]) / np.maximum(way, 1e-12))
    return float(np.bincount(which[wall < level - DEEP]).max(initial=0)) / len(RAYS)


def _aside(points: np.ndarray, view: np.ndarray) -> np.ndarray:
    """(..., p) float: how far points (..., p, 3) are from the middle of pictures, at distance 1; inf behind the camera.

    What is up or down counts as in the picture's width, whose half is `ASPECT` times that of its height.
    """
    into = np.linalg.inv(view[..., :3, :3]).swapaxes(-1, -2)
    x, y, z = np.moveaxis((points - view[..., None, :3, 3]) @ into, -1, 0)
    return np.asarray(np.where(z < 0, np.maximum(np.abs(x), ASPECT * np.abs(y)) / np.maximum(-z, 1e-9), np.inf))


def _shades(furniture: Furniture, height: float) -> np.ndarray:
    """(n, 8, 3) float: corners of what hangs from a ceiling at this height, without its cords, metres."""
    tall, wide = furniture.size[:, 1], furniture.size[:, [0, 2]].max(1)
    hangs = (furniture.position[:, 1] > LOW - DEEP) & (furniture.position[:, 1] + tall > height - AT_CEILING)
    size = np.insert(furniture.size[:, [0, 2]], 1, np.minimum(SHADE[0] * tall, SHADE[1] * wide), axis=1)
    return replace(furniture, size=size).corners[hangs]


def _shown(fragile: Sequence[np.ndarray], views: np.ndarray, halves: np.ndarray) -> np.ndarray:
    """(..., k) float: what boxes (n, 8, 3) of all kinds of `CUTS` cost, in pictures of half widths `halves` (k,)."""
    cut, lacked = np.repeat(CUTS, [len(boxes) for boxes in fragile], axis=0).T
    aside = _aside(np.concatenate(fragile).reshape(-1, 3), views).reshape(*views.shape[:-2], 1, -1, 8)
    beyond, within = aside.max(-1) > (halves / MARGIN)[:, None], aside.min(-1) < halves[:, None]
    return np.asarray((beyond * np.where(within, cut, lacked)).sum(-1))


def _walls(floor: np.ndarray, height: float) -> Furniture:
    """The walls as thin boxes that stand outside of a floor (k, 2)."""
    way = np.roll(floor, -1, 0) - floor
    outwards = -np.array([inward_normal(floor, edge) for edge in range(len(floor))])
    middle = floor + way / 2 + 0.05 * outwards
    size = np.stack([np.linalg.norm(way, axis=1), np.full(len(floor), height), np.full(len(floor), 0.1)], 1)
    return Furniture(size, np.insert(middle, 1, 0.0, axis=1), np.arctan2(outwards[:, 0], outwards[:, 1]))


def _beyond(floor: np.ndarray, things: Furniture, main: int) -> Iterator[Eye]:
    """Eyes behind the walls, which see from where on nothing in their picture is cut open, and the main thing whole."""
    for edge in range(len(floor)):
        inside, along, length = inward_normal(floor, edge), direction(floor, edge), float(edge_lengths(floor)[edge])
        deep, wide = ((things.corners[..., [0, 2]] - floor[edge]) @ way for way in (inside, along))
        for out, middle in product(BEYOND, dict.fromkeys((float(wide[main].mean()), length / 2))):
            for through in THROUGH:
                reach = (out + through) * APERTURE / 2 / LENSES[0]  # half of the picture's width there
                at = min(max(middle, reach + DEEP), length - reach - DEEP)
                met = np.abs(wide - at).min(1) < reach
                if not (met & (deep.min(1) < through) & (deep.max(1) > through)).any():
                    if 2 * (reach + DEEP) < length and deep[main].min() > through:
                        yield Eye(floor[edge] + at * along - out * inside, out + through, inside, min(at, length - at))
                    break


def _spots(room: shapely.Polygon, middle: np.ndarray, aim: np.ndarray) -> list[Eye]:
    """Where a camera inside may stand: in corners, along the walls, around what it sees."""
    floor, spots = np.array(room.exterior.coords)[:-1], []
    for corner in floor:
        away = max(float(np.linalg.norm(middle - corner)), 1e-9)
        spots += [corner + step / away * (middle - corner) for step in STEPS if step < max(away - APART, 0.9)]
    for edge in range(len(floor)):
        start, end = floor[edge], floor[(edge + 1) % len(floor)]
        spots += [start + share * (end - start) + OFF * inward_normal(floor, edge) for share in ALONG]
    around = aim + BEFORE_IT * np.stack([np.cos(TURNS), np.sin(TURNS)], 1)
    return [Eye(spot) for spot in (*spots, *around[shapely.contains_xy(room.buffer(-OFF), around)])]


def _turned(eye: np.ndarray, way: np.ndarray) -> np.ndarray:
    """(`PANS`, `SLOPES`, 4, 4) float camera to world of an eye that looks along a way (2,), turned, `shifted`."""
    cos, sin = np.cos(PANS), np.sin(PANS)
    ways = np.stack([cos * way[0] - sin * way[1], 0 * cos, sin * way[0] + cos * way[1]], 1)
    views = view_matrix(np.broadcast_to(eye, ways.shape), eye + ways)
    shape = (len(PANS), len(SLOPES), 4, 4)
    return shifted(np.broadcast_to(views[:, None], shape), np.broadcast_to(SLOPES, shape[:-2]))


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
