"""Pieces moved out of one another: which goes, and to where what the graph and people ask holds."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from echomodel.boxes import Boxes
from echomodel.boxes2d import axes
from echomodel.objective import Plan, faults_of, unreached
from echomodel.objective.copies import copies_of
from echomodel.objective.physics import TOUCH
from echousd.graph import SceneGraph
from echousd.make.scene import EDGE, REACH, Scene
from echousd.make.verdicts import unbroken
from echousd.place.geometry import Collision
from echousd.place.living import living_faults, plan_to_live_in, severity
from echousd.place.placing import place
from echousd.place.solver import PlaceConfig

GAP = 0.001  # metres left between what was moved apart
DIRECTIONS = 8
ROUNDS = 4  # moves a piece
ASIDE = 2.0  # a seat moves back from its table more easily than aside


def moves_apart(
    scene: Scene, graph: SceneGraph, room: Plan, boxes: Boxes, moves: np.ndarray, deep: float
) -> np.ndarray:
    """(n, 2) float, metres: moves after which nothing reaches deeper than `deep` into anything, as far as that can be
    had; `room`: plan of the boxes."""
    holds, stuck = frozenset(unbroken(graph, boxes)), set[tuple[int, int]]()
    for one in range(len(moves)):
        if scene.hangs_over(one, moves):
            moves = moved_onto_top(scene, graph, boxes, moves, one, holds)
    for _ in range(ROUNDS * len(moves)):
        hits = [pair for pair, _ in scene.overlaps(moves, deep) if pair not in stuck]
        if not hits:
            break
        found = moved_apart(scene, graph, room, boxes, moves, hits[0], holds)
        if found is None:
            stuck.add(hits[0])
        else:
            moves = found
    return moves


def worth(graph: SceneGraph, boxes: Boxes, left: Sequence[Collision], floor: np.ndarray) -> tuple[float, ...]:
    """What a layout leaves to be wished for, the worse first: what collides, relations that hold, living rules."""
    return len(left), -len(unbroken(graph, boxes)), severity(living_faults(graph, boxes, floor))


def searched_anew(graph: SceneGraph, before: Boxes, after: Boxes, floor: np.ndarray) -> Boxes:
    """A layout searched anew after moves: seats reach no deeper under tables than they were moved out of them, what
    else was moved stays."""
    plan = plan_to_live_in(graph, after, floor)
    at, moves = plan.anchor, np.asarray(after.position) - np.asarray(before.position)
    seats = plan.of("seat") & (at >= 0) & plan.of("board")[at]
    out = np.abs(moves - np.where(seats[:, None], moves[at], 0.0)).max(1) > GAP / 2
    who = np.flatnonzero(seats & out)
    deep = np.maximum(-plan.apart(who, at[who]) - TOUCH, 0.0)
    reach = tuple((int(k), float(deep[at[who] == k].min())) for k in np.unique(at[who]))
    rows = zip(graph.nodes, after.size.tolist(), after.position.tolist(), after.yaw.tolist(), out & ~seats, strict=True)
    nodes = (
        node.replaced(size=tuple(size), **({"position": tuple(there), "yaw": yaw} if stays else {}))
        for node, size, there, yaw, stays in rows
    )
    return place(graph.replaced(nodes=tuple(nodes)), after, config=PlaceConfig(reach=reach)).boxes


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

    `room`: plan of the boxes. `holds`: numbers of the relations that must hold afterwards as well.
    """
    trials = list(_trials(scene, graph, boxes, moves, pair, holds))
    most = max((kept for kept, _, _ in trials), default=0)
    tried = [moves for _, _, moves in sorted((one for one in trials if one[0] == most), key=lambda one: one[1])]
    faults = _faults(room, [moved_by(boxes, one) for one in (moves, *tried)])
    found, fewest, before = None, np.inf, next(faults)
    for trial, count in zip(tried, faults, strict=True):
        if count < fewest:
            found, fewest = trial, count
        if fewest <= before:
            break
    return found


def _faults(room: Plan, layouts: Sequence[Boxes]) -> Iterator[int]:
    """How many faults to live with a room has where its boxes stand as in each of some layouts, walked when asked."""
    position = np.array([boxes.position for boxes in layouts], float)
    yaw, moved = np.tile(room.yaw, (len(layouts), 1)), np.ptp(position, axis=0).any(1)
    of = [fault.object // len(room) for fault in faults_of(copies_of(room, position, yaw, moved))]
    return (of.count(k) + len(unreached(room.at(there, room.yaw))) for k, there in enumerate(position))


def _trials(
    scene: Scene, graph: SceneGraph, boxes: Boxes, moves: np.ndarray, pair: tuple[int, int], holds: frozenset[int]
) -> Iterator[tuple[int, float, np.ndarray]]:
    """Relations that hold, what it costs, and the moves with one of a pair moved out of everything."""
    for mover, other in (pair, pair[::-1]):
        group = carried(scene, mover)
        if scene.fixed[mover] or other in group:
            continue
        for way in _ways(free_moves(scene, group, moves), scene.heading[mover]):
            trial = moves.copy()
            trial[group] += way
            kept = unbroken(graph, moved_by(boxes, trial))
            if not holds - kept:
                yield len(kept), cost(scene, mover, way), trial


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


def free_moves(scene: Scene, group: Sequence[int], moves: np.ndarray) -> BaseGeometry:
    """Further moves (x, z) of a group at which it is clear of everything by `GAP` and stays on the floor."""
    space: BaseGeometry = shapely.Point(-moves[group[0]]).buffer(REACH)
    taken = []
    for one in group:
        for other in scene.near(one, moves, 2 * REACH):
            if other not in group:
                way = moves[one] - moves[other] if other < len(moves) else moves[one]
                taken.append(translate(scene.forbidden((one, other)), *-way))
        below, carrier = scene.floor, int(scene.carrier[one])
        if one == group[0] and carrier >= 0:
            below = translate(scene.outline[carrier], *moves[carrier]).buffer(EDGE, join_style="mitre")
        for corner in scene.corners(one, moves):
            if below.covers(shapely.Point(corner)):
                space = space.intersection(translate(below, *-corner))
    return space.difference(shapely.union_all(taken).buffer(GAP, quad_segs=2))


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
