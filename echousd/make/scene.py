"""Everything solid of a room: what is in the way of what, and by how far things may be moved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from echomodel.boxes2d import footprints, upright
from echomodel.objective import Plan
from echomodel.triangles import Mesh, bounds_of, connected_pieces
from echousd.graph import SceneGraph
from echousd.place.geometry import IN_WALL
from echousd.shapes.geometry import Geometry
from echousd.shapes.hulls import FLUSH, Solids, depth, forbidden_moves
from echousd.shapes.walls import ShellPart

REACH = 0.5  # metres that a piece is moved at most in all
NEAR = 0.01  # metres within which solids are looked at first: most things at most touch
EDGE = 0.002  # metres beyond the floor, or beyond what it stands on, that a piece may be


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that can be in the way; numbers from n on are parts of the shell, which stays."""

    solids: Sequence[Solids]  # corners of the convex pieces of every thing in the room, metres
    fixed: np.ndarray  # (s,) bool, what must not move
    carrier: np.ndarray  # (n,) int, as `Problem.carrier`
    heading: np.ndarray  # (n,) float, yaw in radians
    seat: np.ndarray  # (n,) bool
    bulk: np.ndarray  # (n,) float, square root of the footprint, metres
    outline: Sequence[shapely.Polygon]  # n polygons, footprints
    level: Sequence[BaseGeometry]  # n polygons, where the top of each is: a desk with a shelf behind has it there alone
    floor: shapely.Polygon  # the floor, a little wider
    bounds: np.ndarray  # (s, 2, 3) float, boxes of everything
    walls: Sequence[ShellPart]  # with what is in them
    # pair -> forbidden moves of its first against its second from where both stood at first
    known: dict[tuple[int, int], BaseGeometry] = field(default_factory=dict)

    def forbidden(self, pair: tuple[int, int]) -> BaseGeometry:
        """Moves of the first against the second at which they overlap; empty for a thing and what it stands on."""
        i, k = pair
        if i > k:
            turned: BaseGeometry = shapely.transform(self.forbidden((k, i)), np.negative)
            return turned
        if pair not in self.known:
            self.known[pair] = self._against(pair, np.zeros(2), 2 * REACH)
        return self.known[pair]

    def near(self, one: int, moves: np.ndarray, reach: float) -> list[int]:
        """What has a box (in plan and height) within a distance in plan of one thing's."""
        away = np.zeros((len(self.solids), 3))
        away[: len(moves), [0, 2]] = moves
        margin = np.array([reach, 0.0, reach])
        low, high = self.bounds[:, 0] + away - margin, self.bounds[:, 1] + away + margin
        meet = ((self.bounds[one, 0] + away[one] < high) & (self.bounds[one, 1] + away[one] > low)).all(1)
        return [int(k) for k in np.flatnonzero(meet) if k != one]

    def overlaps(self, moves: np.ndarray, deep: float) -> list[tuple[tuple[int, int], float]]:
        """Pairs that reach deeper than `deep` metres into one another after moves (n, 2), deepest first."""
        found = []
        for i in range(len(moves)):
            for k in self.near(i, moves, 0.0):
                way = moves[i] - moves[k] if k < len(moves) else moves[i]
                if k > i and (far := self._depth((i, k), way)) > deep:
                    found.append(((i, k), far))
        return sorted(found, key=lambda hit: -hit[1])

    def in_walls(self, moves: np.ndarray) -> list[tuple[int, int]]:
        """Things, and numbers of walls that they may reach into, or into what is in them, after moves (n, 2)."""
        low, high = self.bounds[: len(moves)].swapaxes(0, 1) + np.insert(moves, 1, 0.0, axis=1)
        met = []
        for number, wall in enumerate(self.walls):
            start, end = np.array([bounds_of(piece.mesh.vertices) for piece in wall.everything]).swapaxes(0, 1)
            shared = np.minimum(high[:, None], end) - np.maximum(low[:, None], start)
            met += [(one, number) for one in np.flatnonzero((shared.min(2) > IN_WALL).any(1)).tolist()]
        return met

    def _against(self, pair: tuple[int, int], way: np.ndarray, reach: float) -> BaseGeometry:
        i, k = pair
        if k < len(self.carrier) and (self.carrier[i] == k or self.carrier[k] == i):
            return shapely.Polygon()
        moved = [np.add(solid, (way[0], 0.0, way[1])) for solid in self.solids[i]]
        return forbidden_moves(moved, self.solids[k], reach)

    def _depth(self, pair: tuple[int, int], way: np.ndarray) -> float:
        """How deep two things reach into one another after a move (2,) of the first, metres."""
        if pair not in self.known:  # a way out that is shorter than `NEAR` passes near solids alone, which are few
            deep = depth(self._against(pair, way, NEAR), np.zeros(2))
            if deep < NEAR:
                return deep
        return depth(self.forbidden(pair), way)

    def corners(self, one: int, moves: np.ndarray) -> np.ndarray:
        """(4, 2) float: those of a thing's footprint after the moves."""
        return np.asarray(shapely.get_coordinates(self.outline[one])[:4] + moves[one])

    def hangs_over(self, one: int, moves: np.ndarray) -> bool:
        """Whether the middle of a thing is above no level part of what it should stand on."""
        carrier = int(self.carrier[one])
        if carrier < 0 or self.fixed[one]:
            return False
        level = translate(self.level[carrier], *moves[carrier])
        return not level.is_empty and not level.buffer(EDGE).contains(shapely.Point(self.corners(one, moves).mean(0)))


def scene_of(
    graph: SceneGraph, room: Plan, geometry: Mapping[str, Geometry], floor: np.ndarray, walls: Sequence[ShellPart]
) -> Scene:
    """The scene of a layout; arguments as `cleared`, `room`: its plan."""
    nodes, size, position, yaw = graph.nodes, room.size, room.position, room.yaw
    placed = zip(nodes, upright(yaw), position, strict=True)
    solids = [
        [np.asarray(one.mesh.vertices, float) @ turn.T + at for one in geometry[node.name].colliders]
        for node, turn, at in placed
    ]
    # what stands before the walls: sills, casings, leaves, rails; walls themselves are the floor's edge
    fitted = (piece for part in walls for filled in part.inner for piece in filled.pieces)
    everything = [*solids, *(_boards(piece.mesh) for piece in fitted)]
    fixed = [node.locked or node.position is not None for node in nodes] + [True] * (len(everything) - len(nodes))
    return Scene(
        everything, np.array(fixed),
        room.carrier, yaw, room.of("seat"), np.sqrt(size[:, 0] * size[:, 2]),
        [shapely.Polygon(corner) for corner in footprints(size, position, yaw)],
        [_level(pieces) for pieces in solids], shapely.Polygon(floor).buffer(EDGE, join_style="mitre"),
        np.array([bounds_of(np.concatenate(pieces)) for pieces in everything]), walls,
    )  # fmt: skip


def _level(solids: Solids) -> BaseGeometry:
    """What lies at the height of a thing's top, in plan."""
    top = max(float(solid[:, 1].max()) for solid in solids)
    near = [solid[solid[:, 1] > top - FLUSH][:, [0, 2]] for solid in solids]
    return shapely.union_all([shapely.convex_hull(shapely.multipoints(points)) for points in near if len(points) > 2])


def _boards(mesh: Mesh) -> Solids:
    """Points of the connected pieces of a mesh."""
    board = connected_pieces(mesh.faces, len(mesh.vertices))
    return [mesh.vertices[np.unique(mesh.faces[board == number])] for number in range(int(board.max()) + 1)]
