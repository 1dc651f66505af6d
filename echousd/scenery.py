"""What a picture needs to know of a stage: world-space triangles with normals, colours and textures (Y-up, metres)."""

from __future__ import annotations

import colorsys
import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Ar, Usd, UsdGeom, UsdShade

GOLDEN = 0.61803398875


@dataclass(frozen=True, eq=False)
class Scenery:
    """Triangles in the world, y up, metres.

    Arguments:
        triangles, normals: (f, 3, 3) float32 corners and their normals.
        flat_colors, emissive: (f, 3) float32 linear RGB.
        gloss: (f,) float32 in [0, 1].
        st: (f, 3, 2) float32 texture coordinates.
        texture: (f,) int, which of `images` colours the face, -1 for none.
        images: (h, w, 3) float32 linear RGB each.
        facing: (2,) float, x and z of the objects' mean front.
    """

    triangles: np.ndarray
    normals: np.ndarray
    flat_colors: np.ndarray
    emissive: np.ndarray
    gloss: np.ndarray
    st: np.ndarray
    texture: np.ndarray
    images: tuple[np.ndarray, ...]
    facing: np.ndarray

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner, (3,) float each."""
        corners = self.triangles.reshape(-1, 3).astype(float)
        return corners.min(0), corners.max(0)

    def colors(self, face: np.ndarray, bary: np.ndarray) -> np.ndarray:
        """(n, 3) colour at points given by face number and barycentric coordinates (n, 3)."""
        out = self.flat_colors[face].astype(float)
        for number, image in enumerate(self.images):
            here = np.flatnonzero(self.texture[face] == number)
            if len(here):
                st = (self.st[face[here]] * bary[here, :, None]).sum(1)
                height, width = image.shape[:2]
                column = (st[:, 0] % 1.0 * width).astype(int) % width
                row = ((1 - st[:, 1] % 1.0) * height).astype(int) % height
                out[here] = image[row, column]
        return out


@dataclass(frozen=True)
class _Material:
    color: tuple[float, float, float] = (0.55, 0.55, 0.55)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gloss: float = 0.05
    texture: str = ""


def class_color(category: str) -> tuple[float, float, float]:
    """One linear colour per word, spread around the colour circle, the same in every run."""
    from echomodel.vocabulary import vocabulary

    if category in ("floor", "wall"):
        return (0.72, 0.71, 0.69)
    names = [entry.name for entry in vocabulary().categories]
    number = names.index(category) if category in names else sum(category.encode())
    hue = (number * GOLDEN) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.55 + 0.2 * (number % 3) / 2, 0.9 - 0.25 * (number % 4) / 3)
    return red**2.2, green**2.2, blue**2.2


def read_scenery(stage: Usd.Stage, *, by_class: bool = False) -> Scenery:
    """Collect every visible mesh of purpose default or render.

    Arguments:
        stage: any stage; Z-up and other units are converted.
        by_class: colour by the nearest `SemanticsLabelsAPI:category` instead of by material.

    Raises ValueError when there is no mesh to see.
    """
    to_metres = UsdGeom.GetStageMetersPerUnit(stage)
    axes = np.eye(3)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        axes = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    cache = UsdGeom.XformCache()
    parts: list[dict[str, np.ndarray]] = []
    images: dict[str, tuple[int, np.ndarray]] = {}
    fronts = []
    materials: dict[str, _Material] = {}
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
        if prim.GetTypeName() != "Mesh" or not _visible(prim):
            continue
        mesh = UsdGeom.Mesh(prim)
        world = np.array(cache.GetLocalToWorldTransform(prim)).T
        world[:3] *= to_metres
        world[:3] = axes @ world[:3]
        part = _triangles(mesh, world)
        if part is None:
            continue
        count = len(part["triangles"])
        looks = _face_looks(mesh, part.pop("face"), materials) if not by_class else [
            (_Material(class_color(_category(prim))), np.arange(count))
        ]
        part.update(
            flat_colors=np.zeros((count, 3), np.float32),
            emissive=np.zeros((count, 3), np.float32),
            gloss=np.zeros(count, np.float32),
            texture=np.full(count, -1),
        )
        part.pop("face", None)
        for look, faces in looks:
            part["flat_colors"][faces], part["emissive"][faces], part["gloss"][faces] = look.color, look.emissive, look.gloss
            if look.texture:
                if look.texture not in images:
                    images[look.texture] = (len(images), _image(look.texture))
                part["texture"][faces] = images[look.texture][0]
        parts.append(part)
        if _category(prim) not in ("floor", "wall"):
            fronts.append(world[[0, 2], 2])
    if not parts:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to draw, found no visible mesh")
    joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    facing = np.mean(fronts, 0) if fronts else np.array([0.0, 1.0])
    return Scenery(images=tuple(image for _, image in images.values()), facing=facing, **joined)


def _visible(prim: Usd.Prim) -> bool:
    imageable = UsdGeom.Imageable(prim)
    purpose = imageable.ComputePurpose()
    return purpose in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render) and imageable.ComputeVisibility() != "invisible"


def _category(prim: Usd.Prim) -> str:
    while prim and not prim.IsPseudoRoot():
        values = prim.GetAttribute("semantics:labels:category")
        if values and values.Get():
            return str(values.Get()[0])
        prim = prim.GetParent()
    return ""


def _triangles(mesh: UsdGeom.Mesh, world: np.ndarray) -> dict[str, np.ndarray] | None:
    """Fan triangles of a mesh in the world, with corner normals and st; `face` is the face that each came from."""
    points = np.asarray(mesh.GetPointsAttr().Get() or [], np.float64).reshape(-1, 3)
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
    index = np.asarray(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
    if not len(points) or not len(counts) or counts.sum() != len(index) or index.max(initial=0) >= len(points):
        return None
    first = np.cumsum(counts) - counts
    fans = np.clip(counts - 2, 0, None)
    face = np.repeat(np.arange(len(counts)), fans)
    step = np.arange(len(face)) - np.repeat(np.cumsum(fans) - fans, fans)
    corner = np.stack([first[face], first[face] + step + 1, first[face] + step + 2], 1)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corner = corner[:, ::-1]
    triangles = points[index[corner]] @ world[:3, :3].T + world[:3, 3]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-12)
    normals = np.repeat(flat[:, None], 3, axis=1)
    authored = _corner_values(mesh, "normals", 3, index, len(points), face, corner)
    if authored is not None:
        turned = authored @ np.linalg.inv(world[:3, :3])  # inverse transpose, as rows
        length = np.linalg.norm(turned, axis=-1, keepdims=True)
        normals = np.where(length > 1e-9, turned / np.maximum(length, 1e-9), normals)
    st = _corner_values(mesh, "st", 2, index, len(points), face, corner)
    return {
        "triangles": triangles.astype(np.float32),
        "normals": normals.astype(np.float32),
        "st": (st if st is not None else np.zeros((len(face), 3, 2))).astype(np.float32),
        "face": face,
    }


def _corner_values(
    mesh: UsdGeom.Mesh, name: str, width: int, index: np.ndarray, points: int, face: np.ndarray, corner: np.ndarray
) -> np.ndarray | None:
    """(t, 3, width) values of a primvar (or of the `normals` attribute) at the corners, or None."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar(name)
    if primvar and primvar.HasValue():
        values, interpolation = primvar.ComputeFlattened(), primvar.GetInterpolation()
    elif name == "normals" and mesh.GetNormalsAttr().HasAuthoredValue():
        values, interpolation = mesh.GetNormalsAttr().Get(), mesh.GetNormalsInterpolation()
    else:
        return None
    table = np.asarray(values, np.float64).reshape(-1, width)
    if interpolation == UsdGeom.Tokens.faceVarying and len(table) == len(index):
        return table[corner]
    if interpolation in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying) and len(table) == points:
        return table[index[corner]]
    if interpolation == UsdGeom.Tokens.uniform and len(table) > face.max(initial=0):
        return np.repeat(table[face][:, None], 3, axis=1)
    return None


def _face_looks(
    mesh: UsdGeom.Mesh, face: np.ndarray, known: dict[str, _Material]
) -> list[tuple[_Material, np.ndarray]]:
    """Materials of a mesh with the triangles that they colour; later entries win."""
    looks = [(_bound(mesh.GetPrim(), known), np.arange(len(face)))]
    for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
        chosen = np.zeros(int(face.max(initial=0)) + 1, bool)
        inside = np.asarray(subset.GetIndicesAttr().Get() or [], int)
        chosen[inside[(inside >= 0) & (inside < len(chosen))]] = True
        looks.append((_bound(subset.GetPrim(), known), np.flatnonzero(chosen[face])))
    return looks


def _bound(prim: Usd.Prim, known: dict[str, _Material]) -> _Material:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        shown = UsdGeom.Gprim(prim).GetDisplayColorAttr().Get() if prim.IsA(UsdGeom.Gprim) else None
        return _Material(tuple(float(c) for c in shown[0])) if shown else _Material()  # type: ignore[arg-type]
    path = str(material.GetPath())
    if path not in known:
        known[path] = _surface(material)
    return known[path]


def _surface(material: UsdShade.Material) -> _Material:
    shader, _, _ = material.ComputeSurfaceSource()
    if not shader:
        return _Material()
    values: dict[str, object] = {}
    texture = ""
    for name in ("diffuseColor", "emissiveColor", "roughness", "metallic"):
        source = shader.GetInput(name)
        if not source:
            continue
        connected = source.GetConnectedSources()[0] if source.HasConnectedSource() else []
        if connected and name == "diffuseColor":
            image = UsdShade.Shader(connected[0].source.GetPrim())
            file = image.GetInput("file").Get() if image.GetInput("file") else None
            texture = str(file.resolvedPath) if file else ""
        elif not connected and source.Get() is not None:
            values[name] = source.Get()
    color = tuple(float(c) for c in values.get("diffuseColor", (0.18, 0.18, 0.18)))  # type: ignore[attr-defined]
    emissive = tuple(float(c) for c in values.get("emissiveColor", (0.0, 0.0, 0.0)))  # type: ignore[attr-defined]
    rough, metal = float(values.get("roughness", 0.5)), float(values.get("metallic", 0.0))  # type: ignore[arg-type]
    return _Material(color, emissive, min(1.0, 0.5 * (1 - rough) + 0.35 * metal), texture)  # type: ignore[arg-type]


def _image(path: str) -> np.ndarray:
    """Linear RGB of an image, from a folder or from inside a usdz."""
    from PIL import Image

    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not asset:
        return np.full((1, 1, 3), 0.5, np.float32)
    picture = Image.open(io.BytesIO(bytes(asset.GetBuffer()))).convert("RGB")
    return (np.asarray(picture, np.float32) / 255) ** 2.2
