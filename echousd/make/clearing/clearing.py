"""Pieces are moved apart until no solid of one reaches into a solid of another: chairs out of their tables first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from echomodel.boxes import Boxes
from echousd.graph import Placed, Relation, SceneGraph
from echousd.make.clearing.scene import REACH, Scene, scene_of
from echousd.make.verdicts import relation_verdicts
from echousd.place.living import living_faults
from echousd.place.report import Collision
from echousd.room import LayoutOutcome
from echousd.shapes.geometry import Geometry
from echousd.tensors import rounded_boxes

DEEP = 0.001  # metres that solids may reach into one another
GAP = 0.001  # metres left between what was moved apart
ROUNDS = 4  # moves a piece
DIRECTIONS = 8
GROUPS = 3  # sets of things that are tried for one move


@dataclass(frozen=True, eq=False)
class Cleared:
    """What became of a layout."""

    boxes: Boxes  # N boxes, those that were moved in other places
    collisions: tuple[Collision, ...]  # what still reaches into one another, or into what a wall holds, deepest first
    moved: Mapping[str, float]  # name -> metres, of what was moved


def cleared_layouts(
    graphs: Sequence[SceneGraph], layouts: Sequence[Boxes], geometry: Mapping[str, Geometry], floor: np.ndarray, *,
    walls: bool,
) -> tuple[list[Boxes], tuple[LayoutOutcome, ...]]:  # fmt: skip
    """Every layout `cleared`, and what became of it; one graph a layout, which says what must stay."""
    found = [cleared(graph, boxes, geometry, floor, walls=walls) for graph, boxes in zip(graphs, layouts, strict=True)]
    outcomes = [
        LayoutOutcome(relation_verdicts(graph, each.boxes), each.collisions)
        for graph, each in zip(graphs, found, strict=True)
    ]
    return [each.boxes for each in found], tuple(outcomes)


def cleared(
    graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], floor: np.ndarray, *, walls: bool
) -> Cleared:
    """Move what is free as little as possible until nothing starts inside anything else.

    What is locked or has a position stays, and no relation that holds is broken: where only that would help, the two
    stay where they are and are among the collisions. Living rules are kept before distances.

    `graph`: N objects. `boxes`: N boxes in its order. `geometry`: name -> solids of each, in its own frame. `floor`:
    (k, 2) float, corners of the floor, metres. `walls`: whether there are any; their sills and casings reach into the
    room.
    """
    scene = scene_of(graph, boxes, geometry, floor, walls=walls)
    holds = frozenset(_unbroken(graph, boxes))
    moves = np.zeros((len(graph.nodes), 2))
    for one in range(len(graph.nodes)):
        if scene.hangs_over(one, moves):
            moves = _onto_top(scene, graph, boxes, moves, one, holds)
    stuck: set[tuple[int, int]] = set()
    for _ in range(ROUNDS * max(len(graph.nodes), 1)):
        hits = [(pair, deep) for pair, deep in scene.overlaps(moves, DEEP) if pair not in stuck]
        if not hits:
            break
        pair = hits[0][0]
        found = _moved_apart(scene, graph, boxes, floor, moves, pair, holds)
        if found is None:
            stuck.add(pair)
        else:
            moves = found
    names = graph.names
    left = tuple(Collision(scene.names[i], scene.names[k], deep) for (i, k), deep in scene.overlaps(moves, DEEP))
    far = np.linalg.norm(moves, axis=1)
    if not far.any():
        return Cleared(boxes, left, {})
    return Cleared(
        rounded_boxes(graph, _at(boxes, moves)), left, {names[i]: float(far[i]) for i in np.flatnonzero(far)}
    )


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
    position = boxes.position.clone()
    position[:, [0, 2]] += position.new_tensor(moves)
    return Boxes(boxes.size, position, boxes.yaw)


def _moved_apart(
    scene: Scene, graph: SceneGraph, boxes: Boxes, floor: np.ndarray, moves: np.ndarray, pair: tuple[int, int],
    holds: frozenset[int],
) -> np.ndarray | None:  # fmt: skip
    """The moves with one of a pair moved out of everything, where most holds and it goes least far; None = nowhere.

    What a thing would leave behind goes with it: a nightstand with its bed.

    `holds`: numbers of the relations that must hold afterwards as well.
    """
    best: tuple[float, ...] | None = None
    found = None
    for mover in pair:
        if mover >= len(graph.nodes) or scene.fixed[mover]:
            continue
        other = pair[0] if mover == pair[1] else pair[1]
        groups = [scene.carried(mover)]
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
                tried = _at(boxes, trial)
                kept = _unbroken(graph, tried)
                broken = holds - kept
                if broken:
                    more = _with_partners(scene, graph, group, broken)
                    if more not in groups and len(groups) <= GROUPS:
                        groups.append(more)
                    continue
                if best is not None and -len(kept) > best[0]:
                    continue
                price = scene.price(mover, way) * (1 + len(group) - len(groups[0]))
                score = (-len(kept), len(living_faults(graph, tried, floor)), price)
                if best is None or score < best:
                    best, found = score, trial
    return found


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
                out += [one for one in scene.carried(number) if one not in out]
    return out


def _ways(space: shapely.geometry.base.BaseGeometry, heading: float) -> list[np.ndarray]:
    """Moves into a space: the nearest, and the nearest straight to each side of a heading."""
    if space.is_empty:
        return []
    start = shapely.Point(0.0, 0.0)
    ends = [shapely.get_coordinates(shapely.shortest_line(start, space))[1]]
    for angle in heading + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS:
        ray = shapely.LineString([(0.0, 0.0), (REACH * np.sin(angle), REACH * np.cos(angle))]).intersection(space)
        if not ray.is_empty:
            ends.append(shapely.get_coordinates(shapely.shortest_line(start, ray))[1])
    return ends
