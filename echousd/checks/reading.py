"""What a rule is, reads and reports: a stage whose prims, rooms, transforms and meshes are each read once; findings."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias, TypeVar

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from echomodel.triangles import area_normals, bounds_of
from echousd.exporting.packing import asset_paths
from echousd.stage.contents import HIDDEN, RoomContents, components, read_contents, triangulated
from echousd.stage.files import prim_specs, specs
from echousd.stage.forms import is_subdivision
from echousd.stage.read import RoomPrims, find_rooms
from echousd.stage.units import metres_per_unit
from echousd.stage.values import NOW, UNREADABLE, MeshArrays, fans, matrix, mesh_arrays, readable

Found = TypeVar("Found")


class Reading:
    """What several rules read of one stage, as it is now: a stage that changes needs another one."""

    def __init__(self, stage: Usd.Stage) -> None:
        self.stage = stage
        self.cache = UsdGeom.XformCache(NOW)
        self._kept: dict[tuple[str, Sdf.Path], object] = {}

    @cached_property
    def prims(self) -> list[Usd.Prim]:
        """All prims that are active, defined and loaded, instances included."""
        return list(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()))

    @cached_property
    def distinct(self) -> list[Usd.Prim]:
        """The same prims, those of an instance's prototype once."""
        seen: set[Sdf.Path] = set()
        found = []
        for prim in self.prims:
            if prim.IsInstanceProxy():
                prototype = prim.GetPrimInPrototype().GetPath()
                if prototype in seen:
                    continue
                seen.add(prototype)
            found.append(prim)
        return found

    @cached_property
    def inactive(self) -> list[Usd.Prim]:
        """The prims that somebody deactivated; what would be below them is not there."""
        return [prim for prim in Usd.PrimRange.AllPrims(self.stage.GetPseudoRoot()) if not prim.IsActive()]

    @cached_property
    def meshes(self) -> list[UsdGeom.Mesh]:
        """The meshes among the distinct prims."""
        return [UsdGeom.Mesh(prim) for prim in self.distinct if prim.IsA(UsdGeom.Mesh)]

    @cached_property
    def authored(self) -> "list[Authored]":
        """All attributes of the distinct prims that somebody authored."""
        return [Authored(attribute) for prim in self.distinct for attribute in prim.GetAuthoredAttributes()]

    @cached_property
    def primvars(self) -> set[str]:
        """Names of all primvars that somebody authored."""
        return {attribute.name.partition(":")[2] for attribute in self.authored}

    @cached_property
    def bound(self) -> set[Sdf.Path]:
        """Paths of the materials that some prim binds, in whatever way."""
        bindings = [one for prim in self.distinct for one in prim.GetAuthoredPropertiesInNamespace("material")]
        return {path for one in bindings if isinstance(one, Usd.Relationship) for path in one.GetTargets()}

    @cached_property
    def rooms(self) -> list[RoomPrims]:
        """The rooms; none where they cannot be told, which echo:EdgeTargets reports."""
        none: list[RoomPrims] = []
        return readable(lambda: find_rooms(self.stage), none)

    @cached_property
    def nodes(self) -> list[Usd.Prim]:
        """The objects of all rooms' graphs."""
        return [prim for room in self.rooms for prim in room.nodes]

    @cached_property
    def labelled(self) -> list[Usd.Prim]:
        """The objects of all rooms' graphs, and what else carries labels in these rooms."""
        return [*self.nodes, *(prim for room in self.rooms for prim in components(room))]

    @cached_property
    def named_files(self) -> dict[Sdf.Layer, set[str]]:
        """The layers in use, but for the session's, and all asset paths that each authors, see `holder`."""
        session = self.stage.GetSessionLayer()
        return {layer: _named_files(layer) for layer in self.stage.GetUsedLayers() if layer != session}

    @cached_property
    def metres(self) -> float:
        """Metres per unit."""
        return metres_per_unit(self.stage)

    def contents(self, room: RoomPrims) -> RoomContents:
        """The objects of one of the rooms."""
        return self.once("contents", room.graph, lambda: read_contents(room))

    def world(self, prim: Usd.Prim) -> np.ndarray:
        """(4, 4) float, column vectors, prim to world; raises StageError where it is not finite."""
        return self.once("world", prim, lambda: matrix(self.cache.GetLocalToWorldTransform(prim), prim))

    def mesh(self, mesh: UsdGeom.Mesh) -> MeshArrays:
        """Points and faces of a mesh; raises StageError or Tf.ErrorException where they cannot be read."""
        return self.once("mesh", mesh.GetPrim(), lambda: mesh_arrays(mesh))

    def triangles(self, mesh: UsdGeom.Mesh) -> tuple[np.ndarray, ...]:
        """Fan triangles of a mesh's faces, as positions in its indices (t, 3) int, as points (t, 3) int and in space
        (t, 3, 3), and their `area_normals`; raises as `mesh` does."""

        def read() -> tuple[np.ndarray, ...]:
            arrays = self.mesh(mesh)
            faces = arrays.indices[corners := fans(arrays.counts)[1]]
            return corners, faces, (triangles := arrays.points[faces]), area_normals(triangles)

        return self.once("triangles", mesh.GetPrim(), read)

    def connected(self, prim: Usd.Prim) -> list[tuple[Usd.Attribute, list[Sdf.Path]]]:
        """The attributes of a prim that are connected, and to what."""

        def read() -> list[tuple[Usd.Attribute, list[Sdf.Path]]]:
            connected = filter(Usd.Attribute.HasAuthoredConnections, prim.GetAuthoredAttributes())
            return [(attribute, attribute.GetConnections()) for attribute in connected]

        return self.once("connected", prim, read)

    def is_guide(self, prim: Usd.Prim) -> bool:
        """Whether a prim is there for tools rather than for the eye (purpose guide or proxy)."""
        return self.once("guide", prim, lambda: UsdGeom.Imageable(prim).ComputePurpose() in HIDDEN)

    def box(self, prim: Usd.Prim) -> np.ndarray | None:
        """(2, 3) float: box around the form of a prim in the world, None of one without; raises as `world` does."""

        def read() -> np.ndarray | None:
            plain = prim.IsA(UsdGeom.Mesh) and not is_subdivision(prim)
            points, world = self.mesh(UsdGeom.Mesh(prim)).points if plain else triangulated(prim)[0], self.world(prim)
            turned = points @ world[:3, :3].T + world[:3, 3]
            return bounds_of(turned) if len(points) else None

        return self.once("box", prim, read)

    def once(self, what: str, prim: Usd.Prim, read: Callable[[], Found]) -> Found:
        """What is read of a prim, read at the first call."""
        key = what, prim.GetPath()
        if key not in self._kept:
            self._kept[key] = read()
        return self._kept[key]  # type: ignore[return-value]


class Authored:
    """An attribute that somebody authored, and what it holds, or what OpenUSD says where that cannot be read."""

    def __init__(self, attribute: Usd.Attribute) -> None:
        self.attribute, self.name = attribute, attribute.GetName()
        try:
            self.value = attribute.Get()
        except Tf.ErrorException as error:
            self.value = error

    def GetPath(self) -> Sdf.Path:
        """Where it is, as prims say it."""
        return self.attribute.GetPath()


def below(prim: Usd.Prim) -> list[Usd.Prim]:
    """A prim and all below it, instances included."""
    return list(Usd.PrimRange(prim, Usd.TraverseInstanceProxies()))


def holder(layer: Sdf.Layer, named: str) -> Sdf.Path:
    """The first prim of a layer that authors an asset path, the root for the layer itself."""
    return next((prim for prim, path in _asset_paths(layer) if path == named), Sdf.Path.absoluteRootPath)


def _named_files(layer: Sdf.Layer) -> set[str]:
    if layer.anonymous:
        return {path for _, path in _asset_paths(layer)}
    return {path for kind in UsdUtils.ExtractExternalReferences(layer.identifier) for path in kind}


def _asset_paths(layer: Sdf.Layer) -> list[tuple[Sdf.Path, str]]:
    """All asset paths that a layer authors, in sublayers, references, payloads, values or metadata, and their prims."""
    found = [(Sdf.Path.absoluteRootPath, path) for path in layer.subLayerPaths]
    found += [(path.GetPrimPath(), named) for path, named in asset_paths(specs(layer))]
    for prim in prim_specs(layer):
        arcs = (*prim.referenceList.GetAddedOrExplicitItems(), *prim.payloadList.GetAddedOrExplicitItems())
        found += [(prim.path.StripAllVariantSelections(), arc.assetPath) for arc in arcs if arc.assetPath]
    return found


Function: TypeAlias = Callable[..., Iterator[Any]]


@dataclass(frozen=True)
class Finding:
    """A fault at a prim (or property) path; the message says what was found and what is allowed."""

    path: Sdf.Path
    message: str
    warning: bool = False


@dataclass(frozen=True)
class StageRule:
    """A rule of our own, called `name`, and what finds its faults."""

    name: str
    find: Callable[[Reading], Iterator[Finding]]


RULES: list[StageRule] = []  # filled by the modules of rules as they are imported


def rule(name: str, over: str = "", of: type | None = None) -> Callable[[Function], Callable[[Reading], Any]]:
    """Make a rule of a generator of findings.

    Arguments:
        over: what of a `Reading` the generator is called for one by one, "" = for the reading alone. What it yields as
            text is said of that prim; one that cannot be read is passed over, as the rules on values report it.
        of: schema that these prims must be of, or have applied.
    """

    def made(function: Function) -> Callable[[Reading], Any]:
        def find(reading: Reading) -> Iterator[Finding]:
            for each in getattr(reading, over):
                if of is None or (each.HasAPI(of) if issubclass(of, Usd.APISchemaBase) else each.IsA(of)):
                    try:
                        for found in function(reading, each):
                            yield Finding(each.GetPath(), found) if isinstance(found, str) else found
                    except UNREADABLE:
                        continue

        RULES.append(StageRule(name, find if over else function))
        return RULES[-1].find

    return made


def applied(prim: Usd.Prim) -> list[str]:
    """Applied API schemas as authored, known to this process or not."""
    return list(prim.GetPrimTypeInfo().GetAppliedAPISchemas())
