"""Furniture moved apart by its solids: chairs are tucked as far as they fit, nothing starts inside anything."""

from collections.abc import Mapping, Sequence

import numpy as np

from echomodel.boxes import Boxes
from echomodel.late import Late, lates
from echousd.graph import SceneGraph
from echousd.graph.arrays import rounded_boxes
from echousd.make.scene import Scene, scene_of
from echousd.make.verdicts import relation_verdicts
from echousd.place.geometry import SOLID, Collision
from echousd.place.living import plan_to_live_in
from echousd.room import LayoutOutcome
from echousd.shapes.geometry import Geometry
from echousd.shapes.walls import ShellPart

moves_apart, moved_by, searched_anew, worth = lates(
    "echousd.make.moving", "moves_apart", "moved_by", "searched_anew", "worth"
)
told = Late("echousd.make.collisions:told")
DEEP = 0.001  # metres that solids may reach into one another
TRIES = 2  # ways: moves, then a search
Cleared = tuple[Boxes, tuple[Collision, ...]]  # boxes, and what still reaches into one another


def cleared_layouts(
    graphs: Sequence[SceneGraph], layouts: Sequence[Boxes], geometry: Mapping[str, Geometry], floor: np.ndarray,
    walls: Sequence[ShellPart], *, place: bool,
) -> tuple[list[Boxes], tuple[LayoutOutcome, ...]]:  # fmt: skip
    """Every layout, `cleared` if furniture may be moved (`place`), and what became of it; one graph a layout, which
    says what must stay."""
    each = zip(graphs, layouts, strict=True)
    found = [cleared(graph, boxes, geometry, floor, walls, tries=TRIES * place) for graph, boxes in each]
    ends = zip(graphs, found, strict=True)
    outcomes = tuple(LayoutOutcome(relation_verdicts(graph, boxes), left) for graph, (boxes, left) in ends)
    return [boxes for boxes, _ in found], outcomes


def cleared(
    graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], floor: np.ndarray, walls: Sequence[ShellPart],
    tries: int = TRIES,
) -> Cleared:  # fmt: skip
    """Move what is free as little as possible until nothing starts inside anything else.

    Returns the boxes, and what still reaches into one another, or into a wall and what it holds, as `check` says it,
    deepest first. What is locked or has a position stays, and no relation that holds is broken: where only that would
    help, the two stay where they are and are among the collisions. Living rules are kept before distances; where moves
    break one nevertheless, a search begins there that knows how far seats fit under their tables.

    `graph`: N objects. `boxes`: N boxes in its order. `geometry`: name -> solids of each, in its own frame. `floor`:
    (k, 2) float, corners of the floor, metres. `walls`: none, or all of them; their sills and casings reach into the
    room. `tries`: 0 moves nothing, 1 does not search.
    """
    room = plan_to_live_in(graph, boxes, floor)
    scene = scene_of(graph, room, geometry, floor, walls)
    moves = np.zeros((len(graph.nodes), 2))
    over = (scene.hangs_over(one, moves) for one in range(len(moves)))
    if not tries or not (scene.overlaps(moves, DEEP) or any(over)):
        return boxes, _left(scene, graph, boxes, geometry, moves)
    moves = moves_apart(scene, graph, room, boxes, moves, DEEP)
    after = rounded_boxes(graph, moved_by(boxes, moves)) if moves.any() else boxes
    found = after, _left(scene, graph, after, geometry, moves)
    if tries < TRIES or worth(graph, *found, floor) <= worth(graph, boxes, (), floor):
        return found
    again = cleared(graph, searched_anew(graph, boxes, after, floor), geometry, floor, walls, tries - 1)
    return min(found, again, key=lambda one: worth(graph, *one, floor))


def _left(
    scene: Scene, graph: SceneGraph, boxes: Boxes, geometry: Mapping[str, Geometry], moves: np.ndarray
) -> tuple[Collision, ...]:
    met = [pair for pair, _ in scene.overlaps(moves, SOLID) if pair[1] < len(moves)]
    in_walls = scene.in_walls(moves)
    return told(scene, graph, boxes, geometry, met, in_walls) if met or in_walls else ()
