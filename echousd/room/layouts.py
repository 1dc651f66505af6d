"""Boxes for a graph: sampled by the layout branch, equal within sets of furniture, repaired; and the floor below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from echomodel.boxes import Boxes
from echousd.graph import SceneGraph
from echousd.room.progress import StageTimer
from echousd.room.reproducible import one_thread, rounded_boxes
from echousd.room.shell import box_corners, floor_polygon
from echousd.room.styles import equal_sizes
from echousd.room.tensors import floor_centre, graph_batch, seeded
from echousd.room.verdicts import judgement

if TYPE_CHECKING:
    from echomodel.protocols import GraphEdit, RoomModel

DRAWS = 3  # of one more layout at most: sizes that are given leave less room than the first had


def sample_boxes(
    model: RoomModel,
    graph: SceneGraph,
    *,
    seed: int,
    number: int,
    steps: int | None = None,
    change: GraphEdit | None = None,
    timer: StageTimer,
) -> Boxes:
    """Boxes from the layout branch in the room's frame; what the graph fixes is given to it and comes back."""
    batch = graph_batch(graph)
    centre = floor_centre(graph)
    nodes = graph.nodes
    given = torch.tensor([None not in (n.size, n.position, n.yaw) for n in nodes])
    known = Boxes(
        torch.tensor([n.size or (1.0, 1.0, 1.0) for n in nodes], dtype=torch.float32),
        torch.tensor([n.position or (0.0, 0.0, 0.0) for n in nodes], dtype=torch.float32) - centre,
        torch.tensor([n.yaw or 0.0 for n in nodes], dtype=torch.float32),
    )
    extra: dict[str, Any] = {"known": known, "known_mask": given} if bool(given.any()) else {}
    if steps is not None:
        extra["steps"] = steps
    if change is not None:
        extra["edit"] = change
    with timer.stage("layout") as tell, one_thread():
        found = model.sample_layout(batch, generator=seeded(seed, "layout", number), progress=tell, **extra)
    return rounded_boxes(graph, Boxes(found.size, found.position + centre, found.yaw))


def finished_boxes(
    graph: SceneGraph, boxes: Boxes, styles: Mapping[str, str], repair: bool, timer: StageTimer
) -> tuple[Boxes, tuple[str, ...]]:
    """Sampled boxes after equal sizes within style groups and, if wanted, repair; and demands in conflict."""
    boxes = _alike(graph, boxes, styles)
    if not repair:
        return rounded_boxes(graph, boxes), ()
    from echousd.repair import RepairConfig
    from echousd.repair import repair as repaired

    with timer.stage("repair"):
        found = repaired(graph, boxes)
        same = _alike(graph, found.boxes, styles, boxes)
        if not torch.equal(same.size, found.boxes.size):
            # chairs of one set that had to shrink: all of them, if it fits
            second = repaired(with_sizes(graph, same), same, config=RepairConfig(arrange=False))
            if len(second.broken) <= len(found.broken) and len(second.collisions) <= len(found.collisions):
                found = second
    return rounded_boxes(graph, found.boxes), found.conflicts


def another_layout(
    graph: SceneGraph,
    model: RoomModel,
    styles: Mapping[str, str],
    *,
    seed: int,
    number: int,
    repair: bool,
    steps: int | None = None,
    timer: StageTimer,
) -> Boxes:
    """One more layout of furniture that is there: of up to `DRAWS` drawings the first without faults, or the best.

    Arguments:
        graph: with the sizes of the furniture, which stay as they are.
        number: of the layout, from 1 on.
    """
    best: tuple[int, Boxes] | None = None
    for draw in range(DRAWS if repair else 1):
        found = sample_boxes(model, graph, seed=seed, number=number + 1000 * draw, steps=steps, timer=timer)
        size = torch.tensor([node.size for node in graph.nodes], dtype=torch.float32)
        found, _ = finished_boxes(graph, Boxes(size, found.position, found.yaw), styles, repair, timer)
        faults = len(judgement(graph, found).faults)
        if best is None or faults < best[0]:
            best = faults, found
        if not faults:
            break
    assert best is not None
    return best[1]


def with_sizes(graph: SceneGraph, boxes: Boxes) -> SceneGraph:
    """The graph with the sizes of the boxes written into its nodes."""
    sizes = [tuple(row) for row in boxes.size.tolist()]
    return graph.replaced(nodes=tuple(n.replaced(size=s) for n, s in zip(graph.nodes, sizes, strict=True)))


def room_floor(graph: SceneGraph, layouts: Sequence[Boxes]) -> np.ndarray:
    """(k, 2) float: corners of the floor, from the graph or around the furniture of all layouts."""
    plan = [box_corners(*(np.asarray(v, float) for v in (b.size, b.position, b.yaw))) for b in layouts]
    return floor_polygon(graph.room.floor_polygon, graph.room.size, np.concatenate(plan))


def plan_boxes(layouts: Sequence[Boxes]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size and position (n, 3), metres, and yaw (n,), radians, of the boxes of all layouts behind one another."""
    size, position, yaw = (
        np.concatenate([np.asarray(getattr(boxes, name), float) for boxes in layouts])
        for name in ("size", "position", "yaw")
    )
    return size, position, yaw


def _alike(graph: SceneGraph, boxes: Boxes, styles: Mapping[str, str], judged_by: Boxes | None = None) -> Boxes:
    names, categories = [n.name for n in graph.nodes], [n.category for n in graph.nodes]
    free = np.array([node.size is None and not node.locked for node in graph.nodes])
    measured = None if judged_by is None else np.asarray(judged_by.size, float)
    size = equal_sizes(names, categories, styles, np.asarray(boxes.size, float), free, measured)
    return Boxes(torch.as_tensor(size, dtype=torch.float32), boxes.position, boxes.yaw)
