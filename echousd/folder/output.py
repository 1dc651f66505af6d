"""Where a room goes, a folder of layers or one flat file: refused before the long work what would be refused after it.

Loads neither pxr nor torch, so that a wrong command line is told at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from echousd.folder.folder import check_writable, claim, held


def check_output(output: Path, *, flat: bool, force: bool) -> None:
    """Refuse before the long work what would be refused after it; raises ValueError."""
    if flat:
        if output.suffix not in (".usda", ".usdc"):
            raise ValueError(f"{output}: with --flat the output is a file that ends in .usda or .usdc")
        if output.exists() and not force:
            raise ValueError(f"{output}: exists; choose another file or use --force")
        return
    if output.suffix in (".usda", ".usdc", ".usd", ".usdz"):
        raise ValueError(f"{output}: the output is a folder; --flat writes one file")
    if output.exists() and not output.is_dir():
        raise ValueError(f"{output}: is a file, the output must be a folder")
    check_writable(output)


@contextmanager
def writing(output: Path, *, flat: bool, force: bool, wait: bool, run: str = "") -> Iterator[bool]:
    """Have the folder for this process alone, from what is read of it to what is written.

    Yields whether the same run was interrupted and has been finished now, see `echousd.folder.folder.held`.
    """
    if flat:
        yield False
        return
    with held(output, wait=wait, run=run) as finished:
        claim(output, force=force)
        yield bool(run) and finished == run
