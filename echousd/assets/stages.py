"""A model that is a USD file: its root prim, surface, labels, licence, physics and variants."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdUtils

from echomodel.triangles import area_normals
from echousd.assets.colors import Coat, flat, texels
from echousd.assets.measured import Measured
from echousd.draw.drawables import Paint, fans, paints_of
from echousd.stage.contents import triangles_of
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage
from echousd.stage.foreign import object_box
from echousd.stage.forms import Form, Polygons, SkippedForms, forms, polygons
from echousd.stage.labels import labels
from echousd.stage.units import metres_per_unit, up_axis
from echousd.textures import TextureError, texture_bytes

IMAGES = (".png", ".jpg", ".jpeg", ".exr", ".tga", ".tif", ".tiff", ".bmp", ".webp", ".avif", ".hdr")


def measured_stage(path: Path, prim_path: str = "", *, painted: bool = False) -> Measured:
    """What a USD file says of the model in it; raises StageError (a ValueError) as `open_stage` does.

    Arguments:
        path: of the file. prim_path: of the model's prim where the stage holds more than it, "" = its root.
        painted: with its colours.
    """
    stage = open_stage(path)
    root = root_prim(stage, path) if not prim_path else named_prim(stage, path, prim_path)
    cache = UsdGeom.XformCache()
    box = object_box(root) if prim_path else None
    points, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), int)], 0
    coats: list[Coat] = []
    known: dict[str, Paint] = {}
    covers: dict[Paint, np.ndarray] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkippedForms)
        for form in forms(root, cache, _visible):
            surface = polygons(form.prim)
            triangles = triangles_of(surface)
            if len(triangles):
                points.append(surface.points @ form.world[:3, :3].T + form.world[:3, 3])
                faces.append(triangles + count)
                count += len(surface.points)
                coats += _coats(form, surface, known, covers) if painted else ()
    prims = [root, *Usd.PrimRange(root, Usd.TraverseInstanceProxies())]
    layer = stage.GetRootLayer()
    data = dict(layer.customLayerData)
    words = {str(key).lower(): str(value) for key, value in data.items() if isinstance(value, str)}
    joints = sum(prim.IsA(UsdPhysics.Joint) for prim in prims[1:])
    variants = tuple(
        f"{name}={root.GetVariantSet(name).GetVariantSelection()}" for name in root.GetVariantSets().GetNames()
    )
    return Measured(
        np.concatenate(points),
        np.concatenate(faces),
        metres=metres_per_unit(stage) if _says_unit(stage) else None,
        z_up=up_axis(stage) == UsdGeom.Tokens.z,
        prim=str(root.GetPath()),
        above=np.array(cache.GetParentToWorldTransform(root)).T,
        yaw=0.0 if box is None else box.yaw,
        labels=tuple(dict.fromkeys(word for prim in prims[:50] for word in labels(prim))),
        materials=tuple(dict.fromkeys(p.GetName() for p in prims if p.IsA(UsdShade.Material))),
        licence=words.get("asset_license") or words.get("license") or words.get("licence") or "",
        author=words.get("asset_credit") or words.get("author") or "",
        joints=joints,
        bodies=any(prim.HasAPI(UsdPhysics.RigidBodyAPI) for prim in prims),
        colliders=any(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in prims),
        variants=variants,
        missing=tuple(missing_files(path)),
        coats=tuple(coats),
    )


def _coats(form: Form, surface: Polygons, known: dict[str, Paint], covers: dict[Paint, np.ndarray]) -> Iterator[Coat]:
    """What covers a surface, by the areas of its materials; both dictionaries hold what was read, and grow."""
    face, corner = fans(surface.counts)
    corners = (surface.points @ form.world[:3, :3].T)[surface.indices[corner]]
    area = np.linalg.norm(area_normals(corners), axis=1)
    worn = np.zeros(len(face), int)
    paints = list(paints_of(form.prim, surface.face[face], known))
    for number, (_, inside) in enumerate(paints):  # later ones win
        worn[inside] = number
    for (paint, _), share in zip(paints, np.bincount(worn, area, len(paints)), strict=True):
        if share > 0 and paint != Paint():  # of no material that is known
            if paint not in covers:
                covers[paint] = _cover(paint)
            yield float(share), covers[paint]


def _cover(paint: Paint) -> np.ndarray:
    found = None
    if paint.texture:
        with contextlib.suppress(TextureError):
            found = texels(texture_bytes(paint.texture) or b"", paint.tint)
    return flat(paint.color, paint.opacity) if found is None else found


def root_prim(stage: Usd.Stage, path: Path) -> Usd.Prim:
    """The prim that a reference to the file brings: the default prim, or the only root prim."""
    default = stage.GetDefaultPrim()
    if default:
        return default
    roots = [prim for prim in stage.GetPseudoRoot().GetChildren() if prim.IsA(UsdGeom.Imageable)]
    if len(roots) != 1:
        names = ", ".join(prim.GetName() for prim in roots[:5]) or "none"
        raise StageError(f"{path}: no default prim and {len(roots)} root prims ({names}), allowed: a default prim")
    return roots[0]


def named_prim(stage: Usd.Stage, path: Path, prim_path: str) -> Usd.Prim:
    """The prim at a path; raises StageError where there is none."""
    valid = Sdf.Path.IsValidPathString(prim_path) and Sdf.Path(prim_path).IsPrimPath()
    prim = stage.GetPrimAtPath(prim_path) if valid else None
    if not prim:
        raise StageError(f"{path}: no prim <{prim_path}>, allowed: the path of a prim of the stage")
    return prim


def missing_files(path: Path) -> list[str]:
    """Files that a stage depends on and that are not there, as their names end."""
    _, _, unresolved = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    return sorted({PurePosixPath(str(name).replace("\\", "/")).name for name in unresolved})


def _says_unit(stage: Usd.Stage) -> bool:
    return any(layer.pseudoRoot.HasInfo("metersPerUnit") for layer in stage.GetUsedLayers())


def _visible(prim: Usd.Prim) -> bool:
    image = UsdGeom.Imageable(prim)
    shown = image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
    return shown and image.ComputeVisibility() != UsdGeom.Tokens.invisible
