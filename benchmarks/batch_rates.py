"""Rooms a second of a batch, against single warm `generate` calls and against the network's own time.

    OMP_NUM_THREADS=1 PXR_WORK_THREAD_LIMIT=1 python benchmarks/batch_rates.py [--rooms 32] [--shapes boxes] [--preview]
    OMP_NUM_THREADS=1 PXR_WORK_THREAD_LIMIT=1 python benchmarks/batch_rates.py --memory --rooms 500
    OMP_NUM_THREADS=1 PXR_WORK_THREAD_LIMIT=1 python benchmarks/batch_rates.py --store --shapes parts --rooms 100

Wanted: per room at least 2.5 times the single calls on boxes and 1.5 times with shapes (two workers, two cores), at
least 1.8 times from one worker to two, and at most 1.5 times the network's and the placing's own time. CPU seconds a
room are printed beside: a busy machine changes those least. `--memory`: what one worker holds while it makes the rooms.
`--paper`: one and two workers on a clock of their own, which only the CPU seconds of every task move. `--store`: what
rooms of all types cost and take beside a store, and would take alone.
"""

from __future__ import annotations

import argparse
import heapq
import json
import resource
import tempfile
import time
from collections.abc import Callable
from multiprocessing import active_children
from pathlib import Path
from typing import Any

from echomodel.echo import EchoModel
from echousd.batches import work
from echousd.batches.batch import BatchProgress, Run, RunOptions, weights_hash
from echousd.batches.executor import LocalWorkers, Outcome, Task, attempt
from echousd.batches.options import BatchRequest, request_of
from echousd.batches.plan import Journal, make_plan, save_plan, shard_folder
from echousd.make import layouts as layouts_module
from echousd.store import Store


def cpu() -> float:
    """CPU seconds of this process and of its children that have ended."""
    own, ended = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + ended.ru_utime + ended.ru_stime


def one_by_one(request: BatchRequest, folder: Path) -> tuple[float, float]:
    """Wall and CPU seconds of single warm calls, each judged and hashed as a batch does."""
    plan = make_plan(request, "")
    jobs = [
        work.Job(e.id, str(folder / e.path), e.seed, plan.options[0], draw=e.draw) for e in plan.entries
    ]  # no boxes: each is sampled alone
    work.room(jobs[0])
    wall, used = time.perf_counter(), cpu()
    for job in jobs[1:]:
        work.room(job)
    return (time.perf_counter() - wall) / (len(jobs) - 1), (cpu() - used) / (len(jobs) - 1)


def network(request: BatchRequest, folder: Path) -> tuple[float, float, float, float]:
    """CPU seconds a room in one process: of the layout branch, of the other branches, of placing, of everything."""
    plan, spent = make_plan(request, ""), {"layouts": 0.0, "shapes": 0.0, "placing": 0.0}

    def timed(method: Callable[..., Any], part: str) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            began = time.process_time()
            try:
                return method(*given, **more)
            finally:
                spent[part] += time.process_time() - began

        return call

    parts = {"sample_layout": "layouts", "sample_shapes": "shapes", "sample_furniture": "shapes"}
    for name, part in parts.items():
        setattr(EchoModel, name, timed(getattr(EchoModel, name), part))
    layouts_module.finished_boxes = timed(layouts_module.finished_boxes, "placing")
    began, store, count = time.process_time(), str(folder / "store"), len(plan.entries)
    for e in plan.entries:
        work.room(work.Job(e.id, str(folder / e.path), e.seed, plan.options[0], draw=e.draw, store=store))
    return (*(seconds / count for seconds in spent.values()), (time.process_time() - began) / count)


def stored(request: BatchRequest, folder: Path) -> None:
    """Print CPU seconds and bytes a room after 10, 20, 50 and 100 of the rooms: alone, and beside a store with it."""
    plan, alone, own = make_plan(request, ""), 0, 0
    store, began = folder / "store", time.process_time()
    for done, entry in enumerate(plan.entries, 1):
        place = folder / entry.path
        work.room(work.Job(entry.id, str(place), entry.seed, plan.options[0], draw=entry.draw, store=str(store)))
        files = [path.stat().st_size for path in place.rglob("*") if path.is_file()]
        told = json.loads(next(place.glob("*.json")).read_text())
        taken = {key: sum(_sizes(Store.create(store).folder(key))) for key in {*told["stored"].values()}}
        own, alone = own + sum(files), alone + sum(files) + sum(taken.values())
        if done in (10, 20, 50, 100, len(plan.entries)):
            held, cpu = sum(_sizes(store)), (time.process_time() - began) / done
            print(
                f"{done:4d} rooms  CPU {cpu:.2f} s a room; kB a room: alone {alone / done / 1000:.0f}, "
                f"own {own / done / 1000:.0f}, with the store {(own + held) / done / 1000:.0f}: "
                f"1/{alone / (own + held):.1f}",
                flush=True,
            )


def _sizes(place: Path) -> list[int]:
    files = [place] if place.is_file() else [path for path in place.rglob("*") if path.is_file()]
    return [path.stat().st_size for path in files]


def memory(request: BatchRequest, folder: Path) -> None:
    """Print what one worker holds after every tenth of the rooms."""
    plan = make_plan(request, weights_hash(""))
    folder.mkdir()
    save_plan(plan, folder)
    pool, journal = LocalWorkers(1), Journal(shard_folder(folder, (0, 1)))
    step, told = max(1, len(plan.entries) // 10), {0}

    def tell(progress: BatchProgress) -> None:
        if progress.done % step == 0 and progress.done not in told:
            told.add(progress.done)
            print(f"{progress.done:6d} rooms  {progress.megabytes:6.0f} MiB, {progress.failed} failed", flush=True)

    Run(plan, plan.entries, frozenset(), folder, journal, RunOptions(progress=tell)).execute(pool)
    pool.close()


class Paper:
    """Workers that are idle but for the run: a task ends when its CPU seconds are over, on their own clock.

    Arguments:
        seen: key of a task and how often it was asked for -> what it gave and its CPU seconds, filled by the first run.
    """

    megabytes = 0.0

    def __init__(self, workers: int, seen: dict[tuple[str, int], tuple[tuple[str, Any], float]]) -> None:
        self.workers, self._seen = workers, seen
        self.now, self._times, self._busy = 0.0, dict[str, int](), list[tuple[float, int, Task, tuple[str, Any]]]()

    def free(self) -> int:
        return self.workers - len(self._busy)

    def submit(self, task: Task) -> None:
        self._times[task.key] = self._times.get(task.key, 0) + 1
        key = (task.key, self._times[task.key])
        if key not in self._seen:
            began = time.process_time()
            found = attempt(task.call, task.argument)
            self._seen[key] = found, time.process_time() - began
        found, seconds = self._seen[key]
        heapq.heappush(self._busy, (self.now + seconds, sum(self._times.values()), task, found))

    def outcomes(self, seconds: float) -> list[Outcome]:
        self.now, _, task, (fate, value) = heapq.heappop(self._busy)
        return [Outcome(task, fate, value) if fate == "done" else Outcome(task, fate, error=value)]

    def close(self) -> None:
        """Nothing to end."""


def on_paper(request: BatchRequest, folder: Path) -> None:
    """Print how long one and two workers would take."""
    plan, alone = make_plan(request, weights_hash("")), 0.0
    seen: dict[tuple[str, int], tuple[tuple[str, Any], float]] = {}
    folder.mkdir()
    work.room(work.Job("warm", str(folder / "warm"), 0, plan.options[0], draw=("bedroom", 9, 0)))
    for workers in (1, 2):
        pool, journal = Paper(workers, seen), Journal(shard_folder(folder / str(workers), (0, 1)))
        Run(plan, plan.entries, frozenset(), folder, journal, RunOptions()).execute(pool)
        alone = alone or pool.now
        print(f"{workers} workers  {pool.now:6.1f} s on paper: {alone / pool.now:.2f} times one", flush=True)


def together(request: BatchRequest, folder: Path, workers: int) -> tuple[float, float]:
    """Wall seconds a room with warm workers, and CPU seconds a room without their start."""
    plan = make_plan(request, weights_hash(""))
    folder.mkdir()
    save_plan(plan, folder)
    pool, journal = LocalWorkers(workers), Journal(shard_folder(folder, (0, 1)))
    warm = [
        work.Job("warm", str(folder / f"warm_{k}"), 0, plan.options[0], draw=("bedroom", 9, k)) for k in range(workers)
    ]

    for job in warm:
        pool.submit(Task(job.folder, work.room, job))
    ended = 0
    while ended < workers:
        ended += len(pool.outcomes(1.0))
    begun = sum(_cpu_of(process.pid) for process in active_children())
    wall = time.perf_counter()
    Run(plan, plan.entries, frozenset(), folder, journal, RunOptions()).execute(pool)
    wall = time.perf_counter() - wall
    used = sum(_cpu_of(process.pid) for process in active_children()) - begun
    pool.close()
    return wall / len(plan.entries), used / len(plan.entries)


def _cpu_of(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=16)
    parser.add_argument("--shapes", default="boxes")
    parser.add_argument("--preview", action="store_true")
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--paper", action="store_true")
    parser.add_argument("--store", action="store_true")
    parser.add_argument("--drafts", type=int, default=None)
    options = parser.parse_args()
    raw = {"shapes": options.shapes, "preview": options.preview, "drafts": options.drafts}
    kinds = ("bedroom", "living_room", "dining_room", "study", "living_dining_room") if options.store else ("bedroom",)
    sample = {kind: -(-options.rooms // len(kinds)) for kind in kinds}
    request = request_of({"sample": sample, "options": raw}, "benchmark")
    with tempfile.TemporaryDirectory() as scratch:
        if options.memory:
            memory(request, Path(scratch) / "memory")
            return
        if options.store:
            stored(request, Path(scratch))
            return
        if options.paper:
            on_paper(request, Path(scratch) / "paper")
            return
        single = one_by_one(request, Path(scratch) / "single")
        print(f"single     {single[0]:6.2f} s a room, CPU {single[1]:6.2f} s", flush=True)
        layouts, others, placing, all_of_it = network(request, Path(scratch) / "network")
        print(
            f"network    CPU {layouts:6.2f} s a room for layouts, {others:.2f} s for shapes, {placing:.2f} s for "
            f"placing, {all_of_it:.2f} s with all else: {all_of_it / (layouts + others):.2f} times the network, "
            f"{all_of_it / (layouts + others + placing):.2f} times network and placing",
            flush=True,
        )
        for workers in (1, 2):
            many = together(request, Path(scratch) / f"many_{workers}", workers)
            print(
                f"{workers} workers  {many[0]:6.2f} s a room, CPU {many[1]:6.2f} s: "
                f"{single[0] / many[0]:.2f} times the single calls, {single[1] / many[1]:.2f} times by CPU",
                flush=True,
            )


if __name__ == "__main__":
    main()
