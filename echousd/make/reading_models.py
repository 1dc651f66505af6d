"""Somebody else's model in a saved room, read back as the geometry of its object."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from pxr import Sdf, Usd, UsdGeom

from echousd.layers.component import MODEL, PLACES
from echousd.shapes.geometry import LICENCE, Geometry, Origin, Part
from echousd.shapes.masses import read_mass
from echousd.shapes.originals.loading import hull_of
from echousd.shapes.originals.original import Original
from echousd.stage.contents import triangulated
from echousd.stage.forms import forms
from echousd.stage.paths import piece_name


def read_original(root: Usd.Prim, asset: str | None, category: str, manifest: Mapping[str, Any]) -> Geometry | None:
    """The geometry of an object that is somebody else's model, None where its model is not there (any more).

    Arguments:
        root: prim of the object. asset: name of its asset. category: its word. manifest: of the room.
    """
    if not root or not asset:
        return None
    cache = UsdGeom.XformCache()
    away = np.linalg.inv(np.array(cache.GetLocalToWorldTransform(root)).T)
    points, faces, count = [], [], 0
    for form in forms(root, cache, _shown):
        vertices, triangles = triangulated(form.prim)
        if len(triangles):
            to_root = away @ form.world
            points.append(vertices @ to_root[:3, :3].T + to_root[:3, 3])
            faces.append(triangles + count)
            count += len(vertices)
    if not points:
        return None
    mesh = trimesh.Trimesh(np.concatenate(points), np.concatenate(faces), process=False)
    told = manifest["meshes"][asset]
    words = (told.get("source", ""), told.get("licence", LICENCE), told.get("credit", ""))
    origin = Origin(*words, asset=told.get("asset", ""), sha256=told.get("sha256", ""))
    return Geometry(
        (Part("mesh", mesh, {}),), (hull_of(mesh, category),), origin, read_mass(root), original=_original(root, asset)
    )


def _original(root: Usd.Prim, asset: str) -> Original:
    """Where the model lies and how it is placed, as the asset's component says."""
    places = root.GetChild(piece_name(asset, PLACES))
    model = places.GetChild(piece_name(asset, MODEL)) if places else None
    layer, prim = None, Sdf.Path("/model")
    for spec in model.GetPrimStack() if model else ():
        for payload in spec.payloadList.prependedItems:
            path = spec.layer.ComputeAbsolutePath(payload.assetPath)
            if os.path.commonpath([Path(path).parent, Path(spec.layer.realPath).parent]) != str(
                Path(spec.layer.realPath).parent
            ):
                layer = Path(path)
            prim = payload.primPath or prim
    pose = np.array(UsdGeom.Xformable(places).GetLocalTransformation()).T if places else np.eye(4)
    return Original(pose, str(prim), layer)


def _shown(prim: Usd.Prim) -> bool:
    image = UsdGeom.Imageable(prim)
    shown = image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
    return shown and image.ComputeVisibility() != UsdGeom.Tokens.invisible
