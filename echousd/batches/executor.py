"""What runs tasks: the protocol, and worker processes of this machine that may die, stall or eat memory."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Protocol

POLL = 0.25  # seconds between two looks at the workers' memory and time
# as many workers as cores: each needs one, and USD need not tell that it was told so
ONE_CORE = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PXR_WORK_THREAD_LIMIT"), "1"
) | {"TF_ENV_SETTING_ALERTS_ENABLED": "0"}


@dataclass(frozen=True)
class Task:
    """A function of `echousd.batches.work` and what it is called with.

    Arguments:
        key: unique in its run; call: the function; given: its one argument.
        network: whether it is the network's, where that has processes of its own.
        rooms: how many it is for; each has the time that one may take.
    """

    key: str
    call: Callable[[Any], Any]
    given: Any
    network: bool = False
    rooms: int = 1


@dataclass(frozen=True)
class Outcome:
    """What became of a task: a value, or an error.

    Arguments:
        fate: `done`, `error` (the function raised), `limit` (killed for its time or memory) or `died`.
    """

    task: Task
    fate: str
    value: Any = None
    error: str = ""


class Executor(Protocol):
    """Runs tasks; local processes and Ray keep it."""

    @property
    def workers(self) -> int:
        """How many rooms are made at once."""
        ...

    def free(self, *, network: bool = False) -> int:
        """How many more tasks are taken now, of the network or others."""
        ...

    @property
    def megabytes(self) -> float:
        """Memory of the workers together, 0 where nobody knows."""
        ...

    def submit(self, task: Task) -> None:
        """Begin a task."""
        ...

    def outcomes(self, seconds: float) -> list[Outcome]:
        """What has ended since, after waiting for at most so long."""
        ...

    def close(self) -> None:
        """End all workers at once; what they were at is lost."""
        ...


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    network: dict[str, str] | None = None  # its environment, if it has a device
    task: Task | None = None
    since: float = 0.0


class LocalWorkers:
    """Processes of this machine, one task at a time each; one that ends early is replaced.

    Arguments:
        workers: how many. timeout: seconds a room may take, None = for ever. memory: MiB that a worker may hold.
        networks: environment of each process that runs the network and nothing else, one a device; none = the workers
            run it, too. Their memory is not limited: it grows with the device's.
    """

    def __init__(
        self,
        workers: int,
        *,
        networks: Sequence[dict[str, str]] = (),
        timeout: float | None = None,
        memory: int | None = None,
    ) -> None:
        self._timeout, self._memory = timeout, memory
        self._context = multiprocessing.get_context("spawn")
        self._workers = [self._start(network) for network in (*[None] * workers, *networks)]

    @property
    def workers(self) -> int:
        """How many rooms are made at once."""
        return len(self._those_for(network=False))

    def free(self, *, network: bool = False) -> int:
        """How many more tasks are taken now, of the network or others."""
        return sum(worker.task is None for worker in self._those_for(network=network))

    @property
    def megabytes(self) -> float:
        """Memory of the workers together."""
        return sum(resident(worker.process.pid) for worker in self._workers)

    @property
    def processes(self) -> list[int]:
        """Process ids of the workers."""
        return [worker.process.pid for worker in self._workers]

    def submit(self, task: Task) -> None:
        """Give a task to an idle worker."""
        worker = next(worker for worker in self._those_for(network=task.network) if worker.task is None)
        worker.task, worker.since = task, time.monotonic()
        with contextlib.suppress(OSError):  # it is dead; `outcomes` will see that
            worker.pipe.send((task.call, task.given))

    def outcomes(self, seconds: float) -> list[Outcome]:
        """What has ended since, after waiting for at most so long; workers beyond a limit are killed."""
        found: list[Outcome] = []
        until = time.monotonic() + seconds
        while not found:
            left = min(POLL, max(until - time.monotonic(), 0.0))
            wait([worker.pipe for worker in self._workers if worker.task is not None] or [], left)
            if all(worker.task is None for worker in self._workers):
                time.sleep(left)
            for number, worker in enumerate(self._workers):
                outcome = self._look(worker)
                if outcome is None:
                    continue
                found.append(outcome)
                worker.task = None
                if outcome.fate in ("limit", "died"):
                    self._workers[number] = self._start(worker.network)
            if time.monotonic() >= until:
                break
        return found

    def close(self) -> None:
        """Kill all workers; rooms appear whole or not at all, so that nothing half-written is left."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            worker.process.join(5)
            worker.pipe.close()

    def _look(self, worker: _Worker) -> Outcome | None:
        if worker.task is None:
            return None
        try:
            if worker.pipe.poll():
                fate, value = worker.pipe.recv()
                return Outcome(worker.task, fate, value) if fate == "done" else Outcome(worker.task, fate, error=value)
        except (EOFError, OSError):
            worker.process.join(5)
            return Outcome(worker.task, "died", error=_ending(worker.process.exitcode))
        if not worker.process.is_alive():
            return Outcome(worker.task, "died", error=_ending(worker.process.exitcode))
        error = ""
        if self._timeout is not None and time.monotonic() - worker.since > self._timeout * worker.task.rooms:
            error = f"took longer than {self._timeout:g} s"
        elif (
            self._memory is not None
            and worker.network is None
            and (held := resident(worker.process.pid)) > self._memory
        ):
            error = f"held {held:.0f} MiB of memory, allowed: {self._memory} MiB"
        if not error:
            return None
        worker.process.kill()
        worker.process.join(5)
        return Outcome(worker.task, "limit", error=error)

    def _those_for(self, *, network: bool) -> list[_Worker]:
        own = [worker for worker in self._workers if worker.network is not None]
        return own if own and network else [worker for worker in self._workers if worker.network is None]

    def _start(self, network: dict[str, str] | None = None) -> _Worker:
        mine, its = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(its, os.getpid()), daemon=True)
        own = ONE_CORE | (network or {})
        before = {name: os.environ.get(name) for name in own}
        os.environ.update(own)
        try:
            process.start()
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
        its.close()
        return _Worker(process, mine, network)


def attempt(call: Callable[[Any], Any], given: Any) -> tuple[str, Any]:
    """`done` and the value, or `error` and one line."""
    try:
        return "done", call(given)
    except ValueError as error:
        return "error", str(error)
    except MemoryError:
        return "error", "no memory left"
    except Exception as error:  # a fault of ours costs one room, not the night
        return "error", f"unexpected {type(error).__name__}: {error}"


def _serve(pipe: Connection, parent: int) -> None:
    """A worker's life: tasks from the pipe until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    _die_with(parent)
    with contextlib.suppress(EOFError, OSError):
        while True:
            call, given = pipe.recv()
            pipe.send(attempt(call, given))


def _die_with(parent: int) -> None:
    """Have the system end this process with its parent (Linux); elsewhere the closed pipe does, after the task."""
    if sys.platform == "linux":
        import ctypes

        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(1)


def resident(process: int | None) -> float:
    """MiB that a process holds, 0 where the system does not tell."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
    except (OSError, ValueError, IndexError):
        return 0.0


def _ending(code: int | None) -> str:
    if code is not None and code < 0:
        return f"the worker was killed (signal {-code})"
    return f"the worker ended (exit code {code})"
