"""The soft tops of beds, sofas and armchairs: how high they are, and where on them a thing lies and is clear."""

from functools import lru_cache

import numpy as np
import shapely

from echomodel.boxes2d import hull, upright
from echomodel.dressing.textiles import LIES
from echomodel.triangles import area_normals, spans_of
from echousd.dressing.setting import Setting, Standing, Thing, geometry_of
from echousd.shapes.hulls import forbidden_moves

ASIDE = 0.15  # metres that a thing moves at most so that it stands in nothing
STEP = 0.02  # metres from place to place
LOW = 0.15  # share of a seat that is lower than its level: pillows, low arms and crowns are higher
LEVEL, LIFTED = 0.003, 0.002  # metres: what is as high as that is one height; what stands so far over it is clear of it
# Metres between folds of a bed, and over its middle from where on it is a board; places behind pillows for cushions.
SOFT, BOARD, BEYOND = 0.04, 0.12, 12
BESIDE = 0.04  # metres that a throw hangs beside what it lies on
RAISED = 0.04  # metres that a thing is raised, or let down, at most so that it lies on the solids of a seat
# Shares of a cushion's extents that it stands on, and the part of that which must be level.
BASE, STEADY = np.array([0.9, 1.0, 0.6]), 0.6
HELD, TRIES = 0.5, 6  # share of what lies flat that is on what it lies on; places that are tried for it


Design = tuple[str, np.ndarray, int]  # kind, extents and variant of a cushion


class Seat:
    """Heights of an upholstered piece on a grid, object frame."""

    def __init__(self, x: np.ndarray, z: np.ndarray, height: np.ndarray, level: float) -> None:
        self.x, self.z, self.height, self.level = x, z, height, level

    @classmethod
    @lru_cache(maxsize=4)  # three rules ask about one bed
    def of(cls, host: Standing) -> "Seat | None":
        """The seat of an object, None where nothing of it looks like one."""
        corners = host.geometry.mesh.triangles
        normal = area_normals(corners)
        double = np.linalg.norm(normal, axis=1)
        half = host.size[[0, 2]] / 2
        x = np.arange(-half[0], half[0], STEP) + STEP / 2
        z = np.arange(-half[1], half[1], STEP) + STEP / 2
        height = heights_of(corners[normal[:, 1] > 0.05 * double], x, z)
        lies = height[(height > 0.2) & (height < min(0.62, 0.75 * float(host.size[1])))]
        if lies.size * STEP**2 < 0.12:
            return None
        return cls(x, z, height, float(np.quantile(lies, LOW)))

    def before_pillows(self, x: float, size: np.ndarray) -> np.ndarray | None:
        """(3,) a place at `x` right before what lies at the head; None where it would not lie flat."""
        rows = np.abs(self.x - x) < size[0] / 2
        deep = int(np.ceil(size[2] / STEP))
        head = self.z < 0.1 * self.z[0]  # the half of the head and a little more
        raised = np.flatnonzero(head & (self.height[rows].max(0) > self.level + 0.08))
        first = int(raised[-1]) + 1 if len(raised) else len(self.z)
        for at in range(first, min(first + BEYOND, len(self.z) - deep)):
            under = self.height[rows, at : at + deep]
            if np.ptp(under) < SOFT:
                return np.array([x, float(under.max()), self.z[at] + (deep - 1) * STEP / 2])
        return None

    def below(self, spot: np.ndarray, size: np.ndarray) -> float | None:
        """Height of the level surface below most of what lies at a spot (3,); None where it is not level."""
        # without its edges, which touch an arm's or a back's foot
        rows, columns = np.abs(self.x - spot[0]) < 0.4 * size[0], np.abs(self.z - spot[2]) < 0.4 * size[2]
        under = self.height[np.ix_(rows, columns)]
        top = float(under.max(initial=-np.inf))
        return top if np.isfinite(top) and (under > top - SOFT).mean() > 0.6 else None


def heights_of(corners: np.ndarray, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(len(x), len(z)) float: height of the highest surface over each cell of a grid, -inf where there is none."""
    out = np.full((len(x), len(z)), -np.inf)
    flat = corners[:, :, [0, 2]]
    one, two = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    large = np.flatnonzero(np.abs(area) > 1e-10)
    ends = spans_of(flat)[:, large]
    (top, bottom), (left, right) = (np.searchsorted(line, ends[..., axis]) for axis, line in enumerate((x, z)))
    count = (bottom - top) * (right - left)  # of cells that its box covers
    cell, n = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count), np.repeat(large, count)
    wide = np.repeat(right - left, count)
    i, k = np.repeat(top, count) + cell // wide, np.repeat(left, count) + cell % wide
    px, pz = x[i] - flat[n, 0, 0], z[k] - flat[n, 0, 1]
    u, v = (px * two[n, 1] - pz * two[n, 0]) / area[n], (one[n, 0] * pz - one[n, 1] * px) / area[n]
    inside, (y0, y1, y2) = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9), corners[n, :, 1].T
    np.maximum.at(out, (i[inside], k[inside]), (y0 + u * (y1 - y0) + v * (y2 - y0))[inside])
    return out


def put(
    setting: Setting, host: Standing, spot: np.ndarray | None, kind: str, size: np.ndarray, turn: float, variant: int,
    lie: tuple[float, ...] = (),
) -> Thing | None:  # fmt: skip
    """Put a thing on a spot (3,) of its host, turned in its frame; None where there is none or it is not clear."""
    if spot is None:
        return None
    thing = Thing(kind, size, host.to_room(spot[None])[0], host.yaw + turn, host.name, variant, lie=lie)
    return setting.put_first([thing], host=host.name, margin=0.0, floor=False)


def corners_of(kind: str, size: np.ndarray, variant: int, lie: tuple[float, ...] = ()) -> np.ndarray:
    """(n, 3) float, metres: corners of what a thing collides with, in its own frame."""
    return geometry_of(kind, tuple(size.tolist()), variant, lie).colliders[0].mesh.vertices


def upon(host: Standing, spot: np.ndarray, size: np.ndarray) -> np.ndarray | None:
    """The spot (3,) for a thing, brought to the solids below it; None where one stands far out, or few hold it."""
    tops = tops_of(host, spot, size)
    top = float(tops.max())
    level = (tops > top - LEVEL).mean() > HELD
    return np.array([spot[0], top, spot[2]]) if level and abs(top - spot[1]) < RAISED else None


def let_down(host: Standing, spot: np.ndarray, size: np.ndarray) -> np.ndarray | None:
    """The spot (3,) let down onto what of its seat is level; None where that is too little for a cushion to stand."""
    tops = tops_of(host, spot, size * BASE)
    top = float(tops[tops < spot[1] + RAISED].max(initial=-np.inf))
    level = (tops > top - LEVEL).mean() > STEADY and top > spot[1] - RAISED
    return np.array([spot[0], top, spot[2]]) if level else None


def tops_of(host: Standing, spot: np.ndarray, size: np.ndarray) -> np.ndarray:
    """(49,) float: heights of the host's solids all over the base of a thing at a spot (3,), -inf where none is."""
    x, z = (spot[axis] + size[axis] * np.linspace(-0.5, 0.5, 7) for axis in (0, 2))
    points = np.stack(np.meshgrid(x, z), -1).reshape(-1, 2)
    tops = np.full(len(points), -np.inf)
    for collider in host.geometry.colliders:
        normal = area_normals(collider.mesh.triangles)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
        beyond = (normal * collider.mesh.triangles[:, 0]).sum(1) - points @ normal[:, [0, 2]].T  # metres, of y = 0
        up, down = normal[:, 1] > 1e-6, normal[:, 1] < -1e-6
        high = (beyond[:, up] / normal[up, 1]).min(1)
        low = (beyond[:, down] / normal[down, 1]).max(1)
        over = (high > low) & (beyond[:, ~up & ~down] > 0).all(1)
        tops[over] = np.maximum(tops[over], high[over])
    return tops


def clear_of(host: Standing, spot: np.ndarray, turn: float, body: np.ndarray) -> np.ndarray | None:
    """The spot (3,) or one near it where a turned thing, of corners (n, 3), reaches into no solid of its seat; None =
    nowhere."""
    stood = body @ upright(-turn) + spot
    taken = forbidden_moves([stood], [collider.mesh.vertices for collider in host.geometry.colliders], ASIDE)
    free = shapely.Point(0, 0).buffer(ASIDE).difference(taken)
    if free.is_empty:
        return None
    way = shapely.get_coordinates(shapely.shortest_line(shapely.Point(0, 0), free))[1]
    return spot + np.array([way[0], 0.0, way[1]])


def lying(
    host: Standing, seat: Seat, spot: np.ndarray | None, turn: float, size: np.ndarray, body: np.ndarray
) -> np.ndarray | None:
    """A place near a spot (3,), or before it, that is clear of the host and on what is below; None where none is."""
    if spot is None:
        return None
    base = np.insert(2 * hull(size[[0, 2]] / 2, np.array(turn)), 1, size[1])
    for _ in range(TRIES):
        down = seat.below(spot, size)
        found = None if down is None else upon(host, np.array([spot[0], down, spot[2]]), base)
        if found is None:
            spot = spot + np.array([0.0, 0.0, 2 * STEP])
            continue
        spot = clear_of(host, found + np.array([0.0, LIFTED, 0.0]), turn, body)
        if spot is None or np.abs(spot - found).max() < LEVEL:
            return spot
    return None


def across(
    host: Standing, seat: Seat, where: np.ndarray, z: float, deep: float, falls: np.ndarray, over: float,
    rng: np.random.Generator,
) -> Thing | None:  # fmt: skip
    """A throw across a bed or an arm, its middle at `z`, that lies on all of it; None where nothing flat of its height
    is.

    `where`: (len(seat.x),) bool, what it lies on. `falls`: (2,) metres that it hangs down at its left and right.
    `over`: metres of its top over what is highest there.
    """
    under, x = seat.height[where][:, np.abs(seat.z - z) < deep / 2], seat.x[where]
    centre = float(x[0] + x[-1]) / 2
    x = x - centre
    middle, top = float(np.median(under[np.abs(x) < 0.6 * x[-1] + STEP])), float(under.max())
    if not 0.25 < middle <= top < min(0.95, middle + BOARD):
        return None
    half = float(np.abs(x[(under > top - 0.2).any(1)]).max()) + STEP / 2
    size, falls = np.round([2 * (half + BESIDE), falls.max(), deep], 3), np.round(falls, 3)
    rows, columns = (np.linspace(0, under.shape[1], LIES[0]), np.arange(1, 2 * LIES[1], 2) / LIES[1] - 1)
    columns = np.clip(columns * size[0] / 2, -half, half)
    near = max(min(0.04, 0.3 * half), 1.6 * half / LIES[1])
    cells = [[under[np.abs(x - at) < near, max(int(k) - 3, 0) : int(k) + 3].max() for at in columns] for k in rows]
    lie = (*falls.tolist(), *np.round(np.clip(top - np.array(cells), 0.0, BOARD), 3).ravel().tolist())
    spot = host.to_room(np.array([[centre, top + over - size[1], z]]))[0]
    return Thing("throw", size, spot, host.yaw, host.name, int(rng.integers(1 << 30)), lie=lie)
