"""Rooms of graphs as the objective sees them, and drawn boxes in them at the heights of what carries them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echomodel.arrays import Array, cast, device_of, full, kit, on_device
from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch, Stated
from echomodel.objective import Plan
from echomodel.objective.access import askew
from echomodel.objective.support import FREE, stacked
from echomodel.openings import HINGES, STEP, Opening, inward_normal
from echomodel.vocabulary import vocabulary

ALMOST = np.radians(3.0)  # off a quarter turn to a wall: nobody turns furniture by so little


def settled(plan: Plan, boxes: Boxes, fixed: Array | None = None) -> Boxes:
    """Boxes at the heights that their carriers give them and, where they almost are, square to a wall.

    Only the last step does so: down a slope that begins where terms have their kinks a hair's breadth decides.

    Arguments: as for `guidance.mended`, the plan in either library.
    """
    start = standing(plan, boxes, fixed)
    off = askew(start, start.kit.arange(len(start)))
    return placed(boxes, start.position, start.yaw - start.kit.where((abs(off) < ALMOST) & ~start.fixed, off, 0.0))


def standing(plan: Plan, boxes: Boxes, fixed: Array | None) -> Plan:
    """The plan with boxes where they are drawn, at the heights of what carries them, but for those that stay."""
    xp, device = kit(plan.yaw), device_of(plan.yaw)
    drawn, like = boxes.to(device), xp.zeros(0, dtype=xp.float64)  # rounding would choose the side
    size, position, yaw = (cast(of, like) for of in (drawn.size, drawn.position, drawn.yaw))
    stays = xp.zeros(len(boxes), dtype=xp.bool) if fixed is None else on_device(fixed, device)
    start = replace(plan, size=size, position=position, yaw=yaw, fixed=stays, floor=cast(plan.floor, like))
    return start.at(stacked(size, position, xp.where(stays, FREE, start.carrier), start.ceiling), yaw)


def placed(boxes: Boxes, position: Array, yaw: Array) -> Boxes:
    """Boxes (N) in other places, in the library, type and place of theirs."""
    drawn = boxes.to(device_of(yaw))
    return Boxes(drawn.size, cast(position, drawn.size), cast(yaw, drawn.size)).to(device_of(boxes.yaw))


def plan_of_graph(graph: GraphBatch, rules: str) -> Plan:
    """The rooms of a graph, on the CPU, as the objective sees them, their boxes nowhere yet."""
    words, nowhere = vocabulary(), full(graph.floor, (graph.num_nodes, 3), 0.0)
    rooms = zip(np.asarray(graph.floor, float), graph.openings.tolist(), strict=True)
    kinds = [words.placements[kind].name for kind in graph.placements[:, 1].tolist()]
    return Plan(
        tuple(words.categories[number] for number in graph.category.tolist()), nowhere, nowhere, nowhere[:, 0],
        graph.scene, graph.floor, tuple(openings_of(floor, rows) for floor, rows in rooms), graph.triplets,
        graph.scene < 0, graph.height, rules,
        stated=tuple(Stated(kind, who, tuple(other for other in others if other >= 0))
                     for kind, (who, _, *others) in zip(kinds, graph.placements.tolist(), strict=True)),
    )  # fmt: skip


def openings_of(floor: np.ndarray, rows: Sequence[Sequence[float]]) -> tuple[Opening, ...]:
    """The openings of rows (`surroundings.opening_rows`); a leaf whose hinges they do not tell swings both ways.

    `floor`: (K, 2) float, corners of their floor, metres, padded with NaN.
    """
    corners = floor[np.isfinite(floor).all(1)]
    out: list[Opening] = []
    normals = np.array([inward_normal(corners, edge) for edge in range(len(corners))]).reshape(-1, 2)
    for row in rows:
        if not np.isfinite(row).all() or not len(corners):
            continue
        near, far = np.array(row[:2]), np.array(row[2:4])
        edge = int((np.abs(((near - corners) * normals).sum(1)) - (normals @ row[4:6])).argmin())
        offset, width = float(np.linalg.norm(near - corners[edge])), float(np.linalg.norm(far - near))
        depth, sill, top, window = row[6:]
        kind = "window" if window else "door" if depth > STEP + 0.01 else "passage"
        for hinge in HINGES if kind == "door" else HINGES[:1]:
            out.append(Opening(f"{len(out)}", kind, edge, offset, width, top - sill, sill if window else 0.0, hinge))
    return tuple(out)
