"""Rules on geometry and materials: texture coordinates, scale, materials inside the default prim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from echousd.checks.findings import UNREADABLE, Finding, applied, rule
from echousd.checks.reading import Reading
from echousd.stage.encoding import NODE_API
from echousd.stage.values import array, matrix, targets

EVEN = 1e-3  # relative difference of scale factors that counts as none
NO_UVS = "no texture coordinates, allowed: primvars:st of type texCoord2f[]"
PHYSICAL = ("PhysicsRigidBodyAPI", "PhysicsCollisionAPI")


@rule("echo:TextureCoordinates", "prims", UsdGeom.Mesh)
def texture_coordinates(reading: Reading, prim: Usd.Prim) -> Iterator[Finding]:
    """Every visible mesh has `primvars:st`, with as many values as its interpolation asks for and indices in range.

    Models of others that have none are warnings: they may need none.
    """
    fault = None if reading.is_guide(prim) else _uv_fault(UsdGeom.Mesh(prim))
    if fault:
        yield Finding(prim.GetPath(), fault, warning=fault == NO_UVS and of_others(prim))


def of_others(prim: Usd.Prim) -> bool:
    """Whether a prim is part of a model of somebody else's, which is taken as it is: `<asset>_placed/<asset>_model`."""
    above = prim.GetPath().GetPrefixes()
    return any(at.name.endswith("_model") and at.GetParentPath().name.endswith("_placed") for at in above)


def _uv_fault(mesh: UsdGeom.Mesh) -> str | None:
    primvar = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance("st")
    if not primvar or not primvar.HasValue():
        return NO_UVS
    values = array(primvar.GetAttr(), 2)
    interpolation = primvar.GetInterpolation()
    points = len(array(mesh.GetPointsAttr(), 3))
    wanted = {
        UsdGeom.Tokens.constant: 1,
        UsdGeom.Tokens.uniform: len(array(mesh.GetFaceVertexCountsAttr(), whole=True)),
        UsdGeom.Tokens.varying: points,
        UsdGeom.Tokens.vertex: points,
        UsdGeom.Tokens.faceVarying: len(array(mesh.GetFaceVertexIndicesAttr(), whole=True)),
    }.get(interpolation, 0)
    indices = array(primvar.GetIndicesAttr(), whole=True) if primvar.IsIndexed() else None
    found = len(values) if indices is None else len(indices)
    if found != wanted:
        return f"primvars:st has {found} texture coordinates, {interpolation} interpolation needs {wanted}"
    if indices is not None and len(indices):
        table = np.asarray(indices)
        if table.min() < 0 or table.max() >= len(values):
            return f"primvars:st:indices reach from {table.min()} to {table.max()}, allowed: 0 to {len(values) - 1}"
    return None


@rule("echo:Scale")
def scale(reading: Reading) -> Iterator[Finding]:
    """No scale is zero, and no node of a graph, body or collider is scaled differently along its axes."""
    told: set[Sdf.Path] = set()
    for prim in reading.prims:
        if not prim.IsA(UsdGeom.Xformable):
            continue
        try:
            local = _factors(matrix(reading.cache.GetLocalTransformation(prim)[0], prim))
            whole = reading.world(prim)
        except UNREADABLE:
            continue
        if local.min() < 1e-6:
            told.add(prim.GetPath())
            yield Finding(prim.GetPath(), f"scale is {_shown(local)}, allowed: above 0")
            continue
        schemas = applied(prim)
        if NODE_API not in schemas and not any(schema in schemas for schema in PHYSICAL):
            continue
        world = _factors(whole)
        if world.min() < 1e-6 or world.max() / world.min() < 1 + EVEN:
            continue
        culprit = _unevenly_scaled(prim, reading.cache)
        if culprit.GetPath() not in told:
            told.add(culprit.GetPath())
            what = "a body, collider or object of a scene graph"
            yield Finding(culprit.GetPath(), f"scale is {_shown(world)}, allowed on {what}: the same along all axes")


@rule("echo:Mirrored", "prims", UsdGeom.Xformable)
def mirrored(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """No transform mirrors: physics engines and many clients turn such meshes inside out."""
    if np.linalg.det(matrix(reading.cache.GetLocalTransformation(prim)[0], prim)[:3, :3]) < -1e-12:
        yield "its transform mirrors (a negative scale), allowed: positive scales"


def _unevenly_scaled(prim: Usd.Prim, cache: UsdGeom.XformCache) -> Usd.Prim:
    above = prim
    while above and not above.IsPseudoRoot():
        factors = _factors(cache.GetLocalTransformation(above)[0])
        if factors.max() / max(factors.min(), 1e-9) > 1 + EVEN:
            return above
        above = above.GetParent()
    return prim


def _factors(matrix) -> np.ndarray:  # type: ignore[no-untyped-def]
    return np.linalg.svd(np.array(matrix)[:3, :3], compute_uv=False)


def _shown(factors: np.ndarray) -> str:
    return "(" + ", ".join(f"{factor:.4g}" for factor in sorted(factors)) + ")"


@rule("echo:MaterialsInside", "prims")
def materials_inside(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Bound materials lie below the default prim, so that a reference to the stage brings them along."""
    default = reading.stage.GetDefaultPrim()
    if not default or not prim.GetPath().HasPrefix(default.GetPath()):
        return
    for relationship in prim.GetRelationships():
        if not relationship.GetName().startswith(str(UsdShade.Tokens.materialBinding)):
            continue
        for target in targets(prim, relationship.GetName()):
            found = reading.stage.GetPrimAtPath(target.GetPrimPath())
            if found and found.IsA(UsdShade.Material) and not target.HasPrefix(default.GetPath()):
                yield f"bound to <{target}>, allowed: a material below the default prim <{default.GetPath()}>"
