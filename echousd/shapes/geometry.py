"""The geometry of one piece of furniture: parts with material slots, colliders, and where it all comes from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from echomodel.furniture.solids import Joint
from echomodel.triangles import Mesh, joined

CONVERTED = "model.usdc"
# Neighbours that fold more sharply than this keep a hard edge; those of cloth, on which what is woven runs on.
CREASE, DRAPED = np.radians((42.0, 80.0))


@dataclass(frozen=True, eq=False)
class Original:
    """The model that a piece of furniture is."""

    pose: np.ndarray  # (4, 4) float, its frame and unit to the object's frame, in metres
    prim: str  # path of its root prim
    # the USD file that holds it, which stays where it is and as it is; None where `files` hold it
    layer: Path | None = None
    # name -> content of a model that was converted to USD or is taken along, to be written beside it
    files: Mapping[str, bytes] = field(default_factory=dict)
    main: str = CONVERTED  # which of the files is the model
    bodies: bool = False  # bodies, colliders: it has rigid bodies or colliders of its own, so that it gets none of ours
    colliders: bool = False


FRAME = "frame"  # the body that holds the joints
LICENCE = "Apache-2.0"  # of everything that EchoUSD itself makes


@dataclass(frozen=True)
class Origin:
    """Where a piece of furniture comes from."""

    shapes: str  # name of the source of shapes, see `echousd.shapes.sources`
    licence: str = LICENCE  # SPDX identifier of its licence
    credit: str = ""  # who must be named, empty where nobody must
    asset: str = ""  # file or id of the model that it is, empty for what EchoUSD made
    sha256: str = ""  # of the model's file


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of a piece of furniture."""

    name: str  # unique in its geometry; the prim is called `<asset>_<name>`
    mesh: Mesh  # in the object's frame, metres
    # material slot (a group of `echousd.shapes.looks`) -> (m,) int face numbers; together every face once
    slots: Mapping[str, np.ndarray]
    crease: float = CREASE  # neighbours that fold more sharply than this keep a hard edge, radians
    body: str = ""  # what it moves with, see `Geometry.joints`; empty where the whole piece is one body


@dataclass(frozen=True, eq=False)
class Mass:
    """What a piece of furniture, or one body of it, weighs."""

    mass: float  # kilograms
    centre: np.ndarray  # (3,) float, metres, in the object's frame
    inertia: np.ndarray  # (3,) float, moments about the principal axes, kg m²
    axes: np.ndarray  # (3, 3) float rotation, its columns are them

    def seen(self, frame: np.ndarray) -> "Mass":
        """The same in another frame, whose axes and unit `frame` (3, 3) turns to and scales by."""
        scale = float(np.cbrt(abs(np.linalg.det(frame))))
        return Mass(self.mass, frame @ self.centre, scale**2 * self.inertia, frame @ self.axes / scale)


@dataclass(frozen=True, eq=False)
class Collider:
    """What a piece of furniture collides with."""

    name: str  # unique in its geometry; the prim is called `<asset>_<name>`
    mesh: Mesh  # in the object's frame, metres
    approximation: str  # UsdPhysics's word for how the mesh is meant, `convexHull` or `convexDecomposition`
    body: str = ""  # as for `Part`


@dataclass(frozen=True, eq=False)
class Geometry:
    """The geometry of one piece of furniture; objects that share an asset share this object."""

    parts: tuple[Part, ...]  # at least one
    colliders: tuple[Collider, ...]  # at least one; together they cover all parts
    origin: Origin  # provenance and licence
    mass: Mass | None = None  # what it weighs, None = nobody knows, it is estimated from the category and the box
    # of the bodies that move (drawers, doors); what is fixed then belongs to the body `FRAME`
    joints: tuple[Joint, ...] = ()
    # body -> what it weighs, for every body of a piece with joints
    masses: Mapping[str, Mass] = field(default_factory=dict)
    # the parts once more with few faces, of the same names, bodies and slots; empty = there are none
    coarse: tuple[Part, ...] = ()
    # numbers from which a furniture program makes the piece again, empty = there are none
    description: tuple[float, ...] = ()
    # somebody else's model that the piece is; its parts and colliders only tell what it looks like
    original: Original | None = None

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts] + [collider.name for collider in self.colliders]
        if not self.parts or not self.colliders or len(set(names)) < len(names):
            raise ValueError(f"geometry has the pieces {names}, need parts and colliders, each with a name of its own")

    @cached_property
    def mesh(self) -> Mesh:
        """All parts as one mesh."""
        return joined([part.mesh for part in self.parts])

    @property
    def theirs_collides(self) -> bool:
        """Whether it is somebody else's model with colliders of its own."""
        return self.original is not None and self.original.colliders

    @property
    def faces(self) -> int:
        """Triangles of all parts."""
        return sum(len(part.mesh.faces) for part in self.parts)

    @property
    def watertight(self) -> bool:
        """Whether every part is closed as it is, or once vertices at one place are one."""
        return all(part.mesh.closed for part in self.parts)
