"""Rooms on any file system of fsspec (`s3://bucket/night`): made in a folder that is thrown away, and put there whole.

    URL/rooms/0000/<id>/...   the room, its manifest last: who finds that has all of it
    URL/store/3f/3fa9...      assets by the hash of their content, as in a folder

Plan, journal and locks stay in the run's own folder on a disk, which object stores cannot hold: nothing there can be
appended to or locked.
"""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from echousd.batches.plan import STORE
from echousd.folder.manifest import find_manifest
from echousd.folder.within import inside
from echousd.store import KEY, MARK, Store


@dataclass(frozen=True, eq=False)
class Remote:
    """A folder on a file system of fsspec.

    Arguments:
        url: such as `s3://bucket/night`, with credentials as that file system takes them from the environment.

    Raises ValueError (of what it does) where nobody answers or what is there is not what it should be.
    """

    url: str

    @cached_property
    def _place(self) -> tuple[Any, str]:
        try:
            from fsspec.core import url_to_fs

            found, root = url_to_fs(self.url)
            return found, root.rstrip("/")
        except Exception as error:  # each file system fails in its own way
            raise ValueError(f"{self.url}: no file system that fsspec can reach ({error})") from None

    def sizes(self, path: str = "") -> dict[str, int]:
        """Path below the URL -> bytes of every file at or below `path`."""
        files, root = self._place
        with self._told("read"):
            files.invalidate_cache()
            top = f"{root}/{path}".rstrip("/")
            found = files.find(top, detail=True) if files.exists(top) else {}
        # a file system may call its files otherwise than it was asked for them (`/bucket` for `bucket`)
        strip = len(files._strip_protocol(root)) + 1
        return {name[strip:]: int(entry["size"]) for name, entry in found.items()}

    def put(self, top: Path, paths: Collection[str]) -> None:
        """Copy files (paths below `top`) in their order; each appears whole where the file system's own do."""
        files, root = self._place
        with self._told("written"):
            for path in paths:
                target = f"{root}/{path}"
                files.makedirs(str(PurePosixPath(target).parent), exist_ok=True)
                files.put_file(str(top / path), target)

    def get(self, path: str, top: Path) -> None:
        """Copy all files at or below `path` to the same paths below a folder, refused where a name leads out of it."""
        files, root = self._place
        for name in self.sizes(path):
            target = inside(top, name, f"{self.url}: a file")  # who filled the bucket may be anybody
            target.parent.mkdir(parents=True, exist_ok=True)
            with self._told("read"):
                files.get_file(f"{root}/{name}", str(target))

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        try:
            yield
        except (OSError, RuntimeError) as error:
            raise ValueError(f"{self.url}: cannot be {what} ({str(error) or type(error).__name__})") from None


def deliver(top: Path, room: str, url: str) -> dict[str, int]:
    """Put a room and what it has in its store (both below `top`) on a file system: assets, files, the manifest last.

    Arguments:
        room: path of its folder below `top`, the same below `url`.

    Returns: key of each of its stored assets -> bytes.
    """
    remote = Remote(url)
    stored: dict[str, int] = {}
    if (top / STORE).is_dir():
        keys = list(Store.open(top / STORE).keys())
        for key in keys:
            place = f"{STORE}/{key[:2]}/{key}"
            files = {path: (top / path).stat().st_size for path in _below(top, place)}
            stored[key] = sum(files.values())
            if remote.sizes(place) != files:  # another room has put it there, or was cut short
                remote.put(top, list(files))
        mark = f"{STORE}/{MARK}"
        if keys and mark not in remote.sizes(mark):
            remote.put(top, [mark])
    name = PurePosixPath(room).name
    manifest = f"{room}/{name}.json"
    remote.put(top, [*(path for path in _below(top, room) if path != manifest), manifest])
    return stored


def complete(url: str, rows: dict[str, dict[str, Any]], paths: dict[str, str]) -> set[str]:
    """Ids of the rooms of journal lines that lie on a file system, assets and all, with as many bytes as they were
    made of; what was changed to something as long is told by `verify` alone, which reads everything.

    Arguments:
        paths: id -> path of its folder below the URL.
    """
    remote = Remote(url)
    held, stored = _held(remote, "rooms"), {Path(path).name: size for path, size in _held(remote, STORE).items()}
    return {
        name
        for name, row in rows.items()
        if row["state"] == "done" and name in paths and held.get(paths[name]) == row.get("bytes", 0)
        if all(stored.get(key) == size for key, size in row.get("stored", {}).items())
    }


def _held(remote: Remote, place: str) -> dict[str, int]:
    """Path of every folder of a shelf (`rooms/0000/<id>`, `store/3f/<key>`) -> bytes below it."""
    held: dict[str, int] = {}
    for path, size in remote.sizes(place).items():
        name = "/".join(PurePosixPath(path).parts[:3])
        held[name] = held.get(name, 0) + size
    return held


@contextmanager
def fetched(url: str, room: str) -> Iterator[Path]:
    """A folder that holds a room (path below the URL) and the run's store as they lie there, for as long as it is open.

    Arguments:
        room: path of its folder.
    """
    remote = Remote(url)
    with tempfile.TemporaryDirectory(prefix="echousd-") as name:
        remote.get(room, Path(name))
        for key in _stored(Path(name) / room):
            remote.get(f"{STORE}/{key[:2]}/{key}", Path(name))
        remote.get(f"{STORE}/{MARK}", Path(name))
        yield Path(name)


def _stored(folder: Path) -> set[str]:

    manifest = find_manifest(folder, folder.name) or {} if folder.is_dir() else {}
    return {key for key in (manifest.get("stored") or {}).values() if KEY.fullmatch(key)}


def _below(top: Path, place: str) -> list[str]:
    return sorted(path.relative_to(top).as_posix() for path in (top / place).rglob("*") if path.is_file())
