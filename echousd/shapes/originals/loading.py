"""A row of an index, or a file of one's own, as the geometry of an object that fills its box."""

import hashlib
import os
import re
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh
from pxr import Sdf, Tf, UsdUtils

from echomodel.files import within_memory
from echomodel.triangles import Mesh, connected_pieces
from echousd.assets.catalogues import Entry
from echousd.assets.describe import described, digest_of
from echousd.assets.measure import Measured, measure
from echousd.assets.model_file import Beside, ModelFile
from echousd.assets.record import AssetRecord
from echousd.assets.reference import Vector, check_reach, joined, split
from echousd.assets.table import Library
from echousd.exporting.packing import PACKED, LeftOut, asset_paths
from echousd.naming import STAGE_FORMS
from echousd.shapes.colliders import collider_of
from echousd.shapes.geometry import CONVERTED, Geometry, Origin, Original, Part
from echousd.shapes.surface import box_projection, creased_normals
from echousd.srgb import to_linear
from echousd.stage.files import layer_bytes, specs, usd_error
from echousd.stage.pen import Pen
from echousd.stage.shading import Image, preview_surface
from echousd.textures import READABLE, TextureError, encoded, image_in


def own_file(asset: str) -> ModelFile:
    """Where a model of one's own lies; its textures may lie in its folder and below."""
    file, prim = split(asset)
    return ModelFile(Path(file), Path(file).parent, prim=prim)


def own_record(asset: str, category: str) -> AssetRecord:
    """The row of a model of one's own, as if it were indexed; raises ValueError that names the file."""
    file = own_file(asset)
    key = joined(file.path.name, file.prim)
    record = described(Entry(key, file, file.path.stem, category=category), file.path, full=False)
    if record.fault:
        raise ValueError(record.fault)
    return record


def library_file(library: Library, record: AssetRecord) -> ModelFile:
    """Where a model of a library lies; raises ValueError where it is gone or is another one than was indexed."""
    path, member = library.path(record)
    model = ModelFile(path, library.root(record), member)
    check_reach(path, model.top, (), f"{library.file}: asset {record.id!r}")
    try:
        same = digest_of(model) == record.sha256
    except ValueError as error:
        raise ValueError(f"{library.file}: asset {record.id!r}: {error}; index the folder again") from None
    if not same:
        raise ValueError(f"{library.file}: asset {record.id!r}: {model} was changed since; index the folder again")
    return model


def geometry_of(
    model: ModelFile, record: AssetRecord, category: str, size: Vector, source: str, *, collect: bool = False
) -> Geometry:
    """The geometry of a model that fills `size` metres; raises ValueError that names its file.

    `model`, `record`: the model's file and its row. `category`: of the object. `source`: name of the shape source.
    `collect`: take a USD model along with all that it needs, instead of referring to where it lies.
    """
    found = measure(model)
    pose = record.pose(size)
    points = found.points @ pose[:3, :3].T + pose[:3, 3]
    mesh = Mesh(points, found.faces)
    original = _original(model, found, pose, collect)
    origin = Origin(source, record.licence, record.author, asset=record.id, sha256=record.sha256)
    return Geometry((Part("mesh", mesh, {}),), (collider_of(mesh, category),), origin, original=original)


def _original(model: ModelFile, found: Measured, pose: np.ndarray, collect: bool) -> Original:
    if model.suffix not in STAGE_FORMS:
        return Original(pose, ROOT, files=converted(model))
    # a payload brings the prim's own transform, and none of those above it
    main, files = collected(model) if collect else (CONVERTED, {})
    layer = None if collect else model.path.absolute()
    return Original(pose @ found.above, found.prim, layer, files, main, found.bodies, found.colliders)


TAKEN = (*STAGE_FORMS, *PACKED, *READABLE, ".mdl", ".mtlx", ".hdr")
MAX_TOTAL = 4 * 2**30  # bytes of one model with all that it needs


def collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    """(name of its layer, name -> content) of a USD model and the files that it depends on.

    Files that are not there stay missing, as they are. Raises ValueError that names the file for one that lies out of
    the library's folder, is of a kind that no model needs, or where all together are too large.
    """
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the exception says as well
    try:
        return _collected(model)
    except Tf.ErrorException as error:
        raise ValueError(f"{model}: cannot be collected with all that it depends on ({usd_error(error)})") from None
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence


def _collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    layers, others, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(model.path)))
    named = [str(layer.realPath) for layer in layers] + [str(path) for path in others]
    top, total = os.path.realpath(model.top), 0
    for name in named:
        path = name.partition("[")[0]
        if os.path.commonpath([top, os.path.realpath(path)]) != top:
            raise ValueError(f"{model}: {_named_by(layers, path)}depends on {path}, allowed: files below {model.top}")
        if Path(path).suffix.lower() not in TAKEN:
            warnings.warn(f"{model}: depends on {path}, which is left out", LeftOut, stacklevel=2)
        total += Path(path).stat().st_size
    if total > MAX_TOTAL:
        raise ValueError(f"{model}: {total} bytes with all that it needs, allowed: {MAX_TOTAL}")
    if model.suffix == ".usdz":
        return model.path.name, {model.path.name: model.path.read_bytes()}
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        if not UsdUtils.LocalizeAsset(Sdf.AssetPath(str(model.path)), folder):
            raise ValueError(f"{model}: cannot be collected with the files that it depends on")
        found = [p for p in sorted(Path(folder).rglob("*")) if p.is_file() and p.suffix.lower() in TAKEN]
        return model.path.name, {p.relative_to(folder).as_posix(): p.read_bytes() for p in found}


def _named_by(layers: Sequence[Sdf.Layer], path: str) -> str:
    """`<prim or property path> ` of who names a file, "" where no value does (a layer that is referred to)."""
    real = os.path.realpath(path)
    for layer in layers:
        for where, name in asset_paths(specs(layer)):
            if os.path.realpath(layer.ComputeAbsolutePath(name)) == real:
                return f"<{where}> "
    return ""


ROOT = "/model"
FOLDER = "textures"
CLOSED = 0.9  # share of a piece's edges with a neighbour on the other side, from which on it has an inside
SAME = 1e-6  # of the extent: points nearer than that are one, as texture coordinates cut surfaces apart


@dataclass
class Images:
    """Images of one model on their way to the disk: name -> content; equal ones are one file."""

    beside: Beside
    files: dict[str, bytes] = field(default_factory=dict)

    def named(self, image: Any) -> str:
        """The path of an image (PIL) of a material from the layer, "" where it cannot be packed."""
        file = image.info.get("file_path", "") if hasattr(image, "info") else ""
        content = self.beside.images.get(file, b"") if file else b""
        ending = ""
        with suppress(TextureError), image_in(content, file) as found:
            found.load()
            ending = {"JPEG": ".jpg", "PNG": ".png"}.get(found.format or "", "")
        if not ending:
            mode = "RGBA" if "A" in image.getbands() or image.mode == "P" else "RGB"
            content, ending = encoded(image.convert(mode)), ".png"
        stem = re.sub(r"[^A-Za-z0-9_\-]+", "_", PurePosixPath(file.replace("\\", "/")).stem) or "image"
        name = f"{FOLDER}/{stem[:40]}_{hashlib.sha256(content).hexdigest()[:8]}{ending}"
        self.files[name] = content
        return f"./{name}"


def converted(model: ModelFile) -> Mapping[str, bytes]:
    """The files of a model as USD: `CONVERTED` with the root prim `ROOT`, and its images.

    The model's own frame and unit are kept. Raises ValueError that names the file where it cannot be read.
    """
    beside = Beside(model)
    try:
        with within_memory(model.path, str(model)), model.opened() as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(file, file_type=model.suffix[1:], resolver=beside, process=False)
            parts = list(_parts(scene))
            if not parts:
                raise ValueError(f"{model}: holds no triangles")
            images = Images(beside)
            layer = _layer(parts, images)
    except (ValueError, ImportError) as error:
        raise ValueError(str(error) if str(error).startswith(str(model)) else f"{model}: {error}") from None
    except Exception as error:  # readers fail on damaged files in every way there is
        raise ValueError(f"{model}: cannot be read ({type(error).__name__}: {error!s:.120})") from None
    return {CONVERTED: layer_bytes(layer, ".usdc"), **images.files}


_Part = tuple[Mesh, np.ndarray | None, Any]  # in the scene's frame, with texture coordinates (v, 2) and a material


def _parts(scene: trimesh.Scene) -> Iterator[_Part]:
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        points = np.asarray(mesh.vertices) @ matrix[:3, :3].T + matrix[:3, 3]
        faces = np.asarray(mesh.faces)[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else np.asarray(mesh.faces)
        faces = outward(points, faces)
        coordinates = getattr(mesh.visual, "uv", None)
        uv = None if coordinates is None or len(coordinates) != len(points) else np.asarray(coordinates)
        if uv is not None:  # beyond a million repeats no digits are left for a place in the image: an exporter's slip
            uv = np.where(np.abs(uv) < 1e6, uv, 0.0) if np.isfinite(uv).all() else None
        yield Mesh(points, faces), uv, getattr(mesh.visual, "material", None)


def _layer(parts: list[_Part], images: Images) -> Sdf.Layer:
    pen = Pen.blank(ROOT[1:], ".usdc")
    pen.define(ROOT, "Xform", kind="component")
    pen.define(f"{ROOT}/Looks", "Scope")
    looks: dict[int, str] = {}
    taken: set[str] = set()
    for number, (whole, uv, material) in enumerate(parts):
        mesh = f"{ROOT}/mesh_{number}"
        _write_mesh(pen, mesh, whole, uv)
        if material is None:
            continue
        if id(material) not in looks:
            label = str(getattr(material, "name", "") or "look")
            name = Tf.MakeValidIdentifier(label.encode("ascii", "replace").decode())
            while name in taken:
                name = f"{name}_{number}"
            taken.add(name)
            looks[id(material)] = f"{ROOT}/Looks/{name}"
            _write_material(pen, looks[id(material)], material, images)
        pen.bind(mesh, looks[id(material)])
    return pen.layer


def _write_mesh(pen: Pen, path: str, whole: Mesh, uv: np.ndarray | None) -> None:
    points, faces = whole.vertices.astype(np.float32), whole.faces.astype(np.int32)
    flat = None if uv is not None else box_projection(whole)
    merged = whole.trimesh
    merged.merge_vertices()  # along the seams of texture coordinates, so that shading has none
    normals, index = creased_normals(Mesh.of(merged))
    values = uv if flat is None else flat.reshape(-1, 2)
    mesh = pen.define(path, "Mesh", {
        "uniform token subdivisionScheme": "none", "uniform bool doubleSided": True, "point3f[] points": points,
        "int[] faceVertexCounts": np.full(len(faces), 3, np.int32),
        "int[] faceVertexIndices": np.ascontiguousarray(faces).ravel(),
        "float3[] extent": np.stack([points.min(0), points.max(0)]),
        "normal3f[] primvars:normals": normals, "int[] primvars:normals:indices": index,
        "texCoord2f[] primvars:st": np.ascontiguousarray(values, np.float32),
    })  # fmt: skip
    mesh.attributes["primvars:normals"].SetInfo("interpolation", "faceVarying")
    mesh.attributes["primvars:st"].SetInfo("interpolation", "vertex" if flat is None else "faceVarying")


def _write_material(pen: Pen, path: str, material: Any, images: Images) -> None:
    look = _pbr(material) if isinstance(material, trimesh.visual.material.PBRMaterial) else _simple(material)
    tint = tuple(map(float, look["tint"]))
    shown = [
        Image(f"{first}_image", images.named(image), dict(outputs), tint if first == "diffuseColor" else ())
        for image, outputs in look["images"]
        for first, _ in outputs[:1]
    ]
    values: dict[str, Any] = {name: float(look[name]) for name in ("roughness", "metallic", "opacity")}
    values["diffuseColor"] = tuple(map(float, look["color"]))
    if any(look.get("emissive", ())):
        values["emissiveColor"] = tuple(map(float, look["emissive"]))
    if look["cutoff"]:
        values["opacityThreshold"] = float(look["cutoff"])
    fed = {name for image in shown for name in image.inputs}
    preview_surface(pen, path, {name: value for name, value in values.items() if name not in fed}, shown)


def _simple(material: Any) -> dict[str, Any]:
    """The look of a Phong material of an OBJ."""
    shown = material.diffuse
    color = np.full(3, 0.6) if shown is None else to_linear(np.asarray(shown, float)[:3] / 255)
    kwargs = getattr(material, "kwargs", {}) or {}
    shine = material.glossiness
    rough = float(np.clip((2.0 / (float(shine) + 2.0)) ** 0.25, 0.15, 1.0)) if isinstance(shine, float | int) else 0.7
    image = material.image
    return {
        "color": color, "tint": (1.0, 1.0, 1.0), "roughness": rough, "metallic": 0.0,
        "opacity": _number(kwargs.get("d"), 1.0) if "d" in kwargs else 1.0 - _number(kwargs.get("tr"), 0.0),
        "cutoff": 0.0, "images": [] if image is None else [(image, [("diffuseColor", "rgb"), *_alpha(image)])],
    }  # fmt: skip


def _pbr(material: Any) -> dict[str, Any]:
    """The look of a glTF material."""
    factor = material.baseColorFactor
    color = np.ones(4) if factor is None else np.asarray(factor, float) / (255.0 if np.max(factor) > 1 else 1.0)
    images: list[tuple[Any, list[tuple[str, str]]]] = []
    masked = material.alphaMode in ("MASK", "BLEND")
    if material.baseColorTexture is not None:
        alpha = _alpha(material.baseColorTexture) if masked else []
        images.append((material.baseColorTexture, [("diffuseColor", "rgb"), *alpha]))
    if material.metallicRoughnessTexture is not None:
        images.append((material.metallicRoughnessTexture, [("roughness", "g"), ("metallic", "b")]))
    if material.normalTexture is not None:
        images.append((material.normalTexture, [("normal", "rgb")]))
    if material.emissiveTexture is not None:
        images.append((material.emissiveTexture, [("emissiveColor", "rgb")]))
    emissive = material.emissiveFactor
    return {
        "color": color[:3],
        "tint": color[:3],
        "roughness": 1.0 if material.roughnessFactor is None else material.roughnessFactor,
        "metallic": 1.0 if material.metallicFactor is None else material.metallicFactor,
        "opacity": color[3] if masked else 1.0,
        "emissive": (0.0,) * 3 if emissive is None else np.asarray(emissive, float),
        "cutoff": (material.alphaCutoff or 0.5) if material.alphaMode == "MASK" else 0.0,
        "images": images,
    }


def _alpha(image: Any) -> list[tuple[str, str]]:
    return [("opacity", "a")] if "A" in image.getbands() else []


def _number(value: Any, otherwise: float) -> float:
    try:
        number = float(value[0] if isinstance(value, list | tuple) else value)
    except (TypeError, ValueError, IndexError):
        return otherwise
    return min(max(number, 0.0), 1.0) if np.isfinite(number) else otherwise


def outward(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(f, 3) int, the faces with every piece turned that is nearly closed, evenly wound and inside out.

    `points`: (v, 3) float. `faces`: (f, 3) int, counter-clockwise seen from outside.
    """
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    place = np.unique(np.rint(points / (SAME * extent)).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    corner = place[faces]
    count = int(place.max()) + 1
    start, end = corner[:, [0, 1, 2]].ravel(), corner[:, [1, 2, 0]].ravel()
    forth, back = start * count + end, end * count + start
    known, often = np.unique(forth, return_counts=True)
    once = often[np.searchsorted(known, forth)] == 1
    paired = np.isin(back, known)
    of_face = connected_pieces(corner, count)
    of_edge, pieces = np.repeat(of_face, 3), int(of_face.max()) + 1
    edges = np.maximum(np.bincount(of_edge, minlength=pieces), 1)
    even = np.bincount(of_edge, once, pieces) == edges
    closed = np.bincount(of_edge, paired, pieces) >= CLOSED * edges
    sums = np.stack([np.bincount(of_face, points[faces].mean(1)[:, axis], pieces) for axis in range(3)], 1)
    middle = sums / np.maximum(np.bincount(of_face, minlength=pieces), 1)[:, None]
    a, b, c = (points[faces[:, k]] - middle[of_face] for k in range(3))
    volume = np.bincount(of_face, np.einsum("ij,ij->i", a, np.cross(b, c)), pieces)
    wrong = (even & closed & (volume < 0))[of_face]
    return np.where(wrong[:, None], faces[:, ::-1], faces)
