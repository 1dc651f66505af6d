"""What solids weigh: boards, tubes and shells by what they are made of; a piece's mass, written and read back."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from pxr import Gf, Usd, UsdPhysics
from shapely.affinity import scale

from echomodel.dressing import PRINTS
from echomodel.files import tables
from echomodel.furniture.solids import MeshedSolid
from echomodel.late import Late
from echomodel.triangles import Mesh, along, cross, lengths
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.shapes.geometry import Geometry, Mass
from echousd.stage.pen import Pen

convex_hull = Late("echousd.shapes.hulls:convex_hull")  # with manifold3d, which who reads masses does without


@dataclass(frozen=True)
class Matter:
    """What a solid stands for: a row of `matter.toml`, which says what its words mean."""

    density: float
    wall: float = np.inf
    core: float = 0.0


_ROWS = {
    part: {name: Matter(**row) for name, row in rows.items()} for part, rows in tables("matter.toml", __file__).items()
}
# Material of a solid -> what it stands for; role and material -> the same, where the material alone tells how it looks.
MATTER = _ROWS["materials"] | {name: _ROWS["materials"][name.partition("_")[0]] for name in PRINTS}
PARTS = {tuple(words.split()): matter for words, matter in _ROWS["parts"].items()}


def weighed(pieces: Iterable[MeshedSolid]) -> Mass:
    """Mass, centre and moments of inertia of meshed solids; overlaps count twice."""
    total, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for piece in pieces:
        matter = PARTS.get((piece.solid.role, piece.solid.material)) or MATTER[piece.solid.material]
        volume, area = _moments(piece)
        inside, skin = max(volume[0], 1e-7), max(area[0], 1e-7)
        walls = min(inside, skin * matter.wall)
        for kilograms, (measure, one, two) in (
            (matter.density * walls, volume if walls >= inside and volume[0] > 0 else area),
            (matter.core * (inside - walls), volume),
        ):
            if kilograms > 0:
                total += kilograms
                first += kilograms / max(measure, 1e-12) * one
                second += kilograms / max(measure, 1e-12) * two
    middle = first / total
    second = second - total * np.outer(middle, middle)
    values, axes = np.linalg.eigh(np.trace(second) * np.eye(3) - second)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return Mass(total, middle, np.maximum(values, LEAST_INERTIA), axes)


Moments = tuple[float, np.ndarray, np.ndarray]


@lru_cache(maxsize=512)  # of what opens each body is weighed, and all of it
def _moments(mesh: MeshedSolid | Mesh) -> tuple[Moments, Moments]:
    """Of the volume and of the surface of a closed mesh: measure, first (3,) and second moment (3, 3) about 0."""
    origin = mesh.vertices[0]
    corners = (mesh.vertices - origin)[mesh.faces]
    one, two, three = corners.transpose(1, 0, 2)
    whole = one + two + three
    pairs = np.einsum("tki,tkj->tij", corners, corners) + whole[:, :, None] * whole[:, None, :]
    six = along(one.T, cross(two, three).T)
    area = lengths(cross(two - one, three - one)) / 2
    solid = (float(six.sum() / 6), six @ whole / 24, np.einsum("t,tij->ij", six, pairs) / 120)
    surface = (float(area.sum()), area @ whole / 3, np.einsum("t,tij->ij", area, pairs) / 12)
    return _moved(*solid, origin), _moved(*surface, origin)


def _moved(measure: float, first: np.ndarray, second: np.ndarray, by: np.ndarray) -> Moments:
    """Moments about a point that lies `-by` from the one that they are about."""
    mixed = np.outer(first, by)
    return measure, first + measure * by, second + mixed + mixed.T + measure * np.outer(by, by)


SOLID = 200.0  # kg/m³ of what nobody knows


def mass_of(geometry: Geometry, category: str) -> Mass:
    """What a piece weighs and how that is spread: as its source knows it, else estimated from its category and shape.

    `geometry`: of the piece. `category`: its word, which has a density of the piece's whole box.

    An estimate takes the matter to fill the convex hulls of the colliders evenly; it is within what real ones weigh.
    """
    if geometry.mass is not None:
        return geometry.mass
    size = np.ptp(geometry.mesh.bounds, axis=0)
    low, high = (0.2, np.inf) if category == OBSTACLE else vocabulary().category(category).kg
    kilograms = round(float(np.clip(np.prod(size) * density(category), low, high)), 2)
    solids = [collider.mesh.vertices for collider in geometry.colliders]
    _, middle, tensor = hull_moments(solids)
    moments, axes = np.linalg.eigh(kilograms * tensor)
    return ballasted(Mass(kilograms, middle, np.maximum(moments, LEAST_INERTIA), axes), solids)


def density(category: str) -> float:
    """Kilograms of a cubic metre of a piece's whole box."""
    return SOLID if category == OBSTACLE else vocabulary().category(category).density


def hull_moments(solids: Iterable[np.ndarray]) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume and centre of mass (3,) of the hulls of solids, and one kilogram's tensor of inertia (3, 3) about it.

    `solids`: corners (n, 3) of each, metres.
    """
    hulls = [convex_hull(solid) for solid in solids]
    moments = [_moments(hull)[0] for hull in hulls]
    volume, first, second = (sum(part) for part in zip(*moments, strict=True))
    middle = first / volume
    square = second / volume - np.outer(middle, middle)
    return volume, middle, np.trace(square) * np.eye(3) - square


def write_mass(pen: Pen, path: str, mass: Mass) -> None:
    """Author mass, centre of mass, moments of inertia and the axes that they are about, of a rigid body."""
    values = {
        "float physics:mass": round(mass.mass, 3),
        "point3f physics:centerOfMass": tuple(round(float(v), 4) + 0.0 for v in mass.centre),
        "float3 physics:diagonalInertia": tuple(float(f"{max(v, LEAST_INERTIA):.5g}") for v in mass.inertia),
        "quatf physics:principalAxes": _quaternion(np.asarray(mass.axes, float)),
    }
    pen.over(path, values, ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])


def read_mass(prim: Usd.Prim) -> Mass | None:
    """The mass that is authored on a body, None where it is not authored in full."""
    api = UsdPhysics.MassAPI(prim)
    authored = (api.GetMassAttr(), api.GetCenterOfMassAttr(), api.GetDiagonalInertiaAttr(), api.GetPrincipalAxesAttr())
    if not prim.HasAPI(UsdPhysics.MassAPI) or not all(attribute.HasAuthoredValue() for attribute in authored):
        return None
    kilograms, centre, inertia, turn = (attribute.Get() for attribute in authored)
    axes = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Quatd(turn))), float).T  # USD's matrices act on rows
    return Mass(float(kilograms), np.array(centre, float), np.array(inertia, float), axes)


def _quaternion(axes: np.ndarray) -> Gf.Quatf:
    """The rotation whose columns are `axes` (3, 3); a reflection gets one axis turned round, which is the same axis."""
    if np.linalg.det(axes) < 0:
        axes = axes * np.array([-1.0, 1.0, 1.0])
    turn = Gf.Matrix3d(*(float(value) for value in axes.T.ravel())).ExtractRotation().GetQuat()
    x, y, z = turn.GetImaginary()
    return Gf.Quatf(*(round(float(value), 6) + 0.0 for value in (turn.GetReal(), x, y, z)))


LEAST_INERTIA = 1e-5  # kg m²: engines take no smaller moments well
SOLE = 0.005  # metres: what is as near to the floor carries the piece
STEADY = 0.75  # share of its base, drawn together about its middle, that the centre of mass of a standing piece is in


def ballasted(mass: Mass, solids: Sequence[np.ndarray]) -> Mass:
    """The mass with weight added in the middle of the base until the centre is well above it; itself where it is.

    `solids`: (n, 3) float corners of the solids of a piece that stands, in its frame, metres, +Y up.
    """
    points = np.concatenate(list(solids))
    plan = shapely.convex_hull(shapely.multipoints(points[points[:, 1] < points[:, 1].min() + SOLE][:, [0, 2]]))
    if plan.area <= 0:
        return mass
    middle = shapely.get_coordinates(plan.centroid)[0]
    centre = np.asarray(mass.centre, float)
    out = shapely.LineString([middle, centre[[0, 2]]])
    inside = out.intersection(scale(plan, STEADY, STEADY, origin=tuple(middle)))
    if inside.length >= out.length * (1 - 1e-6):
        return mass
    added = mass.mass * (out.length / inside.length - 1)
    sole = np.array([middle[0], points[:, 1].min(), middle[1]])
    whole = mass.mass + added
    moved = (mass.mass * centre + added * sole) / whole
    turn = np.asarray(mass.axes, float)
    tensor = turn @ np.diag(mass.inertia) @ turn.T
    for kilograms, at in ((mass.mass, centre), (added, sole)):
        away = at - moved
        tensor += kilograms * (away @ away * np.eye(3) - np.outer(away, away))
    moments, axes = np.linalg.eigh(tensor)
    return Mass(whole, moved, np.maximum(moments, LEAST_INERTIA), axes)
