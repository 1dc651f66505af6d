"""Weight in the base of what would topple, as lamps with long arms have it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.affinity import scale

from echousd.shapes.geometry import Mass

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
