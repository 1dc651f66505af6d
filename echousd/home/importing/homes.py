"""What a reader found as a home: rooms with floors between walls, openings in them, furniture that stays put."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely

from echomodel import openings as usual_openings
from echomodel.openings import USUAL, Opening, direction, inward_normal, numbered, overlap, segment, signed_area
from echomodel.sizes import size_statistics
from echomodel.vocabulary import normalised, vocabulary
from echousd.assets.naming import category_of, known_word, plain
from echousd.graph import GraphError, Node, RoomSpec, SceneGraph, starting_graph
from echousd.graph.nodes import OBSTACLE
from echousd.home.existing import APART, walled
from echousd.home.graph import HomeGraph, HomeRelation, HomeRoom
from echousd.home.importing.found import Drawn, Hole, Piece, Room, kind_of
from echousd.home.openings import Facing, facings, outer_spans
from echousd.home.plan import HomePlan, overlapping, ways, with_openings
from echousd.naming import free_name
from echousd.stage.foreign import LARGE, TAKEN_FOR

LEAST = 0.5  # square metres of a room
TIDY = 0.01  # metres: corners that stand out less are none
WIDE = 1.0  # metres from which a way without a leaf is open: wider than a door
NARROW = 0.4  # metres of what may be a way
REACH = 0.3  # metres from a wall to what is a hole in it
STRAIGHT = 0.97  # cosine between a hole and its wall
UNKNOWN = "living_room"  # what a room is taken for whose kind nobody tells


@dataclass(frozen=True)
class Imported:
    """A plan of somebody's as a home.

    Arguments:
        counts: what was understood, by kind. ignored: what was not, and how often. found: all that was read.
    """

    plan: HomePlan
    counts: dict[str, int]
    ignored: dict[str, int]
    found: Drawn


def imported(found: Drawn, storey: str | None = None, *, lenient: bool = False) -> Imported:
    """The home that a plan describes.

    Arguments:
        storey: one of several, None = the lowest.
        lenient: leave out doors and windows that meet no wall.

    Raises `GraphError` for outlines that are open, cross or overlap, and for openings in no wall.
    """
    if storey is not None and storey not in found.storeys:
        allowed = ", ".join(map(repr, filter(None, found.storeys))) or "to leave it out, as the plan names none"
        raise GraphError(f"no storey {storey!r}, allowed: {allowed}")
    level = storey if storey is not None else next(iter(found.storeys), "")
    ignored = Counter(found.ignored)
    ignored["rooms of other storeys"] += sum(one.storey not in ("", level) for one in found.rooms)
    holes = [one for one in found.holes if one.storey in ("", level)]
    pieces = [one for one in found.pieces if one.storey in ("", level)]
    floors = {one: _outline(one) for one in found.rooms if one.storey in ("", level)}
    if not floors:
        raise GraphError("no rooms, allowed: at least one")
    for room, other, shared in overlapping(floors, APART):
        raise GraphError(f"rooms {room.name!r} and {other.name!r} overlap by {shared:.2f} m², allowed: side by side")
    named: dict[str, Room] = {}
    for one in floors:
        named[free_name(_identifier(one.name), named)] = one
    kinds = {name: room_kind(one.words) for name, one in named.items()}
    ignored["rooms of unknown kind, taken for a living room"] += sum(kind is None for kind in kinds.values())
    corners = {name: tuple(map(tuple, floors[one].tolist())) for name, one in named.items()}
    bare = {
        name: starting_graph(RoomSpec(kinds[name] or UNKNOWN, floor_polygon=corners[name], height=one.height))
        for name, one in named.items()
    }
    home = HomeGraph([HomeRoom(name, graph) for name, graph in bare.items()])
    plan = walled(home, {name: (graph, np.eye(4)) for name, graph in bare.items()})
    assert plan is not None  # they do not overlap
    plan = replace(plan, poses={})
    openings, dropped = _opened(plan, holes, lenient=lenient)
    ignored.update(dropped)
    counts = Counter(one.kind for own in openings.values() for one in own)
    plan = replace(plan, openings=openings)
    met = [*ways(plan)]
    counts["passage"] -= len(met)  # the other side of a door or passage
    inside = {frozenset(pair): way for pair, way in met}
    relations = [
        HomeRelation(one, "open_to" if way.kind == "passage" and way.width >= WIDE else "door", other)
        for (one, other), way in ((sorted(pair), way) for pair, way in inside.items())
    ]
    furnished, left = _furnished(plan, pieces)
    ignored.update(left)
    counts["fixed"] = sum(len(nodes) for nodes in furnished.values())
    graphs = [HomeRoom(name, _graph(graph, furnished[name])) for name, graph in bare.items()]
    plan = replace(plan, home=HomeGraph(graphs, relations))
    if not holes:
        plan = with_openings(replace(plan, home=plan.home.connected()))
    counted = {"rooms": len(named), **{f"{kind}s": counts[kind] for kind in ("door", "window", "passage")}}
    return Imported(
        plan, {**counted, "fixed pieces": counts["fixed"]}, {what: n for what, n in ignored.items() if n}, found
    )


def room_kind(words: Sequence[str]) -> str | None:
    """The room type that some words name, None where none does."""
    for text in words:
        parts = [part for part in normalised(text).rstrip("0123456789_").split("_") if part and not part.isdecimal()]
        for length in range(len(parts), 0, -1):
            for start in range(len(parts) - length, -1, -1):
                kind = vocabulary().known_room_type("_".join(parts[start : start + length]))
                if kind is not None:
                    return kind.name
        if word := kind_of("rooms", plain(text)):
            return word
    return None


def _identifier(text: str) -> str:
    word = normalised("".join(c if c.isascii() and (c.isalnum() or c == "_") else " " for c in text))
    return f"room_{word}" if not word or word[0].isdecimal() else word[:60]


def _outline(room: Room) -> np.ndarray:
    """(k, 2) float, a room's corners without doubles and steps of millimetres; raises `GraphError`."""
    corners = np.asarray(room.corners, float).reshape(-1, 2)
    if len(corners) < 3 or not np.isfinite(corners).all():
        raise GraphError(
            f"room {room.name!r}: an open outline of {len(corners)} corners, allowed: three or more around it"
        )
    shape = shapely.Polygon(corners).simplify(TIDY)
    if not shape.is_valid:
        raise GraphError(f"room {room.name!r}: its outline crosses itself, allowed: one around the floor")
    if shape.area < LEAST:
        raise GraphError(f"room {room.name!r}: {shape.area:.2f} m² of floor, allowed: at least {LEAST} (see --unit)")
    if shape.area > 5000:
        raise GraphError(f"room {room.name!r}: {shape.area:.0f} m² of floor, allowed: at most 5000 (see --unit)")
    ring = shapely.orient_polygons(shape, exterior_cw=False)
    found: np.ndarray = np.array(ring.exterior.coords)[:-1]
    before, after = found - np.roll(found, 1, 0), np.roll(found, -1, 0) - found  # of the first corner, straight or not
    cross = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    bends = cross > 1e-3 * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return found[bends if bends.sum() > 2 else slice(None)].round(4)


# -- doors and windows -------------------------------------------------------------------------------------------------


def _fit(plan: HomePlan, side: Facing, hole: Hole, ends: np.ndarray) -> tuple[float, Opening] | None:
    """How far (metres) a hole is from fitting into a stretch of wall, and the opening that it is there, if it fits."""
    corners, height = plan.floors[side.one], plan.home.room(side.one).graph.room.height
    along, outward = direction(corners, side.edge), -inward_normal(corners, side.edge)
    at, off = (ends - corners[side.edge]) @ along, float((ends.mean(0) - corners[side.edge]) @ outward)
    width = float(np.linalg.norm(ends[1] - ends[0]))
    start, end = max(at.min(), side.low + 0.01), min(at.max(), side.high - 0.01)
    away = abs(off - side.deep / 2)
    if away > side.deep / 2 + REACH or np.ptp(at) < STRAIGHT * width or end - start < max(NARROW, 0.6 * width):
        return None
    use, high = vocabulary().room_type(plan.home.room(side.one).type).use, height or usual_openings.HIGHEST
    windows, sill, usual = usual_openings.WINDOWS, 0.0, USUAL[hole.kind]["height"]
    if hole.kind == "window":
        low, usual, _ = windows.get(use, windows[""])
        sill = hole.sill if hole.sill is not None and 0 <= hole.sill < high else low  # as usual where it is none
    tall = min(hole.height if hole.height is not None and 0.1 <= hole.height <= high else usual, high - sill - 0.01)
    sides = (round(float(start), 4), round(float(end - start), 4), round(float(tall), 4))
    return away + width - (end - start), Opening(hole.kind, hole.kind, side.edge, *sides, round(float(sill), 4))


def _opened(
    plan: HomePlan, holes: Sequence[Hole], *, lenient: bool
) -> tuple[dict[str, tuple[Opening, ...]], Counter[str]]:
    """The openings of every room, those between two on both sides; what was left out."""
    floors, ignored = [*plan.sides.values()], Counter[str]()
    walls = [side for one, other in combinations(floors, 2) for side in facings(one, other)]
    walls += [side for floor in floors for side in outer_spans(floor, floors)]
    found: dict[str, list[Opening]] = {name: [] for name in plan.floors}
    for hole in holes:
        fits = [
            (*fit, wall, which)
            for wall in walls
            for which, ends in enumerate(hole.ends)
            if (fit := _fit(plan, wall, hole, ends))
        ]
        if not fits:
            x, z = hole.ends.mean((0, 1))
            if not lenient:
                raise GraphError(
                    f"{hole.kind} {hole.name!r} at {x:.2f} m north, {z:.2f} m east meets no wall of a room, allowed: "
                    "in a wall, or --lenient to leave it out"
                )
            ignored[f"{hole.kind}s that meet no wall"] += 1
            continue
        _, opening, wall, which = min(fits, key=lambda fit: fit[0])
        sides = [(wall.one, opening), *([(wall.other, wall.across(opening))] if wall.other else [])]
        if hole.kind == "door":
            sides = _leaf(plan, sides, hole.ends[which][0], None if hole.tips is None else hole.tips[which])
        if any(overlap(side, other) > 0 for room, side in sides for other in found[room]):
            ignored[f"{hole.kind}s drawn twice"] += 1
            continue
        for room, side in sides:
            found[room].append(replace(side, name=numbered(side.kind, [one.name for one in found[room]])))
    return {name: tuple(own) for name, own in found.items()}, ignored


def _leaf(
    plan: HomePlan, sides: list[tuple[str, Opening]], hinge: np.ndarray, tip: np.ndarray | None
) -> list[tuple[str, Opening]]:
    """The sides of a door with its leaf where the source has it, else in the room that fewer go through."""
    hubs = [vocabulary().room_type(plan.home.room(name).type).hub for name, _ in sides]
    inner, swing = int(np.argmin(hubs)), "in"
    if tip is not None:
        depths = [(tip - segment(plan.floors[n], o)[0]) @ inward_normal(plan.floors[n], o.edge) for n, o in sides]
        inner = int(np.argmax(depths))
        swing = "in" if max(depths) > 0 else "out"
    out = []
    for number, (name, side) in enumerate(sides):
        floor = plan.floors[name]
        near, far = np.linalg.norm(segment(floor, side) - hinge, axis=1)
        left = (near <= far) == (signed_area(floor) > 0)
        hinge_side = "left" if left or tip is None else "right"
        leaf = replace(side, kind="door", swing=swing, hinge=hinge_side)
        out.append((name, leaf if number == inner else replace(side, kind="passage")))
    return out


# -- furniture ---------------------------------------------------------------------------------------------------------


def _furnished(plan: HomePlan, pieces: Sequence[Piece]) -> tuple[dict[str, list[Node]], Counter[str]]:
    """The pieces of every room, in its own frame, where they stand; what was left out."""
    shapes = {name: shapely.Polygon(floor) for name, floor in plan.floors.items()}
    found: dict[str, list[Node]] = {name: [] for name in shapes}
    ignored = Counter[str]()
    for piece in pieces:
        room = next((name for name, shape in shapes.items() if shape.covers(shapely.Point(piece.at[[0, 2]]))), None)
        if room is None:
            ignored["furniture in no room"] += 1
            continue
        size = None if piece.size is None or not np.isfinite(piece.size[[0, 2]]).all() else np.abs(piece.size)
        known = size if size is not None and np.isfinite(size).all() else None
        read = [known_word(word) or category_of((), word, "", known)[0] for word in piece.words]
        category = next(filter(None, read), "")
        attributes = {}
        if not category:
            if known is None or sorted(known)[1] < LARGE:
                ignored[f"{piece.words[0]!r}, not known"] += 1
                continue
            category, attributes = TAKEN_FOR, {OBSTACLE: piece.words[0][:60] or "thing"}
        usual = size_statistics(category).median
        size = usual if size is None else np.where(np.isfinite(size), size, usual).clip(0.02)
        origin, at, front = plan.origin(room), piece.at.astype(float).copy(), piece.front
        if piece.size is None and vocabulary().category(category).support == "floor":
            at[1] = 0.0  # the source has its middle, of a height that it does not tell
        if piece.sides == 4 and (size[2] - size[0]) * (usual[2] - usual[0]) < 0:  # as such furniture is
            size, front = size[[2, 1, 0]], np.array([-front[1], front[0]])
        floor = plan.floors[room]
        if piece.sides > 1 and _before(floor, at[[0, 2]], front) < _before(floor, at[[0, 2]], -front):
            front = -front
        away = at[0] - origin[0], max(at[1], 0.0), at[2] - origin[1]
        name = free_name(_identifier(piece.name), {node.name for node in found[room]})
        found[room].append(
            Node(
                name, category, size=tuple(size.round(4).tolist()), position=tuple(round(float(v), 4) for v in away),
                yaw=round(float(np.arctan2(front[0], front[1])), 6), locked=True, attributes=attributes,
                shapes="boxes" if attributes else None,
            )
        )  # fmt: skip
    return found, ignored


def _before(floor: np.ndarray, at: np.ndarray, way: np.ndarray) -> float:
    """Metres from a place to the wall that it looks at."""
    ray = shapely.LineString([at, at + np.asarray(way) * 100])
    return float(shapely.Point(at).distance(ray.intersection(shapely.Polygon(floor).exterior)))


def _graph(bare: SceneGraph, nodes: Sequence[Node]) -> SceneGraph:
    """What stands in a room: its own furniture, or what such rooms usually hold where the source has none."""
    room = bare.room.replaced(floor_polygon=None)
    return SceneGraph(room, tuple(nodes)) if nodes else SceneGraph(room, bare.nodes, bare.relations)
