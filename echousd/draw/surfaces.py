"""What of a room can be painted: per object its triangles, with the face corners of the prims that they are."""

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import takewhile

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdShade

from echousd.draw.drawables import Drawable, read_drawables
from echousd.graph import SceneGraph
from echousd.naming import free_name
from echousd.stage.forms import SkippedForms, is_subdivision
from echousd.stage.read import RoomPrims, node_names, room_graph, the_room
from echousd.stage.values import fans, lineage, mesh_arrays

STUFF = ("floor", "wall", "ceiling")
DRESSING_NAME = "Dressing"
DRESSING = ("none", "grouped", "each")


@dataclass(frozen=True, eq=False)
class SurfacePiece:
    """One mesh of an object."""

    path: str  # prim path of the mesh
    # (t, 3) int, the mesh's face corners that each triangle has; vertices: (t, 3) int, its points there
    corners: np.ndarray
    vertices: np.ndarray
    size: int  # face corners of the whole mesh
    polygon: np.ndarray  # (t,) int, the face that each triangle is of
    local: np.ndarray  # local, world: (t, 3, 3) float corners in the mesh's frame, and in the world's (+Y up, metres)
    world: np.ndarray
    # what keeps its material, as that is see-through or glows: paths of subsets, or that of the mesh itself
    kept: tuple[str, ...]
    instances: tuple[str, ...]  # paths of the instances that the mesh belongs to, outermost first


@dataclass(frozen=True, eq=False)
class Painted:
    """One object that gets one texture."""

    name: str  # unique in the room
    path: str  # of its prim, where its material is bound
    kind: str  # `things`, or `stuff` for floor, walls and ceiling
    category: str  # category, style: words of the graph, "" where it has none
    style: str
    pieces: tuple[SurfacePiece, ...]  # at least one

    @property
    def triangles(self) -> np.ndarray:
        """(t, 3, 3) float corners of all pieces in the world, metres."""
        return np.concatenate([piece.world for piece in self.pieces])

    @property
    def topology(self) -> str:
        """Digest of the meshes: the order of their triangles, and where each lies in its mesh; not where they stand."""
        found = hashlib.blake2b(digest_size=16)
        for piece in self.pieces:
            found.update(piece.path.removeprefix(self.path).encode() + b"\0")
            found.update(np.ascontiguousarray(piece.corners, "<i4").tobytes())
            found.update(np.ascontiguousarray(np.rint(piece.local * 1e5), "<i8").tobytes())
        return found.hexdigest()


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What `read_surfaces` found."""

    room: str  # prim path of the room
    graph: SceneGraph  # its scene graph
    palette: str  # its selected harmony, "" without one
    objects: tuple[Painted, ...]  # what can be painted, stuff first
    left_out: Mapping[str, str] = field(default_factory=dict)  # name -> why it cannot


def read_surfaces(stage: Usd.Stage, *, dressing: str = "none") -> Surfaces:
    """Everything in the only room of a stage that can be painted.

    `dressing`: the small things below `Dressing`: `none` of them, `grouped` as one object, or `each`. Raises ValueError
    for another word, StageError for a stage without a room, with several, or with nothing to paint.
    """
    if dressing not in DRESSING:
        raise ValueError(f"dressing is {dressing!r}, allowed: {', '.join(DRESSING)}")
    prims = the_room(stage, None)
    nodes = {str(path): name for path, name in node_names(prims).items()}
    found: dict[str, list[Drawable]] = {}
    left: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkippedForms)  # curves and volumes have no surface to paint
        for drawable in read_drawables(stage):
            owner = _owner(stage, drawable.path, prims, nodes, dressing)
            if owner:
                found.setdefault(owner, []).append(drawable)
    graph = room_graph(prims)
    objects, names = [], set[str]()
    for path, drawables in found.items():
        name = free_name(Tf.MakeValidIdentifier(path.rpartition("/")[2]), names)
        names.add(name)
        try:
            pieces = [_piece(stage, drawable) for drawable in drawables]
        except _Unpaintable as fault:
            left[name] = str(fault)
            continue
        if all(piece.kept == (piece.path,) for piece in pieces):
            left[name] = "all of it is see-through or glows"
            continue
        node = graph.node(nodes[path]) if path in nodes else None
        category = node.category if node else drawables[0].category
        kind = "stuff" if any(drawable.category in STUFF for drawable in drawables) else "things"
        objects.append(Painted(name, path, kind, category, (node and node.style) or "", tuple(pieces)))
    if not objects:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to paint, found no visible mesh")
    variant = prims.room.GetVariantSets().GetVariantSelection("palette")
    objects.sort(key=lambda thing: thing.kind != "stuff")
    return Surfaces(str(prims.room.GetPath()), graph, variant, tuple(objects), left)


class _Unpaintable(Exception):
    """Why an object cannot be painted."""


def _owner(stage: Usd.Stage, path: str, prims: RoomPrims, nodes: Mapping[str, str], dressing: str) -> str:
    """Path of the object that a mesh belongs to, "" for what is not to be painted."""
    room = prims.room.GetPath()
    prim = stage.GetPrimAtPath(path.partition("[")[0])
    if not prim.GetPath().HasPrefix(room):
        return ""
    below = room.AppendChild(DRESSING_NAME)
    if prim.GetPath().HasPrefix(below):
        inner = prim.GetPath().MakeRelativePath(below).GetPrefixes()[0] if prim.GetPath() != below else None
        each = str(below.AppendPath(inner)) if inner else str(below)
        return {"none": "", "grouped": str(below), "each": each}[dressing]
    component = ""
    for above in takewhile(lambda one: one.GetPath() != room, lineage(prim)):
        if str(above.GetPath()) in nodes:
            return str(above.GetPath())
        if not component and Usd.ModelAPI(above).GetKind() == "component":
            component = str(above.GetPath())
    return component or str(prim.GetPath())


def _piece(stage: Usd.Stage, drawable: Drawable) -> SurfacePiece:
    if "[" in drawable.path:
        raise _Unpaintable(f"<{drawable.path}> is placed by an instancer")
    prim = stage.GetPrimAtPath(drawable.path)
    if not prim.IsA(UsdGeom.Mesh) or is_subdivision(prim):
        raise _Unpaintable(f"<{drawable.path}> is no polygon mesh ({prim.GetTypeName()})")
    arrays = mesh_arrays(UsdGeom.Mesh(prim))
    polygon, corners = fans(arrays.counts)
    if UsdGeom.Mesh(prim).GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corners = corners[:, ::-1]
    subsets = [str(subset.GetPath()) for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()]
    owner = np.zeros(len(polygon), int)  # which paint colours a triangle: later ones win
    for number, (_, faces) in enumerate(drawable.paints):
        owner[faces] = number
    shown = {number for number in range(len(drawable.paints)) if (owner == number).any()}
    clear = {n for n in shown if drawable.paints[n][0].opacity < 1 or any(drawable.paints[n][0].emissive)}
    kept = [subset for number, subset in enumerate(subsets, 1) if number in clear]
    if clear == shown:
        kept = [drawable.path]
    world = drawable.triangles @ drawable.world[:3, :3].T + drawable.world[:3, 3]
    through = [p for p in lineage(prim) if p.IsInstance() or (p.IsInstanceProxy() and p.IsInstanceable())]
    return SurfacePiece(
        drawable.path, corners, arrays.indices[corners], int(arrays.counts.sum()), polygon, drawable.triangles, world,
        tuple(kept), tuple(str(each.GetPath()) for each in reversed(through)),
    )  # fmt: skip
