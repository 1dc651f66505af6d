"""Rooms to learn from: furniture and floors of the room generator, told sparsely, as the best of several searches.

The starts of a room are the generator's own arrangement and drafts of the network. What misses a term of the objective
after every search is left out; of the others the cheapest is kept. Further rooms in which the generator itself left
nothing to object to, one in eight, are kept as they are: they cost a tenth of a searched one.
"""

import csv
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.data.roomset import RoomSet, claim, kept_out, pack_rooms
from echomodel.files import write_text
from echomodel.graph import GraphBatch
from echomodel.loading import load_model
from echomodel.objective import KINDS, faults_of, plan_of, unreached
from echomodel.objective.table import cost_of
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_rooms
from echomodel.rules.telling import stated_of_room
from echousd.place.placing import place_boxes

GRAPHS, PLAIN = 20, 200  # of a shard: graphs that are searched, and rooms of the generator that are looked through
OTHERS = 1_000_000  # seeds between the two
HALLS = 0.12  # share of large rooms of several zones
STATED = (0.5, 2.0)  # relations an object, as people tell them
NOTHING = np.zeros((0, 3), int)  # that is told
COLUMNS = ("shard", "graphs", "kept", "from_generator", "faults_generator", "plain", "objects", "cpu_seconds")


@dataclass(frozen=True)
class ExamplesPlan:
    """What a folder of examples is filled with: the world's seed, drafts of the network a room, and the weights that
    draw them, None = those that ship; not `searched`: rooms of the generator alone are kept; `rooms`: a packed set
    whose rooms are searched on in place of the generator's."""

    seed: int
    drafts: int = 2
    weights: str | None = None
    searched: bool = True
    rooms: str | None = None

    def __post_init__(self) -> None:
        if self.rooms is not None and not self.searched:
            raise ValueError(
                f"--unsearched keeps rooms of the generator, --rooms {self.rooms} is searched on: leave one"
            )


def search_examples(
    folder: Path, plan: ExamplesPlan, *, shards: int, workers: int = 1, minutes: float | None = None,
    report: Callable[[dict[str, float]], None] | None = None,
) -> RoomSet:  # fmt: skip
    """Fill a folder with shards of rooms found by search, and join them in its `rooms.npz`; run again to go on.

    Arguments:
        shards: how many there shall be; complete ones are kept. workers: processes.
        minutes: time after which no further shard is begun.
        report: called with each row of the folder's `log.csv`.

    Raises ValueError for a folder that was begun with another plan, or when nothing was found.
    """
    folder.mkdir(parents=True, exist_ok=True)
    kind = "rooms found by search" if plan.searched else "rooms of the generator"
    asked = {"seed": plan.seed, "drafts": plan.drafts, "rooms": plan.rooms, "weights": plan.weights}
    claim(folder, {"kind": kind, **asked})
    left = [number for number in range(shards) if not _shard(folder, number).exists()]
    until = None if minutes is None else time.time() + 60 * minutes
    work = partial(_search_shard, folder, plan, until)
    log = folder / "log.csv"
    if not log.exists():
        write_text(log, ",".join(COLUMNS) + "\n")
    pool = get_context("spawn").Pool(workers) if workers > 1 else None
    try:
        for row in pool.imap_unordered(work, left) if pool else map(work, left):
            if row is not None:
                with log.open("a", newline="") as file:
                    csv.DictWriter(file, COLUMNS).writerow(row)
                if report:
                    report(row)
    finally:
        if pool:
            pool.terminate()
    return joined(folder)


def joined(folder: Path) -> RoomSet:
    """All complete shards of a folder as one packed set, its `rooms.npz`; raises ValueError where there is none."""
    sets = [RoomSet(path) for path in sorted(folder.glob("found-*.npz"))]
    if not sets:
        raise ValueError(f"{folder}: no shard of rooms is complete")
    rooms = [one.room(k) for one in sets for k in range(len(one))]
    info = {"kind": "rooms found by search", "seed": sets[0].info["seed"]}
    pack_rooms(folder / "rooms.npz", rooms, np.concatenate([one.held_out for one in sets]).tolist(), info)
    return RoomSet(folder / "rooms.npz")


def _shard(folder: Path, number: int) -> Path:
    return folder / f"found-{number:05d}.npz"


def _search_shard(folder: Path, plan: ExamplesPlan, until: float | None, number: int) -> dict[str, float] | None:
    """Search the rooms of one shard and write it; its row of the log, None where the time is over."""
    if until is not None and time.time() > until:
        return None
    torch.set_num_threads(1)
    started = time.process_time()
    graphs = GRAPHS if plan.searched else 0
    first = number * graphs
    given = None if plan.rooms is None else RoomSet(plan.rooms)
    if given is None:
        drawn = generate_rooms(graphs, plan.seed, start=first, halls=HALLS)
    else:
        drawn = [given.room(k) for k in range(first, min(first + graphs, len(given)))]
    luck = np.random.Generator(np.random.PCG64([plan.seed, number, 5]))
    labels = label_rooms(drawn, rules="strict") if drawn else []
    stated = [
        stated_of_room(relations, room, float(luck.uniform(*STATED)), seed=int(luck.integers(2**31)))
        for relations, room in zip(labels, drawn, strict=True)
    ]
    starts = [[room.boxes()] for room in drawn]
    if plan.drafts and drawn:
        for more, drafts in zip(starts, _drafts(plan, drawn, stated, number), strict=True):
            more += drafts
    others = generate_rooms(PLAIN if given is None else 0, plan.seed + OTHERS, start=number * PLAIN, halls=HALLS)
    plain = [_with(room, room.size, room.position, room.yaw) for room in others if not _missed(room, NOTHING)]
    kept: list[RoomBoxes] = []
    numbers: list[int] = []
    own = faults = 0
    for k, (room, triplets, begun) in enumerate(zip(drawn, stated, starts, strict=True)):
        ends = [(*it, n) for n, start in enumerate(begun) if (it := _searched(room, triplets, start))]
        faults += len(_missed(room, triplets))
        if ends:
            _, best, which = min(ends, key=lambda one: one[0])
            kept.append(best)
            numbers.append(first + k)
            own += which == 0
    found = len(kept)
    held = [kept_out(n) if given is None else bool(given.held_out[n]) for n in (*numbers, *range(len(plain)))]
    kept += plain
    pack_rooms(_shard(folder, number), kept, held, {"kind": "rooms found by search", "seed": plan.seed})
    seconds = round(time.process_time() - started, 1)
    row = (number, graphs, found, own, faults, len(plain), sum(map(len, kept)), seconds)
    return dict(zip(COLUMNS, row, strict=True))


def _drafts(plan: ExamplesPlan, rooms: list[RoomBoxes], stated: list[np.ndarray], number: int) -> list[list[Boxes]]:
    """Boxes that the network draws of some rooms from noise, `plan.drafts` of each."""
    model, counts = load_model(plan.weights), [len(room) for room in rooms]
    labelled = [replace(room, relations=triplets) for room, triplets in zip(rooms, stated, strict=True)]
    graph = GraphBatch.pack([room.graph() for room in labelled])
    out: list[list[Boxes]] = [[] for _ in rooms]
    for draft in range(plan.drafts):
        generator = torch.Generator().manual_seed(plan.seed * 1_000_003 + number * 101 + draft)
        boxes = model.sample_layout(graph, generator=generator, relation_guidance=0.0).to("cpu")
        columns = (values.split(counts) for values in (boxes.size, boxes.position, boxes.yaw))
        for mine, size, position, yaw in zip(out, *columns, strict=True):
            mine.append(Boxes(size, position, yaw))
    return out


def _searched(room: RoomBoxes, triplets: np.ndarray, start: Boxes) -> tuple[float, RoomBoxes] | None:
    """The room as placing leaves it from a start that misses anything, and what it costs; None where it still does."""
    made = _with(room, *(of.double().numpy() for of in (start.size, start.position, start.yaw)))
    if _missed(made, triplets):
        done = place_boxes(
            room.categories, made.size, made.position, made.yaw, triplets, floor_polygon=room.floor_polygon,
            height=room.height, openings=room.openings,
        )  # fmt: skip
        made = _with(room, done.size, done.position, done.yaw)
        if done.collisions or done.outside or (done.verdict == 0).any() or _missed(made, triplets):
            return None
    plan = plan_of(made, made.categories, made.floor_polygon, made.openings, triplets, height=made.height)
    return cost_of(plan), made


def _with(room: RoomBoxes, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> RoomBoxes:
    """The room with other boxes, their headings from -pi to pi, and no relations."""
    turned = (yaw + np.pi) % (2 * np.pi) - np.pi
    return replace(room, size=size, position=position, yaw=turned, relations=None)


def _missed(room: RoomBoxes, triplets: np.ndarray) -> list:
    plan = plan_of(room, room.categories, room.floor_polygon, room.openings, triplets, height=room.height)
    return faults_of(plan, KINDS) + unreached(plan)
