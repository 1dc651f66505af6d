"""Names of files that were read from a folder: none leads out of it, by `..`, a root or a link (no pxr here)."""

import os
from pathlib import Path, PurePosixPath, PureWindowsPath


def inside(folder: Path, name: object, entry: str) -> Path:
    """The file that an entry of a room's journal, manifest or layer names, below `folder`.

    Arguments:
        folder: the room's folder, whose own path is trusted.
        name: relative path with forward slashes, as it was read.
        entry: what the error calls the place that holds the name, such as `room.json: files`.

    Raises ValueError for a path that is absolute or goes up, and for links on the way that leave the folder.
    """
    allowed = "allowed: a relative path inside the folder"
    if not isinstance(name, str) or not name or "\0" in name:
        raise ValueError(f"{entry} is {name!r:.80}, {allowed}")
    parts = PurePosixPath(name).parts
    drive = ":" in name and PureWindowsPath(name).drive
    if name.startswith("/") or drive or "\\" in name or ".." in parts or not parts:
        raise ValueError(f"{entry} names {name!r:.200}, outside of {folder}; {allowed}")
    path = folder.joinpath(*parts)
    check_links(folder, path, f"{entry} names {name!r:.200}")
    return path


def check_links(folder: Path, path: Path, entry: str) -> None:
    """Raises ValueError if a link at or above `path` (which lies below `folder`) leads out of the folder."""
    names, place = path.parts[len(folder.parts) :], os.fspath(path)
    for name in reversed(names):
        if name == ".." or os.path.islink(place):  # noqa: PTH114  # a Path for each name of each file takes its time
            break
        place = os.path.dirname(place)  # noqa: PTH120
    else:
        return
    top = os.path.realpath(folder)
    real = os.path.realpath(path)
    if os.path.commonpath([top, real]) == top:
        return
    link = next(
        place for place in (*reversed(path.parents), path) if place != folder and _leads_out(place, folder, top)
    )
    raise ValueError(
        f"{entry}, but {link} is a link to {os.path.realpath(link)}, outside of {folder}; "
        "allowed: files of the folder itself"
    )


def _leads_out(place: Path, folder: Path, top: str) -> bool:
    real = os.path.realpath(place)
    return place.is_relative_to(folder) and os.path.commonpath([top, real]) != top
