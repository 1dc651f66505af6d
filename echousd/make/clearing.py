"""Furniture moved apart by its solids: chairs are tucked as far as they fit, nothing starts inside anything."""

from collections.abc import Mapping, Sequence

import numpy as np

from echomodel.boxes import Boxes
from echomodel.late import Late, lates
from echousd.graph import SceneGraph
from echousd.graph.arrays import rounded_boxes
from echousd.make.scene import Scene, scene_of
from echousd.make.verdicts import relation_verdicts, unbroken
from echousd.place.geometry import SOLID, Collision
from echousd.place.living import plan_to_live_in
from echousd.room import LayoutOutcome
from echousd.shapes.geometry import Geometry
from echousd.shapes.walls import ShellPart

moved_apart, moved_by, moved_onto_top = lates("echousd.make.moving", "moved_apart", "moved_by", "moved_onto_top")
told = Late("echousd.make.collisions:told")
DEEP = 0.001  # metres that solids may reach into one another
ROUNDS = 4  # moves a piece


def cleared_layouts(
    graphs: Sequence[SceneGraph], layouts: Sequence[Boxes], geometry: Mapping[str, Geometry], floor: np.ndarray,
    walls: Sequence[ShellPart], *, place: bool,
) -> tuple[list[Boxes], tuple[LayoutOutcome, ...]]:  # fmt: skip
    """Every layout, `cleared` if furniture may be moved (`place`), and what became of it; one graph a layout, which
    says what must stay."""
    found = [
        cleared(graph, boxes, geometry, floor, walls) if place
        else (boxes, colliding_solids(graph, boxes, geometry, floor, walls))
        for graph, boxes in zip(graphs, layouts, strict=True)
    ]  # fmt: skip
    ends = zip(graphs, found, strict=True)
    outcomes = tuple(LayoutOutcome(relation_verdicts(graph, boxes), left) for graph, (boxes, left) in ends)
    return [boxes for boxes, _ in found], outcomes


def cleared(
    graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], floor: np.ndarray, walls: Sequence[ShellPart]
) -> tuple[Boxes, tuple[Collision, ...]]:
    """Move what is free as little as possible until nothing starts inside anything else.

    Returns the boxes, and `colliding_solids` of them. What is locked or has a position stays, and no relation that
    holds is broken: where only that would help, the two stay where they are and are among the collisions. Living rules
    are kept before distances.

    `graph`: N objects. `boxes`: N boxes in its order. `geometry`: name -> solids of each, in its own frame. `floor`:
    (k, 2) float, corners of the floor, metres. `walls`: none, or all of them; their sills and casings reach into the
    room.
    """
    room = plan_to_live_in(graph, boxes, floor)
    scene = scene_of(graph, room, geometry, floor, walls)
    holds = frozenset(unbroken(graph, boxes))
    moves = np.zeros((len(graph.nodes), 2))
    for one in range(len(graph.nodes)):
        if scene.hangs_over(one, moves):
            moves = moved_onto_top(scene, graph, boxes, moves, one, holds)
    stuck: set[tuple[int, int]] = set()
    for _ in range(ROUNDS * len(graph.nodes)):
        hits = [pair for pair, _ in scene.overlaps(moves, DEEP) if pair not in stuck]
        if not hits:
            break
        found = moved_apart(scene, graph, room, boxes, moves, hits[0], holds)
        if found is None:
            stuck.add(hits[0])
        else:
            moves = found
    boxes = rounded_boxes(graph, moved_by(boxes, moves)) if moves.any() else boxes
    return boxes, _left(scene, graph, boxes, geometry, moves)


def colliding_solids(
    graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], floor: np.ndarray, walls: Sequence[ShellPart]
) -> tuple[Collision, ...]:
    """What reaches into one another, or into a wall and what it holds, as `check` says it, deepest first; arguments as
    of `cleared`."""
    scene = scene_of(graph, plan_to_live_in(graph, boxes, floor), geometry, floor, walls)
    return _left(scene, graph, boxes, geometry, np.zeros((len(graph.nodes), 2)))


def _left(
    scene: Scene, graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], moves: np.ndarray
) -> tuple[Collision, ...]:
    met = [pair for pair, _ in scene.overlaps(moves, SOLID) if pair[1] < len(moves)]
    in_walls = scene.in_walls(moves)
    return told(scene, graph, boxes, geometry, met, in_walls) if met or in_walls else ()
