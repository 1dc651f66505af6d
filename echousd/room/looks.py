"""How things look: palettes per style, and which material group each part of a piece of furniture belongs to."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary


@dataclass(frozen=True)
class Look:
    """One UsdPreviewSurface: colours are linear RGB in [0, 1]; `texture` names an image that replaces the colour."""

    color: tuple[float, float, float]
    roughness: float = 0.6
    metallic: float = 0.0
    opacity: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    texture: str = ""


# Colours that go together, as sRGB hex: wood, painted fronts, upholstery, bed linen, blanket, metal, ceramic.
PALETTES: Mapping[str, tuple[str, str, str, str, str, str, str]] = {
    "oak": ("b98f5f", "e7e1d6", "6f7f86", "ece7dd", "8c9ba0", "33353a", "d9d3c7"),
    "walnut": ("77502f", "8a6240", "b9803a", "efe8da", "b06a43", "b08d57", "b9623f"),
    "ash": ("d3b88f", "f0ece3", "a9b39c", "f3efe7", "8fa08a", "d0cfca", "8d9a92"),
    "smoke": ("7d6b5b", "9a8c7f", "5d7088", "dfdcd6", "3f4f66", "9ea3a8", "3c4046"),
    "cherry": ("83523a", "9a6446", "c9b594", "f0e9de", "93443a", "c2a15f", "e4ddd0"),
    "birch": ("dcc39a", "cfd8d3", "c48f85", "f5f0ea", "d5a79c", "8e9498", "c9b8a6"),
}


def linear(hexadecimal: str) -> tuple[float, float, float]:
    """`b98f5f` (sRGB) -> linear RGB."""
    value = np.array([int(hexadecimal[i : i + 2], 16) for i in (0, 2, 4)]) / 255
    value = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    red, green, blue = (round(float(v), 5) for v in value)
    return red, green, blue


@cache
def look(palette: str, group: str) -> Look:
    """The look of a material group in a palette; raises KeyError for unknown words."""
    wood, front, fabric, linen, blanket, metal, ceramic = PALETTES[palette]
    upholstery = np.array(linear(fabric))
    cushion = tuple(round(float(c), 5) for c in 0.75 * upholstery + 0.25 * np.array(linear("f0e8da")))
    return {
        "wood": Look(linear(wood), 0.55),
        "front": Look(linear(front), 0.5),
        "fabric": Look(linear(fabric), 0.92),
        "cushion": Look((cushion[0], cushion[1], cushion[2]), 0.92),
        "linen": Look(linear(linen), 0.9),
        "blanket": Look(linear(blanket), 0.95),
        "metal": Look(linear(metal), 0.35, metallic=0.85),
        "ceramic": Look(linear(ceramic), 0.4),
        "leaf": Look(linear("4f7d3c"), 0.7),
        "soil": Look(linear("4a3a2c"), 0.95),
        "shade": Look(linear("f6e7c8"), 0.8, emissive=tuple(round(0.55 * c, 5) for c in linear("ffe2ae"))),  # type: ignore[arg-type]
        "screen": Look(linear("15171b"), 0.12),
        "glass": Look(linear("dfeae8"), 0.08, opacity=0.35),
        "mirror": Look(linear("c9d2d4"), 0.05, metallic=1.0),
        "book": Look(linear("7a4a40"), 0.8),
        "stem": Look(linear("6b5436"), 0.85),
        "rug": Look(linear("d9d0c0"), 0.95),
        "curtain": Look(linear("ebe5da"), 0.9),
        "accent_cloth": Look(linear(blanket), 0.95),
        "picture": Look(linear("a9b0a8"), 0.8),
        "frame": Look(linear(wood), 0.5),
        "paper": Look(linear("f1ede4"), 0.9),
        "book_a": Look(linear(blanket), 0.7),
        "book_b": Look(linear("e4dccb"), 0.7),
        "book_c": Look(linear("2f3b45"), 0.7),
        "book_d": Look(linear("8f5a3c"), 0.7),
        "petal": Look(linear("f0dfd5"), 0.8),
        "fruit": Look(linear("c9862e"), 0.5),
        "wax": Look(linear("f3eadb"), 0.5),
        "wicker": Look(linear("b08a58"), 0.9),
        "leather": Look(linear("5a3d2b"), 0.5),
    }[group]


def floor_color(palette: str) -> tuple[float, float, float]:
    """Linear colour of floor boards that set the palette's furniture off: light below dark wood, dark below light."""
    wood = np.array(look(palette, "wood").color)
    return linear("c2a27c") if wood.mean() < 0.2 else linear("8d6c4d")


def palette_for(key: str) -> str:
    """A palette for a style's name, the same in every run."""
    names = sorted(PALETTES)
    return names[int.from_bytes(hashlib.blake2b(key.encode(), digest_size=4).digest(), "big") % len(names)]


@dataclass(frozen=True)
class Part:
    """A region of the object's box: `group` reaches up to `top` (fraction of the height, or metres if `metres`)."""

    group: str
    top: float = 1.0
    metres: bool = False


# How the materials of one kind of furniture are laid out; a category's row in the vocabulary names its own.
BANDS: Mapping[str, tuple[Part, ...]] = {
    "bed": (Part("wood", 0.24, True), Part("linen")),
    "sofa": (Part("wood", 0.09, True), Part("fabric")),
    "chair": (Part("wood", 0.46), Part("fabric")),
    "stool": (Part("wood", 0.62), Part("fabric")),
    "office_chair": (Part("metal", 0.40), Part("fabric")),
    "ottoman": (Part("wood", 0.06, True), Part("fabric")),
    "bench": (Part("wood"),),
    "bar_stool": (Part("metal", 0.62), Part("fabric")),
    "table": (Part("wood"),),
    "coffee_table": (Part("metal", 0.84), Part("wood")),
    "side_table": (Part("metal", 0.86), Part("wood")),
    "cabinet": (Part("wood"),),  # with doors and drawers in front
    "shelf": (Part("wood"),),
    "floor_lamp": (Part("metal", 0.74), Part("shade")),
    "table_lamp": (Part("ceramic", 0.48), Part("shade")),
    "ceiling_lamp": (Part("shade", 0.85), Part("metal")),
    "pendant_lamp": (Part("shade", 0.42), Part("metal")),
    "wall_lamp": (Part("metal", 0.3), Part("shade")),
    "plant": (Part("ceramic", 0.27), Part("leaf")),
    "tv": (Part("screen"),),
}
HEADBOARD = 0.09  # metres at the back of a bed that are wood to the top
FOLD = 0.42  # share of a bed's length, from the foot, that the blanket covers
FRONT = 0.012  # metres behind the foremost plane that count as the front of a cabinet


def material_groups(mesh: trimesh.Trimesh, category: str) -> tuple[trimesh.Trimesh, dict[str, np.ndarray]]:
    """Cut a mesh (object frame, metres) along the borders of its materials: (mesh, group -> (m,) face numbers)."""
    laid = vocabulary().category(category).look
    lower, upper = mesh.bounds
    height = upper[1] - lower[1]
    bands = BANDS[laid]
    tops = [lower[1] + (min(p.top, 0.5 * height) if p.metres else p.top * height) for p in bands[:-1]]
    for top in tops:
        mesh = cut(mesh, 1, top)
    if laid == "bed":
        mesh = cut(mesh, 2, lower[2] + HEADBOARD)
        mesh = cut(mesh, 2, upper[2] - FOLD * (upper[2] - lower[2]))
    centre = np.asarray(mesh.triangles_center)
    number = np.searchsorted(np.array(tops), centre[:, 1])
    group = np.array([p.group for p in bands], dtype=object)[number]
    if laid == "bed":
        group[(group == "linen") & (centre[:, 2] > upper[2] - FOLD * (upper[2] - lower[2]))] = "blanket"
        group[centre[:, 2] < lower[2] + HEADBOARD] = "wood"
    elif laid == "cabinet":
        normal = mesh.face_normals
        group[(normal[:, 2] > 0.8) & (centre[:, 2] > upper[2] - FRONT - 0.04 * (upper[2] - lower[2]))] = "front"
    return mesh, {str(name): np.flatnonzero(group == name) for name in sorted(set(group))}


def cut(mesh: trimesh.Trimesh, axis: int, offset: float) -> trimesh.Trimesh:
    """Split the triangles that cross the plane `axis = offset`; a closed mesh stays closed.

    Vertices within 2 mm are moved onto the plane first, so that no slivers appear.
    """
    vertices, faces = np.array(mesh.vertices), np.asarray(mesh.faces)
    span = vertices[:, axis].max() - vertices[:, axis].min()
    distance = vertices[:, axis] - offset
    near = np.abs(distance) < min(0.002, 0.01 * span)
    vertices[near, axis] = offset
    side = np.where(near, 0, np.sign(distance)).astype(int)
    corner = side[faces]
    crossing = (corner.min(1) < 0) & (corner.max(1) > 0)
    if not crossing.any():
        return trimesh.Trimesh(vertices, faces, process=False)
    kept, split, corner = faces[~crossing], faces[crossing], corner[crossing]
    edges = np.sort(np.concatenate([split[:, [0, 1]], split[:, [1, 2]], split[:, [2, 0]]]), axis=1)
    edges = np.unique(edges[side[edges[:, 0]] * side[edges[:, 1]] < 0], axis=0)
    a, b = distance[edges[:, 0]], distance[edges[:, 1]]
    fresh = vertices[edges[:, 0]] + (a / (a - b))[:, None] * (vertices[edges[:, 1]] - vertices[edges[:, 0]])
    fresh[:, axis] = offset
    key = edges[:, 0] * len(vertices) + edges[:, 1]

    def middle(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        wanted = np.minimum(p, q) * len(vertices) + np.maximum(p, q)
        return len(vertices) + np.searchsorted(key, wanted)

    pieces = [kept]
    touching = (corner == 0).any(1)
    if touching.any():  # one corner on the plane: two triangles
        turned = _roll(split[touching], np.argmax(corner[touching] == 0, axis=1))
        p, q, r = turned.T
        m = middle(q, r)
        pieces += [np.stack([p, q, m], 1), np.stack([p, m, r], 1)]
    if (~touching).any():  # one corner alone on its side: three triangles
        alone = corner[~touching] == -np.sign(corner[~touching].sum(1))[:, None]
        p, q, r = _roll(split[~touching], np.argmax(alone, axis=1)).T
        m, n = middle(p, q), middle(r, p)
        pieces += [np.stack([p, m, n], 1), np.stack([m, q, r], 1), np.stack([m, r, n], 1)]
    return trimesh.Trimesh(np.concatenate([vertices, fresh]), np.concatenate(pieces), process=False)


def _roll(faces: np.ndarray, first: np.ndarray) -> np.ndarray:
    return np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
