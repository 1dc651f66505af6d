"""What the layout network draws, judged room by room: weights beside one another and beside the same ones shuffled.

    python benchmarks/drafts.py [WEIGHTS ...] [--ways alone guided searched default] [--count 40]
                                [--rooms ROOMS.json | --types kitchen bathroom ...]
    python benchmarks/drafts.py ships muted shuffled random generator --ways searched --poses 250 1000 4500
    python benchmarks/drafts.py ships shuffled generator --ways default

`ships`, `shuffled` and `muted` (the echo off) are words for WEIGHTS, and so are two who are no network: `random` places
and the room `generator`. `--draws`: so many of each room, of which the one that misses the fewest terms stands (not
`default`, which has its own). `--poses`: what a search may judge, each a whole room; it ends with the move that passes
it, so what it did judge is told. `default` is what `generate` does with a graph without places: of up to eight drafts
the best; the other ways have one. The rooms are of the room generator from a seed that no training used, or every so
many of a rooms file, one near relation an object told; faults are those of all terms. Below each way stand the means of
the differences to the first weights, room by room, with 95 % intervals by bootstrap.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.boxes import Boxes
from echomodel.data.roomset import load_rooms, with_known_words
from echomodel.graph import GraphBatch
from echomodel.loading import load_model
from echomodel.metrics.layouts import Task, kept_relations, tasks_of
from echomodel.objective import KINDS, faults_of, plan_of, unreached
from echomodel.progress import StageTimer
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echousd.evaluation.systems import BASES, Layouts, muted_model, networks, shuffled_model
from echousd.graph.arrays import one_thread
from echousd.make import layouts
from echousd.place import search
from echousd.place.placing import place_boxes
from echousd.stage.boxes import graph_of

SEED = 770_000  # of the generated rooms, as in `placing.py`
OTHERS = {"random": BASES["random"][0], "generator": BASES["generator"][0]}
WORDS = {"ships": partial(load_model, None), "shuffled": shuffled_model, "muted": muted_model}
ROWS = ("told kept", "faults an object", "rooms without")
DRAWS = 4000  # of the bootstrap


def judged(weights: str, way: str, tasks: list[Task], draw: int = 0) -> tuple[np.ndarray, list[list[str]], int]:
    """Part and whole of `ROWS` in each room (R, 3, 2), the terms that each misses, and poses judged in all."""
    if way == "default":
        rooms, poses = judged_by_default(weights, tasks)
    else:
        network = WORDS.get(weights, partial(load_model, weights))
        rooms, poses = (OTHERS.get(weights) or networks(network, None if way == "guided" else 0.0))(tasks, draw), 0
    scores, missed = [], []
    for task, room in zip(tasks, rooms, strict=True):
        if way == "searched":
            with one_thread():
                done = place_boxes(
                    room.categories, room.size, room.position, room.yaw, task.stated, floor_polygon=room.floor_polygon,
                    height=room.height, openings=room.openings, rules=task.rules,
                )  # fmt: skip
            room, poses = replace(room, size=done.size, position=done.position, yaw=done.yaw), poses + done.judged
        plan = plan_of(room, room.categories, room.floor_polygon, room.openings, task.stated, height=room.height)
        found = [fault.rule for fault in [*faults_of(plan, KINDS), *unreached(plan)]]
        kept, told = map(np.sum, kept_relations(task, room)["all"])
        scores.append([(kept, told), (len(found), len(room)), (not found, 1)])
        missed.append(found)
    return np.array(scores, float), missed, poses


def best_of(draws: int, weights: str, way: str, tasks: list[Task]) -> tuple[np.ndarray, Counter[str], int]:
    """As `judged`, of the draw of each room that misses the fewest terms; how often each term was missed."""
    each = [judged(weights, way, tasks, number) for number in range(draws)]
    chosen = np.argmin([scores[:, 1, 0] for scores, *_ in each], axis=0)
    scores = np.array([each[draw][0][room] for room, draw in enumerate(chosen)])
    missed = Counter(term for room, draw in enumerate(chosen) for term in each[draw][1][room])
    return scores, missed, sum(poses for *_, poses in each)


def judged_by_default(weights: str, tasks: list[Task]) -> tuple[list[RoomBoxes], int]:
    """What `generate` makes of the tasks' graphs, whose boxes nobody states, and poses judged in all."""
    network = None if weights in OTHERS else WORDS.get(weights, partial(load_model, weights))()
    rooms, poses, usual = [], [0], layouts.finished_boxes

    def counted(*args: Any) -> Any:
        found = usual(*args)
        poses[0] += found[1]
        return found

    layouts.finished_boxes = counted
    for number, task in enumerate(tasks):
        room = task.room
        graph = graph_of(replace(room, relations=task.stated))
        nodes = tuple(node.replaced(size=None, position=None, yaw=None) for node in graph.nodes)
        graph = graph.replaced(nodes=nodes, room=graph.room.replaced(openings=room.openings))
        model = network or Another(OTHERS[weights], task)
        drafts = layouts.most_drafts(model, len(room))
        boxes, _ = layouts.LayoutSearch(model, number, StageTimer(), drafts=drafts).best(graph)
        size, position, yaw = (np.asarray(of, float) for of in (boxes.size, boxes.position, boxes.yaw))
        rooms.append(replace(room, size=size, position=position, yaw=yaw))
    layouts.finished_boxes = usual
    return rooms, poses[0]


class Another:
    """Who draws layouts of one room without being a network, in the place of one."""

    preset = "compact"

    def __init__(self, draw: Layouts, task: Task) -> None:
        self.draw, self.task, self.asked = draw, task, 0

    def sample_layout(self, graph: GraphBatch, **_: Any) -> Boxes:
        """Boxes (N) of copies of the room, others each time."""
        self.asked += 1
        floor = self.task.room.floor_polygon
        middle = (floor.min(0) + floor.max(0)) / 2 if len(floor) else np.zeros(2)
        rooms = self.draw([self.task] * (graph.num_nodes // len(self.task.room)), self.asked)
        size, position, yaw = (
            np.concatenate([getattr(one, of) for one in rooms]) for of in ("size", "position", "yaw")
        )
        return Boxes(*(of.astype(np.float32) for of in (size, position - [middle[0], 0.0, middle[1]], yaw)))


def interval(mine: np.ndarray, first: np.ndarray) -> np.ndarray:
    """(2, 3), bounds of the differences of two sets of judgements (R, 3, 2) of the same rooms."""
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(mine), size=(DRAWS, len(mine)))
    sums = [of[drawn].sum(1) for of in (mine, first)]
    mine, first = (of[..., 0] / np.maximum(of[..., 1], 1) for of in sums)
    return np.quantile(mine - first, [0.025, 0.975], axis=0)


def generated(count: int, types: list[str] | None) -> list[RoomBoxes]:
    """Rooms of the generator, of each type as many where types are named."""
    if types is None:
        return generate_rooms(count, SEED)
    each = [generate_rooms(-(-count // len(types)), SEED, room_type=name) for name in types]
    return [room for rooms in zip(*each, strict=True) for room in rooms]


def main() -> None:
    """Print a line for each way and weights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", nargs="*", default=["ships"])
    parser.add_argument("--ways", nargs="+", default=["alone"], choices=["alone", "guided", "searched", "default"])
    parser.add_argument("--rooms", type=Path)
    parser.add_argument("--types", nargs="+", help="room types to generate as many of each")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--poses", nargs="+", type=int)
    parser.add_argument("--draws", type=int, default=1)
    options = parser.parse_args()
    rooms = generated(options.count, options.types) if options.rooms is None else load_rooms(options.rooms)
    rooms = [room for room in with_known_words(rooms) if len(room) > 1]
    rooms = [rooms[number * len(rooms) // options.count] for number in range(min(options.count, len(rooms)))]
    tasks = tasks_of(rooms, 0, stated=1.0)
    print(f"{len(tasks)} rooms, {sum(len(task.room) for task in tasks)} objects")
    usual = {"searched": search.BUDGET, "default": layouts.POSES}
    for way, poses in [(w, p) for w in options.ways for p in options.poses or [usual.get(w, 0)]]:
        first: np.ndarray | None = None
        for weights in options.weights:
            if way == "searched":
                search.BUDGET = poses
            layouts.POSES = poses
            found, missed, looked = best_of(options.draws, weights, way, tasks)
            total = found.sum(0)
            told, faults, clean = total[:, 0] / total[:, 1]
            most = ", ".join(f"{name} {n}" for name, n in missed.most_common(6))
            after = f" after {looked / len(tasks):.0f} poses a room" if looked else ""
            said = f"told kept {told:.3f}, {faults:.3f} faults an object, {clean:.2f} without{after}"
            print(f"{way:8s} {weights}: {said}")
            print(f"         {most}", flush=True)
            if first is not None:
                low, high = interval(found, first)
                spans = (f"{name} {a:+.3f} to {b:+.3f}" for name, a, b in zip(ROWS, low, high, strict=True))
                print("         beside the first: " + ", ".join(spans), flush=True)
            first = found if first is None else first


if __name__ == "__main__":
    main()
