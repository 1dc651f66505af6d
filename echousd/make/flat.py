"""A room as one flat file; what differs between its layouts is in variants of `layout`."""

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pxr import Sdf, Usd

from echomodel.files import check_free
from echousd.exporting.formats import flat_layer
from echousd.exporting.packing import Package, Reach, images_beside
from echousd.layers.lights import LIGHTS
from echousd.layers.materials import LOOKS
from echousd.make.save import save_layers
from echousd.room import RoomData
from echousd.stage import encoding as usd
from echousd.stage.files import layer_bytes, open_stage, write_all
from echousd.stage.paths import DRESSING, OBJECTS, ROOM
from echousd.stage.pen import VARIANTS, layout_names
from echousd.stage.showing import showing_layout
from echousd.stage.turning import move_room


def save_flat(room: RoomData, path: Path, *, force: bool = False) -> Path:
    """Write the room as one `.usda` or `.usdc` file without references (variants of the layout included).

    Its images lie beside it in `<name>_textures/`.

    Raises ValueError for another ending, a file that is in the way, or a path that cannot be written.
    """
    if path.suffix not in (".usda", ".usdc"):
        raise ValueError(f"{path}: a flat room ends in .usda or .usdc, found {path.suffix or 'no ending'!r}")
    check_free(path, force=force)
    at = room.options.room_path
    room = replace(room, options=room.options.replaced(room_path=ROOM))
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        stage = open_stage(save_layers(room, Path(scratch) / room.name))
        package = Package(Reach.of(stage), images_beside(path))
        layer = _with_layouts({name: _flat(stage, name, package) for name in layout_names(stage) or ("",)})
        move_room(layer, at)
    write_all({path: layer_bytes(layer, path.suffix), **package.files(path.parent)})
    return path


def _flat(stage: Usd.Stage, layout: str, package: Package) -> Sdf.Layer:
    with showing_layout(stage, layout or None):
        return flat_layer(stage, package=package)


def _with_layouts(layouts: Mapping[str, Sdf.Layer]) -> Sdf.Layer:
    """The first of some flat layers, with the places of objects and lamps and the dressing of each in a variant."""
    layer = next(iter(layouts.values()))
    if len(layouts) == 1:
        return layer
    room = layer.GetPrimAtPath(ROOM)
    variants = Sdf.VariantSetSpec(room, VARIANTS)
    room.variantSetNameList.prependedItems = [VARIANTS]
    room.variantSelections[VARIANTS] = next(iter(layouts))
    for name, found in layouts.items():
        Sdf.VariantSpec(variants, name)
        variant = Sdf.Path(ROOM).AppendVariantSelection(VARIANTS, name)
        for path in (*_places(found), *filter(found.GetPrimAtPath, (DRESSING,)), *_small_relations(found)):
            inside = Sdf.Path(path).ReplacePrefix(ROOM, variant)
            Sdf.CreatePrimInLayer(layer, inside.GetPrimPath())
            Sdf.CopySpec(found, path, layer, inside)
        for look in found.GetPrimAtPath(LOOKS).nameChildren:  # which no other layout needs, perhaps
            if not layer.GetPrimAtPath(look.path):
                Sdf.CopySpec(found, look.path, layer, look.path)
    for path in _places(layer):
        layer.GetPrimAtPath(path.GetPrimPath()).RemoveProperty(layer.GetPropertyAtPath(path))
    for path in _small_relations(layer):
        del layer.GetPrimAtPath(path.GetParentPath()).nameChildren[path.name]
    if layer.GetPrimAtPath(DRESSING):
        del room.nameChildren[Sdf.Path(DRESSING).name]
    return layer


def _small_relations(layer: Sdf.Layer) -> list[Sdf.Path]:
    """Paths of the relations of small things that are nodes."""
    prims = layer.GetPrimAtPath(f"{ROOM}/{usd.GRAPH_NAME}").nameChildren
    ends = {p.path: p.relationships[usd.SUBJECT].targetPathList for p in prims if usd.SUBJECT in p.relationships}
    return [path for path, found in ends.items() if any(end.HasPrefix(DRESSING) for end in found.explicitItems)]


def _places(layer: Sdf.Layer) -> list[Sdf.Path]:
    """Paths of the transforms of objects and lamps."""
    objects = layer.GetPrimAtPath(OBJECTS).nameChildren
    lamps = [prim for prim in layer.GetPrimAtPath(LIGHTS).nameChildren if prim.name.startswith("lamp_")]
    return [found.path for prim in (*objects, *lamps) for found in prim.properties if found.name.startswith("xformOp")]
