"""One writer per room folder: a lock file that names its owner and that dies with the owner's process (no pxr here)."""

import contextlib
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, SoftFileLock, Timeout

from echomodel.files import telling

LOCK = ".echousd.lock"
POLL = 0.05  # seconds between two tries of one who waits
SHORT = 100  # characters of a lock file that are told

_runs: dict[str, str] = {}  # folder -> for what this process has it


@contextmanager
def locked(folder: Path, *, wait: bool = False, run: str = "") -> Iterator[bool]:
    """Keep all other writers out of `folder` inside the block; the same thread may enter again.

    The folder is created if need be, and disappears again if the block left it empty.

    Arguments:
        folder: the room's folder.
        wait: until the other writer is done, else raise at once.
        run: what for, see `run_of`; whoever enters again goes on with the same.

    Yields whether this block is the outermost.

    Raises ValueError that names the other writer, or says why nothing can be written.
    """
    key, created, lock = os.path.realpath(folder), _create(folder), None
    try:
        while (lock := _take(folder)) is None:
            if not wait:
                raise ValueError(f"{folder}: {owner_of(folder)} is writing it; try later, or wait for it (--wait)")
            time.sleep(POLL)
            created += _create(folder)  # the other writer may have removed it with the last of its files
        outermost = lock.lock_counter == 1
        _runs.setdefault(key, run)
        yield outermost
    finally:
        if lock is not None:
            try:
                if lock.lock_counter == 1:
                    _runs.pop(key, None)
                    (folder / LOCK).unlink(missing_ok=True)  # before it is let go, so that nobody else's is removed
            finally:
                lock.release()
        for place in created:
            with contextlib.suppress(OSError):  # not empty, or somebody else's by now
                place.rmdir()


def run_of(folder: Path) -> str:
    """What this process has the folder for, "" where nobody said."""
    return _runs.get(os.path.realpath(folder), "")


def owner_of(folder: Path) -> str:
    """`process 123 on host (since 09:41:07)` as the lock of the folder says, or `another process`."""
    try:
        with (folder / LOCK).open(encoding="ascii", errors="replace") as file:
            words = file.read(SHORT)
    except OSError:
        return "another process"
    return words if words.startswith("process ") and words.isascii() and words.isprintable() else "another process"


def _create(folder: Path) -> list[Path]:
    """Create the folder and return what was created, innermost first."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    with telling(folder, then="; nothing was changed"):
        folder.mkdir(parents=True, exist_ok=True)
    return missing


def _take(folder: Path) -> FileLock | None:
    """The lock of a folder, taken, or None while somebody else has it."""
    path = folder / LOCK
    if path.is_symlink():
        raise ValueError(f"{path}: is a link; remove it, the lock is a file of the folder itself")
    if path.exists() and not path.is_file():
        raise ValueError(f"{path}: is no plain file; remove it")
    lock = FileLock(os.path.realpath(path), timeout=0, is_singleton=True)  # one a thread, which counts its own blocks
    with telling(folder, then="; nothing was changed"):
        try:
            lock.acquire()
        except (Timeout, FileNotFoundError):  # or the folder was removed in between
            return None
    if lock.lock_counter == 1 and not isinstance(lock, SoftFileLock):  # which writes its own owner
        words = f"process {os.getpid()} on {socket.gethostname()[:40]} (since {time.strftime('%H:%M:%S')})"
        with contextlib.suppress(OSError):  # of a full disk, which what comes next meets, too
            path.write_text(words, encoding="ascii", errors="replace")
    return lock
