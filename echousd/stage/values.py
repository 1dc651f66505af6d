"""Values on stages, read with doubt: a file may hold any type anywhere, and OpenUSD hands it on as it is."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics

from echousd.graph import MAX_TEXT
from echousd.stage.encoding import StageError
from echousd.stage.files import source, usd_error

NOW = Usd.TimeCode.EarliestTime()  # what stages are read at: some tools write even what never moves as samples
LARGEST = 1e9  # in the stage's unit; what is further away is a fault, and its square overflows single precision
MAX_CORNERS = 50_000_000  # face corners of one mesh
UNREADABLE = (StageError, Tf.ErrorException)  # what reading a value raises
Read = TypeVar("Read")


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """A polygon mesh in its own frame and the stage's unit.

    Arguments:
        points: (v, 3) float64; counts: (f,) int64 corners of each face; indices: (counts.sum(),) int64 into the points.
    """

    points: np.ndarray
    counts: np.ndarray
    indices: np.ndarray


def owner(attribute: Usd.Attribute | None) -> str:
    """`file: <prim path>: attribute` for error messages."""
    assert attribute is not None
    return f"{source(attribute.GetStage())}: <{attribute.GetPrimPath()}>: {attribute.GetName()}"


def value_of(attribute: Usd.Attribute | None) -> Any:
    """The value at `NOW`, None where there is none; raises StageError where OpenUSD cannot read it."""
    if not attribute:
        return None
    try:
        return attribute.Get(NOW)
    except Tf.ErrorException as error:
        raise StageError(f"{owner(attribute)}: a value that cannot be read ({usd_error(error)})") from None


def number(attribute: Usd.Attribute | None, default: float = 0.0) -> float:
    """A finite number; raises StageError for anything else."""
    found = value_of(attribute)
    if found is None or attribute is None:
        return default
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise StageError(f"{owner(attribute)} is {shown(found)}, allowed: one number")
    if not abs(found) <= LARGEST:
        raise StageError(f"{owner(attribute)} is {found}, allowed: -{LARGEST:g} to {LARGEST:g}")
    return float(found)


def array(attribute: Usd.Attribute | None, width: int = 1, *, whole: bool = False) -> np.ndarray:
    """(n, width) float64, or (n,) for width 1; int64 for `whole`; empty where there is no value.

    Raises StageError for other types, NaN, infinities and numbers beyond `LARGEST`.
    """
    found = value_of(attribute)
    return numbers([] if found is None else found, width, attribute, whole=whole)


def numbers(found: Any, width: int, attribute: Usd.Attribute | None, *, whole: bool = False) -> np.ndarray:
    """What `array` gives, of a value of the attribute that was read already."""
    table = np.asarray(found) if hasattr(found, "__len__") and not isinstance(found, str) else np.asarray("")
    kinds = "iu" if whole else "iuf"
    right = table.ndim == (1 if width == 1 else 2) and (width == 1 or table.shape[1] == width)
    if len(table.shape) and not table.size and not isinstance(found, tuple):
        table, right = np.zeros((0,) if width == 1 else (0, width), np.int64 if whole else np.float64), True
    if not right or table.dtype.kind not in kinds:
        allowed = f"a list of {'whole numbers' if whole else 'numbers' if width == 1 else f'{width} numbers each'}"
        raise StageError(f"{owner(attribute)} is {shown(found)}, allowed: {allowed}")
    if not whole:
        table = table.astype(np.float64)
        if not (table.min(initial=0) >= -LARGEST and table.max(initial=0) <= LARGEST):  # NaN is neither
            bad = ~(np.abs(table) <= LARGEST)
            raise StageError(f"{owner(attribute)} holds {table[bad][0]:g}, allowed: -{LARGEST:g} to {LARGEST:g}")
        return table
    return table.astype(np.int64)


def texts(attribute: Usd.Attribute | None) -> tuple[str, ...]:
    """A list of words, a single one included; empty without a value; raises StageError for anything else."""
    found = value_of(attribute)
    if found is None or attribute is None:
        return ()
    words = (found,) if isinstance(found, str) else tuple(found) if hasattr(found, "__iter__") else (None,)
    if not all(isinstance(word, str) for word in words):
        raise StageError(f"{owner(attribute)} is {shown(found)}, allowed: words")
    longest = max(map(len, words), default=0)
    if longest > MAX_TEXT:
        raise StageError(f"{owner(attribute)} is a text of {longest} characters, allowed: {MAX_TEXT}")
    return words


def asset(attribute: Usd.Attribute | None) -> Sdf.AssetPath | None:
    """An asset path, None without one; raises StageError for anything else."""
    found = value_of(attribute)
    if found is None or isinstance(found, Sdf.AssetPath) or attribute is None:
        return found
    raise StageError(f"{owner(attribute)} is {shown(found)}, allowed: an asset path")


def targets(prim: Usd.Prim, name: str) -> list[Sdf.Path]:
    """Targets of a relationship, none where there is none; raises StageError where they cannot be read."""
    try:
        relationship = prim.GetRelationship(name)
        return list(relationship.GetTargets()) if relationship else []
    except Tf.ErrorException as error:
        where = f"{source(prim.GetStage())}: <{prim.GetPath()}>: {name}"
        raise StageError(f"{where} is no relationship that can be read ({usd_error(error)})") from None


def matrix(found: Gf.Matrix4d, prim: Usd.Prim) -> np.ndarray:
    """(4, 4) float64, column vectors, of a transform of `prim`; raises StageError where it is not finite."""
    table = np.array(found, float).T
    if not (np.abs(table) <= LARGEST).all():
        worst = table[~(np.abs(table) <= LARGEST)][0]
        raise StageError(
            f"{source(prim.GetStage())}: <{prim.GetPath()}>: its transform holds {worst:g}, "
            f"allowed: -{LARGEST:g} to {LARGEST:g}"
        )
    return table


def mesh_arrays(mesh: UsdGeom.Mesh) -> MeshArrays:
    """Points and faces; raises StageError for values of other types and for faces that the points cannot make."""
    points = array(mesh.GetPointsAttr(), 3)
    counts = array(mesh.GetFaceVertexCountsAttr(), whole=True)
    indices = array(mesh.GetFaceVertexIndicesAttr(), whole=True)
    if len(counts) and (counts.min() < 0 or counts.sum() != len(indices) or len(indices) > MAX_CORNERS):
        raise StageError(
            f"{owner(mesh.GetFaceVertexCountsAttr())} asks for {counts.sum()} corners (least {counts.min()}) and "
            f"faceVertexIndices has {len(indices)}, allowed: as many, 0 or more each, {MAX_CORNERS} in all"
        )
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        raise StageError(
            f"{owner(mesh.GetFaceVertexIndicesAttr())} reaches from {indices.min()} to {indices.max()}, "
            f"allowed: 0 to {len(points) - 1}"
        )
    return MeshArrays(points, counts, indices)


def fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces of `counts` (f,) int corners as triangles: (t,) int face, and (t, 3) int positions among all corners."""
    if (counts == 3).all():  # as of nearly all meshes
        return np.arange(len(counts)), np.arange(3 * len(counts)).reshape(-1, 3)
    first, triangles = np.cumsum(counts) - counts, np.clip(counts - 2, 0, None)
    face = np.repeat(np.arange(len(counts)), triangles)
    start, step = first[face], np.arange(len(face)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return face, np.stack([start, start + step + 1, start + step + 2], 1)


def moves(prim: Usd.Prim) -> bool:
    """Whether a prim is a rigid body that engines move."""
    body = UsdPhysics.RigidBodyAPI(prim)
    enabled = prim.HasAPI(UsdPhysics.RigidBodyAPI) and body.GetRigidBodyEnabledAttr().Get() is not False
    return enabled and not body.GetKinematicEnabledAttr().Get()


def lineage(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    """A prim and those above it, the nearest first, but for the pseudo-root."""
    while prim and not prim.IsPseudoRoot():
        yield prim
        prim = prim.GetParent()


def readable(read: Callable[[], Read], otherwise: Read) -> Read:
    """What is read of a stage, or something else where that cannot be read."""
    try:
        return read()
    except UNREADABLE:
        return otherwise


def shown(found: Any, most: int = 40) -> str:
    """A value of an unexpected type in few words: its type and its beginning."""
    text = " ".join(str(found)[:200].split())
    return f"{type(found).__name__} {text if len(text) <= most else text[: most - 3] + '...'}"


@contextmanager
def reading(stage: Usd.Stage) -> Iterator[None]:
    """Turn what OpenUSD raises while a stage is read, at any later value, into a StageError that names the file."""
    try:
        yield
    except Tf.ErrorException as error:
        raise StageError(f"{source(stage)}: cannot be read ({usd_error(error)})") from None
    except UnicodeDecodeError as error:
        raise StageError(f"{source(stage)}: a text that is no UTF-8 ({error.reason})") from None
