"""Who is told how far a long piece of work is, and how long each of its stages took."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

StepListener = Callable[[int, int], None]  # (steps done, steps)
StageListener = Callable[[str, int, int], None]  # (stage, done, total)


def part_of(progress: StepListener | None, attempt: int, tries: int) -> StepListener | None:
    """Progress of one of several draws as progress of all."""
    return progress and (lambda done, steps: progress(attempt * steps + done, tries * steps))


@dataclass
class StageTimer:
    """Measures the stages of one run and tells a listener how far each is."""

    listener: StageListener | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str, total: int = 1) -> Iterator[StepListener]:
        """Time a stage; what it yields takes (done, total)."""
        started = time.perf_counter()
        self.tell(name, 0, total)
        yield lambda done, of: self.tell(name, done, of)
        self.tell(name, total, total)
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - started

    def tell(self, name: str, done: int, total: int) -> None:
        """Pass on how far a stage is."""
        if self.listener is not None:
            self.listener(name, done, total)
