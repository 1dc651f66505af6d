"""Everything on a stage that has a surface, as polygons: meshes, subdivision surfaces, solids, placed instances."""

import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from echomodel.late import lates
from echousd.stage import values

SOLIDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule", "Plane")
instances, refined, smooth_normals, solid = lates(
    "echousd.stage.subdivision", "instances", "refined", "smooth_normals", "solid"
)


class SkippedForms(UserWarning):
    """Visible prims of kinds that have no polygons here; they are left out."""


@dataclass(frozen=True, eq=False)
class Form:
    """One visible surface.

    Arguments:
        prim: its prim, whose materials, primvars and labels count.
        path: prim path, with the instance's number where an instancer placed it.
        world: (4, 4) float, the prim's frame to the world of the stage, column vectors, in the stage's unit.
        above: the instancer whose name and labels count besides those of `prim`, None where there is none.
    """

    prim: Usd.Prim
    path: str
    world: np.ndarray
    above: Usd.Prim | None = None


def shown(prim: Usd.Prim) -> bool:
    """Whether pictures have a prim: visible, and of purpose default or render."""
    image = UsdGeom.Imageable(prim)
    of_pictures = image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
    return of_pictures and image.ComputeVisibility(values.NOW) != UsdGeom.Tokens.invisible


def forms(
    root: Usd.Prim, cache: UsdGeom.XformCache, others: set[Sdf.Path] | frozenset[Sdf.Path] = frozenset()
) -> Iterator[Form]:
    """The surfaces at and below a prim that are `shown`, through instances and instancers.

    Arguments:
        others: prims that are left out with all below them.

    Warns `SkippedForms` of curves, points, volumes and the like. Raises StageError for an instancer that holds more
    than `subdivision.MAX_INSTANCES`.
    """
    skipped: Counter[str] = Counter()
    first: dict[str, str] = {}
    prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in prims:
        if prim.GetPath() in others:
            prims.PruneChildren()
        elif prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()  # prototypes are seen where they are placed
            if shown(prim):
                yield from instances(UsdGeom.PointInstancer(prim), cache, forms)
        elif prim.IsA(UsdGeom.Boundable) and prim.IsA(UsdGeom.Gprim) and shown(prim):
            if prim.IsA(UsdGeom.Mesh) or prim.GetTypeName() in SOLIDS:
                yield Form(prim, str(prim.GetPath()), values.matrix(cache.GetLocalToWorldTransform(prim), prim))
            else:
                skipped[str(prim.GetTypeName())] += 1
                first.setdefault(str(prim.GetTypeName()), str(prim.GetPath()))
    if skipped:
        listed = ", ".join(f"{count} {kind} (such as <{first[kind]}>)" for kind, count in skipped.items())
        warnings.warn(f"left out, as they have no polygons: {listed}", SkippedForms, stacklevel=2)


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons of a surface in its prim's own frame and unit.

    Arguments:
        points: (v, 3) float; counts: (f,) int, corners of each face; indices: (c,) int, point of each corner.
        face: (f,) int, the face of the prim that each came from.
        normals: (v, 3) float of a smooth surface, None where the prim says its own or has edges.
    """

    points: np.ndarray
    counts: np.ndarray
    indices: np.ndarray
    face: np.ndarray
    normals: np.ndarray | None = None


def polygons(prim: Usd.Prim) -> Polygons:
    """The polygons of a mesh (refined where it is a subdivision surface) or of one of `SOLIDS`.

    Raises StageError for values of other types.
    """
    if not prim.IsA(UsdGeom.Mesh):
        mesh = solid(prim)
        count = len(mesh.faces)
        points, faces = np.array(mesh.vertices), np.array(mesh.faces)
        smooth = np.array(mesh.vertex_normals) if prim.GetTypeName() in ("Sphere", "Capsule") else None
        return Polygons(points, np.full(count, 3), faces.ravel(), np.arange(count), smooth)
    arrays = values.mesh_arrays(UsdGeom.Mesh(prim))
    face = np.arange(len(arrays.counts))
    if is_subdivision(prim) and (arrays.counts > 2).all() and len(face):
        points, counts, indices, face = refined(arrays.points, arrays.counts, arrays.indices)
        return Polygons(points, counts, indices, face, smooth_normals(points, indices))
    return Polygons(arrays.points, arrays.counts, arrays.indices, face)


def is_subdivision(prim: Usd.Prim) -> bool:
    """Whether a mesh says that it is a subdivision surface (many that are none leave the scheme open)."""
    scheme = UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr()
    return scheme.HasAuthoredValue() and values.value_of(scheme) in ("catmullClark", "loop")
