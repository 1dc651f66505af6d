"""Furniture moved apart by its solids: chairs are tucked as far as they fit, nothing starts inside anything."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from echomodel.boxes import Boxes
from echomodel.boxes2d import footprints
from echomodel.objective import Plan, faults_of, unreached
from echomodel.objective.copies import copies_of
from echomodel.objective.support import ON_CEILING
from echomodel.triangles import Mesh, connected_pieces
from echousd.graph import Placed, Relation, SceneGraph
from echousd.graph.arrays import rounded_boxes
from echousd.make.verdicts import relation_verdicts
from echousd.place.geometry import Collision
from echousd.place.living import plan_to_live_in
from echousd.room import LayoutOutcome
from echousd.shapes.geometry import Geometry
from echousd.shapes.nofit import FLUSH, Solids, depth, forbidden_moves
from echousd.shapes.walls import ShellPart
from echousd.shapes.walls import walls as walls_of

REACH = 0.5  # metres that a piece is moved at most in all
NEAR = 0.01  # metres within which solids are looked at first: most things at most touch
EDGE = 0.002  # metres beyond the floor, or beyond what it stands on, that a piece may be
ALIKE = 0.7  # cosine between the headings of seats at one side of a table
ASIDE = 2.0  # a seat moves back from its table more easily than aside


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that can be in the way; numbers from n on are parts of the shell, which stays."""

    solids: Sequence[Solids]  # corners of the convex pieces of every thing in the room, metres
    fixed: np.ndarray  # (s,) bool, what must not move
    carrier: np.ndarray  # (n,) int, as `Problem.carrier`
    anchor: np.ndarray  # (n,) int, whom each thing attends, -1 = nobody
    heading: np.ndarray  # (n,) float, yaw in radians
    seat: np.ndarray  # (n,) bool
    bulk: np.ndarray  # (n,) float, square root of the footprint, metres
    outline: Sequence[shapely.Polygon]  # n polygons, footprints
    level: Sequence[BaseGeometry]  # n polygons, where the top of each is: a desk with a shelf behind has it there alone
    floor: shapely.Polygon  # the floor, a little wider
    bounds: np.ndarray  # (s, 2, 3) float, boxes of everything
    names: Sequence[str]  # s names, those of walls for what they hold
    # pair -> forbidden moves of its first against its second from where both stood at first
    known: dict[tuple[int, int], BaseGeometry] = field(default_factory=dict)

    def forbidden(self, pair: tuple[int, int]) -> BaseGeometry:
        """Moves of the first against the second at which they overlap; empty for a thing and what it stands on."""
        i, k = pair
        if i > k:
            turned: BaseGeometry = shapely.transform(self.forbidden((k, i)), np.negative)
            return turned
        if pair not in self.known:
            self.known[pair] = self._against(pair, np.zeros(2), 2 * REACH)
        return self.known[pair]

    def near(self, one: int, moves: np.ndarray, reach: float) -> list[int]:
        """What has a box (in plan and height) within a distance in plan of one thing's."""
        away = np.zeros((len(self.solids), 3))
        away[: len(moves), [0, 2]] = moves
        margin = np.array([reach, 0.0, reach])
        low, high = self.bounds[:, 0] + away - margin, self.bounds[:, 1] + away + margin
        meet = ((self.bounds[one, 0] + away[one] < high) & (self.bounds[one, 1] + away[one] > low)).all(1)
        return [int(k) for k in np.flatnonzero(meet) if k != one]

    def overlaps(self, moves: np.ndarray, deep: float) -> list[tuple[tuple[int, int], float]]:
        """Pairs that reach deeper than `deep` metres into one another after moves (n, 2), deepest first."""
        found = []
        for i in range(len(moves)):
            for k in self.near(i, moves, 0.0):
                way = moves[i] - moves[k] if k < len(moves) else moves[i]
                if k > i and (far := self._depth((i, k), way)) > deep:
                    found.append(((i, k), far))
        return sorted(found, key=lambda hit: -hit[1])

    def _against(self, pair: tuple[int, int], way: np.ndarray, reach: float) -> BaseGeometry:
        i, k = pair
        if k < len(self.carrier) and (self.carrier[i] == k or self.carrier[k] == i):
            return shapely.Polygon()
        moved = [np.add(solid, (way[0], 0.0, way[1])) for solid in self.solids[i]]
        return forbidden_moves(moved, self.solids[k], reach)

    def _depth(self, pair: tuple[int, int], way: np.ndarray) -> float:
        """How deep two things reach into one another after a move (2,) of the first, metres."""
        if pair not in self.known:  # a way out that is shorter than `NEAR` passes near solids alone, which are few
            deep = depth(self._against(pair, way, NEAR), np.zeros(2))
            if deep < NEAR:
                return deep
        return depth(self.forbidden(pair), way)

    def carried(self, *movers: int) -> list[int]:
        """Things and all that stands on them, and on that."""
        out = [*movers]
        for one in out:
            out += [int(i) for i in np.flatnonzero(self.carrier == one) if i not in out and not self.fixed[i]]
        return out

    def guests(self, mover: int, other: int) -> list[int]:
        """Free things that attend a thing or hang over it, but for seats that look as another one does."""
        around = self.anchor == mover
        if other < len(around):
            around &= ~self.seat | (np.cos(self.heading - self.heading[other]) < ALIKE)
        lamps = self.carrier == ON_CEILING
        lamps[lamps] = shapely.contains(self.outline[mover], shapely.centroid(np.array(self.outline)[lamps]))
        return [k for k in np.flatnonzero(around | lamps).tolist() if not self.fixed[k]]

    def space(self, group: Sequence[int], moves: np.ndarray, gap: float, *, pushing: bool = False) -> BaseGeometry:
        """Further moves (x, z) of a group at which it is clear of everything by `gap` metres and stays on the floor.

        `pushing`: whether it only has to be clear of what stays where it is.
        """
        space: BaseGeometry = shapely.Point(-moves[group[0]]).buffer(REACH)
        taken = []
        for one in group:
            for other in self.near(one, moves, 2 * REACH):
                if other not in group and (self.fixed[other] or not pushing):
                    way = moves[one] - moves[other] if other < len(moves) else moves[one]
                    taken.append(translate(self.forbidden((one, other)), *-way))
            below, carrier = self.floor, int(self.carrier[one])
            if one == group[0] and carrier >= 0:
                below = translate(self.outline[carrier], *moves[carrier]).buffer(EDGE, join_style="mitre")
            for corner in self._corners(one, moves):
                if below.covers(shapely.Point(corner)):
                    space = space.intersection(translate(below, *-corner))
        return space.difference(shapely.union_all(taken).buffer(gap, quad_segs=2))

    def pushed(self, group: Sequence[int], moves: np.ndarray, way: np.ndarray) -> list[int]:
        """A group and whatever free it runs into on its way (2,), with what stands on that."""
        out, trial = list(group), moves.copy()
        trial[out] += way
        for one in group:
            for other in self.near(one, trial, 0.0):
                free = other not in out and not self.fixed[other]
                if free and depth(self.forbidden((one, other)), trial[one] - trial[other]) > 0.0:
                    out = self.carried(*out, other)
        return out

    def price(self, mover: int, way: np.ndarray) -> float:
        """What a move costs: its length, more for what is large, and for a seat that does not go back."""
        back = -np.array([np.sin(self.heading[mover]), np.cos(self.heading[mover])])
        far = float(np.linalg.norm(way))
        aside = self.seat[mover] and way @ back < 0.9 * far
        return far * float(self.bulk[mover]) * (ASIDE if aside else 1.0)

    def _corners(self, one: int, moves: np.ndarray) -> np.ndarray:
        return np.asarray(shapely.get_coordinates(self.outline[one])[:4] + moves[one])

    def hangs_over(self, one: int, moves: np.ndarray) -> bool:
        """Whether the middle of a thing is above no level part of what it should stand on."""
        carrier = int(self.carrier[one])
        if carrier < 0 or self.fixed[one]:
            return False
        level = translate(self.level[carrier], *moves[carrier])
        return not level.is_empty and not level.buffer(EDGE).contains(shapely.Point(self._corners(one, moves).mean(0)))

    def onto(self, group: Sequence[int], moves: np.ndarray, gap: float) -> BaseGeometry:
        """Further moves of a group at which its first thing stands on its carrier's level top, whole if possible."""
        one = group[0]
        level = translate(self.level[int(self.carrier[one])], *moves[int(self.carrier[one])]).buffer(EDGE)
        corners, space = self._corners(one, moves), self.space(group, moves, gap)
        for points in (corners, corners.mean(0, keepdims=True)):
            found = space.intersection(shapely.intersection_all([translate(level, *-corner) for corner in points]))
            if not found.is_empty:
                break
        return found


def scene_of(
    graph: SceneGraph, room: Plan, geometry: Mapping[str, Geometry], floor: np.ndarray, *, walls: bool
) -> Scene:
    """The scene of a layout; arguments as `cleared`, `room`: its plan."""
    nodes, size, position, yaw = graph.nodes, room.size, room.position, room.yaw
    solids = [
        [_placed(collider.mesh.vertices, position[i], yaw[i]) for collider in geometry[node.name].colliders]
        for i, node in enumerate(nodes)
    ]
    plan = floor if graph.room.corners is None else graph.room.corners
    height = graph.room.tall
    built = walls_of(plan, height, graph.room.openings, thickness=graph.room.walls) if walls else []
    shell = list(shell_solids(built))
    everything = [*solids, *(pieces for _, pieces in shell)]
    return Scene(
        everything, np.array([node.locked or node.position is not None for node in nodes] + [True] * len(shell)),
        room.carrier, room.anchor, yaw, room.of("seat"), np.sqrt(size[:, 0] * size[:, 2]),
        [shapely.Polygon(corner) for corner in footprints(size, position, yaw)],
        [_level(pieces) for pieces in solids], shapely.Polygon(floor).buffer(EDGE, join_style="mitre"),
        np.array([(np.concatenate(pieces).min(0), np.concatenate(pieces).max(0)) for pieces in everything]),
        [*graph.names, *(wall for wall, _ in shell)],
    )  # fmt: skip


def shell_solids(parts: Sequence[ShellPart]) -> Iterator[tuple[str, Solids]]:
    """Walls' names and convex pieces of what stands before them: sills, casings, leaves; walls are the floor's edge."""
    pieces = ((part.name, piece) for part in parts for filled in part.inner for piece in filled.pieces)
    return ((name, _boards(piece.mesh)) for name, piece in pieces if piece.solid)


def _level(solids: Solids) -> BaseGeometry:
    """What lies at the height of a thing's top, in plan."""
    top = max(float(solid[:, 1].max()) for solid in solids)
    near = [solid[solid[:, 1] > top - FLUSH][:, [0, 2]] for solid in solids]
    return shapely.union_all([shapely.convex_hull(shapely.multipoints(points)) for points in near if len(points) > 2])


def _boards(mesh: Mesh) -> Solids:
    """Points of the connected pieces of a mesh."""
    board = connected_pieces(mesh.faces, len(mesh.vertices))
    return [mesh.vertices[np.unique(mesh.faces[board == number])] for number in range(int(board.max()) + 1)]


def _placed(points: np.ndarray, position: np.ndarray, yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return np.asarray(points, float) @ turn.T + position


DEEP = 0.001  # metres that solids may reach into one another
GAP = 0.001  # metres left between what was moved apart
ROUNDS = 4  # moves a piece
DIRECTIONS = 8
GROUPS = 3  # sets of things that are tried for one move


def cleared_layouts(
    graphs: Sequence[SceneGraph], layouts: Sequence[Boxes], geometry: Mapping[str, Geometry], floor: np.ndarray, *,
    walls: bool,
) -> tuple[list[Boxes], tuple[LayoutOutcome, ...]]:  # fmt: skip
    """Every layout `cleared`, and what became of it; one graph a layout, which says what must stay."""
    found = [cleared(graph, boxes, geometry, floor, walls=walls) for graph, boxes in zip(graphs, layouts, strict=True)]
    outcomes = [
        LayoutOutcome(relation_verdicts(graph, boxes), left) for graph, (boxes, left) in zip(graphs, found, strict=True)
    ]
    return [boxes for boxes, _ in found], tuple(outcomes)


def cleared(
    graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], floor: np.ndarray, *, walls: bool
) -> tuple[Boxes, tuple[Collision, ...]]:
    """Move what is free as little as possible until nothing starts inside anything else.

    Returns the boxes, and what still reaches into one another, or into what a wall holds, deepest first.

    What is locked or has a position stays, and no relation that holds is broken: where only that would help, the two
    stay where they are and are among the collisions. Living rules are kept before distances.

    `graph`: N objects. `boxes`: N boxes in its order. `geometry`: name -> solids of each, in its own frame. `floor`:
    (k, 2) float, corners of the floor, metres. `walls`: whether there are any; their sills and casings reach into the
    room.
    """
    room = plan_to_live_in(graph, boxes, floor)
    scene = scene_of(graph, room, geometry, floor, walls=walls)
    holds = frozenset(_unbroken(graph, boxes))
    moves = np.zeros((len(graph.nodes), 2))
    for one in range(len(graph.nodes)):
        if scene.hangs_over(one, moves):
            moves = _onto_top(scene, graph, boxes, moves, one, holds)
    stuck: set[tuple[int, int]] = set()
    for _ in range(ROUNDS * max(len(graph.nodes), 1)):
        hits = [pair for pair, _ in scene.overlaps(moves, DEEP) if pair not in stuck]
        if not hits:
            break
        found = _moved_apart(scene, graph, room, boxes, moves, hits[0], holds)
        if found is None:
            stuck.add(hits[0])
        else:
            moves = found
    left = tuple(Collision(scene.names[i], scene.names[k], deep) for (i, k), deep in scene.overlaps(moves, DEEP))
    return rounded_boxes(graph, _at(boxes, moves)) if moves.any() else boxes, left


def _onto_top(
    scene: Scene, graph: SceneGraph, boxes: Boxes, moves: np.ndarray, one: int, holds: frozenset[int]
) -> np.ndarray:
    """The moves with a thing, and what stands on it, moved to where its carrier is as high as its box; as they are
    where there is no such place, or where a relation would be broken."""
    group = scene.carried(one)
    for way in _ways(scene.onto(group, moves, GAP), scene.heading[one]):
        trial = moves.copy()
        trial[group] += way
        if not holds - _unbroken(graph, _at(boxes, trial)):
            return trial
    return moves


def _at(boxes: Boxes, moves: np.ndarray) -> Boxes:
    position = np.array(boxes.position, np.float32)
    position[:, ::2] += moves.astype(np.float32)
    return Boxes(boxes.size, position, boxes.yaw)


def _moved_apart(
    scene: Scene, graph: SceneGraph, room: Plan, boxes: Boxes, moves: np.ndarray, pair: tuple[int, int],
    holds: frozenset[int],
) -> np.ndarray | None:  # fmt: skip
    """The moves with one of a pair moved out of everything, where most holds and it goes least far; None = nowhere.

    What a thing would leave behind goes with it: a nightstand with its bed.

    `room`: plan of the boxes. `holds`: numbers of the relations that must hold afterwards as well.
    """
    found, fewest, before = None, np.inf, np.inf
    for together in (False, True):  # a table with its chairs, where each alone would make a fault
        trials = list(_trials(scene, graph, boxes, moves, pair, holds, together))
        most = max((kept for kept, _, _ in trials), default=0)
        tried = [moves for _, _, moves in sorted((one for one in trials if one[0] == most), key=lambda one: one[1])]
        before, *faults = _faults(room, [_at(boxes, one) for one in (moves, *tried)])
        for trial, count in zip(tried, faults, strict=True):
            if count < fewest:
                found, fewest = trial, count
            if fewest <= before:
                return found
    return found


def _faults(room: Plan, layouts: Sequence[Boxes]) -> list[int]:
    """How many faults to live with the plan of a room has where its boxes stand as in each of some layouts."""
    position = np.array([boxes.position for boxes in layouts], float)
    yaw, moved = np.tile(room.yaw, (len(layouts), 1)), np.ptp(position, axis=0).any(1)
    of = [fault.object // len(room) for fault in faults_of(copies_of(room, position, yaw, moved))]
    return [of.count(k) + len(unreached(room.at(there, room.yaw))) for k, there in enumerate(position)]


def _trials(
    scene: Scene, graph: SceneGraph, boxes: Boxes, moves: np.ndarray, pair: tuple[int, int], holds: frozenset[int],
    together: bool,
) -> Iterator[tuple[int, float, np.ndarray]]:  # fmt: skip
    """Relations that hold, what it costs, and the moves with one of a pair moved out of everything.

    `together`: those who attend it go with it, but for those at the side of the other one.
    """
    for mover, other in (pair, pair[::-1]):
        if scene.fixed[mover]:
            continue
        guests = scene.guests(mover, other) if together else []
        groups = [scene.carried(mover, *guests)] if guests or not together else []
        for group in groups:
            if other in group:
                continue
            ways = _ways(scene.space(group, moves, GAP), scene.heading[mover])
            if not ways and len(groups) <= GROUPS:  # boxed in: who stands in its nearest way goes with it
                nearest = _ways(scene.space(group, moves, GAP, pushing=True), scene.heading[mover])[:1]
                groups += [more for way in nearest if (more := scene.pushed(group, moves, way)) not in groups]
            for way in ways:
                trial = moves.copy()
                trial[group] += way
                kept = _unbroken(graph, _at(boxes, trial))
                broken = holds - kept
                if not broken:
                    yield len(kept), scene.price(mover, way) * (1 + len(group) - len(groups[0])), trial
                elif (more := _with_partners(scene, graph, group, broken)) not in groups and len(groups) <= GROUPS:
                    groups.append(more)


def _unbroken(graph: SceneGraph, boxes: Boxes) -> set[int]:
    """Numbers of the relations that are not broken."""
    return {row for row, verdict in enumerate(relation_verdicts(graph, boxes)) if verdict.state != "broken"}


def _with_partners(scene: Scene, graph: SceneGraph, group: list[int], broken: set[int] | frozenset[int]) -> list[int]:
    """A group and what it would leave behind: all whom some relations name and who are free, with what stands on them.

    `broken`: numbers of verdicts, those of the relations and after them those of the placements.
    """
    out = list(group)
    told: tuple[Relation | Placed, ...] = (*graph.relations, *graph.placements)
    for one in (told[row] for row in sorted(broken)):
        for name in (one.subject, one.object) if isinstance(one, Relation) else (one.subject, *one.others):
            number = graph.names.index(name)
            if number not in out and not scene.fixed[number]:
                out = scene.carried(*out, number)
    return out


def _ways(space: shapely.geometry.base.BaseGeometry, heading: float) -> list[np.ndarray]:
    """Moves into a space: the nearest, and the nearest straight to each side of a heading."""
    rays = [
        shapely.LineString([(0.0, 0.0), (REACH * np.sin(angle), REACH * np.cos(angle))]).intersection(space)
        for angle in heading + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    ]
    start = shapely.Point(0.0, 0.0)
    return [shapely.get_coordinates(shapely.shortest_line(start, one))[1] for one in (space, *rays) if not one.is_empty]
