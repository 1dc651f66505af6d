"""Visible meshes of a stage as numpy arrays with their materials: what pictures and other formats are made from."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from echomodel.triangles import area_normals, lengths
from echousd.stage import values
from echousd.stage.encoding import LABELS, StageError
from echousd.stage.forms import forms, polygons
from echousd.stage.units import to_metres
from echousd.textures import TextureError, read_image

LINEAR = (np.arange(256, dtype=np.float32) / 255) ** 2.2  # of a byte of sRGB


@dataclass(frozen=True)
class Texture:
    """An image that a material reads: its resolved path, the prim of its shader, the channel that counts, and what its
    values are multiplied with."""

    path: str
    prim: str
    channel: str = "r"
    scale: float = 1.0


@dataclass(frozen=True)
class Paint:
    """A UsdPreviewSurface in short: linear colours; the colour's texture as resolved path, its shader's prim
    path, what it is multiplied with, and the primvar that it is laid out by; images of roughness and normals."""

    name: str = "grey"
    color: tuple[float, float, float] = (0.55, 0.55, 0.55)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness: float = 0.8
    metallic: float = 0.0
    texture: str = ""
    image: str = ""
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    opacity: float = 1.0
    st: str = "st"
    rough: Texture | None = None
    normal: Texture | None = None

    @property
    def textured(self) -> bool:
        """Whether any image shows."""
        return bool(self.texture or self.rough or self.normal)


@dataclass(frozen=True, eq=False)
class Drawable:
    """One visible mesh."""

    path: str  # prim path of the mesh
    component: str  # name of the nearest prim above with a kind of component, else of the mesh
    category: str  # nearest `SemanticsLabelsAPI:category` label, "" without one
    world: np.ndarray  # (4, 4) float, mesh to world, column vectors, y up, metres
    triangles: np.ndarray  # triangles, normals: (t, 3, 3) float corners and normals in the mesh's frame
    normals: np.ndarray
    st: np.ndarray | None  # (t, 3, 2) float texture coordinates, or None
    paints: tuple[tuple[Paint, np.ndarray], ...]  # materials with the triangles that they colour; later entries win
    double_sided: bool = False  # whether its back is seen, too


def read_drawables(stage: Usd.Stage) -> Iterator[Drawable]:
    """Every visible surface of purpose default or render, instances included; Z-up and other units are converted.

    Surfaces without polygons (curves, volumes ...) are left out with a warning.
    """
    to_world = to_metres(stage)
    cache = UsdGeom.XformCache(values.NOW)
    known: dict[str, Paint] = {}
    owners: dict[Usd.Prim, tuple[str, str]] = {}
    shapes: dict[Usd.Prim, tuple | None] = {}  # of what an instancer places often
    for form in forms(stage.GetPseudoRoot(), cache):
        prim = form.prim
        part = shapes[prim] if prim in shapes else _part(prim, known)
        if form.above is not None:
            shapes[prim] = part
        if part is not None:
            triangles, normals, st, paints = part
            component, category = _owner(prim, owners)
            component = component or prim.GetName()
            if form.above is not None:
                above, also = _owner(form.above, owners)
                number = form.path.partition("[")[2].partition("]")[0]
                component, category = f"{above or form.above.GetName()}{number}", category or also
            double = bool(values.value_of(UsdGeom.Gprim(prim).GetDoubleSidedAttr()))
            yield Drawable(
                form.path, component, category, to_world @ form.world, triangles, normals, st, paints, double
            )


def image_of(prim: str, file: str, halved: int = 0) -> np.ndarray:
    """(h, w, 3) uint8 sRGB of the image that a prim names, by paths, halved so often; raises StageError naming both."""
    try:
        return read_image(file, halved)
    except TextureError as error:
        raise StageError(f"<{prim}>: {error}") from None


def _owner(prim: Usd.Prim, known: dict[Usd.Prim, tuple[str, str]]) -> tuple[str, str]:
    """Name of the nearest component at or above a prim, and the nearest category, "" without one; `known` grows."""
    if prim.IsPseudoRoot():
        return "", ""
    if prim not in known:
        component, category = _owner(prim.GetParent(), known)
        whole = Usd.ModelAPI(prim).GetKind() == "component"
        known[prim] = prim.GetName() if whole else component, own_category(prim) or category
    return known[prim]


def own_category(prim: Usd.Prim) -> str:
    """The category that a prim itself is labelled with, "" without one."""
    return next(iter(values.texts(prim.GetAttribute(LABELS))), "")


def _part(
    prim: Usd.Prim, known: dict[str, Paint]
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, tuple[tuple[Paint, np.ndarray], ...]] | None:
    """Triangles of a surface: corners, corner normals, st and paints."""
    surface = polygons(prim)
    points, counts, index = surface.points, surface.counts, surface.indices
    if not (counts > 2).any():
        return None
    face, corner = values.fans(counts)
    if UsdGeom.Gprim(prim).GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corner = corner[:, ::-1]
    triangles = points[index[corner]]
    paints = tuple(paints_of(prim, surface.face[face], known))
    if surface.normals is not None:
        return triangles, surface.normals[index[corner]], None, paints
    if not prim.IsA(UsdGeom.Mesh):
        return triangles, _flat(triangles), None, paints
    mesh = UsdGeom.Mesh(prim)
    where = (index, len(points), face, corner)
    authored = _corner_values(mesh, "normals", 3, *where)
    length = np.zeros(1) if authored is None else lengths(authored)[..., None]
    normals = _flat(triangles) if length.min(initial=1) <= 1e-9 else np.zeros(1)
    if authored is not None:
        normals = np.where(length > 1e-9, authored / np.maximum(length, 1e-9), normals)
    tables = {name: _corner_values(mesh, name, 2, *where) for name in {"st", *(paint.st for paint, _ in paints)}}
    st = tables["st"]
    if any(table is not None for name, table in tables.items() if name != "st"):
        st = np.zeros((len(face), 3, 2))
        for paint, faces in paints:  # later ones win
            table = tables[paint.st] if tables[paint.st] is not None else tables["st"]
            st[faces] = 0.0 if table is None else table[faces]
    return triangles, normals, st, paints


def _flat(triangles: np.ndarray) -> np.ndarray:
    """(t, 3, 3) normals of triangles (t, 3, 3) at their corners."""
    cross = area_normals(triangles)
    return np.repeat((cross / np.maximum(lengths(cross), 1e-12)[:, None])[:, None], 3, axis=1)


def _corner_values(
    mesh: UsdGeom.Mesh, name: str, width: int, index: np.ndarray, points: int, face: np.ndarray, corner: np.ndarray
) -> np.ndarray | None:
    """(t, 3, width) values of a primvar (or of the `normals` attribute) at the corners, or None."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar(name)
    if primvar and primvar.HasValue():
        found, interpolation, attribute = _flattened(primvar), primvar.GetInterpolation(), primvar.GetAttr()
    elif name == "normals" and mesh.GetNormalsAttr().HasAuthoredValue():
        attribute = mesh.GetNormalsAttr()
        found, interpolation = values.value_of(attribute), mesh.GetNormalsInterpolation()
    else:
        return None
    table = values.numbers(found, width, attribute)
    if interpolation == UsdGeom.Tokens.faceVarying and len(table) == len(index):
        return table[corner]
    if interpolation in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying) and len(table) == points:
        return table[index[corner]]
    if interpolation == UsdGeom.Tokens.uniform and len(table) > face.max(initial=0):
        return np.repeat(table[face][:, None], 3, axis=1)
    return None


def _flattened(primvar: UsdGeom.Primvar) -> Any:
    """Values of a primvar, one for each of its indices; raises StageError for indices out of range."""
    found = values.value_of(primvar.GetAttr())
    if not primvar.IsIndexed() or isinstance(found, str):  # a text is refused where numbers are read
        return found
    index = values.array(primvar.GetIndicesAttr(), whole=True)
    if not hasattr(found, "__len__") or (len(index) and (index.min() < 0 or index.max() >= len(found))):
        count = len(found) if hasattr(found, "__len__") else 0
        raise StageError(
            f"{values.owner(primvar.GetIndicesAttr())} reaches from {index.min(initial=0)} to {index.max(initial=0)}, "
            f"allowed: 0 to {count - 1}"
        )
    return np.asarray(found)[index]


def paints_of(prim: Usd.Prim, face: np.ndarray, known: dict[str, Paint]) -> list[tuple[Paint, np.ndarray]]:
    """Materials of a surface with the triangles that they colour; later ones win.

    `face`: (t,) int, face of each triangle. `known`: materials that were read already, by path; grows.
    """
    paints = [(_bound(prim, known), np.arange(len(face)))]
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        chosen = np.zeros(int(face.max(initial=0)) + 1, bool)
        inside = values.array(subset.GetIndicesAttr(), whole=True)
        chosen[inside[(inside >= 0) & (inside < len(chosen))]] = True
        paints.append((_bound(subset.GetPrim(), known), np.flatnonzero(chosen[face])))
    return paints


def _bound(prim: Usd.Prim, known: dict[str, Paint]) -> Paint:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        authored: Any = values.value_of(UsdGeom.Gprim(prim).GetDisplayColorAttr()) if prim.IsA(UsdGeom.Gprim) else None
        color = rgb(next(iter(authored), None) if hasattr(authored, "__iter__") else None, None)
        return Paint("displayColor", color) if color else Paint()
    path = str(material.GetPath())
    if path not in known:
        known[path] = _surface(material)
    return known[path]


def _surface(material: UsdShade.Material) -> Paint:
    shader, _, _ = material.ComputeSurfaceSource()
    if not shader:
        return Paint()
    found: dict[str, Usd.Attribute] = {}
    images: dict[str, tuple[UsdShade.Shader, Texture]] = {}
    for name in ("diffuseColor", "emissiveColor", "roughness", "metallic", "opacity", "normal"):
        source = shader.GetInput(name)
        if not source:
            continue
        connected = source.GetConnectedSources()[0] if source.HasConnectedSource() else []
        if not connected:
            found[name] = source.GetAttr()
            continue
        image = UsdShade.Shader(connected[0].source.GetPrim())
        file = values.asset(image.GetInput("file").GetAttr()) if image and image.GetInput("file") else None
        if file and file.resolvedPath:
            where = str(file.resolvedPath), str(image.GetPath()), str(connected[0].sourceName)
            images[name] = image, Texture(*where, _first(image, "scale") if name == "roughness" else 1.0)
    texture, tint, laid_out = Texture("", ""), (1.0, 1.0, 1.0), "st"
    if "diffuseColor" in images:
        image, texture = images["diffuseColor"]
        laid_out = _primvar_of(image)
        if image.GetInput("scale"):
            tint = rgb(values.value_of(image.GetInput("scale").GetAttr()), tint)
    rough = values.number(found.get("roughness"), 0.5)
    if "roughness" in images:  # ours fall back to their mean
        rough = (_first(images["roughness"][0], "fallback", 0.0) or 0.5) * images["roughness"][1].scale
    return Paint(
        material.GetPrim().GetName(), rgb(values.value_of(found.get("diffuseColor")), (0.18, 0.18, 0.18)),
        rgb(values.value_of(found.get("emissiveColor")), (0.0, 0.0, 0.0)), rough,
        values.number(found.get("metallic"), 0.0), texture.path, texture.prim, tint,
        values.number(found.get("opacity"), 1.0), laid_out,
        *(images[name][1] if name in images else None for name in ("roughness", "normal")),
    )  # fmt: skip


def _first(image: UsdShade.Shader, name: str, default: float = 1.0) -> float:
    """The first number of an input of an image."""
    authored = image.GetInput(name)
    return float(rgb(values.value_of(authored.GetAttr()), (default,))[0]) if authored else default


def _primvar_of(image: UsdShade.Shader) -> str:
    """Name of the primvar that an image is laid out by, `st` where it does not say."""
    shader, entry = image, "st"
    for _ in range(2):  # a UsdTransform2d may stand between
        source = shader.GetInput(entry) if shader else None
        found = source.GetConnectedSources()[0] if source and source.HasConnectedSource() else []
        shader, entry = UsdShade.Shader(found[0].source.GetPrim()) if found else None, "in"
        name = shader.GetInput("varname") if shader else None
        attributes = name.GetValueProducingAttributes() if name else []
        if attributes:
            return next(iter(values.texts(attributes[0])), "st")
    return "st"


def rgb(found: Any, default: Any) -> Any:
    """Three finite numbers of a colour (of RGB or RGBA), `default` where there are none."""
    try:
        red, green, blue = (float(c) for c in tuple(found)[:3])
    except (TypeError, ValueError):
        return default
    return (red, green, blue) if all(abs(c) < 1e6 for c in (red, green, blue)) else default
