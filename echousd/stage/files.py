"""Open stages and save layers: errors that say which file, and files that appear whole or not at all."""

import os
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile, gettempdir

from pxr import Ar, Sdf, Tf, Usd, UsdUtils

from echomodel.files import raising, whole_file
from echomodel.late import Late
from echousd.naming import STAGE_FORMS
from echousd.pending import check_written
from echousd.stage.encoding import StageError
from echousd.stage.harmless import check_harmless

room_at = Late("echousd.folder.found:room_at")

MEMORY = "/dev/shm"  # where Linux keeps files in memory
# a MaterialX document, not there or no plugin
MATERIALS = re.compile(r"Could not open asset @([^@]*\.mtlx)@", re.IGNORECASE)


def open_stage(path: str | os.PathLike[str]) -> Usd.Stage:
    """The stage in the file at `path`, or of the one room in a folder.

    Raises StageError for a file that is missing, not USD or does not compose, and ValueError for a folder without a
    room or with several, and for a room that is half-written.
    """
    path = Path(path)
    with raising(f"{path}: cannot be opened", OSError, ValueError, kind=StageError):
        there, folder = path.exists(), path.is_dir()
    path = Path(room_at(path)) if folder else path
    check_written([path])
    if not there:
        raise StageError(f"{path}: no such file")
    if not path.is_file():
        raise StageError(f"{path}: not a regular file, allowed: a file, {', '.join(STAGE_FORMS)}")
    check_path(path)
    if path.suffix not in STAGE_FORMS:
        raise StageError(f"{path}: not a USD file (extension {path.suffix!r}), allowed: {', '.join(STAGE_FORMS)}")
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the exception says as well
    try:
        layers = regular_layers(path)
        stage = Usd.Stage.Open(str(path))
        check_written([Path(layer.realPath) for layer in layers if layer.realPath])
        del layers
    except UnicodeDecodeError as error:  # in the names of the layers that it refers to
        raise StageError(f"{path}: a layer that is no UTF-8 text ({error.reason})") from None
    except Tf.ErrorException as error:
        raise StageError(f"{path}: not a USD file that can be read ({usd_error(error)})") from None
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence
    try:
        errors = [str(error) for error in stage.GetCompositionErrors()]
    except UnicodeDecodeError as error:  # USD quotes the damaged layer
        raise StageError(f"{path}: does not compose: a layer that is no UTF-8 text ({error.reason})") from None
    materials = [text for text in errors if MATERIALS.match(text)]
    if len(materials) < len(errors):
        wrong = next(text for text in errors if text not in materials)
        raise StageError(f"{path}: does not compose: {one_line(wrong)}")
    if materials:
        names = ", ".join(dict.fromkeys(Path(MATERIALS.match(text)[1]).name for text in materials))  # type: ignore[index]
        warnings.warn(
            f"{path}: materials that cannot be read here are left out: {names}", MissingMaterials, stacklevel=2
        )
    return stage


def layer_there(path: Path) -> Sdf.Layer | None:
    """The layer in a file, None where no file is there or none that can be read."""
    try:
        return Sdf.Layer.FindOrOpen(str(path)) if path.is_file() else None
    except (Tf.ErrorException, UnicodeDecodeError):  # USD quotes the damaged layer
        return None


def regular_layers(path: Path) -> list[Sdf.Layer]:
    """All layers that a stage may compose, opened; raises StageError for one that is a pipe, which USD would wait for.

    Broken and missing ones are left to composition, which says what is wrong with them.
    """
    found: dict[str, Sdf.Layer] = {}
    todo = [(str(path), "")]
    while todo:
        name, named_by = todo.pop()
        if name in found:
            continue
        try:
            file = _regular(str(Ar.GetResolver().Resolve(name)), named_by)
            if file and not Sdf.Layer.Find(name):
                check_harmless(file, path)
            layer = found[name] = Sdf.Layer.FindOrOpen(name)
        except Tf.ErrorException:
            continue
        if layer:
            _check_clips(layer, path)
            named_by = f"{path}: a layer, {layer.identifier},"
            todo += [(layer.ComputeAbsolutePath(asset), named_by) for asset in layer.GetCompositionAssetDependencies()]
    return [layer for layer in found.values() if layer]


def _check_clips(layer: Sdf.Layer, path: Path) -> None:
    """Raises StageError for value clips that are no files: USD opens their layers for values, or at once."""
    for prim in (prim for prim in prim_specs(layer) if prim.HasInfo("clips")):
        for asset in assets_in(prim.GetInfo("clips")):
            resolved = str(Ar.GetResolver().Resolve(layer.ComputeAbsolutePath(asset)))
            _regular(resolved, f"{path}: {layer.identifier}: <{prim.path}>: clips")


def specs(layer: Sdf.Layer) -> list[Sdf.Spec]:
    """All that a layer holds."""
    return [spec for spec in map(layer.GetObjectAtPath, _paths(layer)) if spec]


def _paths(layer: Sdf.Layer) -> list[Sdf.Path]:
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    return paths


def prim_specs(layer: Sdf.Layer) -> list[Sdf.PrimSpec]:
    """All prims that a layer speaks of, those in variants too."""
    found = [at for at in _paths(layer) if at.IsPrimPath() or at.IsPrimVariantSelectionPath()]
    return [*filter(None, map(layer.GetPrimAtPath, found))]  # the path of a variant set is of that kind, too


def assets_in(value: object) -> Iterator[str]:
    """Asset paths in a value of a layer: in itself, or in the lists and dictionaries that it consists of."""
    if isinstance(value, Sdf.AssetPath):
        if value.path:
            yield value.path
    elif isinstance(value, dict):
        for key in sorted(value, key=str):
            yield from assets_in(value[key])
    elif isinstance(value, Sdf.AssetPathArray | list | tuple):
        for entry in value:
            yield from assets_in(entry)


def _regular(resolved: str, named_by: str) -> Path | None:
    """The file of a layer, None where there is none; raises StageError for what is no file, and says who names it."""
    file = Path(Ar.SplitPackageRelativePathOuter(resolved)[0]) if resolved else None
    if file is None or file.is_file():
        return file
    if not file.exists():
        return None
    raise StageError(f"{named_by} names {str(file)!r}, not a regular file, allowed: layers")


class MissingMaterials(UserWarning):
    """A stage refers to materials in a form that this OpenUSD does not read, such as MaterialX without its plugin."""


def check_path(path: Path) -> None:
    """Raises StageError for a file or folder below which USD would look for layers elsewhere, or not at all."""
    whole = os.path.abspath(path)  # noqa: PTH100  # links stay
    if ":SDF_FORMAT_ARGS:" in whole:
        raise StageError(f"{path}: ':SDF_FORMAT_ARGS:' in a name ends the path for USD, allowed: another name")
    odd = next((c for c in whole if not c.isprintable() or (c == "\\" and os.name == "posix")), None)
    if odd is not None:
        raise StageError(f"{path}: {odd!r} in a name, which USD does not take in paths, allowed: another name")


def opened(stage: Usd.Stage | str | os.PathLike[str]) -> Usd.Stage:
    """The stage itself, or the one in the file at that path."""
    return stage if isinstance(stage, Usd.Stage) else open_stage(stage)


def source(stage: Usd.Stage) -> str:
    """What an error message calls the stage: its file, or the identifier of its anonymous root layer."""
    layer = stage.GetRootLayer()
    return layer.realPath or layer.identifier


def usd_error(error: Tf.ErrorException) -> str:
    """The most specific thing that USD says about an error, in one line."""
    try:
        texts = [str(getattr(entry, "commentary", "")).strip() for entry in error.args]
    except UnicodeDecodeError as odd:  # USD quotes the damaged layer
        return f"a text that is no UTF-8: {odd.reason}"
    specific = [text for text in texts if text and not text.startswith("Failed to open layer")]
    return one_line(specific[-1] if specific else "no layer of a known format")


def one_line(text: str, most: int = 200) -> str:
    """The first line of `text`, cut to `most` characters."""
    line = text.strip().splitlines()[0]
    return line if len(line) <= most else line[: most - 3] + "..."


def layer_bytes(layer: Sdf.Layer, suffix: str) -> bytes:
    """The layer as it would lie on disk; the same content gives the same bytes. `suffix`: `.usda` or `.usdc`."""
    if suffix == ".usda":
        return layer.ExportToString().encode("utf-8")
    for at in (MEMORY, None):  # a disk takes ten times as long to take a file away as USD does to write it
        with suppress(OSError, Tf.ErrorException), NamedTemporaryFile(prefix="echousd-", suffix=suffix, dir=at) as file:
            if layer.Export(file.name):
                return Path(file.name).read_bytes()
    raise OSError(f"cannot write a layer to {gettempdir()}")


def write_all(files: Mapping[Path, bytes], *, left: str = "nothing was changed") -> None:
    """Write files, none of which appears before all have found their room on the disk; the first appears last.

    Raises ValueError where that is impossible, and takes folders that it made away again.

    Arguments:
        left: what the error says about the state in which everything else is left.
    """
    path, made = Path(), list[Path]()
    for taken in (path for path in files if path.is_dir()):  # found out by the rename alone, after others
        raise ValueError(f"{taken}: cannot be written (a folder has that name); {left}")
    try:
        with ExitStack() as held:
            for path, content in files.items():
                made += [place for place in path.parents if not place.exists()]
                path.parent.mkdir(parents=True, exist_ok=True)
                held.enter_context(whole_file(path)).write_bytes(content)
            if len(files) > 1:  # from here on they take their names, one after the other
                left = "others that belong to it may have been"
    except OSError as error:
        for place in sorted(made, key=lambda place: len(place.parts), reverse=True):
            with suppress(OSError):  # somebody else has put something into it
                place.rmdir()
        raise ValueError(f"{error.filename or path}: cannot be written ({error.strerror or error}); {left}") from None
