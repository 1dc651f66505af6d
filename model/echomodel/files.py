"""Files that appear whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image


@contextmanager
def whole_file(path: str | os.PathLike[str], ending: str = ".partial") -> Iterator[Path]:
    """A path beside `path` to write to; renamed to `path` at the end of the block, removed where that raised.

    A file that is replaced passes its rights on.

    Arguments:
        path: the file.
        ending: of the other name, where the writer goes by it.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}{ending}")
    try:
        yield beside
        flush(beside)
        if path.is_file():
            shutil.copymode(path, beside)
        beside.replace(path)
    except OSError as error:
        # whoever reads the message knows the file by its own name; a full disk names none
        if error.filename in (None, str(beside)):
            error.filename = str(path)
        raise
    finally:
        beside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8; the file appears whole."""
    with whole_file(path) as beside:
        beside.write_text(text, "utf-8")


def write_picture(path: Path, picture: Image) -> None:
    """Write a picture in the format of the path's ending; the file appears whole."""
    with whole_file(path, path.suffix) as beside:
        picture.save(beside)


def write_json(path: Path, content: object) -> None:
    """Write something as indented JSON; the file appears whole."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def flush(path: Path) -> None:
    """Have the system write a file, or the names in a folder, to the disk before anything that comes after it."""
    if path.is_dir() and os.name != "posix":
        return
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)
