"""Save a room: the layered folder with its manifest and preview, or one flat file."""

from __future__ import annotations

import io
import json
import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd

import echousd
from echousd.room import folder as folders
from echousd.room.assets import layer_bytes
from echousd.room.compose import LAYERS, room_files
from echousd.room.geometry import Geometry
from echousd.room.room import Room


def save_room(room: Room, folder: Path, *, force: bool = False, preview: bool = True) -> Path:
    """Write the layered room and its preview; see `Room.save`."""
    root = save_layers(room, folder, force=force)
    if preview:
        write_preview(root)
    return root


def save_layers(room: Room, folder: Path, *, force: bool = False) -> Path:
    """Write the layers, assets and the manifest of a room; see `Room.save`."""
    room = replace(room, name=identifier(folder.resolve().name))
    old = folders.claim(folder, force=force)
    recorded: dict[str, str] = old.get("files", {})
    files = room_files(room)
    root, manifest = f"{room.name}.usda", f"{room.name}.json"
    for path in list(files):
        current = _read(folder / path)
        if current is None or path not in recorded:
            continue
        if folders.digest(current) in (recorded[path], folders.digest(files[path])):
            continue
        if path == root:
            files[path] = _keep_root(folder / path, current, files[path])
        else:  # a layer of ours that somebody edited: the edit is lost to the room, but not to its author
            files[str(Path(path).with_suffix(".edited" + Path(path).suffix))] = current
    owned = {path: folders.digest(content) for path, content in files.items() if ".edited." not in path}
    files[manifest] = (json.dumps(manifest_of(room, owned), indent=1) + "\n").encode()
    stale = [path for path in recorded if path not in owned and _unchanged(folder / path, recorded[path])]
    stale += [f"{old['name']}.{end}" for end in ("json", "png") if old.get("name", room.name) != room.name]
    # What is referenced comes before what refers to it, so that a room opens between any two renames.
    last = [f"layers/{name}.usda" for name in reversed(LAYERS)] + [root, manifest]
    changed = folders.write_together(folder, files, last=last, remove=stale)
    for layer in filter(None, (Sdf.Layer.Find(str(folder / path)) for path in changed)):
        layer.Reload()  # this process holds it open, as it was before
    return folder / root


def identifier(word: str) -> str:
    """A file's or folder's name as a USD identifier."""
    name = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in word) or "room"
    return name if not name[0].isdigit() else f"_{name}"


def save_flat(room: Room, path: Path, *, force: bool = False) -> Path:
    """Write the room as one `.usda` or `.usdc` file without references (variants of the layout included).

    Raises ValueError for another ending, a file that is in the way, or a path that cannot be written.
    """
    from echousd.export import flat_layer
    from echousd.stage import open_stage

    if path.suffix not in (".usda", ".usdc"):
        raise ValueError(f"{path}: a flat room ends in .usda or .usdc, found {path.suffix or 'no ending'!r}")
    if path.exists() and not force:
        raise ValueError(f"{path}: exists; choose another file or use --force")
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        root = save_layers(room, Path(scratch) / room.name)
        write_whole(path, layer_bytes(flat_layer(open_stage(root), layouts=room), path.suffix))
    return path


PREVIEW = 400  # pixels


def write_preview(root: Path) -> Path | None:
    """Draw `<name>.png` beside the root layer; None where the extra `render` is not installed."""
    from echousd.render import QUICK, RenderUnavailable, render_file

    out = root.with_suffix(".png")
    try:
        picture = render_file(root, view="perspective", size=PREVIEW, rays=QUICK)
    except RenderUnavailable:
        return None
    buffer = io.BytesIO()
    picture.save(buffer, "PNG")
    write_whole(out, buffer.getvalue(), left="the room itself is complete")
    return out


def write_whole(path: Path, content: bytes, *, left: str = "nothing was changed") -> None:
    """Write a file so that it is there as a whole or not at all; raises ValueError where that is impossible.

    Arguments:
        left: what the error says about the state in which everything else is left.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise ValueError(f"{path}: cannot be written ({error.strerror or error}); {left}") from None


def manifest_of(room: Room, files: dict[str, str]) -> dict[str, Any]:
    """What was asked for, what made the room, what became of every relation, and which files are ours."""
    kept = sum(v.state == "kept" for v in room.verdicts)
    broken = sum(v.state == "broken" for v in room.verdicts)
    return {
        folders.MANIFEST_KEY: 1,
        "name": room.name,
        "generator": f"echousd {echousd.__version__}",
        "seed": room.provenance.seed,
        "preset": room.provenance.preset,
        "model": room.provenance.model,
        "shapes": room.provenance.shapes,
        "source": room.provenance.source,
        "up_axis": room.options.up_axis,
        "walls": room.options.walls,
        "atlas": room.options.atlas,
        "layouts": max(len(room.layouts), 1),
        "relations": {"kept": kept, "broken": broken, "unmeasured": len(room.verdicts) - kept - broken},
        "notes": list(room.notes),
        "verdicts": [verdict.to_json() for verdict in room.verdicts],
        "graph": json.loads(room.graph.to_json()),
        "assets": dict(room.assets),
        "meshes": {asset: _mesh_facts(room.geometry[user]) for asset, user in sorted(room.asset_users.items())},
        "files": dict(sorted(files.items())),
    }


def _mesh_facts(geometry: Geometry) -> dict[str, Any]:
    origin = geometry.origin
    credit = {"credit": origin.credit} if origin.credit else {}
    facts = {"faces": geometry.faces, "watertight": geometry.watertight}
    return {**facts, "source": origin.source, "licence": origin.licence, **credit}


def _keep_root(path: Path, current: bytes, fresh: bytes) -> bytes:
    """The artist's root layer with our sublayers and data brought up to date."""
    theirs, ours = Sdf.Layer.CreateAnonymous(".usda"), Sdf.Layer.CreateAnonymous(".usda")
    if not theirs.ImportFromString(current.decode("utf-8")) or not ours.ImportFromString(fresh.decode("utf-8")):
        raise ValueError(f"{path}: edited by hand and no longer readable as USD; repair it or delete it")
    axes = [Usd.Stage.Open(layer, Usd.Stage.LoadNone).GetMetadata("upAxis") for layer in (theirs, ours)]
    if axes[0] != axes[1]:
        raise ValueError(f"{path}: edited by hand and {axes[0]}-up; a {axes[1]}-up room needs another folder")
    present = list(theirs.subLayerPaths)
    theirs.subLayerPaths = present + [layer for layer in ours.subLayerPaths if layer not in present]
    theirs.customLayerData = {**theirs.customLayerData, **ours.customLayerData}
    return theirs.ExportToString().encode("utf-8")


def _read(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _unchanged(path: Path, recorded: str) -> bool:
    content = _read(path)
    return content is not None and folders.digest(content) == recorded
