"""Floor and furniture brought together: a proposed floor made wider; what has no place left out (`fit="drop"`)."""

from collections.abc import Callable

import numpy as np

from echomodel.boxes import Boxes
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.graph.consistency import GraphError
from echousd.graph.floors import check_space, rectangle
from echousd.make.verdicts import colliding
from echousd.place.living import living_faults

LEAST_FIRST = ("decor", "light", "seat", "screen", "storage", "board", "sofa", "bed")  # what a room misses least
IN_THE_WAY = 0.1  # metres into the swing of a door or the way through a passage
Found = tuple[list[Boxes], tuple[str, ...]]


def with_space(graph: SceneGraph) -> tuple[SceneGraph, tuple[str, ...]]:
    """The graph without what the stated floor cannot hold by its area, and a sentence for each piece.

    Raises `GraphError` where nothing that may be left out is left.
    """
    notes: list[str] = []
    while True:
        try:
            check_space(graph)
            return graph, tuple(notes)
        except GraphError:
            out = _dispensable(graph, graph.names)
            if out is None:
                raise
            graph = graph.remove_node(out)
            notes.append(f"left out: {out}, the floor is too small for all that was asked for")


def fitted(graph: SceneGraph, laid_out: Callable[[SceneGraph], Found]) -> tuple[SceneGraph, Found, tuple[str, ...]]:
    """The graph and its layouts without the pieces that collide or stand in a door, and a sentence for each of them.

    `laid_out`: makes the best layouts of a graph; the first is looked at.
    """
    notes: list[str] = []
    while True:
        found = laid_out(graph)
        boxes = found[0][0]
        hits = colliding(graph, boxes)
        out = _dispensable(graph, [name for hit in hits[:1] for name in (hit.first, hit.second)])
        if out is not None:
            other = hits[0].second if out == hits[0].first else hits[0].first
            why = f"{hits[0].depth:.2f} m deep in {other}"
        else:
            out, why = _in_a_way(graph, boxes)
        if out is None:
            return graph, found, tuple(notes)
        graph = graph.remove_node(out)
        notes.append(f"left out: {out}, no place for it but {why}")


def _in_a_way(graph: SceneGraph, boxes: Boxes) -> tuple[str | None, str]:
    """A piece that stands in the way of a door or passage and may be left out, and how; what a room is for stays, and
    has the place of another one."""
    kind = vocabulary().room_type(graph.room.type)
    spared = {name for name, _ in kind.contents[:1]} if kind.use != "wet" else {name for name, _ in kind.contents}
    others = [node for node in graph.nodes if vocabulary().category(node.category).support == "floor"]
    names = [node.name for node in others if node.category not in spared]
    for fault in living_faults(graph, boxes) if graph.room.openings else ():
        if fault.rule == "door_free" and abs(fault.margin) > IN_THE_WAY:
            stays = graph.node(fault.object).category in spared
            if out := _dispensable(graph, names if stays else [fault.object]):
                return out, f"where {fault.object} must stand to leave a door free" if stays else "in the way of a door"
    return None, ""


def _dispensable(graph: SceneGraph, names: tuple[str, ...] | list[str]) -> str | None:
    """Of some objects the one that a room misses least; None where there is none but what is locked or placed."""
    free = [node for node in graph.nodes if node.name in names and not node.locked and node.position is None]
    if not free or len(graph.nodes) < 2:
        return None
    return min(reversed(free), key=lambda node: LEAST_FIRST.index(vocabulary().category(node.category).role)).name


def with_wider_floor(graph: SceneGraph, corners: np.ndarray) -> SceneGraph:
    """The graph whose proposed floor is the rectangle around it and corners (n, 2) of furniture, where it lacks some.

    x and z in metres, of whole millimetres. Openings in the walls of a floor that was no rectangle go.
    """
    import shapely

    floor = graph.room.corners
    if floor is None or not len(corners) or shapely.Polygon(floor).buffer(1e-3).covers(shapely.MultiPoint(corners)):
        return graph
    both = 1e3 * np.concatenate([floor, corners])
    openings = graph.room.openings if len(floor) == 4 else ()
    return graph.with_room(openings=openings, **rectangle(np.floor(both.min(0)) / 1e3, np.ceil(both.max(0)) / 1e3))
