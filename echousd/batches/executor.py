"""What runs tasks: processes of this machine that may die, stall or eat memory; Ray, whose nodes may be lost."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle, islice
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import ModuleType
from typing import Any

from echomodel.late import extra

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
    """

    key: str
    call: Callable[[Any], Any]
    argument: Any


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


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    environment: dict[str, str]  # which device it has
    task: Task | None = None
    since: float = 0.0


class LocalWorkers:
    """Processes of this machine, one task at a time each; one that ends early is replaced.

    Arguments:
        workers: how many. timeout: seconds a room may take, None = for ever. memory: MiB that a worker may hold.
        devices: environment of each device, which the workers take in turn; none = they have the CPU.
    """

    def __init__(
        self, workers: int, *, devices: Sequence[dict[str, str]] = (), timeout: float | None = None,
        memory: int | None = None,
    ) -> None:  # fmt: skip
        self._timeout, self._memory = timeout, memory
        self._context = multiprocessing.get_context("spawn")
        self._workers = [self._start(one) for one in islice(cycle(devices or [{}]), workers)]

    def free(self) -> int:
        """How many more tasks are taken now."""
        return sum(worker.task is None for worker in self._workers)

    @property
    def megabytes(self) -> float:
        """Memory of the workers together."""
        return sum(resident(worker.process.pid) for worker in self._workers)

    def submit(self, task: Task) -> None:
        """Give a task to an idle worker."""
        worker = next(worker for worker in self._workers if worker.task is None)
        worker.task, worker.since = task, time.monotonic()
        with contextlib.suppress(OSError):  # it is dead; `outcomes` will see that
            worker.pipe.send((task.call, task.argument))

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
                    self._workers[number] = self._start(worker.environment)
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
        error = _beyond(worker.process.pid, worker.since, self._memory, self._timeout)
        if not error:
            return None
        worker.process.kill()
        worker.process.join(5)
        return Outcome(worker.task, "limit", error=error)

    def _start(self, environment: dict[str, str]) -> _Worker:
        mine, its = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(its, os.getpid()), daemon=True)
        own = ONE_CORE | environment
        before = {name: os.environ[name] for name in own if name in os.environ}
        os.environ.update(own)
        try:
            with without_script():
                process.start()
        finally:
            for name in own.keys() - before.keys():
                del os.environ[name]
            os.environ.update(before)
        its.close()
        return _Worker(process, mine, environment)


@contextlib.contextmanager
def without_script() -> Iterator[None]:
    """Have processes begin without the caller's script, which may be on no disk or start them without a guard."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def attempt(call: Callable[[Any], Any], argument: Any) -> tuple[str, Any]:
    """`done` and the value, or `error` and one line."""
    try:
        return "done", call(argument)
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
            call, argument = pipe.recv()
            pipe.send(attempt(call, argument))


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


def _beyond(process: int, since: float, memory: int | None, seconds: float | None) -> str:
    """Which of its limits a process is beyond, MiB and seconds since it began; "" for neither."""
    if seconds is not None and time.monotonic() - since > seconds:
        return f"took longer than {seconds:g} s"
    held = resident(process) if memory is not None else 0.0
    return f"held {held:.0f} MiB of memory, allowed: {memory} MiB" if memory is not None and held > memory else ""


def _ending(code: int | None) -> str:
    if code is not None and code < 0:
        return f"the worker was killed (signal {-code})"
    return f"the worker ended (exit code {code})"


STARTING = 120.0  # seconds that Ray may take to start a worker, who counts its own; then the cluster ends it
DYING = 0.2  # seconds between two looks of a worker at its own memory


class RayCluster:
    """Runs tasks on a Ray cluster; every node must see the run's folder under the same path and have echousd installed.

    Ray itself repeats nothing: a task that is lost with its worker or node is an outcome, and the run begins it again.

    Arguments:
        address: `auto`, the cluster that runs on this machine or a new one, or that of a cluster's head.
        workers: rooms at once, None = as many as the cluster has CPUs.
        timeout, memory: as of `LocalWorkers`; memory is watched by each worker itself.
        gpus: whether the rooms share the cluster's GPUs out; else they are made on CPUs.

    Raises ValueError where Ray is not installed or no cluster answers.
    """

    def __init__(
        self, address: str = "auto", *, workers: int | None = None, timeout: float | None = None,
        memory: int | None = None, gpus: bool = False,
    ) -> None:  # fmt: skip
        self._ray = extra("ray", "--ray needs Ray", "ray")
        self._ours = not self._ray.is_initialized()
        if self._ours:
            self._connect(address, workers)
        self._timeout, self._memory = timeout, memory
        self._slots = workers or max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        there = int(self._ray.cluster_resources().get("GPU", 0))
        if gpus and not there:
            self._leave()
            raise ValueError("device: the Ray cluster has no GPUs, allowed: cpu")
        self._begun: dict[Any, tuple[Task, float]] = {}  # and when it began
        share = min(1.0, there / self._slots) if gpus else 0.0
        self._room = self._ray.remote(num_cpus=1, num_gpus=share, max_retries=0)(watched)

    @property
    def megabytes(self) -> float:
        """0: the workers are elsewhere."""
        return 0.0

    def free(self) -> int:
        """How many more tasks are taken now."""
        return self._slots - len(self._begun)

    def submit(self, task: Task) -> None:
        """Begin a task."""
        reference = self._room.remote(task.call, task.argument, self._memory, self._timeout)
        self._begun[reference] = task, time.monotonic()

    def outcomes(self, seconds: float) -> list[Outcome]:
        """What has ended since, after waiting for at most so long; tasks beyond the time limit are cancelled."""
        found: list[Outcome] = []
        until = time.monotonic() + seconds
        while not found and time.monotonic() < until:
            if not self._begun:
                time.sleep(min(POLL, max(until - time.monotonic(), 0.0)))
                continue
            waiting = list(self._begun)
            ready, _ = self._ray.wait(waiting, num_returns=1, timeout=min(POLL, max(until - time.monotonic(), 0.0)))
            more, _ = self._ray.wait(waiting, num_returns=len(waiting), timeout=0) if ready else ([], None)
            for reference in more:
                task, _ = self._begun.pop(reference)
                found.append(self._ended(reference, task))
            found += self._overdue()
        return found

    def close(self) -> None:
        """End all that was begun, and the cluster where it is ours alone."""
        for reference in self._begun:
            with contextlib.suppress(self._ray.exceptions.RayError, ValueError):
                self._ray.cancel(reference, force=True)
        self._begun.clear()
        self._leave()

    def _leave(self) -> None:
        if self._ours:
            self._ray.shutdown()

    def _connect(self, address: str, workers: int | None) -> None:
        quiet = {"log_to_driver": False, "logging_level": "warning"}
        for name in ("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "RAY_SCHEDULER_EVENTS"):  # what a run says itself
            os.environ.setdefault(name, "0")
        try:
            self._ray.init(address=address, **quiet)
        except ConnectionError as error:
            if address != "auto":
                raise ValueError(f"--ray is {address!r}, where no cluster answers ({error})") from None
            self._ray.init(num_cpus=workers, include_dashboard=False, **quiet)

    def _ended(self, reference: Any, task: Task) -> Outcome:
        errors = self._ray.exceptions
        try:
            fate, value = self._ray.get(reference)
        except errors.OutOfMemoryError:
            return Outcome(task, "limit", error="the node had no memory left")
        except errors.TaskCancelledError:
            return Outcome(task, "died", error="the task was cancelled")
        except errors.RayError as error:
            return Outcome(task, "died", error=f"the worker was lost ({type(error).__name__})")
        return Outcome(task, fate, value) if fate == "done" else Outcome(task, fate, error=value)

    def _overdue(self) -> list[Outcome]:
        found = []
        for reference, (task, since) in list(self._begun.items()):
            if self._timeout is None or time.monotonic() - since <= self._timeout + STARTING:
                continue
            del self._begun[reference]
            self._ray.cancel(reference, force=True)
            found.append(Outcome(task, "limit", error=f"took longer than {self._timeout:g} s"))
        return found


def watched(call: Any, argument: Any, memory: int | None, seconds: float | None = None) -> tuple[str, Any]:
    """`attempt`, given up as soon as the process holds more than so many MiB or takes longer than so many seconds."""
    began = time.monotonic()
    done = threading.Event()
    found: list[tuple[str, Any]] = []

    def work() -> None:
        found.append(attempt(call, argument))
        done.set()

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    while not done.wait(DYING):
        if limit := _beyond(os.getpid(), began, memory, seconds):
            threading.Timer(1.0, os._exit, (1,)).start()  # after this answer is on its way: the thread cannot be ended
            return "limit", limit
    return found[0]


Executor = LocalWorkers | RayCluster
