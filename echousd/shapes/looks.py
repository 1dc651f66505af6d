"""How things look: palettes per style, and which material group each part of a piece of furniture belongs to."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary
from echousd.shapes.finishes.slots import HARMONIES, SECOND, SLOTS, Color, linear, mixed
from echousd.shapes.styles import ROOM_STYLE


@dataclass(frozen=True)
class Look:
    """One UsdPreviewSurface: colours are linear RGB in [0, 1]; the pattern, if there is one, carries the colour."""

    color: Color
    roughness: float = 0.6
    metallic: float = 0.0
    opacity: float = 1.0
    emissive: Color = (0.0, 0.0, 0.0)
    pattern: str = ""
    metres: float = 1.0


SHOWN = 6  # harmonies among which a written room or asset lets one choose
GLOW = tuple(round(0.55 * c, 5) for c in linear("ffe2ae"))  # of a lamp's shade


@cache
def look(palette: str, slot: str, voice: int = 0) -> Look:
    """The look of a material slot in a palette; raises KeyError for unknown words.

    `palette`: a word of `HARMONIES`. `slot`: a word of `SLOTS`. `voice`: odd ones take the second wood and cloth of the
    harmony, so that style groups can be told apart.
    """
    harmony, made = HARMONIES[palette], SLOTS[slot]
    word = SECOND.get(made.color, made.color) if voice % 2 else made.color
    color = mixed(getattr(harmony, word, word), made.mix, made.share)
    emissive = (GLOW[0], GLOW[1], GLOW[2]) if slot == "shade" else (0.0, 0.0, 0.0)
    return Look(color, made.roughness, made.metallic, made.opacity, emissive, made.pattern, made.metres)


def palette_for(key: str, among: Iterable[str] = HARMONIES) -> str:
    """A palette for a style's name, the same in every run."""
    names = sorted(among)
    return names[int.from_bytes(hashlib.blake2b(key.encode(), digest_size=4).digest(), "big") % len(names)]


def palette_of_room(seed: int, style: str | None = None) -> str:
    """The palette of a room for which nobody chose one, of those that go with its `style`."""
    row = vocabulary().known_style(style)
    return palette_for(f"{ROOM_STYLE} {seed}", row.palettes if row else HARMONIES)


def alternatives(chosen: str, style: str | None = None) -> tuple[str, ...]:
    """`SHOWN` harmonies that a room of a style may be shown in: its own, the style's, then those next in the table."""
    names = list(HARMONIES)
    row, start = vocabulary().known_style(style), names.index(chosen)
    following = (*names[start + 1 :], *names[:start])
    return tuple(dict.fromkeys((chosen, *(row.palettes if row else ()), *following)))[:SHOWN]


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
    "metal_box": (Part("metal"),),
    "porcelain": (Part("enamel"),),
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
