"""One piece of furniture as a USD asset: a light component layer with a payload, and the heavy geometry behind it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pxr import Sdf

from echomodel.late import lates
from echomodel.triangles import area_normals, lengths
from echousd.layers.materials import write_looks, write_palettes
from echousd.layers.physics import collides, write_asset_physics, write_joints
from echousd.options import Look
from echousd.shapes.geometry import Geometry
from echousd.shapes.looks import alternatives, look, palette_for
from echousd.shapes.surface import Surface, plain
from echousd.stage.paths import CLASSES, DESCRIPTION, GEO, MTL, ROOM, class_path, layer_name, piece_path
from echousd.stage.pen import Pen, ops, say
from echousd.stage.taxonomy import ade20k
from echousd.stage.units import METRES

move_room, rescale, turn_up = lates("echousd.stage.turning", "move_room", "rescale", "turn_up")
LOD, HIGH, LOW, PROXY = "LOD", "high", "low", "proxy"  # a variant set and its variants, the default first


def refer(group: Sdf.PrimSpec, references: Mapping[str, str]) -> None:
    """Have the prims `references` below one each refer to the asset that it names."""
    for name, asset in references.items():
        arcs = group.nameChildren[name].referenceList
        arcs.prependedItems.append(Sdf.Reference(f"../assets/{asset}/{asset}.usda"))


def as_asked(layer: Sdf.Layer, look: Look, theirs: Callable[[str], bool] = lambda path: False) -> Sdf.Layer:
    """A layer of ours with the unit, the up axis and the room's path that are asked for, changed in place.

    `theirs`: as for `turn_up`.
    """
    metres = layer.pseudoRoot.GetInfo(METRES) if layer.pseudoRoot.HasInfo(METRES) else 1.0
    if (metres, "Y", ROOM) == (look.meters_per_unit, look.up_axis, look.room_path):
        return layer
    rescale(layer, look.meters_per_unit, theirs)
    return move_room(turn_up(layer, theirs) if look.up_axis == "Z" else layer, look.room_path)


def as_class(layer: Sdf.Layer, name: str) -> None:
    """Have what a layer says of an asset's class be a class, and define what is below: no overs of nothing."""
    top = Sdf.Path(class_path(name))
    paths: list[Sdf.Path] = []
    layer.Traverse(top, paths.append)
    for path in paths:
        if path.IsPrimPath():
            layer.GetPrimAtPath(path).specifier = Sdf.SpecifierDef  # a class below would not be seen
    for path in (top.GetParentPath(), top):
        layer.GetPrimAtPath(path).specifier = Sdf.SpecifierClass


def write_mesh(pen: Pen, path: str, form: Surface, **about: str) -> None:
    """Author a mesh with indexed normals and `st`, and a GeomSubset per material group if there are several.

    `about`: other tokens of its own that vary, such as its purpose.
    """
    spec = pen.define(path, "Mesh", {
        # Blender merges an Xform with an only child that has no transform of its own, and the Xform's name is lost.
        # In floats: three.js fails on whole numbers in doubles of a usdc.
        **ops(translate=("float3", (0.0, 0.0, 0.0))), "uniform token subdivisionScheme": "none",
        "point3f[] points": form.points, "int[] faceVertexCounts": np.full(len(form.faces), 3, np.int32),
        "int[] faceVertexIndices": form.faces.ravel(), "float3[] extent": form.extent,
        "normal3f[] primvars:normals": form.normals, "int[] primvars:normals:indices": form.normal_index,
        "texCoord2f[] primvars:st": form.st, "int[] primvars:st:indices": form.st_index,
    } | {f"uniform token {name}": value for name, value in about.items()})  # fmt: skip
    for name, index in (("primvars:normals", form.normal_index), ("primvars:st", form.st_index)):
        each = "uniform" if len(index) == len(form.faces) else "faceVarying"
        spec.attributes[name].SetInfo("interpolation", each)
    if len(form.groups) > 1:
        family = {"uniform token elementType": "face", "uniform token familyName": "materialBind"}
        for name, faces in form.groups.items():
            pen.define(f"{path}/{name}", "GeomSubset", {**family, "int[] indices": faces})
        say(spec, {"uniform token subsetFamily:materialBind:familyType": "partition"})


def geometry_layer(
    name: str, forms: Mapping[str, Surface], geometry: Geometry, data: Mapping[str, Any], style: str = "",
    *, solid: bool = True,
) -> Sdf.Layer:  # fmt: skip
    """`<name>_geo`: a mesh for every part and, as guides, the colliders; their looks; what the furniture was made from.

    `forms`: path of a part below the root -> its surface. `geometry`: whose parts these are, and whose colliders are
    written, which stop things where they are `solid`. `data`: customLayerData. `style`: chooses the looks, which a
    room's materials layer overrides.
    """
    pen = Pen.blank(name, ".usdc", data)
    fields = {f"custom float[] {DESCRIPTION}": geometry.description} if geometry.description else {}
    pen.define(f"/{name}", "Xform", fields)
    pen.define(f"/{name}/{GEO}", "Scope")
    for body in sorted({part.body for part in geometry.parts if part.body}):
        pen.define(piece_path(f"/{name}", name, body), "Xform")
    for path, form in forms.items():
        write_mesh(pen, f"/{name}{path}", form)
    guides = () if geometry.theirs_collides else geometry.colliders
    for collider, form in zip(guides, plain([guide.mesh for guide in guides]), strict=True) if guides else ():
        path = piece_path(f"/{name}", name, collider.name, collider.body)
        write_mesh(pen, path, form, purpose="guide")
        if solid:
            collides(pen, path, collider.approximation)
    _write_looks(pen, name, style, {part: tuple(form.groups) for part, form in forms.items()})
    return pen.layer


def _write_looks(pen: Pen, name: str, style: str, slots: Mapping[str, Sequence[str]]) -> None:
    """The looks of an asset that stands for itself, in plain colours, and its variant set `palette`."""
    bindings = slot_paths(f"/{name}", slots)
    if not bindings:
        return
    used, chosen, scope = sorted(set(bindings.values())), palette_for(style), f"/{name}/{MTL}"
    shown = alternatives(chosen)
    plain = {harmony: {slot: replace(look(harmony, slot), pattern="") for slot in used} for harmony in shown}
    write_looks(pen, plain[chosen], bindings, scope)
    write_palettes(pen, chosen, plain, f"/{name}", scope)


def coarse_layer(name: str, forms: Mapping[str, Surface], data: Mapping[str, Any]) -> Sdf.Layer:
    """`<name>_low`: the meshes once more with few faces; arguments as for `geometry_layer`."""
    pen = Pen.blank(name, ".usdc", data)
    pen.define(f"/{name}", "Xform")
    pen.define(f"/{name}/{GEO}", "Scope")
    for path, form in forms.items():
        write_mesh(pen, f"/{name}{path}", form)
    return pen.layer


def component_layer(
    name: str, category: str, extent: np.ndarray, geometry: Geometry, data: Mapping[str, Any],
) -> Sdf.Layer:  # fmt: skip
    """`<name>.usda`: kind, class, labels, extentsHint, physics, variants and the payload `./<name>_geo.usdc`.

    `name`, `category`: words. `extent`: (2, 3) float, metres. `geometry`: whose joints, colliders and mass are told.
    `data`: customLayerData.
    """
    pen, root = Pen.blank(name, ".usda", data), f"/{name}"
    pen.define(
        root, "Xform", {"float3[] extentsHint": np.asarray(extent, np.float32)}, ["GeomModelAPI"],
        kind="component", assetInfo={"name": name, "identifier": Sdf.AssetPath(f"./{name}.usda")},
        documentation=f"{category}: origin at the centre of the bottom face, +Y up, +Z is the front; metres",
    )  # fmt: skip
    if geometry.joints:
        write_joints(pen, name, geometry)
    slots = most_used(geometry)
    if geometry.original is None:
        _write_levels(pen, name, geometry, slots[0])
    pen.label(root, category=category, ade20k=ade20k(category))
    write_asset_physics(pen, name, category, geometry, slots)
    _add_arcs(pen.layer, name, geometry)
    return pen.layer


def _write_levels(pen: Pen, name: str, geometry: Geometry, slot: str) -> None:
    """The variant set `LOD`: all faces, few where there are such meshes, or the colliders, in the look of a slot."""
    levels = (HIGH, LOW, PROXY) if geometry.coarse else (HIGH, PROXY)
    pen = pen.variants(f"/{name}", LOD, levels, HIGH)[PROXY]
    for part in geometry.parts:
        pen.over(piece_path(f"/{name}", name, part.name, part.body), {"token visibility": "invisible"})
    for collider in geometry.colliders:
        pen.over(piece_path(f"/{name}", name, collider.name, collider.body), {"uniform token purpose": "default"})
    pen.bind(f"/{name}/{GEO}", f"/{name}/{MTL}/{slot}")


def most_used(geometry: Geometry) -> list[str]:
    """Material slots of all parts, the one with most surface first."""
    area: dict[str, float] = {}
    for part in geometry.parts:
        size = lengths(area_normals(part.mesh.triangles))
        for slot, faces in part.slots.items():
            area[slot] = area.get(slot, 0.0) + float(size[faces].sum())
    return sorted(area, key=lambda slot: (-area[slot], slot))


def slot_paths(root: str, slots: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Prim path -> material slot: the part's mesh where it has one slot, a subset of it for each of several.

    `root`: path of the asset's root prim, or of an object that references it. `slots`: path of a part below that -> its
    material slots.
    """
    out: dict[str, str] = {}
    for part, names in slots.items():
        mesh = f"{root}{part}"
        out |= {f"{mesh}/{slot}" if len(names) > 1 else mesh: slot for slot in names}
    return out


def _add_arcs(layer: Sdf.Layer, name: str, geometry: Geometry) -> None:
    """The payloads, and a class whose opinions, in whatever stage, reach all users of the asset."""
    classes = Sdf.PrimSpec(layer, CLASSES, Sdf.SpecifierClass)
    Sdf.PrimSpec(classes, name, Sdf.SpecifierClass)
    layer.GetPrimAtPath(f"/{name}").inheritPathList.prependedItems.append(Sdf.Path(class_path(name)))
    if geometry.theirs_collides:
        return
    if geometry.coarse:
        # a payload inside a variant is stronger than the one beside it, so that its meshes win
        variant = layer.GetPrimAtPath(f"/{name}").variantSets[LOD].variants[LOW].primSpec
        variant.payloadList.prependedItems.append(Sdf.Payload(f"./{layer_name(name, 'low')}", Sdf.Path(f"/{name}")))
    payload = Sdf.Payload(f"./{layer_name(name, 'geo')}", Sdf.Path(f"/{name}"))
    layer.GetPrimAtPath(f"/{name}").payloadList.prependedItems.append(payload)
