"""Runs of an evaluation: which rooms are asked, what every system made of them, and figures over rooms."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import resources
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.data.roomset import load_rooms, with_known_words
from echomodel.data.sgfront import SGFront
from echomodel.metrics.statistics import Counts, Figure, Pair, figure
from echomodel.metrics.tasks import Task
from echomodel.progress import StageListener
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.vocabulary import UnknownWord, vocabulary
from echousd.evaluation.foreign import foreign_rooms
from echousd.evaluation.systems import System, drawn, finished

HELD_OUT = 770_000  # seed of generated rooms that no training used
UNTRAINED = ("random", "generator", "shuffled")
HONEST = (*UNTRAINED, *(f"{name}+search" for name in UNTRAINED), "retrieval", "real")
SYSTEMS = ("default", "network", "guided")
SECTIONS = ("relations", "faults", "selection", "field", "realism", "pictures", "steps", "shapes", "physics")


@dataclass(frozen=True)
class SuiteSettings:
    """What is asked.

    Arguments:
        systems: as `System.parse` reads them; the first is what others are compared with.
        against: rooms file, room set (its held-out rooms), SG-FRONT folder (its test split), or `generated`: rooms of
            the room generator that no training saw.
        count: rooms that are laid out. seed: of every draw. only: sections, () = all.
        relations: an object where people would tell them. drafts: of `+half`, of which the best is kept.
        shapes: set of shapes to compare pieces with, None = the programs' own, drawn anew.
        inception, clip: files of weights of FID, KID and FID-CLIP, None = not measured.
        workers: processes that place rooms; they change nothing.
    """

    systems: tuple[str, ...] = SYSTEMS
    against: str = "generated"
    count: int = 24
    seed: int = 0
    only: tuple[str, ...] = ()
    relations: float = 1.0
    drafts: int = 3
    shapes: str | None = None
    inception: str | None = None
    clip: str | None = None
    workers: int = 1

    def __post_init__(self) -> None:
        wrong = [name for name in self.only if name not in SECTIONS]
        if wrong:
            raise ValueError(f"--only: no section {wrong[0]!r}, allowed: {', '.join(SECTIONS)}")
        if self.count < 2:
            raise ValueError(f"--count is {self.count}, allowed: 2 or more; one room alone has no interval")


@dataclass(frozen=True)
class Table:
    """Rows of systems, columns of figures.

    Arguments:
        name: of the section; note: what is measured, in a sentence or two. rows: system -> column -> figure.
        curves: panel -> line -> (x, y); what is plotted, instead of the rows. plain: without a plot.
    """

    name: str
    title: str
    note: str
    rows: Mapping[str, Mapping[str, Figure]]
    curves: Mapping[str, Mapping[str, tuple[Sequence[float], Sequence[float]]]] = field(default_factory=dict)
    plain: bool = False

    @property
    def columns(self) -> list[str]:
        """Of all rows, in their order."""
        return list(dict.fromkeys(column for row in self.rows.values() for column in row))


@dataclass(frozen=True, eq=False)
class Run:
    """What was laid out.

    Arguments:
        systems: in the order of the rows. tasks: that all who can be asked were asked. reference: other rooms of that
            source. made, of: system -> its rooms and what they were asked, room by room.
        seconds: of the processor a room. missing: what is not measured and why; shown: system -> (n, 256, 256, 3)
        pictures from above; sections add to both.
    """

    settings: SuiteSettings
    systems: Sequence[System]
    tasks: Sequence[Task]
    reference: Sequence[RoomBoxes]
    made: Mapping[str, Sequence[RoomBoxes]]
    of: Mapping[str, Sequence[Task]]
    seconds: Mapping[str, float]
    missing: list[str] = field(default_factory=list)
    shown: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def asked(self) -> list[System]:
        """Systems that lay out other tasks as well, one draft each."""
        return [system for system in self.systems if not system.foreign and system.finish != "half"]


def rooms_against(settings: SuiteSettings) -> tuple[list[RoomBoxes], list[RoomBoxes]]:
    """Rooms to lay out and, of the same source, as many others to compare with; raises ValueError for too few."""
    wanted = 2 * settings.count
    path = Path(settings.against)
    published = (path / "classes_all.txt").exists()
    if settings.against == "generated":
        rooms = generate_rooms(wanted, HELD_OUT + settings.seed)
    elif published:
        rooms = SGFront(path, split="test").rooms()
    else:
        rooms = load_rooms(path, held_out=path.is_dir() or path.suffix == ".npz")
    known = [
        replace(new, relations=old.relations if published and len(new) == len(old) else None)
        for new, old in zip(known_rooms(settings.against, rooms), rooms, strict=True)
    ]
    rooms = [room for room in known if len(room) > 1 and len(room.floor_polygon) > 2]
    if len(rooms) < 4:
        raise ValueError(f"{settings.against}: {len(rooms)} rooms with a floor and two known objects, 4 are needed")
    chosen = _spread(rooms, min(wanted, len(rooms) // 2 * 2))
    return chosen[::2], chosen[1::2]


def _spread(found: Sequence[Any], count: int) -> list[Any]:
    """At most so many, from all parts of a sequence."""
    count = min(count, len(found))
    return [found[number * len(found) // count] for number in range(count)]


def known_rooms(name: str, rooms: Sequence[RoomBoxes]) -> list[RoomBoxes]:
    """The rooms in the vocabulary's words; raises ValueError that names the source for a room type of another one."""
    try:
        return with_known_words(rooms)
    except UnknownWord as error:
        raise ValueError(f"{name}: {error}") from None


def run_systems(
    systems: Sequence[System], tasks: Sequence[Task], settings: SuiteSettings, progress: StageListener | None = None
) -> tuple[dict[str, list[RoomBoxes]], dict[str, float]]:
    """The rooms of every system, and its CPU seconds a room (drawing here, placing wherever it ran)."""
    made: dict[str, list[RoomBoxes]] = {}
    seconds: dict[str, float] = {}
    bases: dict[tuple[str, int], tuple[list[RoomBoxes], float]] = {}
    several = settings.workers > 1
    with ProcessPoolExecutor(settings.workers, get_context("spawn")) if several else nullcontext() as pool:
        for number, system in enumerate(systems):
            keys = [(system.base, draft) for draft in range(settings.drafts if system.finish == "half" else 1)]
            for base, draft in keys:
                if (base, draft) not in bases:
                    bases[base, draft] = _timed(drawn, system, tasks, settings.seed + 1000 * draft)
            drafts = [bases[key] for key in keys]
            work, given = partial(_timed, finished, system), (tasks, zip(*(rooms for rooms, _ in drafts), strict=True))
            done = list(pool.map(work, *given, chunksize=2) if pool else map(work, *given))
            made[system.name] = [room for room, _ in done]
            seconds[system.name] = sum(took for _, took in [*drafts, *done]) / len(tasks)
            if progress:
                progress("rooms", number + 1, len(systems))
    return made, seconds


def _timed(work: Callable[..., Any], *given: Any) -> tuple[Any, float]:
    began = time.process_time()
    return work(*given), time.process_time() - began


def rooms_of(system: System, settings: SuiteSettings) -> tuple[list[Task], list[str]]:
    """Rooms from elsewhere as tasks that they answered themselves, and what was left out of them, a sentence each."""
    assert system.foreign is not None
    found = foreign_rooms(system.foreign)
    known = known_rooms(system.name, found)
    odd = sorted({word for old, new in zip(found, known, strict=True) for word in {*old.categories}
                  if vocabulary().known_category(word) is None})  # fmt: skip
    notes = [f"{system.name}: objects that the vocabulary does not hold are left out: {', '.join(odd)}"] if odd else []
    bare = sum(len(room.floor_polygon) < 3 for room in known)
    if bare:
        notes.append(f"{system.name}: {bare} of {len(known)} rooms have no floor, figures of floors leave them out")
    tasks = []
    for old, new in zip(found, known, strict=True):
        kept = old.relations if old.relations is not None and len(old) == len(new) else ()
        if len(new):
            tasks.append(Task(new, np.array(kept, np.int64).reshape(-1, 3)))
    if len(tasks) < 2:
        raise ValueError(f"{system.name}: {len(tasks)} rooms with known objects, 2 or more are needed for an interval")
    return _spread(tasks, settings.count), notes


def note(section: str, **told: Any) -> str:
    """What a table measures, as notes.toml has it."""
    text = resources.files("echousd.evaluation").joinpath("notes.toml").read_text("utf-8")
    return " ".join(tomllib.loads(text)[section].split()).format(**told)


def figures(
    scores: Mapping[str, Sequence[Mapping[str, Pair]]], columns: Sequence[str], seed: int, reference: str
) -> dict[str, dict[str, Figure]]:
    """The table of some columns of what rooms score, every system compared with one of them on the same rooms."""
    counts = {
        name: {column: Counts.of([row.get(column, (0.0, 0.0)) for row in rows]) for column in columns}
        for name, rows in scores.items()
    }
    return {
        name: {c: figure(row[c], seed, counts[reference][c] if name != reference else None) for c in columns}
        for name, row in counts.items()
    }
