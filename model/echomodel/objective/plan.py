"""What living rules look at: boxes with what their words say, walls, openings and who attends whom."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from echomodel.arrays import Array, at_least, cast, dot, full, held, kit, least_of, norm, on_device, pairs_in, rows
from echomodel.boxes2d import reach, to_frame
from echomodel.floors import edges, known, signed_area, signed_distance
from echomodel.graph import Stated
from echomodel.objective.support import carriers, shared_fraction
from echomodel.openings import Opening
from echomodel.rules.geometry import BoxesLike, PairGeometry, pairs
from echomodel.rules.sets import rule_set
from echomodel.vocabulary import Category, vocabulary


@dataclass(frozen=True, eq=False)
class Found:
    """One rule at P boxes.

    Arguments:
        who: (P,) int64, the box that a fault is counted for. other: (P,) int64, what it is about, -1 = nothing.
        margin: (P,) float, metres, radians or a share; >= 0 iff the rule is kept.
        measure: (P,) float, the number that the sentence names. words: (P,) int64, which sentence of the rule's it is.
    """

    who: Array
    other: Array
    margin: Array
    measure: Array
    words: Array

    def take(self, rows: Array) -> "Found":
        """Some of the rows, by number or mask."""
        return Found(self.who[rows], self.other[rows], self.margin[rows], self.measure[rows], self.words[rows])


def found(
    who: Array, margin: Array, *, other: Array | None = None, measure: Array | None = None,
    words: Array | None = None,
) -> Found:  # fmt: skip
    """A `Found` with what is left out filled in: nothing, the margin, the first sentence."""
    other = full(who, len(who), -1) if other is None else other
    words = full(who, len(who), 0) if words is None else words
    return Found(who, other, margin, margin if measure is None else measure, words)


def nobody(like: Array) -> Found:
    """A `Found` of a rule that looks at no box of a plan, with numbers like these."""
    none, nothing = kit(like).zeros(0, dtype=kit(like).int64), full(like, 0, 0.0)
    return Found(none, none, nothing, nothing, none)


def worst(who: Array, margin: Array, other: Array, count: int, nothing: float) -> tuple[Array, Array]:
    """Of the rows (P,) of each box the least margin (count,), `nothing` where it has none, and whom that is about."""
    least = least_of(who, margin, count, nothing)
    about = full(who, count, -1)
    hit = held(margin) <= held(least)[who]
    about[who[hit]] = other[hit]
    return least, about


def joined(first: Found, second: Found) -> Found:
    """The rows of both."""
    pairs = ((getattr(one, name) for one in (first, second)) for name in ("who", "other", "margin", "measure", "words"))
    return Found(*(kit(first.who).concat(list(pair)) for pair in pairs))


# Predicates that say which anchor an object attends.
NEARNESS = ("close_by", "standing_on", "above", "facing", "opposite")
FACING, PAST = np.cos(np.radians(30.0)), 0.15  # a back turned further, or more of it past its wall's end, is at none
FAR = 9.0  # metres, in place of the distance to something that is not there
CLEAR_HEIGHT = 0.05  # metres: a rug is in nobody's way
UNKNOWN = Category("", "", "", support="floor", role="", look="", density=0.0, ade20k="")
# What of a plan stays as it is while its boxes move.
OF_WORDS = (
    "anchor", "carrier", "group", "joins", "slot_role", "standing", "movable", "solid", "works", "dining", "fronts",
    "smaller", "walls", "walled", "rectangle", "_masks", "_words",
)  # fmt: skip


def _answered(asked: Callable[[Category], object]) -> cached_property[Array]:
    """(N,) bool, boxes whose row answers a question with yes, kept."""
    return cached_property(lambda plan: plan.which(asked))


@dataclass(frozen=True, eq=False)
class Plan:
    """N boxes of S rooms.

    Arguments:
        kinds: N rows of the vocabulary; `UNKNOWN` for other words.
        size, position: (N, 3) float, metres; yaw: (N,) float, radians.
        scene: (N,) int64, room of each box.
        floor: (S, K, 2) float, corners of the floors, padded with NaN, all NaN = unknown; in the frame of the boxes.
        openings: doors and windows of each room.
        triplets: (E, 3) int64, what the graphs state.
        fixed: (N,) bool, boxes whose place and heading somebody stated: no term blames them.
        height: (S,) float, of the ceilings, metres, NaN = unknown; None = all unknown.
        rules: the rule set that the triplets are meant in. stated: where single boxes of the first room must stand.
    """

    kinds: tuple[Category, ...]
    size: Array
    position: Array
    yaw: Array
    scene: Array
    floor: Array
    openings: tuple[tuple[Opening, ...], ...]
    triplets: Array
    fixed: Array
    height: Array | None = None
    rules: str = "strict"
    stated: tuple[Stated, ...] = ()

    @cached_property
    def kit(self) -> Any:
        """The library whose arrays these are: `numpy`, or `torch` where gradients are asked for."""
        return kit(self.size)

    def at(self, position: Array, yaw: Array) -> "Plan":
        """The same boxes at position (N, 3) and yaw (N,): whom each attends and what carries it stays as it is here."""
        out = replace(self, position=position, yaw=yaw)
        vars(out).update({name: getattr(self, name) for name in OF_WORDS})
        vars(out)["floor_points"] = vars(self).setdefault("floor_points", [])
        return out

    # -- words -------------------------------------------------------------------------------------------------------

    def of(self, *roles: str) -> Array:
        """(N,) bool, boxes with one of these roles."""
        return self._kept(("of", *roles), lambda: self.which(lambda kind: kind.role in roles))

    def stands(self, *slot_roles: str) -> Array:
        """(N,) bool, boxes that stand so to what they attend (`slot_role`)."""
        return self._kept(("stands", *slot_roles), lambda: self._mask([one in slot_roles for one in self.slot_role]))

    @cached_property
    def slot_role(self) -> tuple[str, ...]:
        """How each box stands to what it attends: `Category.stands`, and `with` for a sofa that joins a larger one."""
        joins = self.joins.tolist()
        return tuple("with" if j >= 0 else kind.stands for kind, j in zip(self.kinds, joins, strict=True))

    @cached_property
    def joins(self) -> Array:
        """(N,) int64, for sofas that share a coffee table with the first sofa of their room that sofa, -1 = none.

        The first is the one that most tables and screens are told to stand before or opposite, of these the largest.
        """
        out = full(self.scene, len(self), -1)
        sofas = [k for k, kind in enumerate(self.kinds) if kind.role == "sofa" and kind.wall]
        tables = [k for k, kind in enumerate(self.kinds) if kind.stands == "before"]
        scene, near = self.scene.tolist(), vocabulary().predicate_id("close_by")
        # how many tables and screens are told to stand before or opposite each, not only near it
        ends = ((a, b) for a, predicate, b in self.triplets.tolist() if predicate != near)
        served = Counter(sofa for pair in ends for sofa, other in (pair, pair[::-1])
                         if self.kinds[other].stands in ("before", "opposite"))  # fmt: skip
        for room in {scene[k] for k in sofas}:
            here = [k for k in sofas if scene[k] == room]
            if len(here) < 2 or sum(scene[k] == room for k in tables) >= len(here):
                continue  # every sofa has a table of its own
            first = max(here, key=lambda k: (served[k], round(float(self.size[k, 0]), 2), -k))
            for k in here:
                out[k] = first if k != first else -1
        return out

    def which(self, asked: Callable[[Category], object]) -> Array:
        """(N,) bool, boxes whose row answers a question with yes."""
        words, mine = self._words
        return self._mask([bool(asked(kind)) for kind in words])[mine]

    def has(self, asked: Callable[[Category], object]) -> bool:
        """Whether the row of any box answers a question with yes."""
        return any(asked(kind) for kind in self.first._words[0])

    def column(self, asked: Callable[[Category], Any]) -> Array:
        """(N, ...) float, what the rows of the boxes answer."""
        words, mine = self._words
        return self.numbers([asked(kind) for kind in words])[mine]

    def numbers(self, values: Any) -> Array:
        """Numbers as an array like the boxes."""
        return cast(values, self.size)

    # (N,) bool: seats that are moved aside to open or to reach something, and those without a front, stools;
    # boxes at whose front somebody works or takes things out, and those that have one; tables that people sit around
    movable = _answered(lambda kind: kind.role == "seat" and not kind.access)
    solid = _answered(lambda kind: kind.solid)
    works = _answered(lambda kind: kind.access > 0)
    fronts = _answered(lambda kind: kind.front)
    dining = _answered(lambda kind: kind.role == "board" and not (kind.access or kind.wall))

    @cached_property
    def _words(self) -> tuple[list[Category], Array]:
        """The different rows of the vocabulary, and which of them (N,) int64 each box has."""
        words = list(dict.fromkeys(self.kinds))
        number = {kind: k for k, kind in enumerate(words)}
        return words, cast([number[kind] for kind in self.kinds], self.scene)

    @cached_property
    def smaller(self) -> Array:
        """(N,) int64, order of the boxes by volume, of equal ones the later first."""
        xp = self.kit
        return xp.flip(xp.argsort(xp.argsort(xp.flip(held(self.size).prod(1), (0,)), stable=True)), (0,))

    def _kept(self, asked: tuple[str, ...], mask: Callable[[], Array]) -> Array:
        """A mask that is asked for again and again."""
        if asked not in self._masks:
            self._masks[asked] = mask()
        return self._masks[asked]

    @cached_property
    def _masks(self) -> dict[tuple[str, ...], Array]:
        return {}

    def _mask(self, values: Sequence[bool]) -> Array:
        return cast(values, self.fixed)

    @cached_property
    def standing(self) -> Array:
        """(N,) bool, boxes that stand on the floor and are in the way of legs and doors."""
        return self.which(lambda kind: kind.support == "floor") & (held(self.position)[:, 1] < 0.3)

    @cached_property
    def carrier(self) -> Array:
        """(N,) int64, what each box stands on, as `support.carriers`."""
        size, position, yaw = (np.asarray(held(of), np.float64) for of in (self.size, self.position, self.yaw))
        scene, triplets = np.asarray(self.scene), np.asarray(self.triplets)
        out = np.empty(len(self), int)
        for room in np.unique(scene):
            here = np.flatnonzero(scene == room)
            number = np.full(len(self), -1)
            number[here] = np.arange(len(here))
            kept = triplets[(scene[triplets[:, 0]] == room)] if len(triplets) else triplets
            local = np.stack([number[kept[:, 0]], kept[:, 1], number[kept[:, 2]]], 1) if len(kept) else kept
            found = carriers([self.kinds[k] for k in here], size[here], position[here], yaw[here], local)
            out[here] = np.where(found >= 0, here[found.clip(0)], found)
        return cast(out, self.scene)

    @cached_property
    def rooms(self) -> list[tuple[Array, np.ndarray, tuple[Opening, ...]]]:
        """Numbers (s,) of the rooms that share a floor and its openings, its corners (k, 2), and these; known ones."""
        out = []
        for number, openings in enumerate(self.openings):
            corners = on_device(self.floor[number], None)
            corners = corners[np.isfinite(corners).all(1)]
            if len(corners) > 2:
                out.append((full(self.scene, 1, number), corners, openings))
        return out

    @property
    def first(self) -> "Plan":
        """The plan whose floors are these, and whose words are said of all copies of it."""
        return self

    @property
    def moved(self) -> Array:
        """(N,) bool, boxes that do not stand alike in all rooms."""
        return full(self.fixed, len(self), True)

    @cached_property
    def ceiling(self) -> Array:
        """(N,) float, height of the ceiling over each box, metres; NaN = unknown."""
        unknown = self.height is None
        return self.kit.full_like(self.yaw, np.nan) if unknown else cast(self.height, self.yaw)[self.scene]

    @cached_property
    def centres(self) -> Array:
        """(N, 3) float, middle of the bounding box of each box's floor, on the floor, metres; 0 where it is unknown."""
        xp = self.kit
        corners = xp.where(xp.isfinite(self.floor), self.floor, self.floor[:, :1])
        middle = cast(xp.nan_to_num((xp.amax(corners, 1) + xp.amin(corners, 1)) / 2), self.size)
        return xp.stack([middle[:, 0], xp.zeros_like(middle[:, 0]), middle[:, 1]], 1)[self.scene]

    def ends_of(self, predicate: str) -> tuple[Array, Array]:
        """Subjects (P,) and objects (P,) of the relations of one name that the graphs state."""
        (i, _, j), rows = self.stated_pairs, self.rows_of(predicate)
        return i[rows], j[rows]

    @cached_property
    def stated_pairs(self) -> tuple[Array, Array, Array]:
        """Subjects, predicates and objects (E,) of all relations that the graphs state."""
        return self.triplets[:, 0], self.triplets[:, 1], self.triplets[:, 2]

    def rows_of(self, predicate: str) -> Array:
        """Which of the `stated_pairs` have a predicate."""
        return rows(self.stated_pairs[1] == vocabulary().predicate_id(predicate))

    @cached_property
    def pair_geometry(self) -> PairGeometry:
        """The geometry of the `stated_pairs`, which all relations share."""
        i, _, j = self.stated_pairs
        return pairs(self, i, j, self.centres, oriented=rule_set(self.rules).oriented, fronts=self.fronts)

    # -- pairs -------------------------------------------------------------------------------------------------------

    def those(self, mask: Array) -> Array:
        """(P,) int64, numbers of the boxes of a mask (N,) bool."""
        return rows(mask)

    def pairs(self, first: Array, second: Array, *, least: bool = False) -> tuple[Array, Array]:
        """Numbers (P,), (P,) of all ordered pairs of different boxes of one room, the first of `first` (N,) bool.

        Arguments:
            first, second: (N,) bool, by the words of boxes and what stands alike in copies, never by their poses.
            least: the rows go to `worst`, which alone knows what pairs are left out of copies of one room.
        """
        other = ~self.kit.eye(len(self), dtype=self.kit.bool)
        return pairs_in((self.scene[:, None] == self.scene[None]) & first[:, None] & second[None] & other)

    def beside(self, i: Array, others: Array) -> tuple[Array, Array]:
        """Rows (Q,) of boxes i (P,), and the boxes (Q,) of others (N,) bool that stand in the same room."""
        return pairs_in((self.scene[i][:, None] == self.scene[None]) & others)

    def worst(self, who: Array, margin: Array, other: Array) -> tuple[Array, Array]:
        """Of the rows (P,) of each box the least margin (N,), `FAR` where it has none, and whom that is about."""
        return worst(who, margin, other, len(self), FAR)

    def local(self, i: Array, j: Array) -> tuple[Array, Array]:
        """(P,) and (P,): how far i's centre lies to j's +x side and before j's centre, metres."""
        dx, dz = self.position[i, 0] - self.position[j, 0], self.position[i, 2] - self.position[j, 2]
        return to_frame(dx, dz, self.turn[0][j], self.turn[1][j])

    @cached_property
    def turn(self) -> tuple[Array, Array]:
        """(N,) and (N,) float, cosine and sine of the headings."""
        return self.kit.cos(self.yaw), self.kit.sin(self.yaw)

    def axes(self, who: Array) -> tuple[Array, Array]:
        """(P, 2) each, x and z: unit vectors to the +x side and to the front of boxes (P,)."""
        side, front = self._axes
        return side[who], front[who]

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        cos, sin = self.turn
        return self.kit.stack([cos, -sin], -1), self.kit.stack([sin, cos], -1)

    def seen(self, who: Array, points: Array) -> tuple[Array, Array]:
        """(...,) and (...,): how far points (..., 2) lie to the +x side of boxes (...,) and before them, metres."""
        off = points - self.position[who][..., ::2]
        return to_frame(off[..., 0], off[..., 1], self.turn[0][who], self.turn[1][who])

    def reach(self, i: Array, j: Array) -> tuple[Array, Array]:
        """(P,) and (P,): half extents of i along j's width and along j's front, metres."""
        turn = self.yaw[i] - self.yaw[j]
        return reach(self.size[i, 0] / 2, self.size[i, 2] / 2, abs(self.kit.cos(turn)), abs(self.kit.sin(turn)))

    def nearest_point(self, i: Array, j: Array) -> tuple[Array, Array]:
        """(P,) and (P,): lateral and forward, in j's frame, from i's centre to the nearest point of j's footprint."""
        lateral, forward = self.local(i, j)
        half, xp = self.size[j][:, ::2] / 2, self.kit
        aside = xp.minimum(xp.maximum(lateral, -half[:, 0]), half[:, 0]) - lateral
        return aside, xp.minimum(xp.maximum(forward, -half[:, 1]), half[:, 1]) - forward

    def gap(self, i: Array, j: Array) -> Array:
        """(P,): distance from i's centre to j's footprint, 0 inside it, metres."""
        lateral, forward = self.nearest_point(i, j)
        return self.kit.sqrt(at_least(lateral * lateral + forward * forward, 1e-12))

    def ahead(self, i: Array, j: Array, sign: float = 1.0) -> tuple[Array, Array, Array]:
        """(P,) each, metres: from i's front to j, of i's width that j covers, and how far j's middle lies before i's.

        `sign`: -1 looks at i's back.
        """
        lateral, forward = self.local(j, i)
        half_width, half_depth = self.reach(j, i)
        forward = sign * forward
        covered = self.kit.minimum(self.size[i, 0], self.size[i, 0] / 2 + half_width - abs(lateral))
        return forward - half_depth - self.size[i, 2] / 2, covered, forward

    def more_ahead(
        self, i: Array, j: Array, needed: float | Array, share: float | Array, *, start: float = 0.0, sign: float = 1.0
    ) -> Array:
        """(P,): how much more than `needed` metres is free before i, where j covers more than a share of its width.

        Arguments:
            start: share of i's depth before its middle from which on j counts. sign: -1 looks at i's back.
        """
        clear, covered, forward = self.ahead(i, j, sign)
        beside = self.kit.maximum(clear - needed, share * self.size[i, 0] - covered)
        return self.kit.maximum(beside, start * self.size[i, 2] - forward)

    def nearest(self, i: Array, j: Array, margin: Array, needed: float | Array) -> Found:
        """What a rule finds at boxes i (P,) that keep more than `needed` metres, or (N,) by j, to j (P,): the least."""
        least, about = self.worst(i, margin, j)
        who, needed = rows(least < FAR), self.kit.zeros_like(self.yaw) + needed
        return found(who, least[who], other=about[who], measure=at_least((least + needed[about])[who], 0.0))

    @cached_property
    def couples(self) -> tuple[Array, Array, Array]:
        """Pairs (P,), (P,) of boxes, each once, none on the other, and metres (P,) that they may overlap."""
        i, j = self.pairs(self.moved, self.moved)
        keep = (i < j) & (self.carrier[i] != j) & (self.carrier[j] != i)
        i, j = i[keep], j[keep]
        words, mine = self._words
        shared = self.numbers([shared_fraction(one, other) for one in words for other in words]).reshape(-1, 2)
        share, owner = shared[mine[i] * len(words) + mine[j]].T
        short = self.kit.minimum(held(self.size)[:, 0], held(self.size)[:, 2])
        side = self.kit.where(owner > 0, short[j], short[i])
        # chairs are tucked under their own table alone; a nightstand in its bed is moved off its wall later
        strange = (self.anchor[i] != j) & (self.anchor[j] != i)
        head = self.stands("head")
        return i, j, self.kit.where(strange | head[i] | head[j], 0.0, share * side)

    @cached_property
    def anchor(self) -> Array:
        """(N,) int64, the object that each one attends, -1 = none: as the graph states, else the nearest."""
        words, mine = self._words
        xp, table = self.kit, self._mask([b.name in kind.belongs_to for kind in words for b in words])
        belongs = table.reshape(len(words), len(words))[mine[:, None], mine[None]]
        here, other = xp.arange(len(self)), ~xp.eye(len(self), dtype=xp.bool)
        i, j = pairs_in((self.scene[:, None] == self.scene[None]) & belongs & other)
        cost = full(self.size, (len(self), len(self)), np.inf)
        centre = norm(held(self.position[i] - self.position[j])[:, ::2])
        cost[i, j] = held(self.gap(i, j)) + 0.05 * centre
        joining = self.joins >= 0
        cost[:, joining] += xp.where(self.stands("before", "opposite"), self.numbers(np.inf), 0.0)[:, None]
        for predicate in NEARNESS:
            chosen = self.triplets[self.triplets[:, 1] == vocabulary().predicate_id(predicate)]
            for a, b in ((0, 2), (2, 0)):
                cost[chosen[:, a], chosen[:, b]] -= 100.0
        if not len(self):
            return full(self.scene, 0, 0)
        best = cost.argmin(1)
        return xp.where(joining, self.joins, xp.where(xp.isfinite(cost[here, best]), best, -1))

    @cached_property
    def group(self) -> Array:
        """(N,) int64, the box that each one's group is about: whom it attends, and whom that one attends in turn.

        The fitted units of a room are one group.
        """
        xp = self.kit
        out = xp.arange(len(self))
        for _ in range(3):
            ahead = self.anchor[out]
            out = xp.where(ahead >= 0, ahead, out)
        row = self.stands("row")
        if bool(row.any()):
            for room in xp.unique(self.scene[row]):
                here = row & (self.scene == room)
                out[here[out]] = rows(here)[0]
        return out

    def kin(self, i: Array, j: Array) -> Array:
        """(P,) bool: i and j are of one group and may come close; what is only near or opposite it keeps away."""
        away = self.stands("near", "opposite")
        return (self.group[i] == self.group[j]) & ~away[i] & ~away[j]

    def apart(self, i: Array, j: Array) -> Array:
        """(P,): metres between the footprints of i and j along the axis that parts them best, negative = overlap."""
        gaps = []
        for a, b in ((i, j), (j, i)):
            lateral, forward = self.local(a, b)
            half_width, half_depth = self.reach(a, b)
            gaps.append(abs(lateral) - half_width - self.size[b, 0] / 2)
            gaps.append(abs(forward) - half_depth - self.size[b, 2] / 2)
        return self.kit.amax(self.kit.stack(gaps), 0)

    def attended(self, *slot_roles: str, to: Array | None = None) -> tuple[Array, Array]:
        """Numbers (P,), (P,) of boxes that stand so to what they attend, one of `to` (N,) bool, and of that."""
        attends = (self.anchor >= 0) & self.stands(*slot_roles)
        i = self.those(attends if to is None else attends & to[self.anchor])
        return i, self.anchor[i]

    # -- walls -------------------------------------------------------------------------------------------------------

    @cached_property
    def walls(self) -> tuple[Array, Array, Array, Array]:
        """Start (S, K, 2), direction (S, K, 2), inward normal (S, K, 2) and length (S, K) of the walls; 0 = none."""
        start, end = edges(self.floor)
        along, xp = end - start, self.kit
        length = norm(along)
        length = xp.where(length > 1e-3, length, xp.zeros_like(length))
        along = along / at_least(length, 1e-3)[..., None]
        normal = xp.stack([-along[..., 1], along[..., 0]], -1) * xp.sign(signed_area(self.floor))[:, None, None]
        length = length * known(self.floor)[:, None]
        return start, along, normal, length

    @cached_property
    def walled(self) -> Array:
        """(N,) bool, boxes of rooms whose floor is known."""
        return known(self.floor)[self.scene]

    @cached_property
    def rectangle(self) -> tuple[Array, Array] | None:
        """Middle (2,) and half extents (2,), metres, of the floor of one room if that is a rectangle along x and z."""
        corners = self.floor[0][self.kit.isfinite(self.floor[0]).all(1)]
        if len(corners) != 4 or len(self.openings) > 1:
            return None
        low, high = self.kit.amin(corners, 0), self.kit.amax(corners, 0)
        square = bool(((corners == low) | (corners == high)).all()) and bool((high > low).all())
        return ((low + high) / 2, (high - low) / 2) if square else None

    def inside(self, points: Array, who: Array) -> Array:
        """(P, Q): metres from points (P, Q, 2) at boxes (P,) to the nearest wall, negative beyond it; `FAR` without."""
        return self.kit.where(self.walled[who, None], signed_distance(points, self.floor[self.scene[who]]), FAR)

    def back_gaps(self, who: Array) -> Array:
        """(P,): metres between the backs of some boxes and the wall behind them; `FAR` where there is none."""
        start, along, normal, length = (of[self.scene[who]] for of in self.walls)
        side, front = (axis[:, None] for axis in self.axes(who))
        offset = self.position[who][:, None, ::2] - start
        turned = dot(normal, front)
        reach = abs(dot(normal, side)) * self.size[who, None, 0] / 2 + abs(turned) * self.size[who, None, 2] / 2
        gap, at = dot(offset, normal) - reach, dot(offset, along)
        past = abs(at - length / 2) - length / 2 + self.size[who, None, 0] / 2 > PAST * self.size[who, None, 0]
        behind = (length > 0) & (turned > FACING) & ~past & (gap > -1.0)
        return self.kit.amin(self.kit.where(behind, abs(gap), self.kit.full_like(gap, FAR)), 1)

    def __len__(self) -> int:
        return len(self.kinds)


def plan_of(
    boxes: BoxesLike, categories: Sequence[str], floor: Any = None,
    openings: Sequence[Opening] = (), relations: Any = None, *, fixed: np.ndarray | None = None,
    height: float | None = None, rules: str = "strict", stated: Sequence[Stated] = (),
) -> Plan:  # fmt: skip
    """The plan of one room, float64; in numpy, or in torch where the boxes are tensors.

    Arguments:
        boxes: N boxes, metres and radians, arrays or tensors. categories: N words; those outside the vocabulary are in
            the way of others and obey no rule.
        floor: (k, 2) float, corners (x, z) in the frame of the boxes, None = unknown.
        openings: doors and windows in its edges. relations: (E, 3) int, [subject, predicate id, object].
        fixed: (N,) bool, boxes that no term blames.
        height: of the ceiling, metres. rules, stated: as in `Plan`.
    """
    xp = kit(boxes.size)
    corners = np.full((1, 4, 2), np.nan) if floor is None or not len(floor) else np.asarray(floor, np.float64)[None]
    size, position, yaw = (cast(of, xp.zeros(0, dtype=xp.float64)) for of in (boxes.size, boxes.position, boxes.yaw))
    none = np.zeros(len(size), bool)
    triplets = np.zeros((0, 3), int) if relations is None else np.asarray(relations).reshape(-1, 3)
    return Plan(
        kinds_of(categories, triplets), size, position, yaw, xp.zeros(len(size), dtype=xp.int64), xp.asarray(corners),
        (tuple(openings),), xp.asarray(triplets, dtype=xp.int64),
        xp.asarray(none if fixed is None else np.asarray(fixed, bool)),
        None if height is None else xp.asarray([height], dtype=xp.float64), rules, tuple(stated),
    )  # fmt: skip


def kinds_of(categories: Sequence[str], triplets: Array) -> tuple[Category, ...]:
    """The rows of N words; an armchair that is told to be at a desk where nobody else sits is a chair of that desk, a
    stool that is told to be at a coffee table goes with the sofa of that.

    Arguments:
        categories: N words. triplets: (E, 3) int, [subject, predicate id, object].
    """
    rows = [kind_of(word) for word in categories]
    near = {vocabulary().predicate_id(word) for word in ("close_by", "facing")}
    stated = [(a, b) for a, predicate, b in np.asarray(triplets).reshape(-1, 3).tolist() if predicate in near]
    pairs = [(a, b) for a, b in (*stated, *((b, a) for a, b in stated)) if rows[b].role == "board"]
    for seat, board in pairs:
        others = any(b == board and a != seat and rows[a].stands == "at" for a, b in pairs)
        if rows[seat].role != "seat":
            continue
        if rows[board].access and rows[seat].stands == "company" and not others:
            rows[seat] = replace(rows[seat], stands="at", belongs_to=(rows[board].name,))
        elif rows[board].stands == "before" and rows[seat].stands == "at" and rows[seat].solid:
            rows[seat] = replace(rows[seat], stands="foot", belongs_to=rows[board].belongs_to)
    return tuple(rows)


def kind_of(word: str) -> Category:
    """The row of a word, `UNKNOWN` where the vocabulary has none."""
    try:
        return vocabulary().category(word)
    except ValueError:
        return UNKNOWN


def facing_angle(lateral: Array, forward: Array) -> Array:
    """Angle between a front and a direction in its frame, 0 to pi; smooth but at the front itself."""
    return kit(lateral).atan2((lateral * lateral + 1e-12) ** 0.5, forward)
