"""Rooms whose files are a few words: what saving, editing and stepping do with files, without geometry."""

import json
from contextlib import contextmanager
from unittest.mock import patch

from echousd.folder.manifest import MANIFEST_KEY, find_manifest
from echousd.folder.stored import Shelf, asset_from, shelf_of
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.make import save as saving
from echousd.make.finished import Room
from echousd.room import Provenance

CATEGORIES = {"bed": "double_bed", "lamp": "floor_lamp", "desk": "desk"}


def plain_room(names, seed, root=None):
    """The room of some names; with a root layer, that room edited: what stays is taken along as it lies there."""
    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 3.0)), tuple(Node(name, CATEGORIES[name]) for name in names))
    assets, carried = {name: name for name in names}, {}
    if root is not None:
        manifest = find_manifest(root.parent, root.stem)
        shelf = shelf_of(manifest, root.parent)
        seed = manifest["seed"]
        assets |= {name: asset for name, asset in manifest["assets"].items() if name in assets}
        for asset in {manifest["assets"][name] for name in names if name in manifest["assets"]}:
            if shelf is not None and f"assets/{asset}" in shelf.keys:
                carried[asset] = asset_from(shelf, asset)
            else:
                paths = [path for path in _asset(asset, 0) if (root.parent / path).is_file()]
                carried[asset] = {path: (root.parent / path).read_bytes() for path in paths}
    return Room("bedroom", graph, None, {}, assets, None, provenance=Provenance(seed), carried=carried, edited=root)


@contextmanager
def plain_files():
    """Have rooms saved as words: the files alone are stood in for, not what becomes of them."""
    with (
        patch.object(saving, "room_files", _files),
        patch.object(saving, "manifest_of", _manifest),
        patch("echousd.folder.journal.flush", lambda path: None),
        patch("echousd.store.flush", lambda path: None),
    ):
        yield


def _asset(name, seed):
    return {
        f"assets/{name}/{name}.usda": f'#usda 1.0\n# {name} {seed}\ndef Xform "{name}" {{}}\n'.encode(),
        f"assets/{name}/{name}_geo.usdc": f"{name} {seed}".encode(),
    }


def _files(room, shelf: Shelf | None, folder):
    seed = room.provenance.seed
    names = sorted(set(room.assets.values()))
    files = {"textures/wood.jpg": b"wood"}
    for name in names:
        files |= room.carried.get(name) or _asset(name, seed)
    if shelf is not None:
        shelf.put(files)
        files = {path: content for path, content in files.items() if not shelf.holds(path)}
    told = " ".join(f"{name} {shelf.keys[f'assets/{name}'] if shelf else ''}" for name in names)
    for layer in ("layers/layout.usda", "layers/graph.usda"):
        files[layer] = f"#usda 1.0\n# {layer} {seed} {told}\n".encode()
    layers = "@./layers/layout.usda@, @./layers/graph.usda@"
    data = f"customLayerData = {{ int seed = {seed} }}"
    text = f'#usda 1.0\n(\n    {data}\n    subLayers = [{layers}]\n    upAxis = "Y"\n)\n\ndef Xform "Room"\n{{\n}}\n\n'
    files[f"{room.name}.usda"] = text.encode()
    return files


def _manifest(room, owned):
    graph = json.loads(room.graph.to_json())
    return {
        MANIFEST_KEY: 1, "name": room.name, "seed": room.provenance.seed, "graph": graph, "assets": dict(room.assets),
        "files": dict(sorted(owned.items())),
    }  # fmt: skip
