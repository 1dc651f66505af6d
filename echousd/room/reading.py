"""Read a room of ours back from its folder: graph, boxes, meshes, and the assets' files as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from pxr import Usd, UsdGeom

from echomodel.boxes import Boxes
from echousd.graph import SceneGraph
from echousd.room.folder import find_manifest, recover
from echousd.stage import open_stage, read_graph

OBJECTS = "/Room/Objects"


@dataclass(frozen=True, eq=False)
class CarriedAsset:
    """An asset that is used again as it lies on disk: its files (path -> bytes) and its material groups."""

    files: Mapping[str, bytes]
    groups: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SavedRoom:
    """What a room's folder holds.

    Arguments:
        graph: the composed stage's graph, an artist's changes included.
        boxes: N boxes in the order of the graph's nodes, as composed.
        layouts: all arrangements of the variant set `layout`, in its order, or `boxes` alone.
        meshes: object name -> mesh in its own frame, metres.
        assets: object name -> asset name.
        carried: asset name -> its files.
        manifest: as `save` wrote it.
    """

    graph: SceneGraph
    boxes: Boxes
    layouts: tuple[Boxes, ...]
    meshes: Mapping[str, trimesh.Trimesh]
    assets: Mapping[str, str]
    carried: Mapping[str, CarriedAsset]
    manifest: Mapping[str, Any]


def read_room(root: str | Path) -> SavedRoom:
    """Read the room whose root layer is `root` (a stronger layer over a room will do, too).

    Raises ValueError where there is no such stage, no room of ours, or an object without geometry.
    """
    root = Path(root)
    recover(root.parent)
    stage = open_stage(root)
    manifest = find_manifest(root.parent)
    if manifest is None:
        raise ValueError(f"{root}: not a room made by `echousd generate` (no manifest beside it)")
    graph = read_graph(stage)
    size = []
    meshes: dict[str, trimesh.Trimesh] = {}
    carried: dict[str, CarriedAsset] = {}
    assets: dict[str, str] = {}
    for node in graph.nodes:
        asset = manifest["assets"].get(node.name)
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{OBJECTS}/{node.name}/{asset}_mesh"))
        if asset is None or not mesh:
            raise ValueError(f"{root}: object {node.name!r} has no mesh that echousd made; generate the room again")
        assets[node.name] = asset
        if asset not in carried:
            carried[asset] = _carry(root.parent, asset, mesh)
            points = np.asarray(mesh.GetPointsAttr().Get(), float)
            faces = np.asarray(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
            meshes[node.name] = trimesh.Trimesh(points, faces, process=False)
        else:
            meshes[node.name] = next(meshes[n] for n, a in assets.items() if a == asset)
        low, high = meshes[node.name].bounds
        size.append(high - low)
    sizes = torch.tensor(np.array(size), dtype=torch.float32)
    boxes = _boxes(stage, graph, sizes)
    return SavedRoom(graph, boxes, _layouts(stage, graph, sizes) or (boxes,), meshes, assets, carried, manifest)


def _boxes(stage: Usd.Stage, graph: SceneGraph, size: torch.Tensor) -> Boxes:
    """Boxes of the objects as the stage places them now."""
    position, yaw, cache, room = [], [], UsdGeom.XformCache(), stage.GetPrimAtPath("/Room")
    for name in graph.names:
        pose, _ = cache.ComputeRelativeTransform(stage.GetPrimAtPath(f"{OBJECTS}/{name}"), room)
        front = pose.TransformDir((0, 0, 1))
        position.append(tuple(pose.ExtractTranslation()))
        yaw.append(np.arctan2(front[0], front[2]))
    return Boxes(size, *(torch.tensor(np.array(v), dtype=torch.float32) for v in (position, yaw)))


def _layouts(stage: Usd.Stage, graph: SceneGraph, size: torch.Tensor) -> tuple[Boxes, ...]:
    """Boxes under every variant of `layout`; the stage is left as it was."""
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    names = [name for name in variants.GetVariantNames() if name.startswith("layout_")]
    found = []
    for name in sorted(names, key=lambda name: (len(name), name)):
        with Usd.EditContext(stage, stage.GetSessionLayer()):
            variants.SetVariantSelection(name)
            found.append(_boxes(stage, graph, size))
            variants.ClearVariantSelection()
    return tuple(found)


def _carry(folder: Path, asset: str, mesh: UsdGeom.Mesh) -> CarriedAsset:
    paths = [f"assets/{asset}/{asset}{end}" for end in ("_geo.usdc", ".usda")]
    files = {path: (folder / path).read_bytes() for path in paths}
    groups = [child.GetName() for child in mesh.GetPrim().GetChildren() if child.IsA(UsdGeom.Subset)]
    if not groups:  # one group is bound on the mesh itself, under the name of its only look
        bound = mesh.GetPrim().GetRelationship("material:binding").GetTargets()
        groups = [bound[0].name.rsplit("_", 1)[-1]] if bound else ["wood"]
    return CarriedAsset(files, tuple(groups))
