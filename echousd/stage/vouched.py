"""Files that this process may read itself, as it wrote them or another has read them, by path, size and time."""

import os
from collections.abc import Iterable
from pathlib import Path

read_here: set[tuple[str, int, int]] = set()


def just_written(paths: Iterable[Path]) -> None:
    """Have files that this process has just written taken for harmless."""
    read_here.update(map(stamp_of, paths))


def stamp_of(path: Path) -> tuple[str, int, int]:
    """What tells a file that changed from the same file: path, size and time."""
    found = path.stat()
    return os.path.abspath(path), found.st_size, found.st_mtime_ns  # noqa: PTH100  # with no look at each folder
