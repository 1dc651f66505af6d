"""A room's assets and images in a store: which folders they become, and what its layers call them then."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from pxr import Sdf, UsdUtils

from echomodel.files import raising
from echousd.store import Store

SHARED = ("assets", "textures")  # folders of a room whose entries are put into a store


@dataclass
class Shelf:
    """The store as one room sees it.

    Arguments:
        store: where its assets go. folder: of the room.
        keys: `assets/bed` or `textures/wood.jpg` -> its key, of what was put.
    """

    store: Store
    folder: Path
    keys: dict[str, str] = field(default_factory=dict)
    _paths: dict[str, str] = field(default_factory=dict)

    @property
    def at(self) -> str:
        """The store's path from the room's folder, with forward slashes; raises ValueError where there is none."""
        try:
            return Path(os.path.relpath(os.path.realpath(self.store.root), os.path.realpath(self.folder))).as_posix()
        except ValueError:
            raise ValueError(
                f"{self.store.root}: on another drive than {self.folder}, allowed: a store on the same"
            ) from None

    @property
    def place(self) -> Path:
        """Where an asset will lie, whatever its key: as deep in the store."""
        return Path(os.path.realpath(self.store.root)) / "00" / "0"

    def kept_apart(self, asset: str, files: Mapping[str, bytes], main: str) -> Path | None:
        """Put somebody else's model (name -> content) into the store by itself; returns its layer, None for no files.

        Its key stands in the manifest, as the component that refers to it lies in the store, where nobody looks.
        """
        if not files:
            return None
        key = self.keys[f"originals/{asset}"] = self.store.put(files)
        return Path(os.path.realpath(self.store.root)) / key[:2] / key / main

    def put(self, files: Mapping[str, bytes]) -> None:
        """Put the assets and images among a room's files (relative path -> content) into the store."""
        units: dict[str, dict[str, bytes]] = {}
        for path, content in files.items():
            if unit := unit_of(path):
                units.setdefault(unit, {})[path] = content
        for unit, inside in units.items():
            names = {path[len(unit) + 1 :] or PurePosixPath(path).name: path for path in inside}
            key = self.keys[unit] = self.store.put({name: inside[path] for name, path in names.items()})
            for name, path in names.items():
                self._paths[path] = f"{self.at}/{key[:2]}/{key}/{name}"

    def redirect(self, layer: Sdf.Layer, above: str = "..") -> None:
        """Have a layer name the store's files in place of the room's; `above`: the room from the layer's folder."""
        to = {f"{above}/{path}": f"{above}/{stored}" for path, stored in self._paths.items()}
        UsdUtils.ModifyAssetPaths(layer, lambda path: to.get(path, path))

    def holds(self, path: str) -> bool:
        """Whether a file of the room (relative path) lies in the store."""
        return unit_of(path) in self.keys


def unit_of(path: str) -> str:
    """`assets/bed` for what lies below it, an image's own path, "" for what stays with the room."""
    parts = PurePosixPath(path).parts
    return "/".join(parts[:2]) if len(parts) > 1 and parts[0] in SHARED else ""


def shelf_of(manifest: Mapping[str, Any], folder: Path) -> Shelf | None:
    """The shelf that a saved room uses; raises ValueError where its store is gone or is none."""
    at = manifest.get("store")
    if not at:
        return None
    if "\0" in at or "\\" in at or PurePosixPath(at).is_absolute() or PureWindowsPath(at).drive:
        raise ValueError(f"{folder}: its manifest names the store {at!r:.80}, allowed: a relative path")
    with raising(f"{folder}: its manifest names the store {at!r:.80}:"):
        store = Store.open(os.path.realpath(folder / at))
    return Shelf(store, folder, dict(manifest.get("stored") or {}))


def asset_from(shelf: Shelf, asset: str) -> dict[str, bytes]:
    """Files of a stored asset as they would lie in the room's folder; raises ValueError where they are damaged."""
    unit = f"assets/{asset}"
    return {f"{unit}/{name}": content for name, content in shelf.store.read(shelf.keys[unit]).items()}
