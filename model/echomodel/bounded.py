"""Files that anybody may have put there, read up to a limit; archives that may be damaged."""

import json
import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

from echomodel.files import raising


def read_bounded(path: str | os.PathLike[str], most: int) -> bytes:
    """The bytes of a file that anybody may have put there.

    Raises ValueError that names it for what is no regular file (a pipe would wait for ever, a device never ends) or has
    more than `most` bytes, and OSError as the system does.
    """
    file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(file, "rb") as opened:
        found = os.fstat(file)
        if not stat.S_ISREG(found.st_mode):
            raise ValueError(f"{path}: not a regular file, allowed: a file of at most {most} bytes")
        if found.st_size > most:
            raise ValueError(f"{path}: {found.st_size} bytes, allowed: at most {most}")
        return opened.read(found.st_size + 1)[:most]  # a reader makes room for all that it is asked for


def read_json(path: str | os.PathLike[str], most: int) -> Any:
    """The plain data of a JSON file, read as `read_bounded` does; ValueError also where it is no JSON."""
    content = read_bounded(path, most)
    with raising(f"{path}: cannot be read as JSON", ValueError, RecursionError):
        return json.loads(content)


def bounded_lines(file: BinaryIO, most: int, name: str | os.PathLike[str]) -> Iterator[bytes]:
    """Lines of an open file that anybody may have put there; raises ValueError for one of more than `most` bytes."""
    for number, line in enumerate(iter(lambda: file.readline(most + 1), b""), 1):
        if len(line) > most:
            raise ValueError(f"{name}, line {number}: more than {most} bytes, allowed: that many")
        yield line


@contextmanager
def unpacking(name: object) -> Iterator[None]:
    """Raises ValueError that names an archive where the block, which reads it, meets damage or a form unknown.

    Python's module for archives raises what each of their ways of packing raises.
    """
    import lzma
    import zipfile

    try:
        yield
    except (
        zipfile.BadZipFile,
        zlib.error,
        lzma.LZMAError,
        EOFError,
        OSError,
        KeyError,
        RuntimeError,
        ValueError,
    ) as error:
        if isinstance(error, ValueError) and str(error).startswith(str(name)):
            raise  # what the block itself has to say
        raise ValueError(f"{name}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
