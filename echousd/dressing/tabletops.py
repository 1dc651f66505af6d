"""What lies and stands on furniture, and where: on level parts of its mesh with air above."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from echomodel.arrays import once
from echomodel.dressing import KINDS, usual
from echomodel.late import Late
from echomodel.triangles import area_normals, spans_of
from echousd.dressing.setting import APART, EDGE, Setting, Standing, Thing, around, rectangle
from echousd.dressing.stories import TABLE, Wish
from echousd.shapes.geometry import Geometry

shelved_books = Late("echousd.dressing.shelved:shelved_books")
laid = Late("echousd.dressing.laid:laid")

LEVEL = 0.006  # metres: what differs less in height is one level
LEAST, CRACK = 0.012, 5e-4  # m² of a level; metres: cracks between triangles on the grid that joins them
AIR = 0.9  # metres of air above a top that nothing covers
ROW, EACH = 0.8, 0.6  # metres of books side by side at most, so that all are drawn; of a shelf for one thing more


@dataclass(eq=False)
class Surface:
    """A level in an object's frame."""

    host: Standing  # the object
    y: float  # its height above the object's bottom, metres
    air: float  # free height above it
    area: shapely.Geometry  # what lies at this height, in plan; shrinks as things are put down
    above: shapely.STRtree  # what stands on it or passes through it, in plan

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """(2,) x and z of the middle of the level, and its half extents, object frame."""
        bounds = np.array(self.area.bounds).reshape(2, 2)
        return bounds.mean(0), np.ptp(bounds, axis=0) / 2

    @property
    def closed(self) -> bool:
        """Whether doors or drawer fronts stand before it."""
        (x, z), (wide, deep) = self.span
        front = float(self.host.size[2]) / 2 + 0.02
        if front - z - deep < 1e-3:
            return False
        lines = [shapely.LineString([(at, z), (at, front)]) for at in x + wide * np.linspace(-1, 1, 9)[1:-1]]
        return sum(len(self.above.query(line, predicate="intersects")) > 0 for line in lines) > len(lines) / 2

    def put(
        self, setting: Setting, kind: str, at: Sequence[tuple[float, float]] = (), *, size: np.ndarray | None = None,
        turn: float = 0.0, variant: int = 0, count: int = 1, word: str = "", beside: Thing | None = None,
    ) -> Thing | None:  # fmt: skip
        """Put a thing on the first of some places that is free; None where none is.

        `setting`: decides what is free, and learns of the thing. `kind`: what is put there. `at`: places as shares (x,
        z) of the level's half extents from its middle, -1 to 1. `size`: (3,) extents, None for usual ones. `turn`: yaw
        in the object's frame, radians. `variant`, `count`: of the thing; `word`: names its own random numbers.
        `beside`: a thing on the level around which it is put instead.
        """
        rng = setting.rng(self.host.name, kind, word, f"{self.y:.2f}")
        if size is None:
            size, variant = usual(kind, setting.rng("set", kind) if kind in TABLE["sets"] else rng)
        if size[1] > self.air or not self.area.area > 0:
            return None
        middle, half = self.span
        turned = np.abs([np.cos(turn), np.sin(turn)]) @ [[size[0], size[2]], [size[2], size[0]]]
        room = np.maximum(half - turned / 2 - EDGE, 0.0)
        places = [middle + np.array(share) * room for share in at]
        if beside is not None:
            places += [self.host.in_plan(beside.position) + way for way in around(beside, size, rng)]
        for place in places:
            plan = rectangle(place, size[[0, 2]], turn)
            if not self.area.contains(plan.buffer(0.8 * EDGE, join_style="mitre")):
                continue
            if len(self.above.query(plan.buffer(APART), predicate="intersects")):
                continue
            position = self.host.to_room(np.array([[place[0], self.y, place[1]]]))[0]
            thing = Thing(kind, size, position, self.host.yaw + turn, self.host.name, variant, count)
            if setting.put_first([thing], host=self.host.name, floor=False):
                self.area = self.area.difference(plan.buffer(2 * APART))
                return thing
        return None


def surfaces(host: Standing) -> list[Surface]:
    """The levels of an object, highest first."""
    return [Surface(host, *level) for level in _levels(host.geometry)]


@once
def _levels(geometry: Geometry) -> list[tuple[float, float, shapely.Geometry, shapely.STRtree]]:
    """The levels of a piece, as a `Surface` has them."""
    corners = geometry.mesh.triangles
    normal = area_normals(corners)
    double = np.linalg.norm(normal, axis=1)
    up = np.flatnonzero((normal[:, 1] > 0.97 * double) & (double > 1e-9))
    if not len(up):
        return []
    height, area = corners[up, :, 1].mean(1), double[up] / 2
    under = corners[normal[:, 1] < -0.97 * np.maximum(double, 1e-9), :, 1].mean(1)  # of boards, however thick
    order = np.argsort(height)
    groups = np.split(order, np.flatnonzero(np.diff(height[order]) > LEVEL) + 1)
    found: list[tuple[float, float, shapely.Geometry, shapely.STRtree]] = []
    for group in sorted(groups, key=lambda g: -float(height[g].max())):
        if area[group].sum() < LEAST:
            continue
        y = float(height[group].max())
        faces = up[group]
        level = shapely.union_all(shapely.polygons(corners[faces][:, :, [0, 2]]), grid_size=1e-4)
        level = level.buffer(CRACK, join_style="mitre").buffer(-CRACK, join_style="mitre")
        covered = [top - y - 0.04 for top, _, other, _ in found if other.intersection(level).area > 0.3 * level.area]
        air = min([*covered, AIR])
        air = min([air, *(under[(under > y + air / 2) & (under < y + air)] - y - 0.004)])
        if air < 0.06:
            continue
        found.append((y, air, level, shapely.STRtree(_between(corners, y + 0.004, y + air))))
    return found


def _between(corners: np.ndarray, low: float, high: float) -> np.ndarray:
    """The triangles between two heights in plan; those that stand upright as lines."""
    least, most = spans_of(corners[..., 1])
    plan = corners[(most > low) & (least < high)][:, :, [0, 2]]
    if not len(plan):
        return np.array([], object)
    first, second = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    flat = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) < 1e-7
    lines = shapely.linestrings(plan[flat]) if flat.any() else []
    return np.array([*lines, *(shapely.polygons(plan[~flat]) if (~flat).any() else [])], object)


ASKEW = 4  # times as far as others
LAID = 0.6  # share of rooms whose dining table is set
EYE = 1.7  # metres: what is put higher cannot be seen
CASES = ("cabinet", "shelf")  # looks of what books and baskets stand in and on: no cistern, no fridge


def tabletops(setting: Setting) -> None:
    """Things on everything that carries."""
    for host in setting.of("board", "storage", *setting.story.tops):
        levels = surfaces(host)
        if not levels:
            continue
        name = host.row.top
        if name == "dining_table" and setting.has(LAID, setting.rng(host.name, "set")):
            laid(setting, host, levels[0])
        footprint = float(host.size[0] * host.size[2])
        tops = [s for s in levels if s.area.area > 0.3 * footprint and s.host.position[1] + s.y < EYE]
        if name in setting.story.tops and tops:
            decked(setting, host, tops[0], setting.story.tops[name])
        if name in TABLE["stocked"] or (host.row.role == "storage" and host.row.look in CASES):
            for surface in levels:
                if surface is not (tops[0] if tops and name in setting.story.tops else None):
                    stocked(setting, host, surface)


def decked(setting: Setting, host: Standing, surface: Surface, wishes: Sequence[Wish]) -> None:
    """Put what a story wishes on a level; first a television in the middle of a stand for one, where there is none."""
    rng = setting.rng(host.name, "top")
    taken: set[str] = set()
    if host.row.top == "tv_stand" and not setting.of("screen"):  # as wide as looks good on it
        variant = int(setting.rng("television").integers(1 << 30))
        for share in (0.6, 0.5, 0.4):
            wide = round(min(share * float(host.size[0]), KINDS["television"].high[0]), 2)
            size, spots = np.array([wide, round(0.56 * wide + 0.045, 3), 0.2]), ((0, -0.3), (0, 0), (0.2, 0), (-0.2, 0))
            if surface.put(setting, "television", spots, size=size, variant=variant):
                break
    for number, wish in enumerate(wishes):
        order = [str(k) for k in rng.permutation(wish.of)]
        turn = float(rng.uniform(-0.12, 0.12))
        if not setting.has(wish.share, rng) or (wish.needs and wish.needs not in taken):
            continue
        for kind in [k for k in order if k not in taken] or order:
            straight = kind in TABLE["straight"] or surface.area.area < 0.1
            lies = turn * (ASKEW if kind in TABLE["loose"] else 1 - straight)
            thing = surface.put(setting, kind, wish.at, turn=lies, word=str(number))
            if thing:
                taken.add(kind)
                for place, other in enumerate(wish.beside):
                    surface.put(setting, str(rng.choice(other)), word=f"{number} {place}", beside=thing)
                break


def stocked(setting: Setting, host: Standing, surface: Surface) -> None:
    """A row of books against one side of a shelf, and something beside it."""
    if not 0.1 < host.position[1] + surface.y < EYE or surface.area.area < 0.03 or surface.closed:
        return
    rng = setting.rng(host.name, "shelf", f"{surface.y:.2f}")
    wide, deep = 2 * surface.span[1]
    side, books = 1.0 if rng.random() < 0.5 else -1.0, 0.0
    ware = TABLE["stocked"].get("task" if host.row.task else setting.use or host.row.top)
    if ware is None and setting.has(0.85, rng):
        length = min(wide * rng.uniform(0.4, 0.75), ROW)
        for share in (1.0, 0.6, 0.35):
            tall = min(surface.air - 0.015, rng.uniform(0.2, 0.27))
            size = np.round([length * share, tall, min(deep - 0.03, rng.uniform(0.15, 0.2))], 3)
            if size[0] < 0.1 or tall < 0.14 or size[2] < 0.1:
                break
            at = [(x * side, z) for z in (0.9, 0.0) for x in (-0.99, 0.99, -0.5, 0.5, 0.0)]
            count, variant = max(1, int(size[0] / 0.03)), int(rng.integers(1 << 30))
            row = surface.put(setting, "book_row", at, size=size, variant=variant, count=count)
            if row:
                books = float(size[0])
                if setting.full:
                    shelved_books(setting, row, rng)
                break
    had, more = [one.kind for one in setting.placed if one.on == host.name], 2 + int((wide - books) / EACH)
    wanted = rng.permutation(setting.story.shelves if ware is None else ware).tolist()
    wanted.sort(key=had.count)  # first what the piece has not yet
    for number in range(more):
        if rng.random() < 0.85:
            places = [(x * side, 0.2) for x in (0.75, 0.4, 0.95, 0.1, -0.2, -0.6, -0.9)]
            for kind in wanted[number::more]:
                if surface.put(setting, kind, places, word=str(number)):
                    break
