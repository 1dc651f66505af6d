"""`echousd.batch`: many rooms from graphs, and `generate_many`, the same in one process without a folder."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echousd.batches.executor import Executor, LocalWorkers
from echousd.batches.journal import Journal, fault_of, read_journals, room_digest, shard_folder, whole_keys
from echousd.batches.options import BatchRequest, as_paths, request_of
from echousd.batches.plan import (
    ELSEWHERE,
    STATE,
    URL,
    Plan,
    difference,
    is_elsewhere,
    load_plan,
    make_plan,
    packed,
    save_plan,
)
from echousd.batches.remote import Remote, complete
from echousd.batches.run import Run, RunOptions
from echousd.batches.work import CPU, network_processes
from echousd.folder.folder import check_writable
from echousd.folder.lock import locked
from echousd.folder.within import inside
from echousd.naming import free_name

if TYPE_CHECKING:
    from echousd.graph import SceneGraph
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
    sources: str | Path | Sequence[str | Path] = (),
    out: str | Path = "batch",
    *,
    sample: Mapping[str, int] | None = None,
    count: int = 1,
    seed: int = 0,
    variations: Mapping[str, Sequence[Any]] | None = None,
    **options: Any,
) -> BatchResult:
    """Make many rooms in one folder, each whole or not at all; a run that was ended is gone on with (`resume=True`).

    The rooms are the same bytes for any number of workers and shards, whatever died on the way.

    Arguments:
        sources: graph files, folders, globs, JSONL or Parquet files with a graph a line.
        out: folder of the run.
        sample: room type -> how many graphs are drawn from the room generator.
        count, seed: rooms of each graph, the first with this seed, the next with one more.
        variations: option -> values, whose combinations a graph's rooms take in turn.
        options: of the rooms, those of `echousd.batches.options.BatchOptions`;
            of the run, fields of `echousd.batches.run.RunOptions`: workers, shard=(i, n), resume, max_failures,
            timeout, until, memory, ray, to, outside, executor, progress.

    Raises ValueError for what is not allowed, a folder in use or with another plan, and says the difference.
    """
    given = [sources] if isinstance(sources, str | Path) else list(sources)
    how = {field.name: options.pop(field.name) for field in fields(RunOptions) if field.name in options}
    raw = {
        "sources": as_paths(given), "sample": dict(sample or {}), "count": count, "seed": seed,
        "options": options, "variations": {key: list(values) for key, values in (variations or {}).items()},
    }  # fmt: skip
    return run_batch(request_of(raw, "batch"), Path(out), RunOptions(**how))


def run_batch(request: BatchRequest, out: Path, how: RunOptions) -> BatchResult:
    """`batch` for a checked request."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out}: is a file, the output must be a folder")
    check_writable(out)
    if URL.match(out.as_posix()) or (how.to and not is_elsewhere(how.to)):
        what = out if URL.match(out.as_posix()) else how.to
        raise ValueError(f"{what}: allowed: -o a folder on a disk, --to {ELSEWHERE}, or none")
    if how.to:
        Remote(how.to).sizes(STATE)  # who cannot reach it is told before the first room
    device = request.options.device
    if not how.ray and how.executor is None:
        network_processes(device)
    plan = _with_libraries(make_plan(request, weights_hash(request.options.weights), how.to, how.outside), how.outside)
    place = shard_folder(out, how.shard)
    with locked(place):
        _agree_on(plan, out, resume=how.resume or how.shard[1] > 1)
        valid = _valid(plan, out, how.shard)
        journal = Journal(place)
        pool = how.executor or _executor(how, len(plan.entries), device)
        seen = out.resolve() if how.ray else out  # workers elsewhere stand in another folder
        run = Run(plan, plan.packs(how.shard), valid, seen, journal, how)
        try:
            end = run.execute(pool)
        finally:
            pool.close()
            journal.close()
    return BatchResult(out, end.total, end.done, end.failed, end.seconds, run.stopped)


def generate_many(
    graphs: Iterable[SceneGraph], *, seed: int = 0, seeds: Sequence[int] | None = None, **options: Any
) -> Iterator[Room]:
    """Rooms of many graphs in one process, as `echousd.batch` of the same graphs makes them.

    Arguments:
        graphs: taken a few at a time. seed: of every room, or `seeds`, one each.
        options: those of `RoomOptions`.

    Raises ValueError for the first graph that no room can be made of.
    """
    from echomodel.loading import load_model
    from echousd.batches.work import Job, generated, layouts

    request = request_of({"sources": ["graphs"], "options": options}, "generate_many")
    asked = request.options
    load_model(asked.weights, device=asked.device)
    number = 0
    for pack in packed(graphs):
        own = [seed if seeds is None else seeds[number + k] for k in range(len(pack))]
        jobs = [Job("", "", s, asked, graph.to_json()) for s, graph in zip(own, pack, strict=True)]
        for k, found in enumerate(layouts(jobs)):
            if found.error:
                raise ValueError(f"graph {number + k}: {found.error}")
            yield generated(replace(jobs[k], text=found.text, first=found.first), here=True)
        number += len(pack)


def _executor(how: RunOptions, rooms: int, device: str) -> Executor:
    if not how.ray:
        workers, networks = max(min(how.workers or cores(), rooms), 1), network_processes(device)
        return LocalWorkers(workers, networks=networks, timeout=how.timeout, memory=how.memory)
    from echousd.batches.cluster import RayCluster

    gpus = 0.0 if device == CPU else 1.0
    return RayCluster(how.ray, workers=how.workers, timeout=how.timeout, memory=how.memory, gpus=gpus)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def weights_hash(weights: str | None) -> str:
    """Short hash of the weights files; raises ValueError where there are none."""
    source = Path(weights) if weights else Path(str(resources.files("echomodel") / "weights"))
    files = sorted(source.rglob("*")) if source.is_dir() else [source]
    found, digest = [path for path in files if path.is_file()], hashlib.sha256()
    if not found:
        raise ValueError(f"{source}: no weights there")
    for path in found:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _with_libraries(plan: Plan, outside: tuple[str, ...]) -> Plan:
    """The plan that knows its libraries by their bytes; raises ValueError for what its rooms would miss."""
    for options in plan.options:
        options.wishes(outside)
        if options.settle:
            from echousd.settle import require_engine

            require_engine()
    found = {path: weights_hash(path) for path in dict.fromkeys(options.assets for options in plan.options) if path}
    return replace(plan, head={**plan.head, "libraries": found}) if found else plan


def _agree_on(plan: Plan, out: Path, *, resume: bool) -> None:
    """Write the plan, or make sure that the one that lies there is the same."""
    if not (out / STATE / "plan.jsonl").is_file():
        others = sorted(entry.name for entry in out.iterdir() if entry.name != STATE)
        if others:
            raise ValueError(f"{out}: holds {', '.join(others[:3])} and no run of echousd batch; choose another folder")
        save_plan(plan, out)
        return
    old = load_plan(out)
    told = difference(old, plan)
    if told:
        raise ValueError(f"{out}: holds a run with another plan ({told}); choose another folder")
    if not resume:
        raise ValueError(f"{out}: holds a run of {len(old.entries)} rooms; go on with it (--resume) or choose another")


def _valid(plan: Plan, out: Path, shard: tuple[int, int]) -> frozenset[str]:
    """Ids of the shard's rooms that are there as the journal says; a damaged one is set aside."""
    if plan.to:
        paths = {entry.id: entry.path for pack in plan.packs(shard) for entry in pack}
        return frozenset(complete(plan.to, read_journals(out), paths))
    rows, stored = read_journals(out), whole_keys(out, mend=True)
    valid = set()
    for entry in (entry for pack in plan.packs(shard) for entry in pack):
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
            folder.rename(aside / free_name(f"{entry.id}_{int(row['when'])}", there))
    return frozenset(valid)
