"""Which rooms a path means: a file, the folder of a room, a folder of such folders, or a pattern."""

import glob
from pathlib import Path
from typing import Any

from echousd.folder.manifest import find_manifest
from echousd.naming import HOME, HOUSE, STAGE_FORMS
from echousd.pending import half_written


def rooms_at(place: Path) -> list[Path]:
    """The root layers of the rooms at a path, sorted; raises ValueError for a folder or pattern without any."""
    if (place / HOME).is_file():
        return [place / HOME]
    if place.is_dir():
        found = _rooms_below(place)
        if not found:
            raise ValueError(f"{place}: no room in this folder")
        return found
    if not place.exists() and glob.has_magic(str(place)):
        matches = [Path(path) for path in sorted(glob.glob(str(place), recursive=True))]  # noqa: PTH207
        found = _rooms_of(matches)
        if not found:
            raise ValueError(f"{place}: matches {'no room' if matches else 'nothing'}")
        return found
    return [place]


def stages_at(folder: Path) -> list[Path]:
    """The root layers of the rooms of ours below a folder; where there are none, the stages that lie in it."""
    return _rooms_below(folder) or sorted(path for path in folder.iterdir() if path.suffix in STAGE_FORMS)


def room_at(place: Path) -> Path:
    """The one root layer at a path: a file itself, of a folder its room; raises ValueError where several are."""
    if not place.is_dir():
        return place
    found = root_in(place)
    if found is not None:
        return found
    rooms = rooms_at(place)
    if len(rooms) > 1:
        named = [path.relative_to(place) for path in rooms]
        shown = ", ".join(map(str, named[:8])) + ", ..." * (len(named) > 8)
        raise ValueError(f"{place}: a folder of {len(rooms)} rooms, name one file: {shown}")
    return rooms[0]


def manifest_of(root: Path) -> dict[str, Any]:
    """The manifest of the room whose root layer, or whose layer over it, is `root`; raises ValueError for no room."""
    manifest = find_manifest(root.parent, root.stem) if root.exists() else None
    if manifest is None:
        what = "not a room made by `echousd generate` (no manifest beside it)" if root.exists() else "no such file"
        raise ValueError(f"{root}: {what}")
    return manifest


def own_root(root: Path) -> Path:
    """The root layer of the room that `root` is, or is a layer over; `root` itself where there is no room of ours."""
    manifest = find_manifest(root.parent, root.stem)
    return root.with_name(f"{manifest['name']}.usda") if manifest else root


def check_ours(root: Path) -> None:
    """Raises ValueError as `manifest_of` does, unless a run in the folder was interrupted, which is finished first."""
    if not half_written(root.parent):
        manifest_of(root)


def is_home(place: Path) -> bool:
    """Whether a path is a layer of ours that composes rooms, or the folder of one."""
    file = place / HOME if place.is_dir() else place
    return file.suffix == ".usda" and file.is_file() and f"int {HOUSE} ".encode() in file.read_bytes()


def refuse_house(place: Path) -> None:
    """Raises ValueError that names its rooms for a layer of ours that composes several."""
    if is_home(place):
        place = room_at(place)
        rooms = ", ".join(str(path.relative_to(place.parent)) for path in _rooms_below(place.parent)[:8])
        allowed = "allowed for it are --relate and --unrelate alone, their --undo and --redo"
        raise ValueError(f"{place}: a home, which composes rooms; name one of them: {rooms}; {allowed}")


def layer_over(place: Path) -> Path:
    """Somebody's layer over a room: a file itself, of a room's folder the one layer there that names its root.

    Raises ValueError for a folder without one or with several.
    """
    if not place.is_dir():
        return place
    from echousd.stage.files import layer_there

    root = room_at(place)
    layers = sorted(path for path in root.parent.glob("*.usd*") if path.suffix in STAGE_FORMS and path != root)
    opened = {path: layer_there(path) for path in layers}
    over = [
        path
        for path, layer in opened.items()
        if layer and any((path.parent / below).resolve() == root.resolve() for below in layer.subLayerPaths)
    ]
    if len(over) != 1:
        found = ", ".join(path.name for path in over) or "none"
        raise ValueError(f"{place}: layers over {root.name} in this folder: {found}; name the one that changes it")
    return over[0]


def _rooms_below(place: Path) -> list[Path]:
    rooms = [root_in(folder) for folder in (place, *sorted(path for path in place.rglob("*") if path.is_dir()))]
    return [room for room in rooms if room is not None]


def _rooms_of(matches: list[Path]) -> list[Path]:
    """What a pattern found: rooms of folders, and stages that are no layers or assets of these."""
    rooms = [room for path in matches if path.is_dir() for room in _rooms_below(path)]
    stages = [path for path in matches if path.suffix in STAGE_FORMS and path.is_file()]
    folders = {room.parent for room in rooms}
    rooms += [path for path in stages if folders.isdisjoint(path.parents)]
    return sorted(dict.fromkeys(rooms))


def root_in(folder: Path) -> Path | None:
    """The root layer of the room whose folder it is, None where there is none."""
    manifest = find_manifest(folder)
    if manifest is None and half_written(folder):  # the first room there: whoever opens it is told
        return folder / f"{folder.name}.usda"
    root = None if manifest is None else folder / f"{manifest['name']}.usda"
    return root if root is not None and root.is_file() else None
