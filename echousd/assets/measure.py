"""Models as they were read: stages by USD, glTF by trimesh, OBJ and its material libraries here, many times faster."""

from __future__ import annotations

import contextlib
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdUtils

from echomodel.files import within_memory
from echomodel.triangles import area_normals
from echousd.assets.colors import Coat, flat, pixels, texels
from echousd.assets.model_file import STAGES, Beside, ModelFile
from echousd.draw.drawables import Paint, fans, paints_of
from echousd.srgb import to_linear
from echousd.stage.contents import triangles_of
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage
from echousd.stage.foreign import object_box
from echousd.stage.forms import Form, Polygons, SkippedForms, forms, polygons, shown
from echousd.stage.labels import labels
from echousd.stage.units import metres_per_unit, up_axis
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
    if model.suffix not in STAGES:
        return _mesh(model, painted)
    with model.opened():
        pass
    return measured_stage(model.path, model.prim, painted=painted)


def _mesh(model: ModelFile, painted: bool) -> Measured:
    beside = model.beside()
    with model.opened() as file:
        if model.suffix == ".obj":
            return measured_obj(model, file.read().decode("utf-8", "replace"), painted=painted)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(
                file, file_type=model.suffix[1:], resolver=beside, process=False, skip_materials=not painted
            )
    parts = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
    if not parts:
        raise ValueError(f"{model}: holds no triangles")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)])
    about = (scene.metadata or {}).get("asset") or {}
    extras = about.get("extras") or {}
    copyright_ = str(about.get("copyright") or "")
    return Measured(
        np.concatenate([np.asarray(part.vertices, float) for part in parts]),
        faces,
        metres=1.0,  # glTF is in metres, +Y up
        materials=tuple(dict.fromkeys(str(name) for name in scene.geometry)),
        licence=str(extras.get("license") or ""),
        author=str(extras.get("author") or copyright_),
        missing=tuple(dict.fromkeys(beside.missing)),
        coats=tuple(_coats(scene)) if painted else (),
    )


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
        try:
            return flat(factor, factor[3]) if image is None else pixels(image, factor)
        except Exception:  # decoders fail on damaged images in every way there is
            return None
    visual: Any = part.visual
    return flat(to_linear(np.asarray(visual.main_color, float) / 255))


FACE = re.compile(r"^f[ \t]+(.+?)[ \t]*$", re.MULTILINE)
VERTEX = re.compile(r"^v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.MULTILINE)
MATERIAL = re.compile(r"^usemtl[ \t]+(.+?)[ \t]*$", re.MULTILINE)


def measured_obj(model: ModelFile, text: str, *, painted: bool = False) -> Measured:
    """Triangles of an OBJ, names of its materials, textures that are missing; with `painted`, its colours as well.

    Raises ValueError that names the file for one that cannot be read.
    """
    points = np.array(VERTEX.findall(text), float).reshape(-1, 3)
    pieces = MATERIAL.split(text)  # what stands before the first name, then names and what follows them in turns
    names = ["", *pieces[1::2]]
    found = [FACE.findall(piece) for piece in pieces[::2]]
    lines = re.sub(r"/\S*|#.*", "", "\n".join(line for piece in found for line in piece)).splitlines()
    slot = np.repeat(np.arange(len(names)), [len(piece) for piece in found])
    counts = np.array([len(line.split()) for line in lines], int)
    corners = np.array(" ".join(lines).split(), int)
    if (corners < 0).any():
        raise ValueError(f"{model}: faces count points from the end, allowed: plain numbers; write it again")
    starts = np.cumsum(counts) - counts
    triangles, slots = [np.zeros((0, 3), int)], [np.zeros(0, int)]
    for count in np.unique(counts[counts > 2]):
        first = starts[counts == count]
        for k in range(1, count - 1):
            triangles.append(corners[np.stack([first, first + k, first + k + 1], 1)] - 1)
            slots.append(slot[counts == count])
    faces = np.concatenate(triangles)
    beside = model.beside()
    coats = dict(_obj_coats(re.findall(r"^mtllib[ \t]+(.+?)[ \t]*$", text, re.MULTILINE), beside, painted))
    inside = len(faces) > 0 and faces.min() >= 0 and faces.max() < len(points)
    seen: list[Coat] = []
    if painted and coats and inside:
        area = np.bincount(np.concatenate(slots), np.linalg.norm(area_normals(points[faces]), axis=1), len(names))
        seen = [(float(area[k]), coats[name]) for k, name in enumerate(names) if name in coats and area[k] > 0]
    used = tuple(dict.fromkeys(names[1:]))
    return Measured(points, faces, materials=used, missing=tuple(dict.fromkeys(beside.missing)), coats=tuple(seen))


def _obj_coats(libraries: list[str], beside: Beside, painted: bool) -> Iterator[tuple[str, np.ndarray]]:
    """(name, what covers a surface) of the materials of some MTL files; their images are looked for in any case."""
    images: dict[str, np.ndarray | None] = {}
    for library in libraries:
        try:
            content = beside.get(library.strip()).decode("utf-8", "replace")
        except ValueError:
            continue
        for piece in re.split(r"^[ \t]*newmtl[ \t]+", content, flags=re.MULTILINE | re.IGNORECASE)[1:]:
            name, _, rest = piece.partition("\n")
            lines = re.findall(r"^[ \t]*(Kd|map_Kd|d|Tr)[ \t]+(.+?)[ \t]*$", rest, re.MULTILINE | re.IGNORECASE)
            said = {word.lower(): value for word, value in lines}
            image = said.get("map_kd", "")
            if image not in images:
                images[image] = _image(image, beside, painted)
            coat = _plain(said) if images[image] is None else images[image]
            if painted and coat is not None:
                yield name.strip(), coat


def _image(name: str, beside: Beside, painted: bool) -> np.ndarray | None:
    try:
        content = beside.get(name) if name else b""
    except ValueError:
        return None
    return texels(content) if painted else None


def _plain(said: dict[str, str]) -> np.ndarray | None:
    try:
        color = np.clip(np.array(said["kd"].split()[:3], float), 0, 1)
        opacity = float(said["d"].split()[-1]) if "d" in said else 1.0 - float(said.get("tr", "0").split()[0])
    except (KeyError, ValueError):
        return None
    if len(color) != 3 or not np.isfinite([*color, opacity]).all():
        return None
    return flat(to_linear(color), opacity)


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
        for form in forms(root, cache, shown):
            surface = polygons(form.prim)
            triangles = triangles_of(surface)
            if len(triangles):
                points.append(surface.points @ form.world[:3, :3].T + form.world[:3, 3])
                faces.append(triangles + count)
                count += len(surface.points)
                coats += _stage_coats(form, surface, known, covers) if painted else ()
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


def missing_files(path: Path) -> list[str]:
    """Files that a stage depends on and that are not there, as their names end."""
    _, _, unresolved = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    return sorted({PurePosixPath(str(name).replace("\\", "/")).name for name in unresolved})


def _says_unit(stage: Usd.Stage) -> bool:
    return any(layer.pseudoRoot.HasInfo("metersPerUnit") for layer in stage.GetUsedLayers())
