"""Where something can be put down on a piece of furniture: level parts of its mesh with air above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from echomodel.dressing import usual_size
from echomodel.triangles import area_normals
from echousd.dressing.setting import APART, Setting, Standing, Thing, rectangle

LEVEL = 0.006  # metres: what differs less in height is one level
LEAST = 0.012  # m² of a level
EDGE = 0.01  # metres that things keep from the edge
AIR = 0.6  # metres of air above a top that nothing covers


@dataclass(eq=False)
class Surface:
    """A level in an object's frame.

    Arguments:
        host: the object.
        y: its height above the object's bottom, metres. air: free height above it.
        area: what lies at this height, in plan; shrinks as things are put down.
        above: what stands on it or passes through it, in plan.
    """

    host: Standing
    y: float
    air: float
    area: shapely.Geometry
    above: shapely.STRtree

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and z, greatest x and z of the level, object frame."""
        least_x, least_z, most_x, most_z = self.area.bounds
        return least_x, least_z, most_x, most_z

    @property
    def closed(self) -> bool:
        """Whether doors or drawer fronts stand before it."""
        x0, z0, x1, z1 = self.bounds
        front = float(self.host.size[2]) / 2 + 0.02
        if front - z1 < 1e-3:
            return False
        lines = [shapely.LineString([(x, (z0 + z1) / 2), (x, front)]) for x in np.linspace(x0, x1, 9)[1:-1]]
        return sum(len(self.above.query(line, predicate="intersects")) > 0 for line in lines) > len(lines) / 2

    def put(
        self,
        setting: Setting,
        kind: str,
        at: Sequence[tuple[float, float]],
        *,
        size: np.ndarray | None = None,
        turn: float = 0.0,
        variant: int | None = None,
        count: int = 1,
        word: str = "",
    ) -> Thing | None:
        """Put a thing on the first of some places that is free; None where none is.

        Arguments:
            setting: decides what is free, and learns of the thing.
            kind: what is put there.
            at: places as shares (x, z) of the level's half extents from its middle, -1 to 1.
            size: (3,) extents, None for usual ones.
            turn: yaw in the object's frame, radians.
            variant, count: of the thing; word: names its own random numbers.
        """
        rng = setting.rng(self.host.name, kind, word, f"{self.y:.2f}")
        size = usual_size(kind, rng) if size is None else size
        if size[1] > self.air or not self.area.area > 0:
            return None
        x0, z0, x1, z1 = self.bounds
        half = np.array([x1 - x0, z1 - z0]) / 2
        turned = np.abs(np.array([np.cos(turn), np.sin(turn)]) @ [[size[0], size[2]], [size[2], size[0]]])
        room = np.maximum(half - turned / 2 - EDGE, 0.0)
        for share in at:
            place = np.array([(x0 + x1) / 2, (z0 + z1) / 2]) + np.array(share) * room
            plan = rectangle(place, size[[0, 2]], turn)
            if not self.area.contains(plan.buffer(0.8 * EDGE, join_style="mitre")):
                continue
            if len(self.above.query(plan.buffer(APART), predicate="intersects")):
                continue
            position = self.host.to_room(np.array([[place[0], self.y, place[1]]]))[0]
            thing = Thing(
                kind, size, position, self.host.yaw + turn, self.host.name,
                int(rng.integers(1 << 30)) if variant is None else variant, count,
            )  # fmt: skip
            if setting.put_first([thing], host=self.host.name, floor=False):
                self.area = self.area.difference(plan.buffer(2 * APART))
                return thing
        return None


def surfaces(host: Standing) -> list[Surface]:
    """The levels of an object, highest first."""
    mesh = host.geometry.mesh
    corners = np.asarray(mesh.vertices, float)[np.asarray(mesh.faces)]
    normal = area_normals(corners)
    double = np.linalg.norm(normal, axis=1)
    up = np.flatnonzero((normal[:, 1] > 0.97 * double) & (double > 1e-9))
    if not len(up):
        return []
    height, area = corners[up, :, 1].mean(1), double[up] / 2
    order = np.argsort(height)
    groups = np.split(order, np.flatnonzero(np.diff(height[order]) > LEVEL) + 1)
    found: list[Surface] = []
    for group in sorted(groups, key=lambda g: -float(height[g].max())):
        if area[group].sum() < LEAST:
            continue
        y = float(height[group].max())
        faces = up[group]
        level = shapely.union_all(shapely.polygons(corners[faces][:, :, [0, 2]]), grid_size=1e-4)
        covered = [s.y - y - 0.04 for s in found if s.area.intersection(level).area > 0.3 * level.area]
        air = min([*covered, AIR])
        if air < 0.06:
            continue
        found.append(Surface(host, y, air, level, shapely.STRtree(_between(corners, y + 0.004, y + air))))
    return found


def _between(corners: np.ndarray, low: float, high: float) -> np.ndarray:
    """The triangles between two heights in plan; those that stand upright as lines."""
    y = corners[..., 1]
    plan = corners[(y.max(1) > low) & (y.min(1) < high)][:, :, [0, 2]]
    if not len(plan):
        return np.array([], object)
    first, second = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    flat = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) < 1e-7
    lines = shapely.linestrings(plan[flat]) if flat.any() else []
    areas = shapely.polygons(plan[~flat]) if (~flat).any() else []
    return np.array([*lines, *areas], object)
