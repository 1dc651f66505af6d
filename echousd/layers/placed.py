"""A model of somebody else's as a USD asset: a component that places it, refers to it or holds it; whose they are."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf

from echousd.layers.assets import as_asked, component_layer, geometry_layer
from echousd.options import Look
from echousd.shapes.geometry import Geometry, Origin, Original
from echousd.stage.files import layer_bytes
from echousd.stage.paths import asset_file, layer_name, original_file, piece_name
from echousd.stage.pen import ops, say

PLACES, MODEL = "placed", "model"  # the prim that corrects unit, axes, pivot and front, and the model below it


def placed_files(
    name: str, category: str, geometry: Geometry, data: Mapping[str, Any], folder: Path, options: Look
) -> dict[str, bytes]:
    """Path in the room's folder -> content: the component, our collider where it has none, a converted model.

    `category`: its word. `geometry`: with an original. `data`: customLayerData. `folder`: where the component will lie,
    which the path of an original that stays where it is becomes relative to. `options`: of what is ours; the model
    itself stays as it is.
    """
    original = geometry.original
    assert original is not None
    component = component_layer(name, category, geometry.mesh.bounds, geometry, data)
    _place(component, name, original, _reference(name, original, folder))
    ours = {asset_file(name): component}
    if not original.colliders:
        ours[asset_file(name, "geo")] = geometry_layer(name, {}, geometry, data)
    for layer in ours.values():
        as_asked(layer, options, theirs=lambda path: path != f"./{layer_name(name, 'geo')}")
    found = {path: layer_bytes(layer, path[-5:]) for path, layer in ours.items()}
    return found | {original_file(name, path): content for path, content in original.files.items()}


def carried_files(name: str, original: Original, old: Mapping[str, bytes], folder: Path) -> dict[str, bytes]:
    """The files of an asset as they are, but for the path of a model outside as seen from another folder."""
    files = dict(old)
    if original.layer is None:
        return files
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(files[asset_file(name)].decode())
    model = layer.GetPrimAtPath(f"/{name}/{piece_name(name, PLACES)}/{piece_name(name, MODEL)}")
    path = _reference(name, original, folder)
    if model and all(payload.assetPath != path for payload in model.payloadList.prependedItems):
        model.payloadList.prependedItems = [Sdf.Payload(path, Sdf.Path(original.prim))]
        files[asset_file(name)] = layer_bytes(layer, ".usda")
    return files


def _reference(name: str, original: Original, folder: Path) -> str:
    """The path from an asset's component to the model: relative, with forward slashes."""
    if original.layer is None:
        return f"./{original_file(name, original.main).split('/', 2)[2]}"
    try:
        path = Path(os.path.relpath(original.layer, folder.absolute())).as_posix()
    except ValueError:  # on another drive
        return original.layer.as_posix()
    return path if path.startswith(".") else f"./{path}"


def _place(layer: Sdf.Layer, name: str, original: Original, path: str) -> None:
    """Author, in an asset's component layer, the prim that places the model and the payload that is the model."""
    with Sdf.ChangeBlock():
        root = layer.GetPrimAtPath(f"/{name}")
        places = Sdf.PrimSpec(root, piece_name(name, PLACES), Sdf.SpecifierDef, "Xform")
        matrix = Gf.Matrix4d(*(round(float(v), 9) + 0.0 for v in np.asarray(original.pose).T.ravel()))
        places.kind = Kind.Tokens.subcomponent
        say(places, ops(transform=("matrix4d", matrix)))
        model = Sdf.PrimSpec(places, piece_name(name, MODEL), Sdf.SpecifierDef)
        model.kind = ""  # a component has none below it, nor has a subcomponent
        model.payloadList.prependedItems.append(Sdf.Payload(path, Sdf.Path(original.prim)))


def attribution(room: str, origins: dict[str, Origin]) -> str:
    """A table of the models, by licence and author."""
    notice = "Made by others, and placed and scaled here; a licence may ask that they are named."
    lines = [f"# Models in {room}", "", notice, ""]
    lines += ["| asset | model | licence | author |", "|---|---|---|---|"]
    for name, origin in sorted(origins.items(), key=lambda entry: (entry[1].licence, entry[1].credit, entry[0])):
        row = (name, origin.asset, origin.licence, origin.credit or "unknown")
        cells = (" ".join(words.split()).replace("|", "\\|")[:200] for words in row)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
