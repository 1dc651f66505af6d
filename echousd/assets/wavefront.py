"""OBJ files: of what trimesh would read only the triangles and what colours them, many times faster."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from echomodel.triangles import area_normals
from echousd.assets.colors import Coat, flat, texels
from echousd.assets.measured import Measured
from echousd.assets.model_file import Beside, ModelFile
from echousd.srgb import to_linear

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
    coats = dict(_coats(re.findall(r"^mtllib[ \t]+(.+?)[ \t]*$", text, re.MULTILINE), beside, painted))
    inside = len(faces) > 0 and faces.min() >= 0 and faces.max() < len(points)
    seen: list[Coat] = []
    if painted and coats and inside:
        area = np.bincount(np.concatenate(slots), np.linalg.norm(area_normals(points[faces]), axis=1), len(names))
        seen = [(float(area[k]), coats[name]) for k, name in enumerate(names) if name in coats and area[k] > 0]
    used = tuple(dict.fromkeys(names[1:]))
    return Measured(points, faces, materials=used, missing=tuple(dict.fromkeys(beside.missing)), coats=tuple(seen))


def _coats(libraries: list[str], beside: Beside, painted: bool) -> Iterator[tuple[str, np.ndarray]]:
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
