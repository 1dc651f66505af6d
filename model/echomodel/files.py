"""Files that appear whole or not at all, and files of others that are read with doubt."""

import hashlib
import json
import os
import re
import socket
import stat
import sys
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

SHIPPED = Path(__file__).with_name("weights")  # those that come with the package
HELD = 512 * 2**20  # bytes of memory that reading any file of somebody's may take
EACH = 16  # and for each of its bytes: plain data takes more than its text
HOST = f"{zlib.crc32(socket.gethostname().encode()):08x}"
PARTIAL = re.compile(r"\..+\.(?P<host>[0-9a-f]{8})_(?P<process>[0-9]{1,9})\.\w+")  # what `whole_file` writes to


@contextmanager
def whole_file(path: str | os.PathLike[str], ending: str = ".partial") -> Iterator[Path]:
    """A path beside `path` to write to; renamed to `path` at the end of the block, removed where that raised.

    A file that is replaced passes its rights on; a new one has those of any, though a library gave it others.

    Arguments:
        path: the file.
        ending: of the other name, where the writer goes by it.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{HOST}_{os.getpid()}{ending}")
    try:
        sweep(path.parent.absolute())
        beside.unlink(missing_ok=True)  # a link that waits under that name in a folder that somebody sent
        beside.touch(exist_ok=False)
        rights = (path if path.is_file() else beside).stat().st_mode
        yield beside
        flush(beside)
        if beside.stat().st_mode != rights:
            beside.chmod(stat.S_IMODE(rights))
        beside.replace(path)
    except OSError as error:
        # whoever reads the message knows the file by its own name; a full disk names none
        if error.filename in (None, str(beside)):
            error.filename = str(path)
        raise
    finally:
        beside.unlink(missing_ok=True)


@cache
def sweep(folder: Path) -> None:
    """Remove what `whole_file` left in a folder where its process on this machine was killed; once a process."""
    try:
        found = [(entry, PARTIAL.fullmatch(entry.name)) for entry in os.scandir(folder)]
    except OSError:  # whoever writes there is told
        return
    for entry, named in found:
        if (
            named
            and named["host"] == HOST
            and not alive(int(named["process"]))
            and entry.is_file(follow_symlinks=False)
        ):
            with suppress(OSError):
                Path(entry).unlink()


def alive(process: int) -> bool:
    """Whether a process of this machine runs; True where the system does not tell."""
    if os.name == "nt":  # there the question would be an order
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8; the file appears whole."""
    with whole_file(path) as beside:
        beside.write_text(text, "utf-8")


def write_json(path: Path, content: object) -> None:
    """Write something as indented JSON; the file appears whole."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def check_free(path: Path, *, force: bool, other: str = "place") -> None:
    """Refuse to replace a file, or to fill a folder that holds something, unless `force`; raises ValueError.

    `other`: what else may be chosen.
    """
    if path.exists() and not force and not (path.is_dir() and not any(path.iterdir())):
        raise ValueError(f"{path}: exists; choose another {other} or use --force")


def check_ours(folder: Path, what: str, *marks: str, force: bool | None = None, besides: Iterable[str] = ()) -> None:
    """Refuse a folder that holds other things than what is written there, unless `force`; raises ValueError.

    Arguments:
        what: is written there. marks: patterns of files of which one is there where it was written or begun before.
        force: None where that is no choice. besides: names that say nothing.
    """
    names = {path.name for path in folder.iterdir()} - {*besides} if folder.is_dir() else set()
    others = sorted(name for name in names if not PARTIAL.fullmatch(name))
    if others and not force and not any(any(folder.glob(mark)) for mark in marks):
        shown, more = ", ".join(others[:3]) + " ..." * (len(others) > 3), " or use --force" * (force is not None)
        raise ValueError(f"{folder}: holds {shown} and no {what}; choose another folder{more}")


def digest(content: bytes) -> str:
    """Short content hash, as manifests and journals record it."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def cache_folder() -> Path:
    """Where what was computed once is kept for later: `$ECHOUSD_CACHE`, else `~/.cache/echousd`; it may not exist."""
    return Path(os.environ.get("ECHOUSD_CACHE") or Path.home() / ".cache" / "echousd")


def from_cache(kind: str, key: bytes, make: Callable[[], bytes]) -> bytes:
    """What `make` gives for a key: from the cache where that has it whole, else made and kept there if it can be."""
    file, content = Path(), b""
    with suppress(OSError, RuntimeError):  # of a user without a home
        file = cache_folder() / kind / digest(key)
        content = file.read_bytes()
    checksum, found = content[:32], content[32:]
    if checksum != digest(found).encode():
        found = make()
        with suppress(OSError, ValueError):  # that of a path without a name
            file.parent.mkdir(parents=True, exist_ok=True)
            beside = file.with_name(f".{file.name}.{os.getpid()}")
            beside.write_bytes(digest(found).encode() + found)
            beside.replace(file)
    return found


def tables(name: str, beside: str) -> dict[str, Any]:
    """What a TOML file of ours beside a module's file holds; the cache keeps it as JSON, which is read at once."""
    text = Path(beside).with_name(name).read_bytes()

    def read() -> bytes:
        import tomllib

        return json.dumps(tomllib.loads(text.decode())).encode()

    return dict(json.loads(from_cache("tables", text, read)))


def flush(path: Path) -> None:
    """Have the system write a file, or the names in a folder, to the disk before anything that comes after it."""
    if path.is_dir() and os.name != "posix":
        return
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


@contextmanager
def telling(path: str | os.PathLike[str], fails: str = "cannot be written", then: str = "") -> Iterator[None]:
    """Raises ValueError in place of an OSError of the block: the path, what fails, the system's reason, what then."""
    try:
        yield
    except OSError as error:
        raise ValueError(f"{path}: {fails} ({error.strerror or error}){then}") from None


@contextmanager
def raising(what: str, *instead_of: type[Exception], kind: type[Exception] = ValueError) -> Iterator[None]:
    """Raises an error of a kind instead of one of the block's, ValueErrors where none are named, with what it says.

    Arguments:
        what: cannot be done; the reason follows in brackets, or as it is where `what` ends with a colon.
    """
    kinds = instead_of or (ValueError,)
    try:
        yield
    except kinds as error:
        raise kind(f"{what} {error}" if what.endswith(":") else f"{what} ({error})") from None


@contextmanager
def within_memory(path: Path, name: str = "", *, size: int | None = None) -> Iterator[None]:
    """Keep the process from holding much more than a file of somebody's has bytes while the block reads it.

    Arguments:
        path: of the file. name: what the error calls it, "" = its path. size: its bytes, None = as on the disk.

    Raises ValueError that names the file where the block takes more than `HELD` and `EACH` times its bytes besides
    what the process held before. Linux keeps count of that; on other systems nothing is limited here.
    """
    size = (path.stat().st_size if path.is_file() else 0) if size is None else size
    most = HELD + EACH * size
    if sys.platform != "linux":
        yield
        return
    import resource  # no module of other systems

    status = Path("/proc/self/status").read_text().split()
    held = int(status[status.index("VmData:") + 1]) << 10
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limits = [held + most, *(limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(limits), hard))
    try:
        yield
    except MemoryError as error:
        traceback.clear_frames(error.__traceback__)  # what it had read by then
        why = f"{name or path}: takes more memory to read than {most >> 20} MiB, allowed: that much for {size} bytes"
        raise ValueError(why) from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
