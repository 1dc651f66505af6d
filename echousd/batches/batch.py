"""`echousd.batch`: many rooms from graphs; the run that makes them; `generate_many`, the same in one process."""

from __future__ import annotations

import hashlib
import os
import re
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import echousd
from echomodel.files import SHIPPED, check_ours, raising
from echousd.batches import work
from echousd.batches.executor import Executor, LocalWorkers, Outcome, RayCluster, Task
from echousd.batches.options import BatchRequest, request_of
from echousd.batches.plan import (
    STATE,
    STORE,
    Entry,
    Journal,
    RunPlan,
    difference,
    fault_of,
    load_plan,
    make_plan,
    read_journals,
    room_digest,
    save_plan,
    shard_folder,
    whole_keys,
)
from echousd.folder.folder import check_writable
from echousd.folder.lock import locked
from echousd.folder.within import inside
from echousd.graph import SceneGraph
from echousd.graph.files import load_graph
from echousd.naming import free_name

if TYPE_CHECKING:
    from echousd.make.finished import Room


@dataclass(frozen=True)
class BatchResult:
    """What a run left.

    Arguments:
        folder: of the run. rooms: of the shard; done, failed: of them. seconds: of this run.
        stopped: why it ended early, "" where it did not.
    """

    folder: Path
    rooms: int
    done: int
    failed: int
    seconds: float
    stopped: str = ""

    @property
    def complete(self) -> bool:
        """Whether every room is there."""
        return self.done == self.rooms


def batch(
    sources: str | Path | Sequence[str | Path] = (), out: str | Path = "batch", *,
    sample: Mapping[str, int] | None = None, count: int = 1, seed: int = 0,
    variations: Mapping[str, Sequence[Any]] | None = None, **options: Any,
) -> BatchResult:  # fmt: skip
    """Make many rooms in one folder, each whole or not at all; a run that was ended is gone on with (`resume=True`).

    The rooms are the same bytes for any number of workers and shards, whatever died on the way.

    Arguments:
        sources: graph files, folders, globs, JSONL or Parquet files with a graph a line.
        out: folder of the run.
        sample: room type -> how many graphs are drawn from the room generator.
        count, seed: rooms of each graph, the first with this seed, the next with one more.
        variations: option -> values, whose combinations a graph's rooms take in turn.
        options: of the rooms, those of `echousd.batches.options.BatchOptions`;
            of the run, fields of `echousd.batches.batch.RunOptions`: workers, shard=(i, n), resume, max_failures,
            timeout, until, memory, ray, outside, progress.

    Raises ValueError for what is not allowed, a folder in use or with another plan, and says the difference.
    """
    listed = [sources] if isinstance(sources, str | Path) else sources
    how = {field.name: options.pop(field.name) for field in fields(RunOptions) if field.name in options}
    raw = {
        "sources": [Path(one).as_posix() for one in listed], "sample": dict(sample or {}), "count": count, "seed": seed,
        "options": options, "variations": {key: list(values) for key, values in (variations or {}).items()},
    }  # fmt: skip
    return run_batch(request_of(raw, "batch"), Path(out), RunOptions(**how))


def run_batch(request: BatchRequest, out: Path, how: RunOptions, there: RunPlan | None = None) -> BatchResult:
    """`batch` for a checked request, or for the plan that is there, whose sources nobody asks again."""
    check_writable(out)
    if "://" in str(out) or re.match(r"[A-Za-z][A-Za-z0-9+.-]+:/", out.as_posix()):  # `Path` makes one slash of two
        raise ValueError(f"{out}: allowed: a folder on a disk; its rooms are whole and may be copied as they appear")
    device = request.options.device
    if not how.ray:
        work.devices(device)
    weights = weights_hash(request.options.weights)
    ours = {"version": echousd.__version__, "weights": weights}
    plan = replace(there, head=there.head | ours) if there else make_plan(request, weights, how.outside)
    plan = _with_libraries(plan, how.outside)
    place = shard_folder(out, how.shard)
    with locked(place):
        plan = _agree_on(plan, out, resume=how.resume or how.shard[1] > 1)
        valid = _valid(plan, out, how.shard)
        journal = Journal(place)
        pool = _executor(how, len(plan.entries), device)
        seen = out.resolve() if how.ray else out  # workers elsewhere stand in another folder
        run = Run(plan, plan.part(how.shard), valid, seen, journal, how)
        try:
            end = run.execute(pool)
        finally:
            pool.close()
            journal.close()
    return BatchResult(out, end.total, end.done, end.failed, end.seconds, run.stopped)


def generate_many(graphs: Iterable[SceneGraph | str | Path], *, seed: int = 0, **options: Any) -> Iterator[Room]:
    """Rooms of many graphs in one process, as `echousd.batch` of the same graphs makes them.

    Arguments:
        graphs: or files that hold one, taken one at a time. seed: of every room.
        options: those of `RoomOptions`.

    Raises ValueError for the first graph that no room can be made of.
    """
    asked = request_of({"sources": ["graphs"], "options": options}, "generate_many").options
    for number, graph in enumerate(graphs):
        with raising(f"graph {number}:"):
            known = graph if isinstance(graph, SceneGraph) else load_graph(graph)
            yield work.generated(work.Job("", "", seed, asked, known.to_json()))


def _executor(how: RunOptions, rooms: int, device: str) -> Executor:
    if not how.ray:
        workers = max(min(how.workers or cores(), rooms), 1)
        return LocalWorkers(workers, devices=work.devices(device), timeout=how.timeout, memory=how.memory)
    return RayCluster(how.ray, workers=how.workers, timeout=how.timeout, memory=how.memory, gpus=device != "cpu")


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def weights_hash(weights: str | None) -> str:
    """Short hash of the weights files; raises ValueError where there are none."""
    source = Path(weights) if weights else SHIPPED
    files = sorted(source.rglob("*")) if source.is_dir() else [source]
    found, digest = [path for path in files if path.is_file()], hashlib.sha256()
    if not found:
        raise ValueError(f"{source}: no weights there")
    for path in found:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _with_libraries(plan: RunPlan, outside: tuple[str, ...]) -> RunPlan:
    """The plan that knows its libraries by their bytes; raises ValueError for what its rooms would miss."""
    from echousd.assets.choose import wishes_of

    for options in plan.options:
        wishes_of(options, outside)
        if options.settle:
            from echousd.settle.settle import require_engine

            require_engine()
    found = {path: weights_hash(path) for path in dict.fromkeys(options.assets for options in plan.options) if path}
    return replace(plan, head={**plan.head, "libraries": found}) if found else plan


def _agree_on(plan: RunPlan, out: Path, *, resume: bool) -> RunPlan:
    """Write the plan, or make sure that the one that lies there says the same; it counts."""
    if not (out / STATE / "plan.jsonl").is_file():
        check_ours(out, "run of echousd batch", besides=(STATE,))
        save_plan(plan, out)
        return plan
    old = load_plan(out)
    unequal = difference(old, plan)
    if unequal:
        raise ValueError(f"{out}: holds a run with another plan ({unequal}); choose another folder")
    if not resume:
        raise ValueError(f"{out}: holds a run of {len(old.entries)} rooms; go on with it (--resume) or choose another")
    return old


def _valid(plan: RunPlan, out: Path, shard: tuple[int, int]) -> frozenset[str]:
    """Ids of the shard's rooms that are there as the journal says; a changed one is set aside."""
    rows, stored = read_journals(out), whole_keys(out, mend=True)
    valid = set()
    for entry in plan.part(shard):
        row = rows.get(entry.id)
        folder = entry.folder(out)
        if row is None or row["state"] != "done":
            continue
        if not fault_of(folder, row, stored):
            valid.add(entry.id)
        elif folder.is_dir() and room_digest(folder) != row["sha256"]:
            aside = inside(out, f"{STATE}/set_aside", f"{out}: the run")
            aside.mkdir(parents=True, exist_ok=True)
            there = {other.name for other in aside.iterdir()}
            kept = folder.rename(aside / free_name(f"{entry.id}_{int(row['when'])}", there))
            warnings.warn(f"{folder}: changed since it was made; kept as {kept}, and made again", stacklevel=3)
    return frozenset(valid)


MEMORY = 4096  # MiB that a worker may hold
TRIES = 4  # of a task whose worker died: a machine loses one now and then, a room that kills them all is given up
FULL = "No space left on device"


@dataclass
class BatchProgress:
    """How far a run is.

    Arguments:
        total: rooms of the shard; done, failed: of them, earlier runs included.
        seconds: since this run began; made: rooms that it made. megabytes: of the workers.
        room, error: the one that just ended.
    """

    total: int
    done: int = 0
    failed: int = 0
    made: int = 0
    seconds: float = 0.0
    megabytes: float = 0.0
    room: str = ""
    error: str = ""

    @property
    def rate(self) -> float:
        """Rooms a second of this run."""
        return (self.made + self.failed) / self.seconds if self.seconds > 0 else 0.0

    @property
    def left(self) -> float | None:
        """Seconds to go, None while nobody knows."""
        rest = self.total - self.done - self.failed
        return rest / self.rate if self.rate > 0 else None


@dataclass(frozen=True)
class RunOptions:
    """How a plan is run; none of it changes a byte of a room.

    Arguments:
        workers: processes, None = one a core. shard: (i, n), the i-th of n parts of the plan.
        resume: go on with the run in the folder: rooms that are complete and valid stay.
        max_failures: failed rooms after which the run stops. timeout: seconds a room. until: `time.time()` to stop at.
        memory: MiB a worker; a room that needs more fails.
        ray: `auto` or the address of a Ray cluster, whose nodes see the folder under one path; "" = local processes.
        outside: folders besides those of the graphs and of the index in which models may lie.
        progress: called after every room.

    Raises ValueError for a shard that is none of its parts.
    """

    workers: int | None = None
    shard: tuple[int, int] = (0, 1)
    resume: bool = False
    max_failures: int | None = None
    timeout: float | None = None
    until: float | None = None
    memory: int | None = MEMORY
    ray: str = ""
    outside: tuple[str, ...] = ()
    progress: Callable[[BatchProgress], None] | None = None

    def __post_init__(self) -> None:
        part, parts = self.shard
        if not 0 <= part < parts:
            raise ValueError(f"shard is {part}/{parts}, allowed: i/n with i from 0 to n - 1")


@dataclass
class Run:
    """One shard of a plan on an executor.

    Arguments:
        plan, rooms: what there is to do; skip: ids of the rooms that are complete and valid.
        folder: of the run. journal: of the shard. how: when it stops, and who is told.
    """

    plan: RunPlan
    rooms: Sequence[Entry]
    skip: frozenset[str]
    folder: Path
    journal: Journal
    how: RunOptions
    stopped: str = ""
    _begun: dict[str, Entry] = field(default_factory=dict)
    _tries: Counter[str] = field(default_factory=Counter)

    def execute(self, executor: Executor) -> BatchProgress:
        """Do all that is left, until it is done or something stops the run; `stopped` says what."""
        began = time.monotonic()
        progress = BatchProgress(len(self.rooms), done=len(self.skip))
        waiting = deque(entry for entry in self.rooms if entry.id not in self.skip)
        while waiting or self._begun:
            self._check_stop(progress)
            while waiting and not self.stopped and executor.free():
                entry = waiting.popleft()
                if entry.error:
                    self._fail(entry, entry.error, progress)
                    self._check_stop(progress)
                else:
                    self._begin(executor, Task(entry.id, work.room, self._job(entry)), entry)
            if self.stopped and not self._begun:
                break
            for outcome in executor.outcomes(1.0) if self._begun else ():
                entry = self._begun.pop(outcome.task.key)
                if outcome.fate == "died" and self._again(entry):
                    self._begin(executor, outcome.task, entry)
                else:
                    self._ended(entry, outcome, progress)
            progress.seconds, progress.megabytes = time.monotonic() - began, executor.megabytes
            if self.how.progress is not None:
                self.how.progress(progress)
        return progress

    def _check_stop(self, progress: BatchProgress) -> None:
        if self.stopped:
            return
        most, until = self.how.max_failures, self.how.until
        if most is not None and progress.failed > most:
            self.stopped = f"{progress.failed} rooms failed, allowed: {most}"
        elif until is not None and time.time() >= until:
            self.stopped = "the time is over"
        elif not (self.folder / STATE / "plan.jsonl").is_file():
            raise ValueError(f"{self.folder}: was moved or removed meanwhile; go on with --resume where it is")

    def _begin(self, executor: Executor, task: Task, entry: Entry) -> None:
        self._begun[task.key] = entry
        executor.submit(task)

    def _again(self, entry: Entry) -> bool:
        self._tries[entry.id] += 1
        return self._tries[entry.id] < TRIES and not self.stopped

    def _ended(self, entry: Entry, outcome: Outcome, progress: BatchProgress) -> None:
        if outcome.fate != "done":
            if FULL in outcome.error:
                self.stopped = f"{self.folder}: {FULL.lower()}; make room and go on with --resume"
            self._fail(entry, outcome.error, progress)
            return
        if self._write(entry, "done", outcome.value):
            progress.done, progress.made = progress.done + 1, progress.made + 1
            progress.room, progress.error = entry.id, ""

    def _fail(self, entry: Entry, error: str, progress: BatchProgress) -> None:
        if self._write(entry, "failed", {"error": error[:2000]}):
            progress.failed += 1
            progress.room, progress.error = entry.id, error

    def _write(self, entry: Entry, state: str, found: dict[str, Any]) -> bool:
        try:
            self.journal.append({"room": entry.id, "state": state, "when": round(time.time(), 3), **found})
        except OSError as error:
            self.stopped = f"{self.journal.path}: {(error.strerror or str(error)).lower()}; go on with --resume"
            return False
        return True

    def _job(self, entry: Entry) -> work.Job:
        options = self.plan.options[entry.options]
        folder, store = str(entry.folder(self.folder)), str(inside(self.folder, STORE, f"{self.folder}: the run"))
        return work.Job(
            entry.id, folder, entry.seed, options, self.plan.graphs.get(entry.graph, ""), entry.draw,
            "" if options.self_contained else store, outside=self.how.outside,
        )  # fmt: skip
