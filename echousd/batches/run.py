"""A run: the plan's packs through the network, the rooms through the workers, a line in the journal for each."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from echousd.batches import work
from echousd.batches.executor import Executor, Outcome, Task
from echousd.batches.journal import Journal
from echousd.batches.plan import PACK, STORE, Entry, Plan
from echousd.folder.within import inside

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
        to: URL of a file system of fsspec that rooms and store go to, "" = the run's folder, which keeps the rest.
        outside: folders besides those of the graphs and of the index in which models may lie.
        executor: runs the tasks in place of either.
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
    to: str = ""
    outside: tuple[str, ...] = ()
    executor: Executor | None = None
    progress: Callable[[BatchProgress], None] | None = None

    def __post_init__(self) -> None:
        part, parts = self.shard
        if not 0 <= part < parts:
            raise ValueError(f"shard is {part}/{parts}, allowed: i/n with i from 0 to n - 1")


@dataclass
class Run:
    """One shard of a plan on an executor.

    Arguments:
        plan, packs: what there is to do; skip: ids of the rooms that are complete and valid.
        folder: of the run. journal: of the shard. how: when it stops, and who is told.
    """

    plan: Plan
    packs: list[tuple[Entry, ...]]
    skip: frozenset[str]
    folder: Path
    journal: Journal
    how: RunOptions
    stopped: str = ""
    _ready: deque[tuple[Entry, work.Job]] = field(default_factory=deque)
    _wanted: deque[tuple[Entry, work.Job, work.Wanted]] = field(default_factory=deque)
    _tries: dict[str, int] = field(default_factory=dict)
    _asked: dict[str, Any] = field(default_factory=dict)

    def execute(self, executor: Executor) -> BatchProgress:
        """Do all that is left, until it is done or something stops the run; `stopped` says what."""
        began = time.monotonic()
        progress = BatchProgress(sum(map(len, self.packs)), done=len(self.skip))
        waiting = deque(pack for pack in self.packs if any(entry.id not in self.skip for entry in pack))
        layouts_out = 0
        while waiting or self._ready or self._asked or self._wanted:
            self._check_stop(progress)
            while not self.stopped:
                soon = len(self._ready) + PACK * layouts_out
                early = waiting and (soon < 2 * executor.workers or not self._ready)  # no worker waits for another's
                if self._wanted and executor.free(network=True):
                    entry, job, wanted = self._wanted.popleft()
                    key = f"samples {len(job.answers)} {entry.id}"
                    self._submit(executor, Task(key, work.samples, (job, wanted), network=True), entry)
                elif early and executor.free(network=True):
                    layouts_out += self._submit_layouts(executor, waiting.popleft(), progress)
                elif self._ready and executor.free():
                    entry, job = self._ready.popleft()
                    self._submit(executor, Task(f"room {entry.id}", work.room, job), entry)
                else:
                    break
            if self.stopped and not self._asked:
                break
            for outcome in executor.outcomes(1.0):
                asked = self._asked.pop(outcome.task.key)
                if outcome.fate == "died" and self._again(outcome.task.key):
                    self._submit(executor, outcome.task, asked)
                elif isinstance(asked, Entry):
                    self._ended(asked, outcome, progress)
                else:
                    layouts_out -= 1
                    self._drawn(asked, outcome, progress)
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

    def _submit_layouts(self, executor: Executor, pack: tuple[Entry, ...], progress: BatchProgress) -> int:
        """Begin a pack's layouts, of all its rooms, as what is sampled together is part of the plan."""
        good = tuple(entry for entry in pack if not entry.error)
        for entry in pack:
            if entry.error and entry.id not in self.skip:
                self._fail(entry, entry.error, progress)
        if all(entry.id in self.skip for entry in good):
            return 0
        jobs = [self._job(entry) for entry in good]
        task = Task(f"layouts {pack[0].number}", work.layouts, jobs, network=True, rooms=len(jobs))
        self._submit(executor, task, good)
        return 1

    def _submit(self, executor: Executor, task: Task, asked: Any) -> None:
        self._asked[task.key] = asked
        executor.submit(task)

    def _again(self, key: str) -> bool:
        self._tries[key] = self._tries.get(key, 1) + 1
        return self._tries[key] <= TRIES and not self.stopped

    def _drawn(self, pack: tuple[Entry, ...], outcome: Outcome, progress: BatchProgress) -> None:
        """Rooms whose first drafts were sampled are ready; if the pack was too much for a worker, each is alone."""
        found = outcome.value if outcome.fate == "done" else [work.Sampled()] * len(pack)
        for entry, sampled in zip(pack, found, strict=True):
            if entry.id in self.skip:
                continue
            if sampled.error:
                self._fail(entry, sampled.error, progress)
                continue
            self._ready.append((entry, self._job(entry, sampled.text, sampled.first)))

    def _ended(self, entry: Entry, outcome: Outcome, progress: BatchProgress) -> None:
        if isinstance(outcome.value, work.Wanted):
            self._wanted.append((entry, outcome.task.given, outcome.value))
            return
        if outcome.fate == "done" and isinstance(outcome.value, bytes):
            job = outcome.task.given[0]
            self._ready.appendleft((entry, replace(job, answers=(*job.answers, outcome.value))))
            return
        if outcome.fate != "done":
            if FULL in outcome.error:
                self.stopped = f"{self.folder}: {FULL.lower()}; make room and go on with --resume"
            self._fail(entry, outcome.error, progress)
            return
        row = {"room": entry.id, "state": "done", "when": round(time.time(), 3), **outcome.value}
        if self._write(row):
            progress.done, progress.made = progress.done + 1, progress.made + 1
            progress.room, progress.error = entry.id, ""

    def _fail(self, entry: Entry, error: str, progress: BatchProgress) -> None:
        row = {"room": entry.id, "state": "failed", "when": round(time.time(), 3), "error": error[:2000]}
        if self._write(row):
            progress.failed += 1
            progress.room, progress.error = entry.id, error

    def _write(self, row: dict[str, Any]) -> bool:
        try:
            self.journal.append(row)
        except OSError as error:
            self.stopped = f"{self.journal.path}: {(error.strerror or str(error)).lower()}; go on with --resume"
            return False
        return True

    def _job(self, entry: Entry, text: str = "", first: work.Rows | None = None) -> work.Job:
        options = self.plan.options[entry.options]
        folder, store = str(entry.folder(self.folder)), str(inside(self.folder, STORE, f"{self.folder}: the run"))
        if self.plan.to:
            folder, store = entry.path, STORE
        return work.Job(
            entry.id, folder, entry.seed, options, text or self.plan.graphs.get(entry.graph, ""), entry.draw, first,
            "" if options.self_contained else store, to=self.plan.to, outside=self.how.outside,
        )  # fmt: skip
