"""Quality against cost of sampling steps, per sampler: python benchmarks/step_sweep.py ROOMS.json [--shapes SET]."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.compact.shape import wholeness
from echomodel.data.roomset import with_known_words
from echomodel.data.shapeset import ShapeSet
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.metrics.pointsets import chamfer, surface_points
from echomodel.roomboxes import RoomBoxes, read_rooms
from echomodel.rules import label_rooms, verdicts
from echomodel.samplers import SAMPLERS
from echomodel.training.layout_losses import outside
from echomodel.tsdf import mesh_from_tsdf

RULES = "sgfront"
POINTS = 1024


def layout_row(model: EchoModel, graph: GraphBatch, truth: Boxes, steps: int, sampler: str, pull: float) -> str:
    """Share of relations kept, of objects that reach more than 0.1 m beyond a wall, size error, seconds per room."""
    started = time.perf_counter()
    generator = torch.Generator().manual_seed(0)
    boxes = model.sample_layout(
        graph, generator=generator, steps=steps, sampler=sampler, rules=RULES, relation_guidance=pull
    )
    seconds = (time.perf_counter() - started) / graph.num_scenes
    kept = verdicts(boxes, graph.triplets, rules=RULES)
    close = kept[(graph.triplets[:, 1] == 5) & (kept >= 0)].float().mean()
    wrong = float((boxes.size.log() - truth.size.log()).abs().mean())
    total = float(kept[kept >= 0].float().mean())
    beyond = float((outside(boxes, graph.floor[graph.scene]).amax(1) > 0.1).float().mean())
    return (
        f"{sampler:10} {steps:5d} {pull:5.2f}  kept {total:.3f}  close_by {float(close):.3f}  outside {beyond:.3f}"
        f"  log size error {wrong:.3f}  {seconds * 1000:7.1f} ms per room"
    )


def shape_row(
    model: EchoModel, graph: GraphBatch, boxes: Boxes, references: dict[int, torch.Tensor], steps: int, sampler: str
) -> str:
    """Distance to the nearest true shape of the class, wholeness, seconds per object; one draw of each object."""
    started = time.perf_counter()
    generator = torch.Generator().manual_seed(0)
    grids = model.sample_shapes(graph, boxes, generator=generator, steps=steps, sampler=sampler, candidates=1)
    seconds = (time.perf_counter() - started) / graph.num_nodes
    nearest = []
    for grid, category in zip(grids.numpy(), graph.category.tolist(), strict=True):
        try:
            points = torch.from_numpy(surface_points(mesh_from_tsdf(grid), POINTS))
        except ValueError:
            continue
        nearest.append(float(chamfer(points, references[category]).min()))
    whole = float(wholeness(grids).mean())
    return (
        f"{sampler:10} {steps:5d}  nearest true shape {np.mean(nearest):.5f}  wholeness {whole:.3f}"
        f"  {seconds * 1000:7.1f} ms per object"
    )


def references_of(shapes: ShapeSet, categories: list[int], count: int = 24) -> dict[int, torch.Tensor]:
    """Surface points (count, POINTS, 3) of true shapes per class."""
    rng, found = np.random.default_rng(0), {}
    for category in sorted(set(categories)):
        chosen = rng.permutation(np.flatnonzero(shapes.category == category))[:count]
        clouds = [surface_points(mesh_from_tsdf(shapes[int(i)]), POINTS) for i in chosen]
        found[category] = torch.from_numpy(np.stack(clouds))
    return found


def graphs_of(rooms: list[RoomBoxes]) -> tuple[GraphBatch, Boxes]:
    """Rooms as graphs with half of their relations, and their true boxes."""
    relations = label_rooms(rooms, rules=RULES, drop=0.5, rng=np.random.default_rng(0))
    graphs = [room.graph(triplets=rows) for room, rows in zip(rooms, relations, strict=True)]
    return GraphBatch.pack(graphs), Boxes.cat([room.boxes() for room in rooms])


def main() -> None:
    """Read the arguments and print one line per setting."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", type=Path)
    parser.add_argument("--steps", default="5,10,20,50,100,1000")
    parser.add_argument("--limit", type=int, default=60)
    parser.add_argument("--model", type=Path)
    parser.add_argument("--shapes", type=Path, help="set of true shapes to compare with")
    options = parser.parse_args()
    steps = [int(word) for word in options.steps.split(",")]
    model = EchoModel.load(options.model)
    rooms = [room for room in with_known_words(read_rooms(options.rooms)) if len(room) > 1][: options.limit]
    graph, truth = graphs_of(rooms)
    references = references_of(ShapeSet(options.shapes), graph.category.tolist()) if options.shapes else {}
    for sampler in SAMPLERS:
        for count in steps:
            if options.shapes:
                print(shape_row(model, graph, truth, references, count, sampler), flush=True)
            else:
                for pull in (0.0, 0.1):
                    print(layout_row(model, graph, truth, count, sampler, pull), flush=True)


if __name__ == "__main__":
    main()
