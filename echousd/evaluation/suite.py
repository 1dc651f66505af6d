"""The suite: every system is asked the same rooms, and every table holds the same honest rows."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.data.roomset import load_rooms
from echomodel.loading import load_model
from echomodel.metrics.layouts import layout_scores, strata_of
from echomodel.metrics.statistics import Counts, Figure, Pair, figure
from echomodel.metrics.tasks import GROUPS, Task, changed, extended, kept_relations, tasks_of, with_known_words
from echomodel.progress import StageListener
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echousd.evaluation.systems import System, described, drawn, finished

HELD_OUT = 770_000  # seed of generated rooms that no training used
UNTRAINED = ("random", "generator", "shuffled")
HONEST = (*UNTRAINED, *(f"{name}+search" for name in UNTRAINED), "retrieval", "real")
SYSTEMS = ("default", "network", "guided")
SECTIONS = ("relations", "faults")
LIBRARIES = ("numpy", "scipy", "torch", "scikit-learn", "echousd")


@dataclass(frozen=True)
class SuiteSettings:
    """What is asked.

    Arguments:
        systems: as `System.parse` reads them; the first is what others are compared with.
        against: rooms file, room set or SG-FRONT folder, or `generated`: held-out rooms of the room generator.
        samples: rooms that are laid out. seed: of every draw. only: sections, () = all.
        told: relations an object where people would tell them. drafts: of `+half`, of which the best is kept.
        workers: processes that place rooms.
    """

    systems: tuple[str, ...] = SYSTEMS
    against: str = "generated"
    samples: int = 24
    seed: int = 0
    only: tuple[str, ...] = ()
    told: float = 1.0
    drafts: int = 3
    workers: int = 1

    def __post_init__(self) -> None:
        wrong = [name for name in self.only if name not in SECTIONS]
        if wrong:
            raise ValueError(f"--only: no section {wrong[0]!r}, allowed: {', '.join(SECTIONS)}")
        if self.samples < 2:
            raise ValueError(f"--samples is {self.samples}, allowed: 2 or more; one room alone has no interval")


@dataclass(frozen=True)
class Table:
    """Rows of systems, columns of figures.

    Arguments:
        name: of the section; note: what is measured, in a sentence or two. better: column -> "low" or "high".
        rows: system -> column -> figure.
    """

    name: str
    title: str
    note: str
    rows: Mapping[str, Mapping[str, Figure]]
    better: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Run:
    """What was laid out: system -> its rooms, in the order of the tasks."""

    settings: SuiteSettings
    tasks: Sequence[Task]
    reference: Sequence[RoomBoxes]
    made: Mapping[str, Sequence[RoomBoxes]]
    seconds: Mapping[str, float]


def rooms_against(settings: SuiteSettings) -> tuple[list[RoomBoxes], list[RoomBoxes]]:
    """Rooms to lay out and, of the same source, as many others to compare with; raises ValueError for too few."""
    wanted = 2 * settings.samples
    if settings.against == "generated":
        rooms = generate_rooms(wanted, HELD_OUT + settings.seed)
    else:
        rooms = load_rooms(Path(settings.against))
    rooms = [room for room in with_known_words(rooms) if len(room) > 1 and len(room.floor_polygon) > 2]
    if len(rooms) < 4:
        raise ValueError(f"{settings.against}: {len(rooms)} rooms with a floor and two known objects, 4 are needed")
    count = min(wanted, len(rooms) // 2 * 2)
    chosen = [rooms[number * len(rooms) // count] for number in range(count)]
    return chosen[::2], chosen[1::2]


def run_systems(
    systems: Sequence[System], tasks: Sequence[Task], settings: SuiteSettings, progress: StageListener | None = None
) -> tuple[dict[str, list[RoomBoxes]], dict[str, float]]:
    """The rooms of every system, and its CPU seconds a room (drawing here, placing wherever it ran)."""
    made: dict[str, list[RoomBoxes]] = {}
    seconds: dict[str, float] = {}
    bases: dict[tuple[str, int], tuple[list[RoomBoxes], float]] = {}
    with Workers(settings.workers) as pool:
        for number, system in enumerate(systems):
            drafts, spent = [], 0.0
            for draft in range(settings.drafts if system.finish == "half" else 1):
                if (system.base, draft) not in bases:
                    began = time.process_time()
                    found = drawn(system, tasks, settings.seed + 1000 * draft)
                    bases[system.base, draft] = found, time.process_time() - began
                drafts.append(bases[system.base, draft][0])
                spent += bases[system.base, draft][1]
            done = pool.map(_finished, [(system, *row) for row in zip(tasks, zip(*drafts, strict=True), strict=True)])
            made[system.name] = [room for room, _ in done]
            seconds[system.name] = (spent + sum(took for _, took in done)) / len(tasks)
            if progress:
                progress("rooms", number + 1, len(systems))
    return made, seconds


def _finished(asked: tuple[System, Task, Sequence[RoomBoxes]]) -> tuple[RoomBoxes, float]:
    began = time.process_time()
    return finished(*asked), time.process_time() - began


class Workers:
    """A map over so many processes, in order; none of them where one is enough."""

    def __init__(self, count: int) -> None:
        self.pool = ProcessPoolExecutor(count, get_context("spawn")) if count > 1 else None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if self.pool:
            self.pool.shutdown()

    def map(self, function: Callable, rows: Sequence) -> list:
        """The function of every row."""
        return list(self.pool.map(function, rows, chunksize=2) if self.pool else map(function, rows))


def figures(
    scores: Mapping[str, Sequence[Mapping[str, Pair]]], columns: Sequence[str], seed: int, reference: str
) -> dict[str, dict[str, Figure]]:
    """The table of some columns of what rooms score, every system compared with one of them."""
    counts = {
        name: {column: Counts.of([row.get(column, (0.0, 0.0)) for row in rows]) for column in columns}
        for name, rows in scores.items()
    }
    return {
        name: {c: figure(row[c], seed, counts[reference][c] if name != reference else None) for c in columns}
        for name, row in counts.items()
    }


# -- sections ----------------------------------------------------------------------------------------------------------


def relations(run: Run, systems: Sequence[System], rooms: Sequence[RoomBoxes]) -> list[Table]:
    """The paper's Table 2: half of all relations told by the published rules; plain, after a change, an addition."""
    settings = run.settings
    plain = tasks_of(rooms, settings.seed, rules="sgfront")
    rng = np.random.default_rng([settings.seed, 12])
    modes = {
        "plain": plain,
        "change": [changed(task, rng) for task in plain[::2]],
        "addition": [extended(task, rng) for task in plain[::2]],
    }
    quick = [system for system in systems if system.finish != "half" and not system.foreign]
    tables = []
    for mode, tasks in modes.items():
        made, _ = run_systems(quick, tasks, settings)
        scores = {
            name: [kept_relations(task, room) for task, room in zip(tasks, found, strict=True)]
            for name, found in made.items()
        }
        columns = [*GROUPS, "all"] + (["edited", "rest"] if mode != "plain" else [])
        rows = figures(scores, columns, settings.seed, quick[0].name)
        title = {"plain": "as told", "change": "after a change", "addition": "after an addition"}[mode]
        note = (
            "Share of the told relations that hold, by the published rules (yaw ignored, quirks kept); half of all "
            "relations that hold are told. A pair of words counts as the mean of its two shares. Edits are made in "
            "every second room; a change turns one relation round and keeps what contradicts it."
        )
        tables.append(Table("relations", f"Relations kept, {title}", note, rows, dict.fromkeys(columns, "high")))
    return tables


def faults(run: Run, systems: Sequence[System], rooms: Sequence[RoomBoxes]) -> list[Table]:
    """What a person would point at, in all and by the two halves of the terms, and by strata."""
    scores = {
        name: [layout_scores(task, room) for task, room in zip(run.tasks, made, strict=True)]
        for name, made in run.made.items()
    }
    first, seed = next(iter(scores)), run.settings.seed
    columns = ["told", "faults", "faults A", "faults B", "faultless", "physics"]
    better = {"told": "high", "faultless": "high"} | dict.fromkeys(("faults", "faults A", "faults B", "physics"), "low")
    note = (
        "One relation an object told, as people write. Faults an object by the living and composition terms. `+search` "
        "searches with the terms that count here: its own count flatters it. `+half` searches and chooses its best "
        "draft by half A alone: what it scores by half B nobody optimised."
    )
    tables = [Table("faults", "Faults an object", note, figures(scores, columns, seed, first), better)]
    for stratum in strata_of(run.tasks[0]):
        words = [strata_of(task)[stratum] for task in run.tasks]
        parts = {word: [k for k, one in enumerate(words) if one == word] for word in sorted(set(words))}
        rows = {
            name: {
                f"{word} ({len(at)})": figure(Counts.of([found[k]["faults"] for k in at]), seed)
                for word, at in parts.items()
            }
            for name, found in scores.items()
        }
        tables.append(Table("faults", f"Faults an object by {stratum}", "Rooms in brackets.", rows))
    terms = sorted({name for rows in scores.values() for row in rows for name in row if name.startswith("term ")})
    by_term = {
        name: [{t: row.get(t, (0.0, row["faults"][1])) for t in terms} for row in found]
        for name, found in scores.items()
    }
    rows = figures(by_term, terms, seed, first)
    rows = {name: {t.removeprefix("term "): f for t, f in row.items()} for name, row in rows.items()}
    return [*tables, Table("faults", "Faults an object by term", "Terms that found something somewhere.", rows)]


RUNNERS: dict[str, Callable[[Run, Sequence[System], Sequence[RoomBoxes]], list[Table]]] = {
    "relations": relations,
    "faults": faults,
}


def evaluate(settings: SuiteSettings, progress: StageListener | None = None) -> tuple[dict[str, Any], Run]:
    """Lay out and score: what the report says, and the rooms.

    Raises ValueError for systems, sets and sections that there are not.
    """
    names = list(dict.fromkeys([*settings.systems, *HONEST]))
    systems = [System.parse(name) for name in names]
    rooms, others = rooms_against(settings)
    tasks = tasks_of(rooms, settings.seed, told=settings.told)
    made, seconds = run_systems([s for s in systems if not s.foreign], tasks, settings, progress)
    run = Run(settings, tasks, others, made, seconds)
    chosen = settings.only or SECTIONS
    tables = []
    for number, name in enumerate(chosen):
        tables += RUNNERS[name](run, systems, rooms)
        if progress:
            progress("figures", number + 1, len(chosen))
    told = {system.name: described(system) for system in systems}
    asked = {name: value for name, value in asdict(settings).items() if name != "workers"}  # which change nothing
    found = {"settings": asked, "about": about(settings, systems, rooms, others), "systems": told}
    return {**found, "tables": tables}, run


def about(
    settings: SuiteSettings, systems: Sequence[System], rooms: Sequence[RoomBoxes], others: Sequence[RoomBoxes]
) -> dict[str, Any]:
    """Versions, and hashes of data and weights."""
    text = json.dumps([room.to_json() for room in [*rooms, *others]], sort_keys=True)
    weights = {"shipped": load_model(None).hash} | {s.name: load_model(s.weights).hash for s in systems if s.weights}
    return {
        "versions": {"python": platform.python_version()} | {name: version(name) for name in LIBRARIES},
        "data": hashlib.sha256(text.encode()).hexdigest(),
        "weights": weights,
        "rooms": len(rooms),
        "objects": sum(map(len, rooms)),
    }
