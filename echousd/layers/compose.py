"""All files of a layered room as bytes, without touching the disk: the same room gives the same bytes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Sdf

import echousd
from echomodel.dressing import KINDS
from echomodel.late import Late
from echousd.draw.sight import Furniture
from echousd.dressing.dress import Dressing, dress
from echousd.dressing.setting import Recipe, Thing, geometry_of
from echousd.layers import assets, cameras, lights, materials, physics, structure
from echousd.layers.cameras import room_points
from echousd.naming import free_name
from echousd.options import Look
from echousd.room import RoomData
from echousd.shapes import looks
from echousd.shapes.finishes.baking import let_go
from echousd.shapes.geometry import LICENCE, Geometry, Part
from echousd.shapes.styles import ROOM_STYLE
from echousd.shapes.surface import Surface, surfaces
from echousd.stage.encoding import relation_name
from echousd.stage.files import layer_bytes
from echousd.stage.paths import DRESSING, OBJECTS, SHELL, asset_file, class_path, layer_file, piece_path
from echousd.stage.pen import Pen, layout_pens, ops
from echousd.stage.taxonomy import ade20k, word_of
from echousd.stage.write import graph_layer as write_graph_layer

if TYPE_CHECKING:
    from echousd.folder.stored import Shelf

OF_OTHERS = ("attribution", "carried_files", "placed_files")  # of rooms with models of other people
attribution, carried_files, placed_files = (Late(f"echousd.layers.placed:{name}") for name in OF_OTHERS)
write_nodes, thumbnails = Late("echousd.dressing.nodes:write_nodes"), Late("echousd.draw.from_files:thumbnails")
FILE = "ATTRIBUTION.md"
OTHERS = "room_others"  # what the names of a room's second materials begin with
ASSETS = {"atlas", "meters_per_unit", "up_axis", "room_path"}  # options that the files of an asset depend on
GENERATOR = f"echousd {echousd.__version__}"
LAYERS = ("dressing", "materials", "physics", "layout", "graph", "geometry", "shell")  # strongest first


@dataclass(frozen=True)
class Asset:
    """One piece of furniture, ready to be written: path of a part below its root -> material slots, and the files."""

    name: str
    slots: Mapping[str, Sequence[str]]
    files: Mapping[str, bytes]


def room_files(room: RoomData, shelf: Shelf | None = None, folder: Path | None = None) -> dict[str, bytes]:
    """Relative path -> content of everything that a room consists of, except the preview and the manifest.

    `shelf`: takes assets and images, which are not among the files then. `folder`: where the room will lie, which paths
    of models outside of it are relative to; None = the present one.
    """
    place = (folder or Path.cwd()) / "assets"
    made = {name: _asset(room, name, user, shelf, place / name) for name, user in room.asset_users.items()}
    dressing = dress(room)
    asked = Look(**room.options.model_dump(include=ASSETS))
    small = {name: _small(asked, name, recipe) for name, recipe in dressing.recipes.items()}
    files = {path: content for asset in (*made.values(), *small.values()) for path, content in asset.files.items()}
    origins = {name: room.geometry[user].origin for name, user in room.asset_users.items()}
    if theirs := {name: origin for name, origin in origins.items() if origin.asset}:  # models of other people
        files[FILE] = attribution(room.name, theirs).encode()
    if room.options.thumbnails:
        files |= thumbnails(files, [*made, *small])
    built = structure.shell_prims(room, dressing.bare, dressing.cuts)
    harmony = room.options.palette or looks.palette_of_room(room.provenance.seed, room.graph.room.style)
    slots = sorted({slot for asset in small.values() for slots in asset.slots.values() for slot in slots})
    named, bindings = room_slots(room, made, built, slots)
    shown = looks.alternatives(harmony, room.graph.room.style)
    tables = {word: {name: looks.look(word, *of) for name, of in named.items()} for word in shown}
    of_looks = [partial(materials.look_images, look, harmony) for look in tables[harmony].values()]
    with ThreadPoolExecutor(1) as beside:  # what bakes them lets go of Python's lock
        others = beside.map(partial.__call__, of_looks[::2])
        images = [one() for one in of_looks[1::2]]
    let_go()
    for found in (*images, *others):  # equal images are one file
        files |= dict(found.values())
    files |= lights.image_files(room)
    layers = {
        "geometry": geometry_layer(room),
        "shell": structure.shell_layer(built, layer_data(room, f"{room.name}_shell"), room.graph.room.openings),
        "graph": graph_layer(room), "layout": layout_layer(room), "physics": physics_layer(room, built),
        "materials": materials_layer(room, bindings, tables, harmony),
    }  # fmt: skip
    if room.options.dress != "none":
        layers["dressing"] = dressing_layer(room, dressing, small)
    if shelf is not None:
        shelf.put(files)
        files = {path: content for path, content in files.items() if not shelf.holds(path)}
    for name, layer in layers.items():
        if shelf is not None:
            shelf.redirect(layer)
        path = layer_file(name, crate=room.options.crate)
        files[path] = _bytes(room.options, layer, path)
    root = root_layer(room, dressing.hung, [part.extent for part in built if part.label == "wall"])
    if shelf is not None:
        shelf.redirect(root, above=".")
    files[f"{room.name}.usda"] = _bytes(room.options, root, ".usda")
    return files


def layer_data(room: RoomData, name: str) -> dict[str, Any]:
    """The customLayerData of a layer: who made it, from what, and under which licence."""
    return {
        "asset_name": name, "generator": GENERATOR, "seed": room.provenance.seed,
        "model": room.provenance.model, "asset_license": LICENCE,
    }  # fmt: skip


def simready_data(room: RoomData) -> dict[str, Any]:
    """What SimReady's profiles ask of a root layer besides; the date is the earliest there is, as in our archives."""
    about = {"asset_type": "Scene", "source_file": room.provenance.source or "none", "usd_date_generated": "1980-01-01"}
    return {**about, "SimReady_Metadata": dict(about)}


def geometry_layer(room: RoomData) -> Sdf.Layer:
    """`layers/geometry.usda`: every object references its asset."""
    pen = _pen(room, "geometry")
    for path, kind in (("/Room", "assembly"), (OBJECTS, "group"), (SHELL, "group")):
        pen.define(path, "Xform", kind=kind)
    for node in room.graph.nodes:
        alike: dict[str, Any] = {"instanceable": True} if node.name in instanced(room) else {}
        pen.define(f"{OBJECTS}/{node.name}", "Xform", **alike)
        pen.label(f"{OBJECTS}/{node.name}", ade20k=ade20k(word_of(node)))
    assets.refer(pen.over(OBJECTS), room.assets)
    return pen.layer


def instanced(room: RoomData) -> frozenset[str]:
    """Names of the objects that are instances: those of ours whose asset has another user, where that is asked for."""
    users = Counter(room.assets.values())
    shared = {name for name, asset in room.assets.items() if users[asset] > 1 and room.geometry[name].original is None}
    return frozenset(shared if room.options.instances else ())


def graph_layer(room: RoomData) -> Sdf.Layer:
    """`layers/graph.usda`: nodes, labels and relations, as asked for."""
    layer = write_graph_layer(room.graph)
    layer.customLayerData = {**layer.customLayerData, **layer_data(room, f"{room.name}_graph")}
    return layer


def layout_layer(room: RoomData) -> Sdf.Layer:
    """`layers/layout.usda`: overs with xformOps, in a variant set `layout` where there are several layouts."""
    pen = _pen(room, "layout")
    pen.layer.pseudoRoot.SetInfo("upAxis", room.options.up_axis)  # its places are so already
    pen.over("/Room")
    for boxes, inside in zip(room.layouts, layout_pens(pen, len(room.layouts), "layout_0"), strict=True):
        for number, name in enumerate(room.names):
            x, y, z = (round(float(v), 5) + 0.0 for v in boxes.position[number])
            turn = ("float", round(float(np.degrees(float(boxes.yaw[number]))), 4) + 0.0)
            place = (x, 0.0 - z, y) if room.options.up_axis == "Z" else (x, y, z)
            turned = {f"rotate{room.options.up_axis}": turn}
            inside.over(f"{OBJECTS}/{name}", ops(translate=("double3", place), **turned))
    return pen.layer


def physics_layer(room: RoomData, built: Sequence[structure.ShellPrim]) -> Sdf.Layer:
    """`layers/physics.usda`: the scene, the shell, its doors' hinges; the furniture's physics is in its assets."""
    pen = _pen(room, "physics")
    pen.over("/Room")
    forms = {True: "convexHull", False: "none"}  # what may turn, what stands as it is
    solid = {mesh.path: forms[part.joint is not None] for part in built for mesh in part.meshes if mesh.solid}
    physics.write_physics(pen, solid)
    for part in built:
        if part.joint and part.mass:
            physics.write_hinge(pen, part.path, part.joint, part.mass)
    return pen.layer


def room_slots(
    room: RoomData, made: Mapping[str, Asset], built: Sequence[structure.ShellPrim], small: Collection[str]
) -> tuple[dict[str, tuple[str, int]], dict[str, str]]:
    """Material name -> slot and variant of its look, and prim path -> material name; the dressing binds its own.

    `made`: the furniture. `built`: the shell. `small`: material slots of the dressing.
    """
    table: dict[str, tuple[str, int]] = {}
    bindings: dict[str, str] = {}
    variants, slugs, alike = {ROOM_STYLE: 0}, _slugs(room), instanced(room)
    for node in room.graph.nodes:
        asset, style = room.assets[node.name], room.styles[node.name]
        slug, variant = slugs[style], variants.setdefault(style, len(variants))
        if style == ROOM_STYLE and looks.second(room.provenance.seed, node.category):
            slug, variant = OTHERS, 1
        above = class_path(asset) if node.name in alike else f"{OBJECTS}/{node.name}"
        for path, slot in assets.slot_paths(above, made[asset].slots).items():
            name = f"{slug}_{slot}"
            table[name] = slot, variant
            bindings[path] = name
    table |= {f"{ROOM_STYLE}_{slot}": (slot, 0) for slot in small}
    covered = {f"{SHELL}/{name}": slot for name, slot in structure.covered_walls(room).items()}
    shell = {mesh.look: mesh.look for part in built for mesh in part.meshes} | {slot: slot for slot in covered.values()}
    shell |= {"floor": structure.floor_slot(room), "glass": "pane"}
    table |= {name: (slot, 0) for name, slot in shell.items()}
    for part in built:
        own = {"wall": covered.get(part.path, "wall")}
        bindings |= {mesh.path: own.get(mesh.look, mesh.look) for mesh in part.meshes}
    used = {*bindings.values(), *(f"{ROOM_STYLE}_{slot}" for slot in small)}
    return {name: of for name, of in table.items() if name in used}, bindings


def materials_layer(
    room: RoomData, bindings: Mapping[str, str], tables: Mapping[str, Mapping[str, looks.Look]], harmony: str
) -> Sdf.Layer:
    """`layers/materials.usda`: materials, bindings (prim path -> material), and the variant set `palette`.

    `tables`: harmony -> material name -> its look. `harmony`: of the whole room.
    """
    pen = _pen(room, "materials")
    pen.over("/Room")
    materials.write_looks(pen, tables[harmony], bindings, also=tables[harmony], harmony=harmony)
    for asset in sorted({room.assets[name] for name in instanced(room)}):
        assets.as_class(pen.layer, asset)
    materials.write_palettes(pen, harmony, tables)
    if room.options.materialx:
        from echousd.layers.materialx import write_networks

        write_networks(pen, harmony, tables)
    return pen.layer


def root_layer(room: RoomData, hung: Furniture | None = None, walls: Sequence[np.ndarray] = ()) -> Sdf.Layer:
    """The root layer: metadata, sublayers, lights and cameras; `hung`: what stands in a camera's way at walls; `walls`:
    lower and upper corner of each with its windows, of which a bay stands out."""
    pen = _pen(room, "")
    layer = pen.layer
    layer.customLayerData = {**layer.customLayerData, **simready_data(room)}
    layer.documentation = (
        "A room made by EchoUSD. Put your own opinions into a stronger layer; layers/ is rewritten. "
        "Readers that compose no sublayers (three.js, tinyusdz) need `echousd export` of it."
    )
    seen = np.concatenate([room_points(room), *walls])
    bounds = np.array([seen.min(0), seen.max(0)])
    values = {"float3[] extentsHint": bounds.astype(np.float32)}
    pen.define("/Room", "Xform", values, ["GeomModelAPI"], kind="assembly", assetInfo={"name": room.name})
    furniture = Furniture(*(np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw)))
    lights.write_lights(pen, room, bounds)
    walled = room.floor if room.options.walls else None
    main = cameras.main_piece(room.graph.room.type, [node.category for node in room.graph.nodes], furniture)
    openings = cameras.opening_boxes(room, windows=True), cameras.opening_boxes(room, windows=False)
    cameras.write_cameras(pen, seen, furniture, walled, hung, openings, main)
    names = [name for name in LAYERS if name != "dressing" or room.options.dress != "none"]
    layer.subLayerPaths = [f"./{layer_file(name, crate=room.options.crate)}" for name in names]
    return layer


def _asset(room: RoomData, name: str, user: str, shelf: Shelf | None, folder: Path) -> Asset:
    geometry, word = room.geometry[user], word_of(room.graph.node(user))
    if geometry.original is not None:
        if shelf is not None:  # a model lies once in the store, however many rooms place it in whatever size
            kept = shelf.kept_apart(name, geometry.original.files, geometry.original.main)
            original = replace(geometry.original, layer=kept, files={}) if kept else geometry.original
            geometry, folder = replace(geometry, original=original), shelf.place
        assert geometry.original is not None
        if name in room.carried:
            return Asset(name, {}, carried_files(name, geometry.original, room.carried[name], folder))
        data = _asset_data(name, geometry)
        return Asset(name, {}, placed_files(name, word, geometry, data, folder, room.options))
    if name in room.carried:
        carried = {piece_path("", name, part.name, part.body): tuple(part.slots) for part in geometry.parts}
        return Asset(name, carried, room.carried[name])
    return _written(room.options, name, word, room.styles[user], geometry)


@lru_cache(maxsize=1024)  # of some 25 kB each
def _small(look: Look, name: str, recipe: Recipe) -> Asset:
    """A small thing, of which rooms have many; `look`: as `ASSETS` says."""
    return _written(look, name, KINDS[recipe[0]].name, ROOM_STYLE, geometry_of(*recipe))


def _written(look: Look, name: str, category: str, style: str, geometry: Geometry) -> Asset:
    forms = _forms(name, geometry.parts, atlas=look.atlas)
    extents = np.stack([form.extent for form in forms.values()])
    extent = np.stack([extents[:, 0].min(0), extents[:, 1].max(0)])
    data = _asset_data(name, geometry)
    payload = assets.geometry_layer(name, forms, geometry, data, style, solid=physics.stops(category))
    layer = assets.component_layer(name, category, extent, geometry, data)
    coarse = _forms(name, geometry.coarse) if geometry.coarse else {}
    low = {asset_file(name, "low"): _bytes(look, assets.coarse_layer(name, coarse, data), ".usdc")} if coarse else {}
    slots = {part: tuple(form.groups) for part, form in forms.items()}
    return Asset(name, slots, {
        **low, asset_file(name, "geo"): _bytes(look, payload, ".usdc"), asset_file(name): _bytes(look, layer, ".usda"),
    })  # fmt: skip


def _forms(name: str, parts: Sequence[Part], *, atlas: bool = False) -> dict[str, Surface]:
    """Path of each part below an asset's root -> its surface."""
    made = surfaces([(part.mesh, part.slots, part.crease) for part in parts], atlas=atlas)
    return {piece_path("", name, part.name, part.body): form for part, form in zip(parts, made, strict=True)}


def _bytes(look: Look, layer: Sdf.Layer, path: str) -> bytes:
    """A layer of the room as it lies on disk, in the conventions that are asked for; `path` ends as its file does."""
    return layer_bytes(assets.as_asked(layer, look), path[-5:])


def _asset_data(name: str, geometry: Geometry) -> dict[str, Any]:
    """The customLayerData of an asset's layers."""
    credit = {"asset_credit": geometry.origin.credit} if geometry.origin.credit else {}
    return {"asset_name": name, "generator": GENERATOR, "asset_license": geometry.origin.licence, **credit}


def _slugs(room: RoomData) -> dict[str, str]:
    """Style -> the first word of its materials' names; styles that differ in what no name may hold stay apart."""
    out: dict[str, str] = {}
    for style in (room.styles[node.name] for node in room.graph.nodes):
        if style not in out:
            word = "".join(c if Sdf.Path.IsValidIdentifier(f"a{c}") else "_" for c in style)
            word = word if word[:1].isalpha() else f"style_{word}"
            out[style] = free_name(word, {ROOM_STYLE, OTHERS, *out.values()} - {style})
    return out


def _pen(room: RoomData, layer: str) -> Pen:
    return Pen.blank("Room", data=layer_data(room, f"{room.name}_{layer}" if layer else room.name))


def dressing_layer(room: RoomData, dressing: Dressing, small: Mapping[str, Asset]) -> Sdf.Layer:
    """`layers/dressing.usda`: everything below `/Room/Dressing`, in variants as the layout; muted, the room is bare."""
    pen = _pen(room, "dressing")
    pen.over("/Room")
    users = Counter(dressing.assets[name] for things in dressing.layouts for name in things)
    shared = [asset for asset, count in users.items() if room.options.instances and count > len(dressing.layouts)]
    for things, inside in zip(dressing.layouts, layout_pens(pen, len(dressing.layouts)), strict=True):
        _write_things(inside, things, dressing, small, shared)
    for asset in sorted(shared):
        _bind_parts(pen, class_path(asset), small[asset])
        assets.as_class(pen.layer, asset)
    taken = [relation_name(*relation.triple) for relation in room.graph.relations]
    for number, graph in enumerate(dressing.graphs):
        at = f"/Room{{layout=layout_{number}}}" if len(dressing.layouts) > 1 else "/Room"
        write_nodes(pen.layer, graph, Sdf.Path(at), taken)
    return pen.layer


def _write_things(
    pen: Pen, things: Mapping[str, Thing], dressing: Dressing, small: Mapping[str, Asset], shared: Sequence[str]
) -> None:
    group = pen.define(DRESSING, "Xform", kind="group")
    for name, thing in things.items():
        asset, path = dressing.assets[name], f"{DRESSING}/{name}"
        place = tuple(round(float(v), 5) + 0.0 for v in thing.position)
        turn = round(float(np.degrees(thing.yaw)), 4) + 0.0
        alike: dict[str, Any] = {"instanceable": True} if asset in shared else {}
        pen.define(path, "Xform", ops(translate=("double3", place), rotateY=("float", turn)), **alike)
        if asset not in shared:
            _bind_parts(pen, path, small[asset])
    assets.refer(group, {name: dressing.assets[name] for name in things})


def _bind_parts(pen: Pen, root: str, asset: Asset) -> None:
    """Bind a small thing's parts below a prim, or below its class; another layer defines the material."""
    for where, slot in assets.slot_paths(root, asset.slots).items():
        pen.bind(where, f"{materials.LOOKS}/{ROOM_STYLE}_{slot}")
