"""One writer per room folder: a lock file that names its owner and that dies with the owner's process (no pxr here)."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import stat
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from echomodel.files import alive

try:
    import fcntl
except ImportError:  # no such locks on this system: the owner that the file names decides
    fcntl = None  # type: ignore[assignment]

LOCK = ".echousd.lock"
POLL = 0.05  # seconds between two tries of one who waits
FORGOTTEN = 24 * 3600  # seconds after which the lock of another host is nobody's
SHORT = 4096  # bytes of a lock file that are read

_held: dict[str, tuple[int, int, str]] = {}  # folder -> (thread, how often, for what)
_guard = threading.Lock()


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
    key, thread = os.path.realpath(folder), threading.get_ident()
    with _guard:
        owner, times, first = _held.get(key, (thread, 0, run))
        if times and owner == thread:
            _held[key] = (thread, times + 1, first)
    if times and owner == thread:
        try:
            yield False
        finally:
            with _guard:
                _held[key] = (thread, _held[key][1] - 1, first)
        return
    created = _create(folder)
    file = None
    try:
        while file is None:
            file = _take(folder)
            if file is None and not wait:
                raise ValueError(
                    f"{folder}: {owner_of(folder)} is writing it; try later, wait for it (--wait), or delete "
                    f"{LOCK} in it if that process is gone"
                )
            if file is None:
                time.sleep(POLL)
                created += _create(folder)  # the other writer may have removed it with the last of its files
        with _guard:
            _held[key] = (thread, 1, run)
        yield True
    finally:
        if file is not None:
            with _guard:
                _held.pop(key, None)
            try:
                (folder / LOCK).unlink(missing_ok=True)  # before it is let go, so that nobody else's is removed
            finally:
                os.close(file)
        for place in created:
            with contextlib.suppress(OSError):  # not empty, or somebody else's by now
                place.rmdir()


def run_of(folder: Path) -> str:
    """What this process has the folder for, "" where nobody said."""
    with _guard:
        return _held.get(os.path.realpath(folder), (0, 0, ""))[2]


def owner_of(folder: Path) -> str:
    """`process 123 on host` as the lock of the folder says, or `another process`."""
    found = _read(folder / LOCK)
    if not found:
        return "another process"
    since = time.strftime("%H:%M:%S", time.localtime(found["since"]))
    return f"process {found['process']} on {found['host']} (since {since})"


def _create(folder: Path) -> list[Path]:
    """Create the folder and return what was created, innermost first."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); nothing was changed") from None
    return missing


def _take(folder: Path) -> int | None:
    """The open lock file, or None while somebody else has it."""
    path = folder / LOCK
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
    except FileNotFoundError:  # the folder was removed in between
        return None
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise ValueError(f"{path}: is a link; remove it, the lock is a file of the folder itself") from None
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); nothing was changed") from None
    try:
        if not stat.S_ISREG(os.fstat(file).st_mode):
            raise ValueError(f"{path}: is no plain file; remove it")
        sure = _flock(file)
        if sure is not False and _same(file, path) and _is_free(path, sure is None):
            me = {"process": os.getpid(), "host": _host(), "since": round(time.time(), 3)}
            os.ftruncate(file, 0)
            os.write(file, json.dumps(me).encode())
            return file
    except OSError as error:
        os.close(file)
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); nothing was changed") from None
    except BaseException:  # Ctrl-C, too
        os.close(file)
        raise
    os.close(file)
    return None


def _flock(file: int) -> bool | None:
    """Whether the system's lock was had; None on a system or a disk that knows none."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK):
            return False
        if error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS):
            return None
        raise
    return True


def _same(file: int, path: Path) -> bool:
    """Whether the locked file still lies there; the last owner removes its own."""
    try:
        there, mine = path.lstat(), os.fstat(file)
    except FileNotFoundError:
        return False
    return (there.st_dev, there.st_ino) == (mine.st_dev, mine.st_ino)


def _is_free(path: Path, unsure: bool) -> bool:
    """Whether the owner that the file names is gone; what cannot be read names nobody.

    The lock of a dead process is free at once on its own host. Another host may not see this host's locks.
    """
    found = _read(path)
    if not found:
        return True
    if found["host"] != _host():
        return not 0 <= time.time() - found["since"] <= FORGOTTEN
    return not unsure or found["process"] == os.getpid() or not alive(found["process"])


def _host() -> str:
    return _plain(socket.gethostname())


def _plain(word: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "-._") else "_" for c in word[:100])


def _read(path: Path) -> dict | None:
    try:
        with path.open("rb") as file:
            found = json.loads(file.read(SHORT))
        process, host, since = found["process"], found["host"], float(found["since"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError, OverflowError):
        return None
    if type(process) is not int or not 0 < process < 2**31 or not isinstance(host, str) or not 0 < since < 2**32:
        return None
    return {"process": process, "host": _plain(host), "since": since}
