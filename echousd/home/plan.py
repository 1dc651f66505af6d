"""The plan of a home: conflicts named first, then cells from the solver, floors between walls, doors and windows."""

import itertools
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import networkx
import numpy as np
import shapely

from echomodel.openings import Opening, inward_normal, segment, signed_area
from echomodel.plans import floor_extents
from echomodel.rooms.statistics import room_type_statistics
from echomodel.vocabulary import vocabulary
from echousd.graph import GraphError, SceneGraph
from echousd.home.graph import HomeGraph, HomeRelation, HomeRoom
from echousd.home.openings import Floor, counterpart, facings, openings_of
from echousd.home.solve import CORNERS, EFFORTS, FACADE, Cells, Problem, Wish, scaled, solved
from echousd.shapes.walls import outline as offset

INNER, OUTER = 0.12, 0.24  # metres, thickness of walls between rooms and of outer walls
STATED, FREE, LOOSE = (0.92, 1.08), (0.7, 1.5), (0.5, 2.5)  # shares of its area that a room may have
WALLED = 0.27  # metres of a cell's side that walls take
PATH = 1.5  # metres across a hall
ENTERED = 3  # rank of halls among hubs
LARGER = 1.15  # of a smaller room's area
LEAST = 1.5  # metres, short side of any cell
RATIOS = (1.3, 1.0, 1.6, 1.15, 1.45, 1.8)  # of a free outline, long side over short side
MOST_PLANS = 12
NARROW = 0.85  # of the short side that a room's furniture would have
HALL = 6.0  # long side over short side of a hall


Key = TypeVar("Key")


@dataclass(frozen=True, eq=False)
class HomePlan:
    """Where the rooms of a home lie, and their doors and windows.

    Arguments:
        home: the graph, in which every room is reached.
        cells: (k, 2) float of every room, corners (x, z) in metres of its floor and half of its walls; they meet.
        rects: the cells as the solver has them, from which an edit begins. walls: thickness of each edge's wall.
        openings: of every room, which count the edges of its floor. poses: of rooms whose frame is their own.
        lit: rooms whose windows nobody stated: they are only proposed until the furniture is there.
    """

    home: HomeGraph
    cells: Mapping[str, np.ndarray]
    walls: Mapping[str, tuple[float, ...]]
    openings: Mapping[str, tuple[Opening, ...]]
    rects: Cells
    poses: Mapping[str, np.ndarray] = field(default_factory=dict)
    lit: frozenset[str] = frozenset()

    def pose(self, name: str) -> np.ndarray:
        """(4, 4) float, a room's own frame to the home's, metres, column vectors."""
        if name in self.poses:
            return self.poses[name]
        pose = np.eye(4)
        pose[[0, 2], 3] = self.origin(name)
        return pose

    @cached_property
    def floors(self) -> dict[str, np.ndarray]:
        """(k, 2) float of every room, corners (x, z) of its floor, metres, in the home's frame."""
        return {
            name: offset(np.asarray(cell, float), [-thick for thick in self.walls[name]]).round(4)
            for name, cell in self.cells.items()
        }

    @cached_property
    def sides(self) -> dict[str, Floor]:
        """The floors with their walls, behind which others are found."""
        return {name: Floor(name, floor, self.walls[name]) for name, floor in self.floors.items()}

    def behind(self, name: str, opening: Opening) -> tuple[str, Opening] | None:
        """The room behind an opening of a room, and the hole on its side; None for one that leads outside."""
        return counterpart(self.sides[name], opening, self.sides.values())

    @property
    def areas(self) -> dict[str, float]:
        """Square metres of every floor."""
        return {name: abs(signed_area(floor)) for name, floor in self.floors.items()}

    @property
    def area(self) -> float:
        """Square metres of all floors."""
        return sum(self.areas.values())

    def origin(self, name: str) -> np.ndarray:
        """(2,) float, metres: where the middle of a room's own frame lies in the home's."""
        floor = self.floors[name]
        return ((floor.min(0) + floor.max(0)) / 2).round(4)

    def graph(self, name: str) -> SceneGraph:
        """The graph of a room with the floor, walls and openings that it has in the plan, in its own frame."""
        graph, pose = self.home.room(name).graph, self.pose(name)[[0, 2]]
        corners = tuple(map(tuple, ((self.floors[name] - pose[:, 3]) @ pose[:, [0, 2]]).round(4).tolist()))
        return graph.with_room(floor_polygon=corners, size=None, walls=self.walls[name], openings=self.openings[name])

    def broken(self) -> tuple[str, ...]:
        """Relations of the graph that the plan does not keep, measured on its floors and openings."""
        joined = {(frozenset(pair), opening.kind) for pair, opening in ways(self)}
        return tuple(str(relation) for relation in self.home.relations if not self._keeps(relation, joined))

    def _keeps(self, relation: HomeRelation, joined: Container[tuple[frozenset[str], str]]) -> bool:
        row = relation.row
        a, b = (shapely.Polygon(self.cells[name]) for name in relation.pair)
        if row.passes:
            kinds = {"door", "passage"} if relation.predicate == "door" else {"passage"}
            return any((frozenset(relation.pair), kind) in joined for kind in kinds)
        if row.wall:
            return bool(shapely.length(shapely.intersection(a, b)) >= row.wall - 1e-6)
        if row.symmetric:
            return bool(shapely.distance(a, b) > 1e-3)
        if any(row.step):
            axis, sign = (0 if row.step[0] else 1), sum(row.step)
            middle, edge = (a.bounds[axis] + a.bounds[2 + axis]) / 2, b.bounds[2 + axis if sign > 0 else axis]
            return bool(sign * (middle - edge) >= -1e-3)
        return bool(a.area > b.area)


def ways(plan: HomePlan) -> Iterator[tuple[tuple[str, str], Opening]]:
    """The pairs of rooms that one gets through between, and by what; a door is told by the room that has its leaf."""
    for name, openings in plan.openings.items():
        for opening in openings:
            other = plan.behind(name, opening) if opening.kind != "window" else None
            match = other and next((o for o in plan.openings[other[0]] if _same(o, other[1])), None)
            if other and match and (opening.kind == "door" or (match.kind == "passage" and name < other[0])):
                yield (name, other[0]), opening


def doorways(plan: HomePlan) -> Iterator[tuple[tuple[str, str], Opening, np.ndarray]]:
    """The `ways`, and (2, 2) float lower and upper corner (x, z), metres, of the floor in each."""
    floors = plan.sides
    for (one, other), opening in ways(plan):
        near = segment(floors[one].corners, opening)
        behind = next(f for f in facings(floors[one], floors[other]) if f.edge == opening.edge)
        far = near - inward_normal(floors[one].corners, opening.edge) * behind.deep
        corners = np.concatenate([near, far])
        yield (one, other), opening, np.array([corners.min(0), corners.max(0)])


def _same(opening: Opening, wanted: Opening) -> bool:
    gaps = (opening.offset - wanted.offset, opening.width - wanted.width, opening.height - wanted.height)
    return opening.kind != "window" and opening.edge == wanted.edge and max(map(abs, gaps)) < 5e-3


def overlapping(floors: Mapping[Key, np.ndarray], most: float) -> Iterator[tuple[Key, Key, float]]:
    """Pairs of floors, (k, 2) float each, that share more than so many square metres, and how many they share."""
    shapes = {name: shapely.Polygon(corners) for name, corners in floors.items()}
    for one, other in itertools.combinations(shapes, 2):
        shared = shapes[one].intersection(shapes[other]).area
        if shared > most:
            yield one, other, shared


def plan_home(home: HomeGraph, *, seed: int = 0, before: HomePlan | None = None) -> HomePlan:
    """The plan of a home; the same graph and seed give the same plan.

    Arguments:
        before: an earlier plan, from which it begins.

    Raises `GraphError` that names what contradicts itself, with a smallest set of relations that cannot hold together.
    """
    home = home.connected()
    faults = conflicts(home)
    if faults:
        raise GraphError(faults[0])
    first = _problem(home, seed, before)
    for effort, problem in itertools.product(EFFORTS, _attempts(first)):
        found = [solved(one, effort) for one in _varied(problem)]
        for _, lie, _ in sorted((one for one in found if one[0] == "solved"), key=lambda one: one[2]):
            plan = _walled(home, lie)
            if home.area and first.free and abs(plan.area / home.area - 1) > 0.02:
                plan = _walled(home, scaled(lie, home.area / plan.area))
            plan = with_openings(plan)
            if not plan.broken():
                return plan
    raise GraphError(_unplannable(first))


def _varied(problem: Problem) -> Iterator[Problem]:
    """The problem, and that of a new plan in other outlines, too, if it is free: the best of these is taken."""
    yield problem
    side = float(np.sqrt(np.prod(problem.extents)))
    for number, ratio in enumerate(RATIOS if problem.free and problem.before is None else ()):
        yield replace(problem, extents=(side / ratio**0.5, side * ratio**0.5), seed=problem.seed + number)


def plans(home: HomeGraph, count: int, seed: int = 0) -> list[HomePlan]:
    """Several plans that differ, the first that of `plan_home`; fewer where no more are found."""
    if not 1 <= count <= MOST_PLANS:
        raise GraphError(f"plans is {count}, allowed: 1 to {MOST_PLANS}")
    found: list[HomePlan] = []
    for number in range(3 * count):
        made = plan_home(home, seed=seed + number)
        if not any(_alike(made, other) for other in found):
            found.append(made)
        if len(found) == count:
            break
    return found


def _alike(one: HomePlan, other: HomePlan) -> bool:
    shared = sum(
        shapely.intersection(shapely.Polygon(one.cells[name]), shapely.Polygon(other.cells[name])).area
        for name in one.cells
    )
    return shared > 0.9 * sum(abs(signed_area(cell)) for cell in one.cells.values())


# -- before solving ----------------------------------------------------------------------------------------------------


def conflicts(home: HomeGraph) -> tuple[str, ...]:
    """What contradicts itself in a graph, without solving anything: words, orders, areas, walls that would cross."""
    return tuple(dict.fromkeys((*_pairs(home), *_circles(home), *_areas(home), *_crossing(home))))


def _pairs(home: HomeGraph) -> Iterator[str]:
    joined = {frozenset(r.pair): r for r in home.relations if r.row.wall}
    for relation in home.relations:
        if relation.row.symmetric and not relation.row.wall and frozenset(relation.pair) in joined:
            yield f"'{joined[frozenset(relation.pair)]}' and '{relation}' cannot both hold"


def _circles(home: HomeGraph) -> Iterator[str]:
    for step in ((1, 0), (0, 1), None):
        order = networkx.DiGraph()
        for relation in home.relations:
            row, pair = relation.row, relation.pair
            if step is None:
                if row.compares:
                    order.add_edge(*pair, sentence=str(relation))
            elif row.step in (step, (-step[0], -step[1])):
                order.add_edge(*(pair if row.step == step else pair[::-1]), sentence=str(relation))
        for circle in networkx.simple_cycles(order):
            ends = zip(circle, (*circle[1:], circle[0]), strict=True)
            sentences = " and ".join(f"'{order.edges[pair]['sentence']}'" for pair in ends)
            yield f"{sentences} cannot all hold"
            break


def _areas(home: HomeGraph) -> Iterator[str]:
    stated = {room.name: room.area for room in home.rooms if room.area is not None}
    for relation in home.relations:
        row, (one, other) = relation.row, relation.pair
        known = {one, other} <= stated.keys() and row.compares
        if known and stated[one] <= stated[other]:
            yield f"'{relation}': {one} has {stated[one]:g} m², {other} {stated[other]:g} m²"
    least = sum(stated.get(room.name, _usual(room)[0]) for room in home.rooms)
    most = home.area or (None if home.outline is None else _inside(home.outline, len(home.rooms)))
    if most is not None and least > most * STATED[1]:
        listed = ", ".join(f"{room.name} {stated.get(room.name, _usual(room)[0]):.3g}" for room in home.rooms)
        yield f"the rooms need {least:.3g} m² at least ({listed}), the home has {most:.3g} m²"
    if home.outline is not None and home.area is not None:
        room = _inside(home.outline, len(home.rooms))
        if not 0.8 < home.area / room < 1.2:
            yield f"area is {home.area:g} m², the outline leaves {room:.3g} m² between its walls; state one of them"
    edges = np.zeros((1, 2)) if home.outline is None else np.diff([*home.outline, home.outline[0]], axis=0)
    if (np.abs(edges).min(1) > 1e-3).any():
        yield "the outline has a slanted wall, allowed: walls along x and z"


def _inside(outline: Sequence[tuple[float, float]], rooms: int) -> float:
    """Square metres of floor that an outline with so many rooms holds, about."""
    area = abs(signed_area(outline))
    return area - OUTER * float(shapely.Polygon(outline).length) - INNER * max(rooms - 1, 0) * np.sqrt(area / rooms)


def _crossing(home: HomeGraph) -> Iterator[str]:
    """Relations of rooms that share walls in no flat plan: a smallest set, that of Kuratowski."""
    shared = networkx.Graph(relation.pair for relation in home.relations if relation.row.wall)
    flat, witness = networkx.check_planarity(shared, counterexample=True)
    if not flat:
        pairs = {frozenset(edge) for edge in witness.edges}
        sentences = [f"'{r}'" for r in home.relations if r.row.wall and frozenset(r.pair) in pairs]
        yield f"no flat plan has all of {', '.join(sentences)}: their ways would cross; leave one of them out"


# -- the problem -------------------------------------------------------------------------------------------------------


def _usual(room: HomeRoom) -> tuple[float, float, float]:
    """Square metres of floor that a room has at least, and as its furniture would have it; metres of its short side."""
    nodes, statistics = room.graph.nodes, room_type_statistics(room.type)
    asked = [node.category for node in nodes], [node.size for node in nodes]
    extents = floor_extents(room.type, *asked, np.random.default_rng(0))
    return float(statistics.area[0]), extents[0] * extents[1], min(NARROW * min(extents), statistics.short[2])


def _problem(home: HomeGraph, seed: int, before: HomePlan | None) -> Problem:
    """What the solver is asked at first: areas as stated or usual, in proportion to the whole."""
    floors, stated = _wanted(home)
    gross = {name: (np.sqrt(area) + WALLED) ** 2 for name, area in floors.items()}
    voids: tuple[tuple[float, float, float, float], ...] = ()
    if home.outline is not None:
        corners = np.array(home.outline)
        extents = corners.max(0) - corners.min(0)
        whole = shapely.Polygon(corners - corners.min(0))
        voids = tuple(rectangles(shapely.box(0, 0, *extents).difference(whole)))
        loose = sum(area for name, area in gross.items() if name not in stated)
        scale = (whole.area - sum(gross[name] for name in stated)) / loose if loose else 1.0
        gross = {name: area * (1.0 if name in stated else scale) for name, area in gross.items()}
    elif before is not None:
        corners = np.concatenate([*before.cells.values()])
        extents = corners.max(0) - corners.min(0)
        gross = {name: area * extents.prod() / sum(gross.values()) for name, area in gross.items()}
    else:
        ratio = RATIOS[seed % len(RATIOS)]
        extents = np.sqrt(sum(gross.values()) * np.array([1 / ratio, ratio]))
    wishes, wet = [], []
    for room in home.rooms:
        row, area = vocabulary().room_type(room.type), gross[room.name]
        outer = FACADE if row.daylight or row.use == "outdoor" or room.name == home.entered_by else 0.0
        ratio = max(room.ratio, HALL) if row.hub == ENTERED else room.ratio  # a hall may be as long as it must
        short = min(_usual(room)[2], 0.75 * np.sqrt(area)) + INNER
        wishes.append(Wish(room.name, area, *(STATED if room.name in stated else FREE), ratio, short, outer))
        wet += [room.name] if row.use == "wet" else []
    order = np.random.default_rng(seed).permutation(len(wishes)) if seed else range(len(wishes))
    asked = tuple(wishes[number] for number in order)  # another order, another plan
    lie = None if before is None else before.rects
    sides = (float(extents[0]), float(extents[1]))
    free = home.outline is None
    return Problem(asked, home.relations, sides, voids, free, together=tuple(wet), seed=seed, before=lie)


def _wanted(home: HomeGraph) -> tuple[dict[str, float], set[str]]:
    """Square metres of floor of every room, and the rooms that state theirs.

    What is free grows with the walls that a room shares, as `larger_than` says, and with the whole.
    """
    drawn = {room.name: room.graph.room.corners for room in home.rooms}
    stated = {name: abs(signed_area(corners)) for name, corners in drawn.items() if corners is not None}
    stated |= {room.name: room.area for room in home.rooms if room.area is not None}
    floors = {room.name: stated.get(room.name, _usual(room)[1]) for room in home.rooms}
    for room in home.rooms:
        walls = FACADE + sum(r.row.wall + CORNERS for r in home.relations if r.row.wall and room.name in r.pair)
        hall = vocabulary().room_type(room.type).hub == ENTERED
        least = PATH * (walls / 2 - PATH) * 1.2 if hall else (walls / 4) ** 2
        floors[room.name] = stated.get(room.name, max(floors[room.name], least))
    order = networkx.DiGraph(relation.pair for relation in home.relations if relation.row.compares)
    for name in reversed([*networkx.topological_sort(order)]):
        smaller = [floors[other] for other in order.successors(name)]
        floors[name] = stated.get(name, max([floors[name], *(LARGER * area for area in smaller)]))
    for name in networkx.topological_sort(order):
        larger = [floors[other] for other in order.predecessors(name)]
        floors[name] = stated.get(name, min([floors[name], *(area / LARGER for area in larger)]))
    total = home.area or (None if home.outline is None else _inside(home.outline, len(home.rooms)))
    rest = sum(area for name, area in floors.items() if name not in stated)
    if total is not None and rest:
        scale = max(total - sum(stated.values()), 0.2 * rest) / rest
        floors = {name: area * (1.0 if name in stated else scale) for name, area in floors.items()}
    return floors, {*stated}


def rectangles(shape: shapely.Geometry) -> Iterator[tuple[float, float, float, float]]:
    """Boxes that cover a shape of right angles."""
    for part in getattr(shape, "geoms", [shape]):
        if part.area < 1e-6:
            continue
        xs = sorted({round(x, 6) for x, _ in part.exterior.coords})
        zs = sorted({round(z, 6) for _, z in part.exterior.coords})
        for x, after in itertools.pairwise(xs):
            for z, next_z in itertools.pairwise(zs):
                if part.covers(shapely.Point((x + after) / 2, (z + next_z) / 2)):
                    yield x, z, after, next_z


def _attempts(first: Problem) -> Iterator[Problem]:
    """The problem, and then ever milder ones: wet rooms apart, freer areas, a notched outline."""
    yield first
    apart = replace(first, together=())
    if first.together:
        yield apart
    loose = replace(apart, wishes=tuple(_loosened(wish) for wish in first.wishes))
    yield loose
    if first.free:
        wide = (1.15 * first.extents[0], 1.15 * first.extents[1])
        yield replace(loose, extents=wide, gaps=True)


def _loosened(wish: Wish) -> Wish:
    low, high = (wish.least, wish.most) if wish.least == STATED[0] else LOOSE
    return replace(wish, least=low, most=high, ratio=max(wish.ratio, 3.5), short=min(wish.short, LEAST))


def _unplannable(problem: Problem) -> str:
    """What to say of a graph that no plan was found for: a smallest set of relations that is proven not to hold."""
    wishes = tuple(replace(wish, least=0.0, most=1e3, ratio=20.0, short=1.0) for wish in problem.wishes)
    side = 2.5 * max(problem.extents)
    bare = replace(problem, wishes=wishes, gaps=True, together=(), extents=(side, side), voids=(), before=None)

    def impossible(relations: Sequence[HomeRelation]) -> bool:
        return solved(replace(bare, relations=tuple(relations)))[0] == "impossible"

    if not impossible(problem.relations):
        within = "areas" if problem.free else "outline and areas"
        return f"no plan found that keeps all {len(problem.relations)} relations with these {within}; free one of them"
    kept = list(problem.relations)
    for relation in problem.relations:
        fewer = [one for one in kept if one is not relation]
        if impossible(fewer):
            kept = fewer
    return f"no plan of rectangles has all of {', '.join(repr(str(r)) for r in kept)}; leave one of them out"


# -- from cells to floors ----------------------------------------------------------------------------------------------


def _walled(home: HomeGraph, lie: Cells) -> HomePlan:
    """Floors between walls of real thickness, without openings, about the middle of the home."""
    shapes = {name: shapely.box(*rect) for name, rect in lie.items()}
    whole = shapely.union_all([*shapes.values()])
    low, high = np.array(whole.bounds).reshape(2, 2)
    shift = -((low + high) / 2).round(2) if home.outline is None else np.array(home.outline).min(0)
    cells = {name: _corners(shape) + shift for name, shape in shapes.items()}
    walls = {name: _thickness(cells[name] - shift, whole) for name in cells}
    return HomePlan(home, cells, walls, {name: () for name in cells}, lie)


def with_openings(plan: HomePlan, before: HomeGraph | None = None) -> HomePlan:
    """The plan with the doors, passages and windows that its graph asks for.

    Arguments:
        before: the graph that its openings are of, which stay but for those between rooms that it joins in another way.
    """
    if before is None:
        openings = openings_of(plan.home, [*plan.sides.values()], {}, ())
        whole = shapely.union_all([shapely.Polygon(cell) for cell in plan.cells.values()])
        plain = whole.area > 0.999 * whole.envelope.area  # then thick walls have the outside behind them all along
        lit = (name for name, own in openings.items() if plain and any(one.kind == "window" for one in own))
        return replace(plan, openings=openings, lit=frozenset(lit))
    other = {frozenset(r.pair) for r in {*before.relations} ^ {*plan.home.relations} if r.row.passes}

    def stays(name: str, opening: Opening) -> bool:
        behind = plan.behind(name, opening)
        return behind is None or frozenset((name, behind[0])) not in other

    there = {name: [one for one in own if stays(name, one)] for name, own in plan.openings.items()}
    return replace(plan, openings=openings_of(plan.home, [*plan.sides.values()], there, before.relations))


def _corners(shape: shapely.Geometry) -> np.ndarray:
    """(k, 2) float, corners of a cell without those on straight edges, the first edge at -z."""
    ring = shapely.orient_polygons(shape.simplify(1e-4), exterior_cw=False)
    corners = np.array(ring.exterior.coords)[:-1].round(4)
    after, before = np.roll(corners, -1, 0) - corners, corners - np.roll(corners, 1, 0)
    corners = corners[np.abs(after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0]) > 1e-6]
    first = int(np.lexsort((corners[:, 0], corners[:, 1]))[0])
    return np.roll(corners, -first, axis=0)


def _thickness(cell: np.ndarray, whole: shapely.Geometry) -> tuple[float, ...]:
    """What is taken of a cell along each of its edges: an outer wall, or half of one between rooms."""
    out = []
    for start, end in zip(cell, np.roll(cell, -1, 0), strict=True):
        on_border = shapely.LineString([start, end]).intersection(whole.boundary.buffer(1e-4)).length
        out.append(OUTER if on_border > 0.01 else INNER / 2)
    return tuple(out)
