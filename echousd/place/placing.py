"""Placing: move and size sampled boxes as little as possible until the room keeps its graph and nothing collides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.late import Late
from echomodel.objective import TERMS
from echomodel.objective.plan import kind_of
from echomodel.objective.sizes import fitting_loads, hung_lamps, in_proportion, laid_tables, smaller_sizes, usual_sizes
from echomodel.objective.support import FREE, ON_FLOOR, stacked
from echomodel.openings import Opening, signed_area
from echomodel.rules import margins, verdicts
from echomodel.rules.geometry import Spread
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.graph.arrays import stated_placements, triplets_of
from echousd.place.distances import BED_LIT
from echousd.place.geometry import collisions, outside
from echousd.place.problem import Problem, problem_of
from echousd.place.search import Arranged, Search
from echousd.place.solver import PlaceConfig, solve, unmet

if TYPE_CHECKING:
    from echousd.place.conflicts import Conflict

FULL = 0.3  # share of a floor that is covered from which on smaller furniture is tried
BAD = 1.5  # cost of a room in which something is broken
WORTH = 1.0  # that smaller furniture must save of what an arrangement costs
UPRIGHT = np.array([False, True, False])  # the side that taller and shorter are about
OVER = 0.15  # metres between the middles of a lamp and of the table that it hangs over
SMALLEST = 0.02  # metres: no side of a sampled box is shorter
fitted = Late("echousd.place.fitted:fitted")  # a kitchen's units
conflicts = Late("echousd.place.conflicts:conflicts")  # where something is not met


@dataclass(frozen=True, eq=False)
class PlacedBoxes:
    """What became of the boxes of one room.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        verdict: (e,) int8, 1 kept, 0 broken, -1 not measured.
        conflicts: groups of demands that contradict each other.
        collisions: (pair, depth in metres) of boxes that still collide; outside: (object, depth in metres).
        judged: poses, each of a whole room, that the search looked at.
    """

    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    verdict: np.ndarray
    conflicts: tuple[Conflict, ...]
    collisions: tuple[tuple[tuple[int, int], float], ...]
    outside: tuple[tuple[int, float], ...]
    judged: int

    @property
    def boxes(self) -> Boxes:
        """The same boxes, float32."""
        return Boxes(*(of.astype(np.float32) for of in (self.size, self.position, self.yaw)))


def place(
    graph: SceneGraph, boxes: Boxes, *, config: PlaceConfig | None = None, begun: dict[bytes, Arranged] | None = None
) -> PlacedBoxes:
    """Place the sampled boxes of a graph: see `place_boxes`.

    Nodes that are locked or have a position stay where they are, nodes with a size keep it, nodes with a yaw keep it.

    Arguments:
        graph: the graph that the boxes were sampled for.
        boxes: N boxes in the order of its nodes, metres and radians, in the frame of the room's floor.

    Raises:
        ValueError: as `place_boxes`, or another number of boxes than nodes.
    """
    nodes = graph.nodes
    if len(boxes) != len(nodes):
        raise ValueError(f"{len(boxes)} boxes for a graph of {len(nodes)} objects: need one box per object")
    return place_boxes(
        [node.category for node in nodes], np.asarray(boxes.size, float), np.asarray(boxes.position, float),
        np.asarray(boxes.yaw, float), triplets_of(graph), floor_polygon=graph.room.corners, height=graph.room.tall,
        openings=graph.room.openings, stated=stated_placements(graph),
        fixed=np.array([node.locked or node.position is not None for node in nodes]),
        rigid=np.array([node.locked or node.size is not None for node in nodes]),
        turned=np.array([node.locked or node.yaw is not None for node in nodes]), config=config, begun=begun,
    )  # fmt: skip


def place_boxes(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, triplets: np.ndarray, *,
    floor_polygon: np.ndarray | None = None, height: float | None = None, fixed: np.ndarray | None = None,
    rigid: np.ndarray | None = None, turned: np.ndarray | None = None, openings: Sequence[Opening] = (),
    stated: tuple[Stated, ...] = (), rules: str = "strict", config: PlaceConfig | None = None,
    begun: dict[bytes, Arranged] | None = None,
) -> PlacedBoxes:  # fmt: skip
    """Move and size boxes as little as possible until relations, collisions, floor, walls and support are right.

    Arguments:
        categories: n category words (words outside the vocabulary stand on the floor and belong to nothing).
        size, position: (n, 3) float, metres, position = centre of the bottom face; yaw: (n,) float, radians.
        triplets: (e, 3) int, [subject, predicate id, object].
        floor_polygon: (k, 2) float, x and z, metres; None = no walls.
        height: of the ceiling, metres; None = ceiling things keep their height.
        fixed, rigid, turned: (n,) bool, boxes that must keep their position, size, yaw.
        openings: doors and windows in the edges of the floor polygon.
        stated: where single objects must stand in the room.
        rules: `strict` or `sgfront`.
        begun: what earlier searches of the same boxes found, by their sizes, which goes on from there; filled.

    Raises:
        ValueError: a box that is not finite, a floor without area, or unknown rules.
    """
    n = len(categories)
    bad = ~(np.isfinite(size).all(1) & np.isfinite(position).all(1) & np.isfinite(yaw))
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise ValueError(
            f"box {i} ({categories[i]}) is not finite: size {size[i]}, position {position[i]}, yaw {yaw[i]}"
        )
    triplets = np.asarray(triplets, int).reshape(-1, 3)
    none = np.zeros(n, bool)
    fixed, rigid, turned = (none if mask is None else np.asarray(mask, bool) for mask in (fixed, rigid, turned))
    config = config or PlaceConfig()
    terms = tuple(term for term in TERMS if term.name not in config.without)
    tried: list[Arranged] = []
    known = {} if begun is None else begun

    sizes = [predicate.id for predicate in vocabulary().predicates if predicate.measures == "size"]
    measured = np.unique(triplets[np.isin(triplets[:, 1], sizes)][:, [0, 2]])
    held: np.ndarray = fixed

    def posed(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, kept: np.ndarray) -> Problem:
        return problem_of(
            categories, size, position, yaw, triplets, floor_polygon=floor_polygon, height=height,
            fixed=held, rigid=kept, turned=turned, openings=openings, stated=stated, rules=rules,
        ).no_deeper(config.reach)  # fmt: skip

    drawn = at = posed(np.where(rigid[:, None], size, np.maximum(size, SMALLEST)), position, yaw, rigid)
    if floor_polygon is not None and config.arrange:
        higher = [predicate.id for predicate in vocabulary().predicates if predicate.order == "height"]
        of_more = np.unique(triplets[np.isin(triplets[:, 1], list({*sizes} - {*higher}))][:, [0, 2]])
        lenient = np.isin(np.arange(n), of_more)[:, None] | (np.isin(np.arange(n), measured)[:, None] & UPRIGHT)
        usual = usual_sizes(drawn.categories, drawn.size, lenient=lenient)
        sides = np.array([kind.round or bool(kind.aspect) for kind in drawn.kinds], bool)  # that go together
        kept = rigid | (sides & ~np.isin(np.arange(n), measured))
        at = posed(np.where(rigid[:, None], size, usual), position, yaw, kept)
        at, planned = fitted(at, rigid) if any(kind.stands == "row" for kind in at.kinds) else (at, none)
        if planned.any():
            held, rigid, kept = fixed | planned, rigid | planned, kept | planned
            at = posed(at.size, at.position, at.yaw, kept)
        anchor, compared = at.anchor, triplets[np.isin(triplets[:, 1], sizes)]
        free = ~rigid & ~np.isin(np.arange(n), measured)

        def suited(to: Problem, size: np.ndarray) -> Problem:
            laid = laid_tables(to.categories, size, anchor, ~rigid)
            broken = margins(Spread(laid, to.position, to.yaw), compared, rules=rules, fronts=to.fronts) < 0
            ends = compared[broken][:, ::2].ravel()
            laid[ends] = size[ends]
            return to.at(fitting_loads(to.categories, laid, to.carrier, free), to.position, to.yaw)

        at = suited(at, at.size)

        def searched(of: Problem) -> Arranged:
            key = of.size.tobytes()
            tried.append(Search(of.spread(), terms, yields=config.yields).run(config.anew, known.get(key)))
            known[key] = tried[-1]
            return tried[-1]

        chosen = searched(at)
        less = suited(at, smaller_sizes(at.categories, at.size, free)) if fullness(at) > FULL else at
        if chosen.wrong and chosen.cost > BAD and not np.array_equal(less.size, at.size):
            other = searched(less)
            if other.cost < chosen.cost - WORTH:
                at, chosen = less, other
        hung = hung_lamps(at.categories, at.size, chosen.state.position, chosen.state.yaw, free)
        at = posed(hung, chosen.state.position, chosen.state.yaw, kept)
    found = solve(at)
    if at is not drawn and unmet(found.at):  # what the graph states comes before all habits
        plain = solve(drawn)
        if unmet(plain.at) < unmet(found.at):
            found, at, held = plain, drawn, fixed
    turn = at.yaw
    # The supports are met to a fraction of a millimetre; put them exactly, ceiling things as the solver left them.
    hung = lamps_along(categories, at.position, found.position, triplets, held) if at is not drawn else found.position
    size_end = in_proportion(at.categories, found.size, ~rigid)
    end = stacked(size_end, hung, np.where(held, FREE, at.carrier), np.nan)
    ceiling = np.inf if height is None else np.maximum(height - size_end[:, 1], 0.0)
    end[~held, 1] = np.clip(end[:, 1], 0.0, ceiling)[~held]  # whatever is told of a lamp, it stays in the room
    written = Spread(*(of.astype(np.float32) for of in (size_end, end, turn)))
    verdict = verdicts(written, triplets, rules=rules, center=at.centre, fronts=at.fronts)
    hit = collisions(at.categories, size_end, end, turn, at.pairs)
    beyond = outside(at, size_end, end, turn)
    broken = set(np.flatnonzero(verdict == 0).tolist())
    failures = broken, {pair for pair, _ in hit}, {number for number, _ in beyond}
    against, judged = conflicts(at, found, failures) if any(failures) else (), sum(one.judged for one in tried)
    return PlacedBoxes(size_end, end, turn, verdict, against, hit, beyond, judged)


def fullness(at: Problem) -> float:
    """Share of the floor that furniture covers."""
    standing = at.carrier == ON_FLOOR
    return float((at.size[standing, 0] * at.size[standing, 2]).sum()) / abs(signed_area(at.floor.polygon))


def lamps_along(
    categories: Sequence[str], before: np.ndarray, after: np.ndarray, triplets: np.ndarray, fixed: np.ndarray
) -> np.ndarray:
    """(n, 3) float: the positions afterwards, lamps over what moved moved with it.

    Arguments:
        before, after: (n, 3) float, where the boxes stood when the lamps were hung, and where they stand now.
        triplets: (e, 3) int; a lamp that is told of anything else than what it hangs over stays.
        fixed: (n,) bool, boxes that must not move.
    """
    kinds, out = [kind_of(word) for word in categories], after.copy()
    above = vocabulary().predicate_id("above")
    lit = [j for j, kind in enumerate(kinds) if kind.support == "floor" and kind.role in ("board", "bed")]
    for i, kind in enumerate(kinds):
        if kind.support != "ceiling" or fixed[i] or not lit:
            continue
        off = np.hypot(*(before[lit] - before[i])[:, [0, 2]].T)
        j = lit[int(off.argmin())]
        ends = triplets[(triplets[:, [0, 2]] == i).any(1)][:, [0, 2]].ravel().tolist()
        below = [k for a, predicate, k in triplets.tolist() if a == i and predicate == above and k in lit]
        if len(below) == 1:  # perhaps in a row with others
            j = below[0]
        elif off.min() >= (BED_LIT.most if kinds[j].role == "bed" else OVER):
            continue
        if {*ends} <= {i, j}:
            out[i, [0, 2]] += (after[j] - before[j])[[0, 2]] - (after[i] - before[i])[[0, 2]]
    return out
