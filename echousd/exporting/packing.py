"""What a room may take along into an archive: its own images, nothing else of this machine, values that are written."""

import io
import os
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from pxr import Ar, Sdf, Usd, UsdUtils

from echomodel.files import raising
from echousd.naming import free_name
from echousd.stage.encoding import StageError
from echousd.stage.files import assets_in, specs
from echousd.stage.values import shown
from echousd.store import store_above
from echousd.textures import TextureError, file_of, texture_bytes

PACKED = (".png", ".jpg", ".jpeg", ".exr", ".avif", ".m4a", ".mp3", ".wav")  # what a usdz may hold beside layers
EARLIEST = (0, (1 << 5) | 1)  # time and date as a zip archive stores them
SEARCH_PATH = "PXR_AR_DEFAULT_SEARCH_PATH"
FOLDER = "textures"
UDIM_TILES = range(1001, 1101)


class LeftOut(UserWarning):
    """A file that no archive may hold; what named it goes without."""


@dataclass(frozen=True)
class Reach:
    """Where files of a room may lie: below its folder (for a usdz: in the file), in named search paths, in a store."""

    room: Path
    places: tuple[Path, ...]
    _real: Callable[[str], str] = field(default_factory=lambda: cache(os.path.realpath), compare=False)  # of folders

    @classmethod
    def of(cls, stage: Usd.Stage, search: Sequence[str | os.PathLike[str]] = ()) -> "Reach":
        """The reach of a stage: of its root layer, of `search` and of OpenUSD's own search path variable."""
        root = file_of(stage.GetRootLayer().realPath).resolve()
        own = root if root.suffix == ".usdz" else root.parent
        named = [*search, *filter(None, os.environ.get(SEARCH_PATH, "").split(os.pathsep))]
        return cls(root, (own, *(Path(place).resolve() for place in named)))

    def holds(self, path: str) -> bool:
        """Whether a file, all links followed, lies in reach."""
        folder, name = os.path.split(file_of(path))
        real = Path(self._real(folder), name)
        real = real.resolve() if name == ".." or real.is_symlink() else real
        return any(map(real.is_relative_to, self.places)) or store_above(real) is not None

    def check(self, path: str, where: str) -> None:
        """Raises StageError that names `where` (a prim, a layer) for a file out of reach."""
        if not self.holds(path):
            allowed = ", ".join(map(str, self.places))
            raise StageError(
                f"{self.room}: {where} names {path!r}, allowed: files in {allowed} (--search DIR adds one)"
            )

    def check_layers(self, stage: Usd.Stage) -> None:
        """Raises StageError for a layer of the stage out of reach."""
        for layer in stage.GetUsedLayers():
            if not layer.anonymous and layer.realPath and not self.holds(layer.realPath):
                self.check(layer.realPath, f"a layer of <{_first_prim(stage, layer)}>")


def _first_prim(stage: Usd.Stage, layer: Sdf.Layer) -> Sdf.Path:
    """The first prim with an opinion in a layer, the pseudo-root where there is none."""
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)):
        if any(spec.layer == layer for spec in prim.GetPrimStack()):
            return prim.GetPath()
    return Sdf.Path.absoluteRootPath


@dataclass
class Package:
    """The files that go into an archive beside the layer: name in the archive -> content.

    Arguments:
        reach: what may be packed at all.
        folder: that the files lie in, beside the layer.
        names: path of a file on this machine -> its name in the archive, "" for what is left out.
    """

    reach: Reach
    folder: str = FOLDER
    names: dict[str, str] = field(default_factory=dict)
    content: dict[str, bytes] = field(default_factory=dict)

    def take(self, path: str, where: str) -> str:
        """The path in the archive of an asset path of a flat layer, "" where there is no such file.

        Raises StageError for a file out of reach or one that cannot be read.
        """
        if path not in self.names:
            self.names[path] = self._tiles(path, where) if "<UDIM>" in path else self._file(path, where)
        return self.names[path]

    def _file(self, path: str, where: str, name: str = "") -> str:
        if not os.path.exists(file_of(path)):  # noqa: PTH110  # nor where the text can be no path
            return ""
        self.reach.check(path, where)
        inside = Ar.SplitPackageRelativePathInner(path)[1] or path
        ending = PurePosixPath(inside).suffix.lower()
        if ending not in PACKED:
            message = f"{self.reach.room}: {where} names {path!r}, which is left out (packed: {', '.join(PACKED)})"
            warnings.warn(message, LeftOut, stacklevel=2)
            return ""
        with raising(f"{self.reach.room}: {where}:", TextureError, kind=StageError):
            content = texture_bytes(path)
        if content is None:
            return ""
        name = name or self._unused(PurePosixPath(inside.replace("\\", "/")).name)
        self.content[name] = content
        return f"./{self.folder}/{name}"

    def _tiles(self, path: str, where: str) -> str:
        before, _, after = path.rpartition("<UDIM>")
        pattern = self._unused(f"{PurePosixPath(f'{before}0').name[:-1]}<UDIM>{after.rstrip(']')}")
        packed = [
            self._file(f"{before}{tile}{after}", where, pattern.replace("<UDIM>", str(tile))) for tile in UDIM_TILES
        ]
        return f"./{self.folder}/{pattern}" if any(packed) else ""

    def _unused(self, name: str) -> str:
        taken = {PurePosixPath(used).name.casefold() for used in (*self.content, *self.names.values())}
        stem, ending = os.path.splitext(name)  # noqa: PTH122  # a name with `<UDIM>`, no path
        return free_name(stem, lambda one: f"{one}{ending}".casefold() in taken) + ending

    def files(self, folder: Path) -> dict[Path, bytes]:
        """What is packed, as files below `folder`."""
        return {folder / self.folder / name: content for name, content in self.content.items()}


def images_beside(file: Path) -> str:
    """Name of the folder for the images of a flat layer; each file has its own."""
    return f"{file.stem}_{FOLDER}"


def take_assets(layer: Sdf.Layer, package: Package | None) -> None:
    """Point every asset path of a flat layer (attributes, arrays, samples, metadata) into the archive, or nowhere.

    Arguments:
        package: receives the files; None leaves them all out.

    Raises StageError that names the prim or property of a file out of reach.
    """
    renamed: dict[str, str] = {}
    for where, path in asset_paths(specs(layer)):
        renamed[path] = package.take(path, f"<{where}>") if package is not None else ""
    UsdUtils.ModifyAssetPaths(layer, lambda path: renamed.get(path, ""))


def without_clock(archive: bytes) -> bytes:
    """The zip archive with the earliest time there is, 1 January 1980, on all its files: equal rooms, equal bytes."""
    out = bytearray(archive)
    with zipfile.ZipFile(io.BytesIO(archive)) as package:
        entry = package.start_dir
        for file in package.infolist():
            for time in (file.header_offset + 10, entry + 12):
                struct.pack_into("<HH", out, time, *EARLIEST)
            entry += 46 + sum(struct.unpack_from("<HHH", archive, entry + 28))
    return bytes(out)


# What specs say that never holds an asset path, most of it all; offsets are what Python cannot hold.
PLAIN = {
    "typeName", "custom", "variability", "specifier", "apiSchemas", "interpolation", "targetPaths", "connectionPaths",
    "references", "payload", "inheritPaths", "variantSelection", "variantSetNames", "kind", "subLayerOffsets",
}  # fmt: skip


def asset_paths(found: Iterable[Sdf.Spec]) -> Iterator[tuple[Sdf.Path, str]]:
    """Every asset path in the values and metadata of some specs, behind the path of its prim or property."""
    for spec in found:
        for key in (key for key in spec.ListInfoKeys() if key not in PLAIN):
            for path in assets_in(spec.GetInfo(key)):
                yield spec.path, path


def misfit(kind: Sdf.ValueTypeName, found: Any) -> bool:
    """Whether a value is of another type than its attribute; OpenUSD reads such a value, but cannot write it."""
    held = _held(kind)
    return not isinstance(found, held) or (isinstance(found, bool) and bool not in held)


@cache  # asked of every value
def _held(kind: Sdf.ValueTypeName) -> tuple[type, ...]:
    """What values of an attribute of a type are."""
    default = kind.defaultValue
    if default is None:
        return (object, bool)
    whole = isinstance(default, int) and not isinstance(default, bool)
    numbers = (int, float, Sdf.TimeCode) if isinstance(default, float | Sdf.TimeCode) else (int,) if whole else ()
    return (*(numbers or (type(default),)), type(None), Sdf.ValueBlock)


def check_types(layer: Sdf.Layer, where: str) -> None:
    """Raises StageError for the first value of a layer that is of another type than its attribute.

    Arguments:
        where: the file that the error names.
    """
    for spec in (spec for spec in specs(layer) if isinstance(spec, Sdf.AttributeSpec)):
        samples = layer.ListTimeSamplesForPath(spec.path) if spec.HasInfo("timeSamples") else ()
        for found in (spec.default, *(layer.QueryTimeSample(spec.path, time) for time in samples)):
            if misfit(spec.typeName, found):
                raise StageError(f"{where}: <{spec.path}> is {shown(found)}, allowed: {spec.typeName}")
