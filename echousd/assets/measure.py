"""Read a model of any kind: stages by USD, glTF by trimesh, OBJ here, whose material libraries are read as well."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from echomodel.files import within_memory
from echousd.assets.colors import Coat, flat, pixels
from echousd.assets.measured import Measured
from echousd.assets.model_file import STAGES, ModelFile
from echousd.assets.stages import measured_stage
from echousd.assets.wavefront import measured_obj
from echousd.srgb import to_linear


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
    shown: Any = part.visual
    return flat(to_linear(np.asarray(shown.main_color, float) / 255))
