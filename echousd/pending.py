"""Folders of rooms in which a run was interrupted while it moved its files into place (no pxr here)."""

from collections.abc import Iterable
from pathlib import Path

STAGING = ".echousd"  # folder in a room's where a run keeps what is not in place yet
JOURNAL = "journal.json"  # in it: what goes where
DEEP = 3  # folders from a room's own to that of its deepest layers


def half_written(folder: Path) -> bool:
    """Whether a room's folder holds some files of an old room and some of a new."""
    return (folder / STAGING / JOURNAL).is_file()


def check_written(files: Iterable[Path]) -> None:
    """Raises ValueError where one of the files is in a room's folder that is half-written.

    Arguments:
        files: layers, absolute or from where the process stands.
    """
    for folder in dict.fromkeys(above for file in files for above in file.parents[:DEEP]):
        if half_written(folder):
            raise ValueError(
                f"{folder}: half-written, by a run that was interrupted or has not ended; finish it with "
                f"`echousd edit {folder} --recover` or whatever writes it"
            )
