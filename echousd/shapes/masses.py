"""What a piece of furniture weighs and how its matter is spread: estimated, written and read back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely
import trimesh
from pxr import Gf, Usd, UsdPhysics
from scipy.spatial import ConvexHull, QhullError
from shapely.affinity import scale

from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.shapes.geometry import Collider, Geometry, Mass

SOLID = 200.0  # kg/m³ of what nobody knows


def mass_of(geometry: Geometry, category: str) -> Mass:
    """What a piece weighs and how that is spread: as its source knows it, else estimated from its category and shape.

    Arguments:
        geometry: of the piece. category: its word, which has a density of the piece's whole box.

    An estimate takes the matter to fill the convex hulls of the colliders evenly; it is within what real ones weigh.
    """
    if geometry.mass is not None:
        return geometry.mass
    size = np.ptp(geometry.mesh.bounds, axis=0)
    low, high = (0.2, np.inf) if category == OBSTACLE else vocabulary().category(category).kg
    kilograms = round(float(np.clip(np.prod(size) * density(category), low, high)), 2)
    middle, tensor = _spread(geometry.colliders)
    moments, axes = np.linalg.eigh(kilograms * tensor)
    mass = Mass(kilograms, middle, np.maximum(moments, LEAST_INERTIA), axes)
    return ballasted(mass, [collider.mesh.vertices for collider in geometry.colliders])


def density(category: str) -> float:
    """Kilograms of a cubic metre of a piece's whole box."""
    return SOLID if category == OBSTACLE else vocabulary().category(category).density


def hull_volume(points: np.ndarray) -> float:
    """Volume of the convex hull of points (n, 3), m³; 0 of points in one plane."""
    try:
        return float(ConvexHull(points).volume)  # trimesh's hull is a mesh and takes five times as long
    except QhullError:
        return 0.0


def _spread(colliders: Iterable[Collider]) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,), and the tensor of inertia (3, 3) about it of one kilogram in the colliders' hulls."""
    hulls = [collider.mesh.convex_hull for collider in colliders]
    volume = np.array([max(float(hull.volume), 1e-9) for hull in hulls])
    centres = np.array([hull.center_mass for hull in hulls])
    middle = volume @ centres / volume.sum()
    tensor = np.zeros((3, 3))
    for hull, own, centre in zip(hulls, volume, centres, strict=True):
        away = centre - middle
        tensor += _inertia(hull) + own * (away @ away * np.eye(3) - np.outer(away, away))
    return middle, tensor / volume.sum()


def _inertia(hull: trimesh.Trimesh) -> np.ndarray:
    tensor = np.asarray(hull.moment_inertia)
    return (tensor + tensor.T) / 2


def write_mass(prim: Usd.Prim, mass: Mass) -> None:
    """Author mass, centre of mass, moments of inertia and the axes that they are about."""
    api = UsdPhysics.MassAPI.Apply(prim)
    api.CreateMassAttr(round(mass.mass, 3))
    api.CreateCenterOfMassAttr(Gf.Vec3f(*(round(float(v), 4) + 0.0 for v in mass.centre)))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(float(f"{max(v, LEAST_INERTIA):.5g}") for v in mass.inertia)))
    api.CreatePrincipalAxesAttr(_quaternion(np.asarray(mass.axes, float)))


def read_mass(prim: Usd.Prim) -> Mass | None:
    """The mass that is authored on a body, None where it is not authored in full."""
    api = UsdPhysics.MassAPI(prim)
    told = (api.GetMassAttr(), api.GetCenterOfMassAttr(), api.GetDiagonalInertiaAttr(), api.GetPrincipalAxesAttr())
    if not prim.HasAPI(UsdPhysics.MassAPI) or not all(attribute.HasAuthoredValue() for attribute in told):
        return None
    kilograms, centre, inertia, turn = (attribute.Get() for attribute in told)
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

    Arguments:
        solids: (n, 3) float corners of the solids of a piece that stands, in its frame, metres, +Y up.
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
