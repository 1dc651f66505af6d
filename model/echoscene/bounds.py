"""Box statistics of the published data: the bounds file that normalises sizes and positions (SPEC: section 2)."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

from echomodel.boxes import BoxStatistics


def statistics_from_bounds(bounds: Sequence[float]) -> BoxStatistics:
    """Fourteen numbers, lowest and highest size (3 + 3, metres), position (3 + 3, metres) and angle (unused).

    Raises:
        ValueError: not fourteen finite numbers, or a highest that is not above its lowest.
    """
    numbers = [float(v) for v in bounds]
    if len(numbers) != 14 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"box bounds: {len(numbers)} numbers, expected 14 finite ones")
    low, high, start, stop = (tuple(numbers[i : i + 3]) for i in (0, 3, 6, 9))
    return BoxStatistics(low, high, start, stop, log_size=False)


def read_bounds(path: str | os.PathLike[str]) -> BoxStatistics:
    """Read a `centered_bounds_*_trainval.txt` file; raises ValueError naming the file."""
    try:
        return statistics_from_bounds([float(word) for word in Path(path).read_text("utf-8").split()])
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
