"""Models as they were read: stages by USD, glTF and OBJ by trimesh."""

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdUtils
from trimesh.util import append_faces

from echomodel.files import within_memory
from echomodel.triangles import area_normals
from echousd.assets.colors import Coat, flat, pixels, texels
from echousd.assets.model_file import Beside, ModelFile
from echousd.draw.drawables import Paint, paints_of
from echousd.naming import STAGE_FORMS
from echousd.srgb import to_linear
from echousd.stage.contents import NOTHING, triangles_of
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage
from echousd.stage.foreign import object_box
from echousd.stage.forms import Form, Polygons, SkippedForms, forms, polygons
from echousd.stage.labels import labels
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import NOW, fans
from echousd.textures import TextureError, texture_bytes


@dataclass(frozen=True, eq=False)
class Measured:
    """A model as it was read, in its own frame and unit.

    Arguments:
        points: (v, 3) float. faces: (f, 3) int.
        metres: per unit, None where the file does not say. z_up: whether +Z points up.
        above: (4, 4) float, from the frame above its root prim to its own frame, as only a prim below others has one.
        yaw: radians by which a prim of a stage stands turned about its up axis, counter-clockwise seen from above.
        coats: areas of its surface with what covers them (`echousd.assets.colors.Coat`), where they were asked for.
        others: as in `AssetRecord`.
    """

    points: np.ndarray
    faces: np.ndarray
    metres: float | None = None
    z_up: bool = False
    prim: str = ""
    above: np.ndarray = field(default_factory=lambda: np.eye(4))
    yaw: float = 0.0
    labels: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    licence: str = ""
    author: str = ""
    joints: int = 0
    bodies: bool = False
    colliders: bool = False
    variants: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    coats: tuple[Coat, ...] = ()

    def turned(self, turn: np.ndarray) -> trimesh.Trimesh:
        """The surface after a rotation (3, 3), in the model's own unit."""
        return trimesh.Trimesh(self.points @ turn.T, self.faces, process=False)


def measure(model: ModelFile, *, painted: bool = False) -> Measured:
    """Read a model, with `painted` its colours as well.

    Raises ValueError that names the file for one that cannot be read or has no surface.
    """
    try:
        with within_memory(model.path, str(model)):
            found = _measured(model, painted)
    except ImportError:
        raise
    except Exception as error:  # readers fail on damaged files in every way there is
        if isinstance(error, ValueError) and str(error).startswith(str(model.path)):
            raise
        raise ValueError(f"{model}: cannot be read ({type(error).__name__}: {error!s:.120})") from None
    if not len(found.faces):
        raise ValueError(f"{model}: holds no triangles")
    used = np.unique(found.faces)
    if used[0] < 0 or used[-1] >= len(found.points):
        raise ValueError(f"{model}: faces name points that are not there")
    if not np.isfinite(found.points[used]).all():
        raise ValueError(f"{model}: holds coordinates that are no numbers")
    if len(used) < len(found.points):
        number = np.zeros(len(found.points), int)
        number[used] = np.arange(len(used))
        found = replace(found, points=found.points[used], faces=number[found.faces])
    if np.ptp(found.points, axis=0).max() <= 0:
        raise ValueError(f"{model}: all points of its triangles are one")
    return found


def _measured(model: ModelFile, painted: bool) -> Measured:
    if model.suffix not in STAGE_FORMS:
        return _mesh(model, painted)
    with model.opened():
        pass
    return measured_stage(model.path, model.prim, painted=painted)


def _mesh(model: ModelFile, painted: bool) -> Measured:
    beside = Beside(model)
    obj = model.suffix == ".obj"  # whose materials are in a file of their own
    with model.opened() as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = trimesh.load_scene(
            file, file_type=model.suffix[1:], resolver=beside, process=False, skip_materials=not (painted or obj),
            group_material=not obj,
        )  # fmt: skip
    parts = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
    if not parts:
        raise ValueError(f"{model}: holds no triangles")
    about = (scene.metadata or {}).get("asset") or {}
    extras = about.get("extras") or {}
    copyright_ = str(about.get("copyright") or "")
    return Measured(
        *append_faces([np.asarray(part.vertices, float) for part in parts], [part.faces for part in parts]),
        metres=None if obj else 1.0,  # glTF is in metres, +Y up
        materials=tuple(dict.fromkeys(_material_names(scene) if obj else map(str, scene.geometry))),
        licence=str(extras.get("license") or ""),
        author=str(extras.get("author") or copyright_),
        missing=tuple(dict.fromkeys(beside.missing)),
        coats=tuple(_coats(scene)) if painted else (),
    )


def _material_names(scene: trimesh.Scene) -> Iterator[str]:
    for part in scene.geometry.values():
        name = getattr(getattr(part.visual, "material", None), "name", None)
        if name:
            yield str(name)


def _coats(scene: trimesh.Scene) -> Iterator[Coat]:
    """What covers the parts of a model, by their areas in the scene."""
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        part = scene.geometry[name]
        cover = _cover(part) if isinstance(part, trimesh.Trimesh) else None
        if cover is not None:
            yield float(part.area) * abs(float(np.linalg.det(matrix[:3, :3]))) ** (2 / 3), cover


def _cover(part: trimesh.Trimesh) -> np.ndarray | None:
    """A part's texture, its material's colour, or the mean of its points' colours."""
    material = getattr(part.visual, "material", None)
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        factor = np.ones(4) if material.baseColorFactor is None else np.asarray(material.baseColorFactor, float)
        factor = factor / 255.0 if factor.max(initial=0.0) > 1 else factor
        image = material.baseColorTexture
    else:
        image, factor = getattr(material, "image", None), np.ones(4)
    if image is not None:
        try:
            return pixels(image, factor)
        except Exception:  # decoders fail on damaged images in every way there is
            return None
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        return flat(factor, factor[3])
    plain: Any = part.visual if material is None else material
    color = np.asarray(plain.main_color, float) / 255
    return flat(to_linear(color), color[3])


def measured_stage(path: Path, prim_path: str = "", *, painted: bool = False) -> Measured:
    """What a USD file says of the model in it; raises StageError (a ValueError) as `open_stage` does.

    Arguments:
        path: of the file. prim_path: of the model's prim where the stage holds more than it, "" = its root.
        painted: with its colours.
    """
    stage = open_stage(path)
    root = root_prim(stage, path) if not prim_path else named_prim(stage, path, prim_path)
    cache = UsdGeom.XformCache(NOW)
    box = object_box(root) if prim_path else None
    points, faces = [NOTHING[0]], [NOTHING[1]]
    coats: list[Coat] = []
    known: dict[str, Paint] = {}
    covers: dict[Paint, np.ndarray] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkippedForms)
        for form in forms(root, cache):
            surface = polygons(form.prim)
            triangles = triangles_of(surface)
            if len(triangles):
                points.append(surface.points @ form.world[:3, :3].T + form.world[:3, 3])
                faces.append(triangles)
                coats += _stage_coats(form, surface, known, covers) if painted else ()
    prims = [root, *Usd.PrimRange(root, Usd.TraverseInstanceProxies())]
    _, _, unresolved = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    layer = stage.GetRootLayer()
    data = dict(layer.customLayerData)
    measures = any(used.pseudoRoot.HasInfo("metersPerUnit") for used in stage.GetUsedLayers())
    words = {str(key).lower(): str(value) for key, value in data.items() if isinstance(value, str)}
    joints = sum(prim.IsA(UsdPhysics.Joint) for prim in prims[1:])
    variants = tuple(
        f"{name}={root.GetVariantSet(name).GetVariantSelection()}" for name in root.GetVariantSets().GetNames()
    )
    return Measured(
        *append_faces(points, faces), metres=metres_per_unit(stage) if measures else None,
        z_up=up_axis(stage) == UsdGeom.Tokens.z, prim=str(root.GetPath()),
        above=np.array(cache.GetParentToWorldTransform(root)).T, yaw=0.0 if box is None else box.yaw,
        labels=tuple(dict.fromkeys(word for prim in prims[:50] for word in labels(prim))),
        materials=tuple(dict.fromkeys(p.GetName() for p in prims if p.IsA(UsdShade.Material))),
        licence=words.get("asset_license") or words.get("license") or words.get("licence") or "",
        author=words.get("asset_credit") or words.get("author") or "", joints=joints,
        bodies=any(prim.HasAPI(UsdPhysics.RigidBodyAPI) for prim in prims),
        colliders=any(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in prims), variants=variants,
        missing=tuple(sorted({PurePosixPath(str(name).replace("\\", "/")).name for name in unresolved})),
        coats=tuple(coats),
    )  # fmt: skip


def _stage_coats(
    form: Form, surface: Polygons, known: dict[str, Paint], covers: dict[Paint, np.ndarray]
) -> Iterator[Coat]:
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
                covers[paint] = _stage_cover(paint)
            yield float(share), covers[paint]


def _stage_cover(paint: Paint) -> np.ndarray:
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
