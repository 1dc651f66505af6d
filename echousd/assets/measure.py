"""Read a model of any kind: stages by USD, glTF by trimesh, OBJ here, as of it only the triangles are wanted."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import numpy as np
import trimesh

from echousd.assets.measured import Measured
from echousd.assets.model_file import STAGES, ModelFile
from echousd.assets.stages import measured_stage


def measure(model: ModelFile) -> Measured:
    """Read a model; raises ValueError that names the file for one that cannot be read or has no surface."""
    try:
        if model.suffix in STAGES:
            with model.opened():
                pass
            found = measured_stage(model.path, model.prim)
        else:
            found = _mesh(model)
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


def _mesh(model: ModelFile) -> Measured:
    beside = model.beside()
    with model.opened() as file:
        if model.suffix == ".obj":
            return _obj(model, file.read().decode("utf-8", "replace"))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(
                file, file_type=model.suffix[1:], resolver=beside, process=False, skip_materials=True
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
    )


FACE = re.compile(r"^f[ \t]+(.+?)[ \t]*$", re.MULTILINE)
VERTEX = re.compile(r"^v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.MULTILINE)


def _obj(model: ModelFile, text: str) -> Measured:
    """An OBJ without its texture coordinates and normals: triangles, names of materials, textures that are missing."""
    points = np.array(VERTEX.findall(text), float).reshape(-1, 3)
    lines = re.sub(r"/\S*|#.*", "", "\n".join(FACE.findall(text))).splitlines()
    counts = np.array([len(line.split()) for line in lines], int)
    corners = np.array(" ".join(lines).split(), int)
    if (corners < 0).any():
        raise ValueError(f"{model}: faces count points from the end, allowed: plain numbers; write it again")
    starts = np.cumsum(counts) - counts
    triangles = [np.zeros((0, 3), int)]
    for count in np.unique(counts[counts > 2]):
        first = starts[counts == count]
        for k in range(1, count - 1):
            triangles.append(corners[np.stack([first, first + k, first + k + 1], 1)] - 1)
    beside = model.beside()
    for library in re.findall(r"^mtllib[ \t]+(.+?)[ \t]*$", text, re.MULTILINE):
        try:
            content = beside.get(library.strip()).decode("utf-8", "replace")
        except ValueError:
            continue
        for image in re.findall(r"^[ \t]*map_Kd[ \t]+(.+?)[ \t]*$", content, re.MULTILINE | re.IGNORECASE):
            if image not in beside.images and image not in beside.missing:
                try:
                    beside.get(image)
                except ValueError:
                    continue
    used = re.findall(r"^usemtl[ \t]+(.+?)[ \t]*$", text, re.MULTILINE)
    missing = tuple(dict.fromkeys(beside.missing))
    return Measured(points, np.concatenate(triangles), materials=tuple(dict.fromkeys(used)), missing=missing)
