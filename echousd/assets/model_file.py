"""A model's file and what lies beside it: read with doubt, as a model may name anything."""

import io
import os
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

from trimesh.resolvers import Resolver

from echomodel.bounded import unpacking
from echousd.textures import MAX_BYTES

MAX_MODEL = 2 * 2**30  # bytes
TEXTS, MAX_TEXT = (".obj", ".gltf"), 2**28  # what is read takes ten times as much memory


@dataclass(frozen=True)
class ModelFile:
    """Where a model lies.

    Arguments:
        path: the file, or the archive that holds it. top: folder that the model's own files are looked for below.
        member: name in the archive, "" where there is none.
        prim: path of the model's prim in a stage that holds more than it, "" = its root.
    """

    path: Path
    top: Path
    member: str = ""
    prim: str = ""

    @property
    def suffix(self) -> str:
        """Ending of the model's own name, in lower case."""
        return PurePosixPath(self.member or self.path.name).suffix.lower()

    def __str__(self) -> str:
        return f"{self.path}!{self.member}" if self.member else str(self.path)

    @contextmanager
    def opened(self) -> Iterator[io.BufferedIOBase]:
        """The model's bytes; raises ValueError for a file that is missing, no regular file, empty or too large."""
        with unpacking(self):
            if not self.path.is_file():
                found = "not a regular file" if self.path.exists() else "no such file"
                raise ValueError(f"{self}: {found}")
            if not self.member:
                _check_size(self, self.path.stat().st_size)
                with self.path.open("rb") as file:
                    yield file
                return
            archive = _archive(self.path, self.path.stat().st_mtime_ns)
            _check_size(self, archive.getinfo(self.member).file_size)
            yield io.BytesIO(archive.read(self.member))


@lru_cache(maxsize=4)
def _archive(path: Path, changed: int) -> zipfile.ZipFile:
    """An archive that stays open: reading its directory takes longer than reading a model."""
    return zipfile.ZipFile(path)


def _check_size(model: ModelFile, size: int) -> None:
    most = MAX_TEXT if model.suffix in TEXTS else MAX_MODEL
    if not 0 < size <= most:
        raise ValueError(f"{model}: {size} bytes, allowed for a model: 1 to {most}")


class Beside(Resolver):
    """Files that a model names, in the form in which trimesh asks for them; none lies out of the library's folder.

    What was asked for in vain is noted in `missing`, contents of images in `images`.
    """

    def __init__(self, model: ModelFile) -> None:
        self.model = model
        self.missing: list[str] = []
        self.images: dict[str, bytes] = {}

    def get(self, name: Any) -> bytes:
        """Content of a file that the model names; raises ValueError where there is none in reach."""
        place = name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
        place = place.replace("\\", "/").strip()
        try:
            with unpacking(self.model):
                content = self._member(place) if self.model.member else self._file(place)
        except ValueError:
            self.missing.append(place)
            raise ValueError(f"{self.model}: names {place!r}, which is not there") from None
        self.images[place] = content
        return content

    def _file(self, name: str) -> bytes:
        top = os.path.realpath(self.model.top)
        for wanted in (name, PurePosixPath(name).name):  # exporters leave absolute paths of their own machine behind
            path = os.path.realpath(self.model.path.parent / wanted)
            if os.path.commonpath([top, path]) == top and Path(path).is_file():
                if Path(path).stat().st_size > MAX_BYTES:
                    raise ValueError(f"{path}: too large")
                return Path(path).read_bytes()
        raise ValueError("out of reach")

    def _member(self, name: str) -> bytes:
        folder = PurePosixPath(self.model.member).parent
        archive = _archive(self.model.path, self.model.path.stat().st_mtime_ns)
        wanted = str(folder / name)
        if archive.getinfo(wanted).file_size > MAX_BYTES:
            raise ValueError(f"{wanted}: too large")
        return archive.read(wanted)

    def keys(self) -> list[str]:
        """No names are told beforehand."""
        return []

    def write(self, name: str, data: Any) -> None:
        """Nothing is written beside a model."""
        raise ValueError(f"{self.model}: {name!r} is not written beside it")

    def namespaced(self, namespace: str) -> "Beside":
        """Itself."""
        return self
