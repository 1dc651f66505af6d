"""Who is told how far a long piece of work is."""

from __future__ import annotations

from collections.abc import Callable

StepListener = Callable[[int, int], None]  # (steps done, steps)
StageListener = Callable[[str, int, int], None]  # (stage, done, total)


def part_of(progress: StepListener | None, attempt: int, tries: int) -> StepListener | None:
    """Progress of one of several draws as progress of all."""
    if progress is None:
        return None
    return lambda done, steps: progress(attempt * steps + done, tries * steps)
