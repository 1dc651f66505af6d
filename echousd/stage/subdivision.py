"""Polygons of what has none of its own: subdivision surfaces, by Catmull and Clark's rules, USD's solids, instances."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pxr import Usd, UsdGeom

from echousd.stage import values
from echousd.stage.encoding import StageError

if TYPE_CHECKING:
    import trimesh

    from echousd.stage.forms import Form

MAX_INSTANCES = 50_000  # of one instancer
LEVELS = 2
SIDES = 32  # corners of a circle
MAX_FACES = 400_000  # beyond which a level less is made


def refined(
    points: np.ndarray, counts: np.ndarray, indices: np.ndarray, levels: int = LEVELS
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points, counts and indices after some levels, and the face that each of the new faces came from.

    Arguments:
        points: (v, 3) float; counts: (f,) int, at least 3 each; indices: (c,) int.
    """
    face = np.arange(len(counts))
    for _ in range(levels):
        if len(indices) > MAX_FACES:
            break
        owner = np.repeat(np.arange(len(counts)), counts)
        points, indices = _once(points, counts, indices, owner)
        face, counts = face[owner], np.full(len(owner), 4)
    return points, counts, indices, face


def _once(
    points: np.ndarray, counts: np.ndarray, indices: np.ndarray, owner: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One level: each corner of a face becomes a quad (corner, edge after it, middle, edge before it)."""
    v, corners = len(points), np.arange(len(indices))
    start = np.cumsum(counts) - counts
    after = np.where(corners + 1 < (start + counts)[owner], corners + 1, start[owner])
    before = np.empty_like(corners)
    before[after] = corners
    middle = np.zeros((len(counts), 3))
    np.add.at(middle, owner, points[indices])
    middle /= counts[:, None]

    ends = np.sort(np.stack((indices, indices[after]), 1), 1)
    edges, edge = np.unique(ends, axis=0, return_inverse=True)
    edge = edge.ravel()
    uses = np.bincount(edge, minlength=len(edges))
    across = np.zeros((len(edges), 3))
    np.add.at(across, edge, middle[owner])
    half = points[edges].mean(1)
    border = uses != 2
    on_edge = np.where(border[:, None], half, (points[edges].sum(1) + across) / 4)

    valence, faces_at = np.zeros(v), np.zeros(v)
    np.add.at(valence, edges.ravel(), 1)
    np.add.at(faces_at, indices, 1)
    mean_half, mean_face = np.zeros((v, 3)), np.zeros((v, 3))
    for end in (0, 1):
        np.add.at(mean_half, edges[:, end], half)
    np.add.at(mean_face, indices, middle[owner])
    n = np.maximum(valence, 1)[:, None]
    moved = (mean_face / np.maximum(faces_at, 1)[:, None] + 2 * mean_half / n + (n - 3) * points) / n
    rim, rim_edges = np.zeros((v, 3)), np.zeros(v)
    for end in (0, 1):
        np.add.at(rim, edges[border, end], half[border])
        np.add.at(rim_edges, edges[border, end], 1)
    spline = (rim + 2 * points) / 4
    moved = np.where(
        (rim_edges == 2)[:, None], spline, np.where(((rim_edges > 0) | (valence < 1))[:, None], points, moved)
    )

    whole = np.concatenate((moved, on_edge, middle))
    quads = np.stack((indices, v + edge, v + len(edges) + owner, v + edge[before]), 1)
    return whole, quads.ravel()


def smooth_normals(points: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """(v, 3) float unit normals of a surface of quads, weighted by area."""
    quads = indices.reshape(-1, 4)
    cross = np.cross(points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]])
    out = np.zeros_like(points)
    for corner in range(4):
        np.add.at(out, quads[:, corner], cross)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


def solid(prim: Usd.Prim) -> trimesh.Trimesh:
    """One of `echousd.stage.forms.SOLIDS` as triangles, in the prim's own frame and unit."""
    import trimesh  # with scipy half a second, which subdivision surfaces need not wait for

    kind = prim.GetTypeName()

    def length(name: str, default: float) -> float:
        return max(values.number(prim.GetAttribute(name), default), 1e-9)

    scale = 0.5 if kind == "Capsule" else 1.0  # of what USD takes where nothing is said
    radius, height = length("radius", scale), length("height", 2 * scale)
    if kind == "Cube":
        return trimesh.creation.box([length("size", 2.0)] * 3)
    if kind == "Sphere":
        return trimesh.creation.icosphere(3, radius)
    axis = str(values.value_of(prim.GetAttribute("axis")) or "Z")
    if kind == "Plane":  # its width runs along x, along z where x is its axis; a turn takes x to y, or to z
        x, y = (length(name, 2.0) / 2 for name in (("width", "length") if axis == "Z" else ("length", "width")))
        mesh = trimesh.Trimesh([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [(0, 1, 2), (0, 2, 3)], process=False)
    elif kind == "Cylinder":
        mesh = trimesh.creation.cylinder(radius, height, sections=SIDES)
    elif kind == "Cone":
        mesh = trimesh.creation.cone(radius, height, sections=SIDES)
    else:
        mesh = trimesh.creation.capsule(height, radius, count=[SIDES, SIDES // 2])
    mesh.apply_translation(-mesh.bounds.mean(0))  # USD's solids lie around their origin
    turn = {"X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}.get(axis)
    if turn is not None:
        mesh.apply_transform(np.block([[np.array(turn, float), np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]]))
    return mesh


def instances(
    instancer: UsdGeom.PointInstancer, cache: UsdGeom.XformCache, below: Callable[..., Iterable[Form]]
) -> Iterator[Form]:
    """The forms `below` the prototypes of an instancer, wherever it places them; raises StageError."""
    prim = instancer.GetPrim()
    which = values.array(instancer.GetProtoIndicesAttr(), whole=True)
    if len(which) > MAX_INSTANCES:
        raise StageError(f"<{prim.GetPath()}> places {len(which)} instances, allowed: {MAX_INSTANCES}")
    prototypes = [prim.GetStage().GetPrimAtPath(path) for path in instancer.GetPrototypesRel().GetForwardedTargets()]
    if len(which) and (which.min() < 0 or which.max() >= len(prototypes)):
        raise StageError(
            f"<{prim.GetPath()}>: protoIndices reach from {which.min()} to {which.max()}, "
            f"allowed: 0 to {len(prototypes) - 1}"
        )
    how = UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    places = instancer.ComputeInstanceTransformsAtTime(values.NOW, values.NOW, *how) or []
    seen = instancer.ComputeMaskAtTime(values.NOW) or [True] * len(places)
    own = values.matrix(cache.GetLocalToWorldTransform(prim), prim)
    known: dict[int, list[tuple[Form, np.ndarray]]] = {}
    for number, place in enumerate(places):
        kind = int(which[number])
        if not seen[number] or not prototypes[kind]:
            continue
        if kind not in known:  # below the prototype, relative to it
            base = np.linalg.inv(values.matrix(cache.GetLocalToWorldTransform(prototypes[kind]), prototypes[kind]))
            known[kind] = [(form, base @ form.world) for form in below(prototypes[kind], cache)]
        for form, local in known[kind]:
            world = own @ values.matrix(place, prim) @ local
            yield replace(form, path=f"{prim.GetPath()}[{number}]{form.path}", world=world, above=prim)
