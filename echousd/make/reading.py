"""A room read back from its folder: graph, boxes, meshes, files, what is locked; in metres, +Y up, however saved."""

import warnings
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from echomodel.boxes import Boxes
from echomodel.triangles import Mesh
from echousd.folder.folder import recover
from echousd.folder.found import manifest_of, root_in
from echousd.folder.manifest import find_manifest
from echousd.folder.stored import asset_from, shelf_of
from echousd.folder.within import inside
from echousd.graph import SceneGraph
from echousd.graph.text import graph_from_plain
from echousd.layers.placed import MODEL, PLACES
from echousd.make.furnishing import SAME, Brief, box_fields
from echousd.naming import STAGE_FORMS
from echousd.shapes.colliders import approximation, collider_of
from echousd.shapes.geometry import LICENCE, Collider, Geometry, Origin, Original, Part
from echousd.shapes.matter import read_mass
from echousd.stage.contents import read_contents, room_frame, surface_of
from echousd.stage.files import open_stage, opened
from echousd.stage.paths import DESCRIPTION, GEO, OBJECTS, asset_file, piece_name, piece_of
from echousd.stage.read import find_rooms, room_graph, the_room
from echousd.stage.showing import each_layout
from echousd.stage.units import Z_TO_Y, metres_per_unit
from echousd.stage.values import NOW, matrix, reading

WRITTEN_BY = "up_axis", "meters_per_unit", "faces", "atlas", "materialx", "thumbnails"  # options of an asset's files
SCALED = 0.01  # what a prim may be scaled by, more or less, before it is said


@dataclass(frozen=True, eq=False)
class SavedRoom:
    """What a room's folder holds."""

    graph: SceneGraph  # the composed stage's graph, an artist's changes included
    boxes: Boxes  # N boxes in the order of the graph's nodes, as composed
    layouts: tuple[Boxes, ...]  # all arrangements of the variant set `layout`, in its order, or `boxes` alone
    operations: Mapping[str, Mapping[str, Any]]  # object name -> names of its own transforms, in order -> values
    geometry: Mapping[str, Geometry]  # object name -> geometry; objects of one asset have one
    assets: Mapping[str, str]  # object name -> asset name
    carried: Mapping[str, Mapping[str, bytes]]  # asset name -> its files as they are, path -> bytes
    manifest: Mapping[str, Any]  # as `save` wrote it


def read_room(root: str | Path) -> SavedRoom:
    """Read the room whose root layer is `root` (a stronger layer over a room will do, too).

    Raises ValueError where there is no such stage, no room of ours, or an object without geometry.
    """
    root = Path(root)
    recover(root.parent)
    stage, manifest = open_stage(root), manifest_of(root)
    shelf = shelf_of(manifest, root.parent)
    graph = room_graph(the_room(stage, None))
    geometry: dict[str, Geometry] = {}
    carried: dict[str, Mapping[str, bytes]] = {}
    assets: dict[str, str] = {}
    made: dict[str, Geometry] = {}
    operations: dict[str, dict[str, Any]] = {}
    at = stage.GetPrimAtPath(manifest["room_path"])
    objects, z_up, metres = f"{at.GetPath()}/{OBJECTS.rpartition('/')[2]}", stands_z_up(at), metres_per_unit(stage)
    for node in graph.nodes:
        where = f"{objects}/{node.name}"
        prim = stage.GetPrimAtPath(where)
        asset: str | None = manifest["assets"].get(node.name) or _asset_of(prim, manifest)
        read = read_original if "asset" in manifest.get("meshes", {}).get(asset, {}) else _geometry
        try:
            found = made.get(asset or "") or read(prim, asset, node.category, manifest)
        except (TypeError, ValueError, IndexError, AttributeError, ArithmeticError, Tf.ErrorException) as error:
            if read is read_original and isinstance(error, ValueError):
                raise
            reason = " ".join(str(error).split())
            raise ValueError(
                f"{root}: <{where}> holds what echousd did not write there ({reason}); generate the room again"
            ) from None
        if asset is None or found is None:
            remedy = f"take it out there and have `edit --add {node.name}:{node.category}` make it, or generate again"
            raise ValueError(f"{root}: object {node.name!r} has no mesh that echousd made; {remedy}")
        if asset not in made:
            found = made[asset] = in_our_frame(found, metres, z_up=z_up)
            if shelf is not None and f"assets/{asset}" in shelf.keys:
                carried[asset] = asset_from(shelf, asset)
            else:
                recorded = (path for path in manifest["files"] if path.startswith(f"assets/{asset}/"))
                ours = (asset_file(asset, part) for part in ("geo", "", "low"))
                paths = dict.fromkeys((*ours, *recorded))
                files = {path: inside(root.parent, path, f"asset {asset!r}") for path in paths}
                must = asset_file(asset)
                carried[asset] = {path: f.read_bytes() for path, f in files.items() if path == must or f.exists()}
        assets[node.name], geometry[node.name] = asset, found
        operations[node.name] = {op.GetName(): op.Get(NOW) for op in UsdGeom.Xformable(prim).GetOrderedXformOps()}
    bounds = np.array([geometry[name].mesh.bounds for name in graph.names])
    sizes = np.asarray(bounds[:, 1] - bounds[:, 0], np.float32)
    boxes = _boxes(stage, objects, graph, sizes)
    layouts = tuple(_boxes(stage, objects, graph, sizes) for _ in each_layout(stage))
    return SavedRoom(graph, boxes, layouts, operations, geometry, assets, carried, manifest)


def _boxes(stage: Usd.Stage, objects: str, graph: SceneGraph, size: np.ndarray) -> Boxes:
    """Boxes of the objects below a path as the stage places them now."""
    position, yaw, cache, room = [], [], UsdGeom.XformCache(NOW), stage.GetPrimAtPath(objects).GetParent()
    turn, ahead = (Z_TO_Y, (0, -1, 0)) if stands_z_up(room) else (np.eye(3), (0, 0, 1))
    for name in graph.names:
        prim = stage.GetPrimAtPath(f"{objects}/{name}")
        with reading(stage):
            pose, _ = cache.ComputeRelativeTransform(prim, room)
        scale = np.linalg.norm(matrix(pose, prim)[:3, :3], axis=0)
        if np.abs(scale - 1.0).max() > SCALED:
            by = " x ".join(f"{v:.2f}" for v in scale)
            warnings.warn(
                f"<{prim.GetPath()}> is scaled by {by}: its box stays as made; --resize does it", stacklevel=3
            )
        front, place = (np.array(v) @ turn.T for v in (pose.TransformDir(ahead), pose.ExtractTranslation()))
        position.append(place * metres_per_unit(stage))
        yaw.append(np.arctan2(front[0], front[2]))
    return Boxes(size, *(np.array(v, np.float32) for v in (position, yaw)))


def _asset_of(prim: Usd.Prim, manifest: Mapping[str, Any]) -> str | None:
    """The room's asset that a prim refers to whose name the manifest does not know: a piece renamed or copied since."""
    name = prim.GetAssetInfoByKey("name") if prim else None
    return name if name in manifest["assets"].values() else None


def _geometry(root: Usd.Prim, asset: str | None, category: str, manifest: Mapping[str, Any]) -> Geometry | None:
    """Parts and colliders below an object's root; None where there is no mesh of ours."""
    parts, colliders = [], []
    for prim, name, body in _pieces(root, asset) if root and asset else ():
        mesh = UsdGeom.Mesh(prim)
        points, faces = (np.asarray(one.Get()) for one in (mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr()))
        form = Mesh(points.astype(float), faces.reshape(-1, 3))
        if mesh.GetPurposeAttr().Get() == UsdGeom.Tokens.guide:
            kind = prim.GetAttribute("physics:approximation").Get() or approximation(category)
            colliders.append(Collider(name, form, kind, body))
        else:
            parts.append(Part(name, form, _slots(mesh, len(form.faces)), body=body))
    if not parts or not colliders:
        return None
    entry = manifest.get("meshes", {}).get(asset, {})
    origin = Origin(entry.get("shapes", manifest["shapes"]), entry.get("licence", LICENCE), entry.get("credit", ""))
    return Geometry(
        tuple(parts), tuple(colliders), origin, read_mass(root),
        description=tuple(root.GetAttribute(DESCRIPTION).Get() or ()),
    )  # fmt: skip


def _pieces(root: Usd.Prim, asset: str) -> Iterator[tuple[Usd.Prim, str, str]]:
    """Meshes of ours below an object's root, their names, and the body that they stand below, empty = the root."""
    geo = root.GetChild(GEO)
    for prim in geo.GetChildren() if geo else ():
        name = piece_of(asset, prim.GetName())
        if name is None:
            continue
        if prim.IsA(UsdGeom.Mesh):
            yield prim, name, ""
        elif prim.IsA(UsdGeom.Xform):
            for child in prim.GetChildren():
                own = piece_of(asset, child.GetName())
                if own is not None and child.IsA(UsdGeom.Mesh):
                    yield child, own, name


def _slots(mesh: UsdGeom.Mesh, faces: int) -> dict[str, np.ndarray]:
    """Material slot -> faces of a mesh that we wrote."""
    subsets = [UsdGeom.Subset(child) for child in mesh.GetPrim().GetChildren() if child.IsA(UsdGeom.Subset)]
    if subsets:
        return {subset.GetPrim().GetName(): np.asarray(subset.GetIndicesAttr().Get()) for subset in subsets}
    # one slot is bound on the mesh itself: the asset, the weakest that speaks of it, calls its look by the slot
    specs = mesh.GetPrim().GetRelationship("material:binding").GetPropertyStack()
    bound = specs[-1].targetPathList.GetAddedOrExplicitItems() if specs else ()
    return {bound[0].name if bound else "wood": np.arange(faces)}


def read_original(root: Usd.Prim, asset: str | None, category: str, manifest: Mapping[str, Any]) -> Geometry | None:
    """The geometry of an object that is somebody else's model, None where its model is not there (any more).

    `root`: prim of the object. `asset`: name of its asset. `category`: its word. `manifest`: of the room.
    """
    if not root or not asset:
        return None
    cache = UsdGeom.XformCache(NOW)
    points, faces = surface_of(root, cache, np.linalg.inv(matrix(cache.GetLocalToWorldTransform(root), root)))
    if not len(faces):
        return None
    mesh = Mesh(points, faces)
    entry = manifest["meshes"][asset]
    words = (entry.get("shapes", ""), entry.get("licence", LICENCE), entry.get("credit", ""))
    origin = Origin(*words, asset=entry.get("asset", ""), sha256=entry.get("sha256", ""))
    shape = collider_of(mesh, category)
    return Geometry((Part("mesh", mesh, {}),), (shape,), origin, read_mass(root), original=_original(root, asset))


def _original(root: Usd.Prim, asset: str) -> Original:
    """Where the model lies and how it is placed, as the asset's component says."""
    places = root.GetChild(piece_name(asset, PLACES))
    model = places.GetChild(piece_name(asset, MODEL)) if places else None
    layer, prim = None, Sdf.Path("/model")
    for spec in model.GetPrimStack() if model else ():
        for payload in spec.payloadList.prependedItems:
            path = spec.layer.ComputeAbsolutePath(payload.assetPath)
            if not Path(path).is_relative_to(Path(spec.layer.realPath).parent):
                layer = Path(path)
            prim = payload.primPath or prim
    pose = np.array(UsdGeom.Xformable(places).GetLocalTransformation(NOW)).T if places else np.eye(4)
    return Original(pose, str(prim), layer)


def stands_z_up(room: Usd.Prim) -> bool:
    """Whether a room's own axes have +Z up: not where a prim of +Y up is turned as a whole."""
    cache = UsdGeom.XformCache(NOW)
    own = room_frame(room, cache) @ matrix(cache.GetLocalToWorldTransform(room), room)
    return bool(abs(own[1, 2]) > abs(own[1, 1]))


def in_our_frame(geometry: Geometry, metres: float, *, z_up: bool) -> Geometry:
    """A piece in the object's frame: metres, +Y up, +Z its front.

    `metres`: per unit in which it was read. `z_up`: read with +Z up, -Y its front.
    """
    if metres == 1.0 and not z_up:
        return geometry
    turn = Z_TO_Y if z_up else np.eye(3)
    parts = tuple(replace(part, mesh=_brought(part.mesh, metres * turn)) for part in geometry.parts)
    colliders = tuple(replace(collider, mesh=_brought(collider.mesh, metres * turn)) for collider in geometry.colliders)
    original = geometry.original
    if original is not None:
        pose = np.eye(4)
        pose[:3, :3] = metres * turn
        original = replace(original, pose=pose @ original.pose)
    mass = geometry.mass and geometry.mass.seen(metres * turn)
    return replace(geometry, parts=parts, colliders=colliders, mass=mass, original=original)


def _brought(mesh: Mesh, to_ours: np.ndarray) -> Mesh:
    return Mesh(mesh.vertices @ to_ours.T, mesh.faces)


def with_locked_places(graph: SceneGraph, *files: Path | None) -> tuple[SceneGraph, tuple[str, ...]]:
    """The graph with size, position and yaw of locked objects that lack one, and a sentence for each without a place.

    Arguments:
        files: stages or folders of rooms in which the objects may stand, the first that holds one counts.

    Raises ValueError for a stage that cannot be read.
    """
    wanted = {node.name for node in graph.nodes if node.locked and None in (node.size, node.position, node.yaw)}
    for file in files:
        at = _stage_of(file) if wanted and file else None
        stage = opened(at) if at else None
        things = (
            {one.node.name: one for room in find_rooms(stage) for one in read_contents(room).objects} if stage else {}
        )
        for name in wanted & things.keys():
            thing, node = things[name], graph.node(name)
            graph = graph.update_node(
                name, size=node.size or tuple(thing.size.round(4).tolist()),
                position=node.position or tuple(thing.position.round(4).tolist()),
                yaw=round(float(thing.yaw), 7) if node.yaw is None else node.yaw,
            )  # fmt: skip
        wanted -= things.keys()
    lost = sorted(name for name in wanted if graph.node(name).position is None)
    return graph, tuple(f"{name} is locked but stands nowhere yet: it gets a place like all others" for name in lost)


def with_earlier_locks(graph: SceneGraph, earlier: Path | None) -> tuple[SceneGraph, tuple[str, ...]]:
    """The graph in which what the last generation has locked stays so, where the graph says nothing of its place.

    `earlier`: folder or root layer of that generation. Returns the graph, and a sentence for each object that stays and
    one for edits that do not.
    """
    manifest = (find_manifest(earlier if earlier.is_dir() else earlier.parent, earlier.stem) if earlier else None) or {}
    try:
        old = graph_from_plain(SceneGraph, manifest.get("graph"))
    except ValueError:  # none that can be read
        return graph, ()
    was, asked = ({*one.names, *(relation.triple for relation in one.relations)} for one in (old, graph))
    edits = len(manifest.get("history", ())) if was != asked else 0
    gone = f"what {edits} edit{'s' * (edits > 1)} made of the room that is there goes; generate ROOM -o ROOM keeps it"
    locked = {(node.name, node.category): node for node in old.nodes if node.locked}
    free = [node for node in graph.nodes if (node.locked, node.position, node.yaw) == (False, None, None)]
    kept = [node for node in free if (node.name, node.category) in locked]
    for node in kept:
        place = locked[node.name, node.category]
        fields = {"size": node.size or place.size, "position": place.position, "yaw": place.yaw}
        graph = graph.update_node(node.name, locked=True, **fields)
    if graph.room.extents is None and any(node.locked and node.name in old.names for node in graph.nodes):
        around = {"floor_polygon": old.room.floor_polygon, "size": old.room.size}  # the walls that they stand at
        graph = graph.with_room(openings=graph.room.openings or old.room.openings, **around)
    stays = "stays locked as in the room that is there; echousd edit --unlock frees it"
    return graph, (*[gone] * bool(edits), *(f"{node.name} {stays}" for node in kept))


piece_asked = attrgetter("name", "category", "shapes", "asset")


def with_locked_shapes(brief: Brief, earlier: Path) -> Brief:
    """The brief in which locked objects, and others of one asset with them, keep the shapes of the last generation.

    Nothing is kept of a room whose assets were made or written otherwise, or that cannot be read. `earlier`: as above.
    """
    saved, root = None, _stage_of(earlier)
    with suppress(ValueError):
        saved = read_room(root) if root else None
    asked = {"shapes": brief.shapes, **{name: getattr(brief.options, name) for name in WRITTEN_BY}}
    if saved is None or any(saved.manifest[name] != value for name, value in asked.items()):
        return brief
    boxes = box_fields(saved.graph.names, saved.boxes)
    made = {piece_asked(node): boxes[node.name]["size"] for node in saved.graph.nodes if node.asset is None}
    alike = [node for node in brief.graph.nodes if piece_asked(node) in made]
    same = [one for one in alike if np.allclose(one.size or made[piece_asked(one)], made[piece_asked(one)], atol=SAME)]
    locked = {saved.assets[node.name] for node in same if node.locked}
    assets = {node.name: saved.assets[node.name] for node in same if saved.assets[node.name] in locked}
    return replace(
        brief, assets=assets, moving=assets.keys(), boxes=[{name: boxes[name] for name in assets}] * len(brief.boxes),
        geometry={name: saved.geometry[name] for name in assets},
        carried={asset: saved.carried[asset] for asset in locked},
    )  # fmt: skip


def _stage_of(file: Path) -> Path | None:
    """The stage at a path: the file itself, or the root layer of a room's folder."""
    found = root_in(file) if file.is_dir() else file
    return found if found and found.is_file() and found.suffix in STAGE_FORMS else None
