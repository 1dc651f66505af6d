"""Save a room: the layered folder with its manifest and preview."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pxr import Sdf, Usd

import echousd
from echomodel.late import Late, lates
from echousd.draw.pictures import is_ours, png
from echousd.folder import folder as folders
from echousd.folder import ownership
from echousd.folder.manifest import MANIFEST_KEY
from echousd.graph import SceneGraph
from echousd.layers.compose import LAYERS, room_files
from echousd.naming import as_identifier
from echousd.options import Look
from echousd.place.living import living_faults
from echousd.room import LayoutOutcome, RoomData
from echousd.shapes.geometry import Geometry
from echousd.shapes.sources.named import beside
from echousd.stage.files import open_stage, write_all
from echousd.stage.harmless import check_harmless
from echousd.stage.paths import UNFIT, layer_file
from echousd.stage.pen import layout_names
from echousd.stage.vouched import just_written

if TYPE_CHECKING:
    from echousd.folder.stored import Shelf

# of rooms that are there already
graph_from_plain = Late("echousd.graph.text:graph_from_plain")
remembered, undone = Late("echousd.folder.history:remembered"), Late("echousd.folder.history:undone")
loses_text, merged_root, referenced = lates("echousd.folder.merging", "loses_text", "merged_root", "referenced")
showing_layout = Late("echousd.stage.showing:showing_layout")


def save_layers(room: RoomData, folder: Path, *, force: bool = False, store: str | Path | None = None) -> Path:
    """Write the layers, assets and the manifest of a room; see `Room.save`.

    Warns of every file that is kept because somebody else wrote or edited it, and names it.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: is a file, the output must be a folder")
    with folders.held(folder):
        old = folders.claim(folder, force=force, root=room.name)
        shelf = None
        if store or (store is None and old.get("store")):
            from echousd.folder.stored import Shelf, shelf_of
            from echousd.store import Store

            shelf = Shelf(Store.create(store), folder) if store else shelf_of(old, folder)
        if shelf:  # of many rooms, whose layers as text would take more than all else that is their own
            room = replace(room, options=room.options.model_copy(update={"crate": True}))
        return _save_layers(room, folder, old, replace(shelf, keys={}) if shelf else None)


def _save_layers(room: RoomData, folder: Path, old: Mapping[str, Any], shelf: Shelf | None) -> Path:
    recorded: dict[str, str] = dict(old.get("files", {}))
    # A folder that was renamed or copied keeps its root's name: other layers refer to it.
    room = replace(room, name=old.get("name") or as_identifier(folder.resolve().name))
    room = replace(room, assets=ownership.free_assets(folder, room, recorded))
    room = replace(room, graph=beside(room.graph, folder))
    files = room_files(room, shelf, folder)
    root, manifest = f"{room.name}.usda", f"{room.name}.json"
    current = ownership.read(folder, root)
    painted: Mapping[str, bytes] = {}
    unfit: Sequence[str] = ()
    if current is not None:
        check_harmless(folder / root)
    if current is not None or room.edited is not None:
        from echousd.layers.paintings import refitted

        painted, unfit = refitted(folder, root, files, current, room.edited)
    owned = {path: folders.digest(content) for path, content in files.items()}
    remarks = []
    if current is not None and root in recorded and folders.digest(current) not in (recorded[root], owned[root]):
        files[root] = merged_root(folder / root, current, files[root])  # not ours alone: `owned` says so
        remarks = [root] if loses_text(current) else []
    for path in (path for files_of in room.carried.values() for path in files_of):
        if path in files and path in recorded and path in owned and ownership.read(folder, path) == files[path]:
            owned[path] = recorded[path]  # if it was edited, it is taken along as it is and still not ours
    replaced = [path for path in files if path != root or root not in recorded] + ([] if old else [manifest])
    kept = ownership.backups(folder, [*replaced, *remarks], recorded, files)
    files |= painted  # the user's own: not among what the manifest knows as ours
    files |= {name: ownership.read(folder, path) or b"" for path, name in kept.items() if name}
    gone = [path for path in recorded if path not in owned]
    needed = referenced(folder, recorded, gone, replaced) if gone else {}
    owned |= {path: recorded[path] for path in needed}
    history: list[dict[str, Any]] = []
    if room.edited and old:
        steps = graph_from_plain(SceneGraph, old["graph"]).diff(room.graph).lines() if "graph" in old else []
        history, archive = remembered(folder, old, files, owned, list(kept.values()), steps)
        files |= archive
        kept_steps = {entry["restores"] for entry in history}
        owned |= {path: recorded[path] for path in kept_steps & recorded.keys()}
        owned |= {path: folders.digest(content) for path, content in archive.items()}
    gone = [path for path in gone if path not in owned or path in needed]
    fields = {**manifest_of(room, owned), "history": history}
    if shelf:
        fields |= {"store": shelf.at, "stored": dict(sorted(shelf.keys.items()))}
    files[manifest] = (json.dumps(fields, indent=1) + "\n").encode()
    left = {path: ownership.read(folder, path) or b"" for path in gone if path not in needed}
    stale = [path for path, content in left.items() if folders.digest(content) == recorded[path]]
    # What is referenced comes before what refers to it, so that a room opens between any two renames.
    layers = [layer_file(name, crate=room.options.crate) for name in reversed(LAYERS)]
    last = [*layers, UNFIT, root, manifest]
    drawn = ownership.pictures(folder, room.name)
    remove = [*stale, *(undone(folder) if old else ()), *drawn]
    named_kept = {path: name for path, name in kept.items() if name}
    changed = folders.write_together(folder, files, last=last, remove=remove, kept=named_kept)
    just_written(folder / path for path in files if path in owned and path.endswith((".usda", ".usdc")))
    for fault in unfit:
        warnings.warn(fault, stacklevel=3)
    for path in gone:
        if path not in stale and (folder / path).is_file():
            why = f"{needed[path]} refers to it" if path in needed else "it was edited"
            warnings.warn(f"{folder / path}: no longer part of the room; kept, as {why}", stacklevel=3)
    for layer in filter(None, (Sdf.Layer.Find(str(folder / path)) for path in changed)):
        layer.Reload()  # this process holds it open, as it was before
    return folder / root


PREVIEW = 640  # pixels across


def write_pictures(root: Path, stage: Usd.Stage | None = None) -> list[Path]:
    """Draw `<name>.png` and, of several layouts, `<name>_layouts.png` beside the root layer; those that were drawn.

    `stage`: of the root layer, where it is open.
    """
    stage = stage or open_stage(root)
    preview = write_preview(root, stage)  # None without the extra `render`, which a sheet needs as well
    return [drawn for drawn in (preview, preview and write_sheet(root, stage)) if drawn]


def write_preview(root: Path, stage: Usd.Stage | None = None) -> Path | None:
    """Draw `<name>.png` beside the root layer; None where the extra `render` is not installed.

    `stage`: of the root layer, where it is open.
    """
    from echousd.draw.rays import RenderUnavailable
    from echousd.draw.rendering import render_stage
    from echousd.draw.tracing import QUICK

    out = root.with_suffix(".png")
    try:
        picture = render_stage(stage or open_stage(root), size=PREVIEW, rays=QUICK)
    except RenderUnavailable:
        return None
    if out.is_file() and not is_ours(out):
        kept = folders.backup_name(out.parent, out.name)
        out.replace(out.with_name(kept))
        folders.tell_kept(out.parent, out.name, kept)
    write_all({out: png(picture)}, left="the room itself is complete")
    return out


SHEET = 280  # pixels of one layout


def write_sheet(root: Path, stage: Usd.Stage) -> Path | None:
    """Draw `<name>_layouts.png`, all layouts side by side, beside the root layer; None where there is only one.

    The sheet of a room that has only one layout any more is taken away.
    """
    from PIL import Image, ImageDraw

    from echousd.draw.rendering import QUICK, render_stage

    out = root.with_name(f"{root.stem}_layouts.png")
    names = layout_names(stage)
    if out.is_file() and not is_ours(out):
        return None
    if not names:
        out.unlink(missing_ok=True)
        return None
    wide = min(len(names), 4)
    sheet = Image.new("RGB", (wide * SHEET, -(-len(names) // wide) * SHEET), "white")
    for number, name in enumerate(names):
        with showing_layout(stage, name):
            picture = render_stage(stage, size=SHEET, rays=QUICK)
        ImageDraw.Draw(picture).text((8, 6), name, fill="black")
        sheet.paste(picture, (number % wide * SHEET, number // wide * SHEET))
    write_all({out: png(sheet)}, left="the room itself is complete")
    return out


def manifest_of(room: RoomData, files: dict[str, str]) -> dict[str, Any]:
    """What was asked for, what made the room, what became of every relation, and which files are ours."""
    first = room.outcomes[0] if room.outcomes else LayoutOutcome()
    return {
        MANIFEST_KEY: 1, "name": room.name, "generator": f"echousd {echousd.__version__}", "seed": room.provenance.seed,
        "preset": room.provenance.preset, "model": room.provenance.model, "shapes": room.provenance.shapes,
        "source": room.provenance.source, **room.options.model_dump(include=set(Look.model_fields)),
        "layouts": [{"name": f"layout_{i}", **found.to_json()} for i, found in enumerate(room.outcomes)],
        "relations": first.counts(), "notes": list(room.notes),
        "verdicts": [verdict.to_json() for verdict in room.verdicts],
        "living": [fault.to_json() for fault in living_faults(room.graph, room.boxes, room.floor)],
        "graph": json.loads(room.graph.to_json()), "assets": dict(room.assets),
        "meshes": {asset: _mesh_facts(room.geometry[user]) for asset, user in sorted(room.asset_users.items())},
        "files": dict(sorted(files.items())),
    }  # fmt: skip


def _mesh_facts(geometry: Geometry) -> dict[str, Any]:
    origin = geometry.origin
    credit = {"credit": origin.credit} if origin.credit else {}
    facts = {"faces": geometry.faces, "watertight": geometry.watertight}
    asset = {"asset": origin.asset, "sha256": origin.sha256} if origin.asset else {}
    return {**facts, "shapes": origin.shapes, "licence": origin.licence, **credit, **asset}
