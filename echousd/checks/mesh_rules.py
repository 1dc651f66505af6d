"""Rules on meshes: faces, normals, extents and texture coordinates, even scales, materials inside the default prim."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from echomodel.triangles import along, bounds_of, cross, lengths
from echousd.checks.reading import Finding, Reading, applied, rule
from echousd.stage.encoding import NODE_API
from echousd.stage.pen import ARTICULATION
from echousd.stage.values import NOW, UNREADABLE, MeshArrays, array, lineage, matrix, readable, targets

THIN = 1e-9  # area of a triangle in shares of the square of its longest side that is none
UNIT = 0.05  # how far the length of a normal may be from 1
EXTENT = 1e-3  # how far an extent may be from the points, in shares of their diagonal
HINT = 0.1  # the same of a component, which has levels of detail
AGAINST = 0.5  # share of the faces whose normals point the other way


@rule("echo:MeshIndices", "meshes")
def mesh_indices(reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[str]:
    """Faces have three corners or more, as many in all as there are indices, and indices name points."""
    read = readable(lambda: reading.mesh(mesh), None)
    points = array(mesh.GetPointsAttr(), 3) if read is None else read.points
    counts = array(mesh.GetFaceVertexCountsAttr(), whole=True) if read is None else read.counts
    indices = array(mesh.GetFaceVertexIndicesAttr(), whole=True) if read is None else read.indices
    if len(counts) and counts.min() < 3:
        yield f"a face has {counts.min()} corners, allowed: 3 or more"
    elif counts.sum() != len(indices):
        yield f"faces ask for {counts.sum()} corners, faceVertexIndices has {len(indices)}"
    elif len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        yield f"faceVertexIndices reach from {indices.min()} to {indices.max()}, allowed: 0 to {len(points) - 1}"


@rule("echo:Degenerate", "meshes")
def degenerate(reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[Finding]:
    """No face uses a point twice or has no area; models of others may, in few faces."""
    _, faces, corners, normals = reading.triangles(mesh)
    twice = (faces.T[[1, 2, 0]] == faces.T).any(0)
    one, two, three = corners.transpose(1, 2, 0)
    sides = reduce(np.maximum, (along(side, side) for side in (one - two, two - three, three - one)))  # squares
    flat = twice | (along(normals.T, normals.T) <= (THIN * sides) ** 2)
    if flat.any():
        message = f"{int(flat.sum())} of {len(flat)} triangles have no area"
        yield Finding(mesh.GetPath(), message, warning=not twice.any() or of_others(mesh.GetPrim()))


@rule("echo:Subdivision", "meshes")
def subdivision(_reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[str]:
    """A mesh with normals is no subdivision surface: clients would round its edges."""
    scheme = mesh.GetSubdivisionSchemeAttr()
    has = UsdGeom.PrimvarsAPI(mesh).HasPrimvar("normals") or mesh.GetNormalsAttr().HasAuthoredValue()
    if has and scheme.HasAuthoredValue() and scheme.Get() != UsdGeom.Tokens.none:
        yield f"subdivisionScheme is {scheme.Get()!r} on a mesh with normals, allowed: none"


@rule("echo:EmptyMeshes", "meshes")
def empty_meshes(reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[str]:
    """A mesh has faces."""
    if not len(reading.mesh(mesh).counts) and not reading.is_guide(mesh.GetPrim()):
        yield "a mesh without faces"


@rule("echo:Normals", "meshes")
def normals(reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[str]:
    """Normals have length 1, and are as many as their interpolation asks for."""
    found = _normals(reading, mesh)
    if found is None:
        return
    if found.fault:
        yield found.fault
        return
    length = lengths(found.values)
    wrong = np.abs(length - 1) > UNIT
    if wrong.any():
        yield f"a normal has length {length[wrong][0]:.4g} ({int(wrong.sum())} of {len(length)}), allowed: 1"


@rule("echo:Extents")
def extents(reading: Reading) -> Iterator[Finding]:
    """An extent is the box around the points, a component's hint that around its meshes: clients cull by them."""
    yield from _hints(reading)
    for mesh in reading.meshes:
        try:
            arrays = reading.mesh(mesh)
            extent = array(mesh.GetExtentAttr(), 3) if mesh.GetExtentAttr().HasAuthoredValue() else None
        except UNREADABLE:
            continue
        if extent is None or not len(arrays.points):
            continue
        box = bounds_of(arrays.points)
        slack = EXTENT * np.linalg.norm(box[1] - box[0]) + 1e-6
        if extent.shape != (2, 3) or np.abs(extent - box).max() > slack:
            yield Finding(mesh.GetPath(), f"extent is {_shown(extent)}, its points reach {_shown(box)}")


def _hints(reading: Reading) -> Iterator[Finding]:
    """Components that state another box (`extentsHint`) than that of what they show."""
    cache = UsdGeom.BBoxCache(NOW, [UsdGeom.Tokens.default_], useExtentsHint=False)
    for prim in reading.prims:
        attribute = prim.GetAttribute(UsdGeom.Tokens.extentsHint)
        if not attribute or not attribute.HasAuthoredValue() or not prim.IsModel() or prim.IsGroup():
            continue
        try:
            hint = array(attribute, 3)[:2]
            found = cache.ComputeUntransformedBound(prim).ComputeAlignedRange()
            box = np.array([found.GetMin(), found.GetMax()])
            slack = HINT * np.linalg.norm(box[1] - box[0])
            if found.IsEmpty() or (hint.shape == (2, 3) and (np.abs(hint - box) <= slack).all()):
                continue
            still = _still(cache, prim, box)
        except UNREADABLE:
            continue
        low, high = np.stack([box, still], 1)  # of what is seen, and of what must be in the hint
        within = hint.shape == (2, 3) and (low[0] - slack <= hint[0]).all() and (hint[1] <= high[0] + slack).all()
        if not within or (hint[0] > low[1] + slack).any() or (hint[1] < high[1] - slack).any():
            yield Finding(prim.GetPath(), f"extentsHint is {_shown(hint)}, its meshes reach {_shown(box)}")


def _still(cache: UsdGeom.BBoxCache, component: Usd.Prim, box: np.ndarray) -> np.ndarray:
    """(2, 3) float, a component's box without its doors and drawers, which may stand open.

    Arguments:
        box: that of all of it; the result where nothing moves. Where nothing else is, the result has its sides swapped.
    """
    below = list(Usd.PrimRange(component, Usd.TraverseInstanceProxies()))
    joints = [UsdPhysics.Joint(prim) for prim in below if prim.IsA(UsdPhysics.Joint)]
    moving = {path for joint in joints for path in joint.GetBody1Rel().GetTargets()}
    frames = {component.GetPath(), *(path for joint in joints for path in joint.GetBody0Rel().GetTargets())}
    for prim in below:
        if prim.HasAPI(UsdPhysics.RigidBodyAPI) and prim.GetPath() not in frames:
            moving.add(prim.GetPath())
        if prim.GetVariantSets().HasVariantSet(ARTICULATION):  # not articulated, they are moved all the same
            moving |= {each.GetPath() for each in below if each != prim and _placed(each, prim)}
    if not moving:
        return box
    found = Gf.Range3d()
    walk = iter(Usd.PrimRange(component, Usd.TraverseInstanceProxies()))
    for prim in walk:
        if prim.GetPath() in moving:
            walk.PruneChildren()
        elif prim.IsA(UsdGeom.Gprim):
            found.UnionWith(cache.ComputeRelativeBound(prim, component).ComputeAlignedRange())
    return np.array([found.GetMin(), found.GetMax()])  # an empty one has the least after the greatest


def _placed(prim: Usd.Prim, above: Usd.Prim) -> bool:
    """Whether a prim below another is a group with a transform of its own."""
    own = prim.IsA(UsdGeom.Xform) and prim.GetPath().HasPrefix(above.GetPath())
    return bool(own and UsdGeom.Xformable(prim).GetXformOpOrderAttr().HasAuthoredValue())


@rule("echo:Winding", "meshes")
def winding(reading: Reading, mesh: UsdGeom.Mesh) -> Iterator[str]:
    """Faces turn outwards: closed surfaces enclose a positive volume, and faces agree with their normals."""
    corners, faces, triangles, turned = reading.triangles(mesh)
    if not len(faces):
        return
    sign = -1.0 if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded else 1.0
    if _closed(faces):
        a, b, c = (triangles - triangles.mean((0, 1))).transpose(1, 0, 2)
        if sign * float((a * cross(b, c)).sum()) < 0:
            yield "closed and turned inside out: its faces wind the wrong way round"
            return
    found = _normals(reading, mesh)
    if found is None or found.interpolation != UsdGeom.Tokens.faceVarying or found.fault:
        return
    against = along(sign * turned.T, sum(found.values[corner] for corner in corners.T).T) < 0
    if against.any() and (area := lengths(turned))[against].sum() > AGAINST * area.sum() > 0:
        yield f"{area[against].sum() / area.sum():.0%} of its surface winds against its normals, allowed: outwards"


@dataclass(frozen=True, eq=False)
class Laid:
    """Values of a mesh's primvar, one for each of what its interpolation names, and what is wrong with them."""

    values: np.ndarray
    interpolation: str
    fault: str = ""

    @classmethod
    def of(cls, primvar: UsdGeom.Primvar, width: int, arrays: MeshArrays, word: str) -> "Laid":
        """A primvar of so many numbers each; raises as `array`."""
        values, name = array(primvar.GetAttr(), width), primvar.GetName()
        if primvar.IsIndexed():
            index = array(primvar.GetIndicesAttr(), whole=True)
            if len(index) and (index.min() < 0 or index.max() >= len(values)):
                reach = f"from {index.min()} to {index.max()}, allowed: 0 to {len(values) - 1}"
                return cls(values, primvar.GetInterpolation(), f"{name}:indices reach {reach}")
            values = values[index]
        return cls.counted(values, primvar.GetInterpolation(), arrays, f"{name} has {len(values)} {word}")

    @classmethod
    def counted(cls, values: np.ndarray, interpolation: str, arrays: MeshArrays, problem: str) -> "Laid":
        """Values that must be as many as their interpolation asks for on a mesh; `problem` says how many there are."""
        tokens = UsdGeom.Tokens
        many = {
            tokens.constant: 1, tokens.uniform: len(arrays.counts), tokens.faceVarying: len(arrays.indices)
        }.get(interpolation, len(arrays.points))  # fmt: skip
        fault = "" if len(values) == many else f"{problem}, {interpolation} interpolation needs {many}"
        return cls(values, interpolation, fault)


def _normals(reading: Reading, mesh: UsdGeom.Mesh) -> Laid | None:
    """The normals that somebody authored for a mesh, None for none and for such as cannot be read."""

    def read() -> Laid | None:
        primvar, arrays = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals"), reading.mesh(mesh)
        if primvar and primvar.HasAuthoredValue():
            return Laid.of(primvar, 3, arrays, "normals")
        if not mesh.GetNormalsAttr().HasAuthoredValue():
            return None
        values = array(mesh.GetNormalsAttr(), 3)
        return Laid.counted(values, mesh.GetNormalsInterpolation(), arrays, f"{len(values)} normals")

    return reading.once("normals", mesh.GetPrim(), lambda: readable(read, None))


def _closed(faces: np.ndarray) -> bool:
    """Whether every edge of some triangles (t, 3) is walked once in each direction."""
    ends, size = faces.T.astype(np.int64), int(faces.max()) + 1
    after = ends[[1, 2, 0]]
    return np.array_equal(np.sort((ends * size + after).ravel()), np.sort((after * size + ends).ravel()))


def _shown(box: np.ndarray) -> str:
    return " to ".join("(" + ", ".join(f"{value:.4g}" for value in row) + ")" for row in box)


EVEN = 1e-3  # relative difference of scale factors that counts as none
NO_UVS = "no texture coordinates, allowed: primvars:st of type texCoord2f[]"
PHYSICAL = ("PhysicsRigidBodyAPI", "PhysicsCollisionAPI")


@rule("echo:TextureCoordinates", "prims", UsdGeom.Mesh)
def texture_coordinates(reading: Reading, prim: Usd.Prim) -> Iterator[Finding]:
    """Every visible mesh has `primvars:st`, with as many values as its interpolation asks for and indices in range.

    Models of others that have none are warnings: they may need none.
    """
    if reading.is_guide(prim):
        return
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("st")
    if not primvar or not primvar.HasValue():
        yield Finding(prim.GetPath(), NO_UVS, warning=of_others(prim))
    elif fault := Laid.of(primvar, 2, reading.mesh(UsdGeom.Mesh(prim)), "texture coordinates").fault:
        yield Finding(prim.GetPath(), fault)


def of_others(prim: Usd.Prim) -> bool:
    """Whether a prim is part of a model of somebody else's, which is taken as it is: `<asset>_placed/<asset>_model`."""
    above = prim.GetPath().GetPrefixes()
    return any(at.name.endswith("_model") and at.GetParentPath().name.endswith("_placed") for at in above)


@rule("echo:Scale")
def scale(reading: Reading) -> Iterator[Finding]:
    """No scale is zero, and no node of a graph, body or collider is scaled differently along its axes."""
    reported: set[Sdf.Path] = set()
    for prim in reading.prims:
        if not prim.IsA(UsdGeom.Xformable):
            continue
        try:
            own = matrix(reading.cache.GetLocalTransformation(prim)[0], prim)
            local = _factors(own.tobytes())
            whole = reading.world(prim)
        except UNREADABLE:
            continue
        if local.min() < 1e-6:
            reported.add(prim.GetPath())
            yield Finding(prim.GetPath(), f"scale is {_listed(own)}, allowed: above 0")
            continue
        schemas = applied(prim)
        if NODE_API not in schemas and not any(schema in schemas for schema in PHYSICAL):
            continue
        world = _factors(whole.tobytes())
        if world.min() < 1e-6 or world.max() / world.min() < 1 + EVEN:
            continue
        culprit = _unevenly_scaled(prim, reading.cache)
        if culprit.GetPath() not in reported:
            reported.add(culprit.GetPath())
            what = "a body, collider or object of a scene graph"
            yield Finding(culprit.GetPath(), f"scale is {_listed(whole)}, allowed on {what}: the same along all axes")


@rule("echo:Mirrored", "prims", UsdGeom.Xformable)
def mirrored(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """No transform mirrors: physics engines and many clients turn such meshes inside out."""
    if np.linalg.det(matrix(reading.cache.GetLocalTransformation(prim)[0], prim)[:3, :3]) < -1e-12:
        yield "its transform mirrors (a negative scale), allowed: positive scales"


def _unevenly_scaled(prim: Usd.Prim, cache: UsdGeom.XformCache) -> Usd.Prim:
    for above in lineage(prim):
        factors = _factors(np.array(cache.GetLocalTransformation(above)[0]).tobytes())
        if factors.max() / max(factors.min(), 1e-9) > 1 + EVEN:
            return above
    return prim


@lru_cache(maxsize=4096)  # most prims have one of a few
def _factors(transform: bytes) -> np.ndarray:
    """(3,) float, how a transform (4, 4) float scales along its axes."""
    return np.linalg.svd(np.frombuffer(transform).reshape(4, 4)[:3, :3], compute_uv=False)


def _listed(transform: np.ndarray) -> str:
    """How a transform scales along x, y and z; of one that shears, along its own axes, the least first."""
    along, factors = np.linalg.norm(transform[:3, :3], axis=1), _factors(transform.tobytes())[::-1]
    shown = along if np.allclose(np.sort(along), factors, rtol=EVEN, atol=1e-6) else factors
    return "(" + ", ".join(f"{factor:.4g}" for factor in shown) + ")"


@rule("echo:MaterialsInside", "prims")
def materials_inside(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Bound materials lie below the default prim, so that a reference to the stage brings them along."""
    default = reading.stage.GetDefaultPrim()
    if not default or not prim.GetPath().HasPrefix(default.GetPath()):
        return
    for relationship in prim.GetAuthoredRelationships():
        if not relationship.GetName().startswith(str(UsdShade.Tokens.materialBinding)):
            continue
        for target in targets(prim, relationship.GetName()):
            found = reading.stage.GetPrimAtPath(target.GetPrimPath())
            if found and found.IsA(UsdShade.Material) and not target.HasPrefix(default.GetPath()):
                yield f"bound to <{target}>, allowed: a material below the default prim <{default.GetPath()}>"
