"""Pieces moved out of one another: which goes, who goes with it, and to where what the graph and people ask holds."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from echomodel.boxes import Boxes
from echomodel.boxes2d import axes
from echomodel.objective import Plan, faults_of, unreached
from echomodel.objective.copies import copies_of
from echomodel.objective.support import ON_CEILING
from echousd.graph import Placed, Relation, SceneGraph
from echousd.make.scene import EDGE, REACH, Scene
from echousd.make.verdicts import unbroken
from echousd.shapes.hulls import depth

GAP = 0.001  # metres left between what was moved apart
DIRECTIONS = 8
GROUPS = 3  # sets of things that are tried for one move
ALIKE = 0.7  # cosine between the headings of seats at one side of a table
ASIDE = 2.0  # a seat moves back from its table more easily than aside


def moved_onto_top(
    scene: Scene, graph: SceneGraph, boxes: Boxes, moves: np.ndarray, one: int, holds: frozenset[int]
) -> np.ndarray:
    """The moves with a thing, and what stands on it, moved to where its carrier is as high as its box; as they are
    where there is no such place, or where a relation would be broken."""
    group = carried(scene, one)
    for way in _ways(moves_onto(scene, group, moves), scene.heading[one]):
        trial = moves.copy()
        trial[group] += way
        if not holds - unbroken(graph, moved_by(boxes, trial)):
            return trial
    return moves


def moved_by(boxes: Boxes, moves: np.ndarray) -> Boxes:
    """The boxes after moves (n, 2) in plan."""
    position = np.array(boxes.position, np.float32)
    position[:, ::2] += moves.astype(np.float32)
    return Boxes(boxes.size, position, boxes.yaw)


def moved_apart(
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
        faults = _faults(room, [moved_by(boxes, one) for one in (moves, *tried)])
        before = next(faults)
        for trial, count in zip(tried, faults, strict=True):
            if count < fewest:
                found, fewest = trial, count
            if fewest <= before:
                return found
    return found


def _faults(room: Plan, layouts: Sequence[Boxes]) -> Iterator[int]:
    """How many faults to live with a room has where its boxes stand as in each of some layouts, walked when asked."""
    position = np.array([boxes.position for boxes in layouts], float)
    yaw, moved = np.tile(room.yaw, (len(layouts), 1)), np.ptp(position, axis=0).any(1)
    of = [fault.object // len(room) for fault in faults_of(copies_of(room, position, yaw, moved))]
    return (of.count(k) + len(unreached(room.at(there, room.yaw))) for k, there in enumerate(position))


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
        guests = guests_of(scene, mover, other) if together else []
        groups = [carried(scene, mover, *guests)] if guests or not together else []
        for group in groups:
            if other in group:
                continue
            ways = _ways(free_moves(scene, group, moves), scene.heading[mover])
            if not ways and len(groups) <= GROUPS:  # boxed in: who stands in its nearest way goes with it
                nearest = _ways(free_moves(scene, group, moves, pushing=True), scene.heading[mover])[:1]
                groups += [more for way in nearest if (more := pushed(scene, group, moves, way)) not in groups]
            for way in ways:
                trial = moves.copy()
                trial[group] += way
                kept = unbroken(graph, moved_by(boxes, trial))
                broken = holds - kept
                if not broken:
                    yield len(kept), cost(scene, mover, way) * (1 + len(group) - len(groups[0])), trial
                elif (more := _with_partners(scene, graph, group, broken)) not in groups and len(groups) <= GROUPS:
                    groups.append(more)


def _with_partners(scene: Scene, graph: SceneGraph, group: list[int], broken: set[int] | frozenset[int]) -> list[int]:
    """A group and what it would leave behind: all whom some relations name and who are free, with what stands on them.

    `broken`: numbers of verdicts, those of the relations and after them those of the placements.
    """
    out = list(group)
    stated: tuple[Relation | Placed, ...] = (*graph.relations, *graph.placements)
    for one in (stated[row] for row in sorted(broken)):
        for name in (one.subject, one.object) if isinstance(one, Relation) else (one.subject, *one.others):
            number = graph.names.index(name)
            if number not in out and not scene.fixed[number]:
                out = carried(scene, *out, number)
    return out


def _ways(space: shapely.geometry.base.BaseGeometry, heading: float) -> list[np.ndarray]:
    """Moves into a space: the nearest, and the nearest straight to each side of a heading."""
    rays = [
        shapely.LineString([(0.0, 0.0), (REACH * np.sin(angle), REACH * np.cos(angle))]).intersection(space)
        for angle in heading + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    ]
    start = shapely.Point(0.0, 0.0)
    return [shapely.get_coordinates(shapely.shortest_line(start, one))[1] for one in (space, *rays) if not one.is_empty]


def carried(scene: Scene, *movers: int) -> list[int]:
    """Things and all that stands on them, and on that."""
    out = [*movers]
    for one in out:
        out += [int(i) for i in np.flatnonzero(scene.carrier == one) if i not in out and not scene.fixed[i]]
    return out


def guests_of(scene: Scene, mover: int, other: int) -> list[int]:
    """Free things that attend a thing or hang over it, but for seats that look as another one does."""
    around = scene.anchor == mover
    if other < len(around):
        around &= ~scene.seat | (np.cos(scene.heading - scene.heading[other]) < ALIKE)
    lamps = scene.carrier == ON_CEILING
    lamps[lamps] = shapely.contains(scene.outline[mover], shapely.centroid(np.array(scene.outline)[lamps]))
    return [k for k in np.flatnonzero(around | lamps).tolist() if not scene.fixed[k]]


def free_moves(scene: Scene, group: Sequence[int], moves: np.ndarray, *, pushing: bool = False) -> BaseGeometry:
    """Further moves (x, z) of a group at which it is clear of everything by `GAP` and stays on the floor.

    `pushing`: whether it only has to be clear of what stays where it is.
    """
    space: BaseGeometry = shapely.Point(-moves[group[0]]).buffer(REACH)
    taken = []
    for one in group:
        for other in scene.near(one, moves, 2 * REACH):
            if other not in group and (scene.fixed[other] or not pushing):
                way = moves[one] - moves[other] if other < len(moves) else moves[one]
                taken.append(translate(scene.forbidden((one, other)), *-way))
        below, carrier = scene.floor, int(scene.carrier[one])
        if one == group[0] and carrier >= 0:
            below = translate(scene.outline[carrier], *moves[carrier]).buffer(EDGE, join_style="mitre")
        for corner in scene.corners(one, moves):
            if below.covers(shapely.Point(corner)):
                space = space.intersection(translate(below, *-corner))
    return space.difference(shapely.union_all(taken).buffer(GAP, quad_segs=2))


def pushed(scene: Scene, group: Sequence[int], moves: np.ndarray, way: np.ndarray) -> list[int]:
    """A group and whatever free it runs into on its way (2,), with what stands on that."""
    out, trial = list(group), moves.copy()
    trial[out] += way
    for one in group:
        for other in scene.near(one, trial, 0.0):
            free = other not in out and not scene.fixed[other]
            if free and depth(scene.forbidden((one, other)), trial[one] - trial[other]) > 0.0:
                out = carried(scene, *out, other)
    return out


def cost(scene: Scene, mover: int, way: np.ndarray) -> float:
    """What a move costs: its length, more for what is large, and for a seat that does not go back."""
    back = -axes(scene.heading[mover])[1]
    far = float(np.linalg.norm(way))
    aside = scene.seat[mover] and way @ back < 0.9 * far
    return far * float(scene.bulk[mover]) * (ASIDE if aside else 1.0)


def moves_onto(scene: Scene, group: Sequence[int], moves: np.ndarray) -> BaseGeometry:
    """Further moves of a group at which its first thing stands on its carrier's level top, whole if possible."""
    one = group[0]
    level = translate(scene.level[int(scene.carrier[one])], *moves[int(scene.carrier[one])]).buffer(EDGE)
    corners, space = scene.corners(one, moves), free_moves(scene, group, moves)
    for points in (corners, corners.mean(0, keepdims=True)):
        found = space.intersection(shapely.intersection_all([translate(level, *-corner) for corner in points]))
        if not found.is_empty:
            break
    return found
