"""Painted looks of a room, `looks/<name>.usda`: layers of the user's own, and what of them fits no longer."""

import glob
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Tf, Usd, Vt

from echousd.draw.surfaces import DRESSING, Surfaces, read_surfaces
from echousd.folder.within import inside
from echousd.stage.encoding import StageError
from echousd.stage.files import layer_bytes, open_stage
from echousd.stage.harmless import check_harmless
from echousd.stage.paths import UNFIT
from echousd.stage.vouched import just_written

FOLDER = "looks"
VARIANTS, MADE = "looks", "made"  # the variant set of the room, and its variant without paint
RECORD = "echousd_look"  # in customLayerData: which objects a look was painted for
LONGEST = 64  # characters of a look's name


@dataclass(frozen=True)
class Look:
    """A painted look, as its layer says."""

    name: str  # of the look and of its variant
    path: str  # of its layer in the room's folder
    dressing: str  # whether small things were painted, see `read_surfaces`
    objects: Mapping[str, str]  # prim path of an object -> digest of its meshes
    meshes: tuple[str, ...]  # prim paths of these meshes


def primvar(look: str) -> str:
    """Name of the texture coordinates of a look."""
    return f"st_{look}"


def attached(root: bytes | None) -> list[str]:
    """Sublayers of a root layer (its bytes) that are looks, such as `./looks/painted.usda`."""
    layer = _parsed(root) if root else None
    return [path for path in layer.subLayerPaths if path.startswith(f"./{FOLDER}/")] if layer else []


def with_sublayers(root: bytes, first: Sequence[str], keep: Callable[[str], bool]) -> bytes:
    """A root layer of ours whose strongest sublayers are others, and of its own those that are kept."""
    layer = _parsed(root)
    assert layer
    layer.subLayerPaths = [*first, *filter(keep, layer.subLayerPaths)]
    return layer.ExportToString().encode("utf-8")


def read_looks(folder: Path, paths: Iterable[str]) -> list[Look]:
    """The looks in layers of a room's folder; those that cannot be read, or that no import wrote, are left out."""
    found = []
    for path in paths:
        try:
            place = inside(folder, path.removeprefix("./"), "a look")
            check_harmless(place)
            layer = Sdf.Layer.OpenAsAnonymous(str(place))
        except (ValueError, Tf.ErrorException):
            continue
        look = read_look(layer, path.removeprefix("./")) if layer else None
        if look is not None:
            found.append(look)
    return found


def read_look(layer: Sdf.Layer, path: str) -> Look | None:
    """What a look's layer says of itself, None where it says nothing."""
    record = layer.customLayerData.get(RECORD)
    if not isinstance(record, dict) or not isinstance(record.get("name"), str):
        return None
    name, objects, meshes = record["name"], record.get("objects"), record.get("meshes")
    if not isinstance(objects, dict) or not isinstance(meshes, Vt.StringArray):
        return None
    right = all(isinstance(digest, str) for digest in objects.values()) and Sdf.Path.IsValidIdentifier(name)
    right = right and len(name) <= LONGEST and all(map(_is_prim_below, (*objects, *meshes)))
    dressing = record.get("dressing")
    return (
        Look(name, path, dressing if dressing in DRESSING else "none", dict(objects), tuple(meshes)) if right else None
    )


def _is_prim_below(place: str) -> bool:
    """Whether a text is the path of a prim inside a room."""
    path = Sdf.Path(place) if Sdf.Path.IsValidPathString(place) else Sdf.Path.emptyPath
    plain = path.IsAbsolutePath() and path.IsPrimPath() and not path.ContainsPrimVariantSelection()
    return plain and path.pathElementCount > 1


def unfitting(looks: Sequence[Look], stage: Usd.Stage) -> dict[str, list[str]]:
    """Path of a look's layer -> prim paths of its objects that changed or are gone in the room on the stage."""
    found: dict[str, list[str]] = {}
    known: dict[str, Surfaces] = {}
    for look in looks:
        if look.dressing not in known:
            known[look.dressing] = read_surfaces(stage, dressing=look.dressing)
        now = {thing.path: thing.topology for thing in known[look.dressing].objects}
        wrong = [path for path, topology in look.objects.items() if now.get(path) != topology]
        if wrong:
            found[look.path] = wrong
    return found


def unfit_layer(looks: Sequence[Look], unfit: Mapping[str, Sequence[str]], data: Mapping[str, object]) -> bytes:
    """`layers/unfit.usda`: local opinions, which are stronger than a look's variant, that take its paint away again."""
    stage = Usd.Stage.CreateInMemory()
    layer = stage.GetRootLayer()
    layer.customLayerData = dict(data)
    for look in looks:
        for path in unfit.get(look.path, ()):
            prim = stage.OverridePrim(path)
            prim.CreateRelationship(f"collection:{look.name}:includes", False).SetTargets([])  # its material binds none
            for mesh in (mesh for mesh in look.meshes if f"{mesh}/".startswith(f"{path}/")):
                over = stage.OverridePrim(mesh)
                name = f"primvars:{primvar(look.name)}"
                over.CreateAttribute(name, Sdf.ValueTypeNames.TexCoord2fArray, False).Block()
                over.CreateAttribute(f"{name}:indices", Sdf.ValueTypeNames.IntArray, False).Block()
    top = layer.rootPrims[0].name if layer.rootPrims else ""
    layer.defaultPrim = top
    return layer_bytes(layer, ".usda")


def brought(root: Path | None, folder: Path) -> dict[str, dict[str, bytes]]:
    """The looks of a room that was edited, for another folder that it goes to.

    `root`: root layer of the room that was edited, None = it was not. `folder`: where it goes. Returns sublayer
    (`./looks/painted.usda`) -> path -> content of its files, strongest first; warns of those whose place another look
    has.
    """
    if root is None or root.parent.resolve() == folder.resolve():
        return {}
    found: dict[str, dict[str, bytes]] = {}
    stage = Usd.Stage.Open(str(root), Usd.Stage.LoadNone)  # holds the layers
    for layer in stage.GetLayerStack(False):
        place = Path(layer.realPath)
        if place.parent != root.parent.resolve() / FOLDER:
            continue
        beside = sorted(place.with_suffix("").rglob("*"))
        paths = [f"{FOLDER}/{each.relative_to(place.parent).as_posix()}" for each in (*beside, place) if each.is_file()]
        content = {path: inside(root.parent, path, "a look").read_bytes() for path in paths}
        taken = {path: folder / path for path in content if (folder / path).exists()}
        other = [path for path, it in taken.items() if not it.is_file() or it.read_bytes() != content[path]]
        if other:
            message = f"{folder / other[0]}: is another look; that of {root.parent} is not taken along"
            warnings.warn(message, stacklevel=5)
            continue
        found[f"./{FOLDER}/{place.name}"] = content
    return found


def refitted(
    folder: Path, root: str, files: dict[str, bytes], current: bytes | None, edited: Path | None = None
) -> tuple[dict[str, bytes], list[str]]:
    """Keep the looks that a room's root layer names, and mute what of them fits no longer.

    `folder`: of the room. `root`: name of its root layer in `files`. `files`: path -> content of the room that will be
    written; the root layer is changed, `UNFIT` added if need be. `current`: bytes of the root layer that lies there
    now. `edited`: root layer of the room that this one was edited from, whose looks go along. Returns the files of
    looks that go along, and a sentence for every object whose paint is muted.
    """
    along = brought(edited, folder)
    here = [path for path in attached(current) if (folder / path).is_file() and path not in along]
    paths = [*along, *here]
    if not paths:
        return {}, []
    looks = [*(read_looks(edited.parent, along) if edited else []), *read_looks(folder, here)]
    # Beside the folder, so that what its layers refer to outside of it (a store) is found.
    beside, mark = folder.resolve().parent, f".{folder.name}.echousd-"
    for left in beside.glob(f"{glob.escape(mark)}*"):  # of a run that was killed: the folder is ours alone now
        shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=mark, dir=beside) as scratch:
        alone = with_sublayers(files[root], (), lambda path: path.removeprefix("./") in files)
        for path, content in {**files, root: alone}.items():
            place = Path(scratch) / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
            just_written([place])
        try:
            unfit = unfitting(looks, open_stage(Path(scratch) / root))
        except (StageError, ValueError):  # nothing there to paint any more
            unfit = {look.path: list(look.objects) for look in looks}
    if unfit:
        files[UNFIT] = unfit_layer(looks, unfit, {"generator": "echousd"})
    first = [*paths, *([f"./{UNFIT}"] if unfit else [])]
    files[root] = with_sublayers(files[root], first, lambda path: path not in (*paths, f"./{UNFIT}"))
    return {path: content for each in along.values() for path, content in each.items()}, [
        f"{folder / path}: {', '.join(name.rpartition('/')[2] for name in names)} changed or gone since painted; shown "
        "as made, export and paint again"
        for path, names in unfit.items()
    ]


def _parsed(root: bytes) -> Sdf.Layer | None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    try:
        return layer if layer.ImportFromString(root.decode("utf-8")) else None
    except (UnicodeDecodeError, Tf.ErrorException):
        return None
