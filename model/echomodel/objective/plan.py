"""What living rules look at: boxes with what their words say, walls, openings and who attends whom (torch)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from echomodel.floors import edges, known, padded, signed_area, signed_distance
from echomodel.objective.support import carriers, shared_fraction
from echomodel.openings import Opening
from echomodel.roomboxes import RoomBoxes
from echomodel.rules.geometry import BoxesLike, PairGeometry, pairs
from echomodel.rules.placements import Stated
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

    who: Tensor
    other: Tensor
    margin: Tensor
    measure: Tensor
    words: Tensor

    def take(self, rows: Tensor) -> Found:
        """Some of the rows, by number or mask."""
        return Found(self.who[rows], self.other[rows], self.margin[rows], self.measure[rows], self.words[rows])


def found(
    who: Tensor, margin: Tensor, *, other: Tensor | None = None, measure: Tensor | None = None,
    words: Tensor | None = None,
) -> Found:  # fmt: skip
    """A `Found` with what is left out filled in: nothing, the margin, the first sentence."""
    other = torch.full_like(who, -1) if other is None else other
    words = torch.zeros_like(who) if words is None else words
    return Found(who, other, margin, margin if measure is None else measure, words)


def nobody(like: Tensor) -> Found:
    """A `Found` of a rule that looks at no box of a plan, with numbers like these."""
    none, nothing = torch.zeros(0, dtype=torch.int64), like.new_zeros(0)
    return Found(none, none, nothing, nothing, none)


def worst(who: Tensor, margin: Tensor, other: Tensor, count: int, nothing: float) -> tuple[Tensor, Tensor]:
    """Of the rows (P,) of each box the least margin (count,), `nothing` where it has none, and whom that is about."""
    least = margin.new_full((count,), nothing).scatter_reduce(0, who, margin, "amin")
    about = torch.full((count,), -1, dtype=torch.int64)
    hit = margin.detach() <= least.detach()[who]
    about[who[hit]] = other[hit]
    return least, about


def joined(first: Found, second: Found) -> Found:
    """The rows of both."""
    pairs = ((getattr(one, name) for one in (first, second)) for name in ("who", "other", "margin", "measure", "words"))
    return Found(*(torch.cat(list(pair)) for pair in pairs))


# Predicates that say which anchor an object attends.
NEARNESS = ("close_by", "standing_on", "above", "facing", "opposite")
FACING = np.cos(np.radians(30.0))  # a back turned further from a wall's normal does not lean on it
FAR = 9.0  # metres, in place of the distance to something that is not there
CLEAR_HEIGHT = 0.05  # metres: a rug is in nobody's way
UNKNOWN = Category("", "", "", support="floor", role="", look="", density=0.0, ade20k="")
# What of a plan stays as it is while its boxes move.
OF_WORDS = (
    "anchor", "carrier", "group", "joins", "stance", "standing", "movable", "solid", "works", "dining", "fronts",
    "smaller", "walls", "walled", "rectangle", "_masks",
)  # fmt: skip


def _answered(asked: Callable[[Category], object]) -> cached_property[Tensor]:
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
        given: (N,) bool, boxes whose place and heading somebody stated: no term blames them.
        height: (S,) float, of the ceilings, metres, NaN = unknown; None = all unknown.
        rules: the rule set that the triplets are meant in. stated: where single boxes of the first room must stand.
    """

    kinds: tuple[Category, ...]
    size: Tensor
    position: Tensor
    yaw: Tensor
    scene: Tensor
    floor: Tensor
    openings: tuple[tuple[Opening, ...], ...]
    triplets: Tensor
    given: Tensor
    height: Tensor | None = None
    rules: str = "strict"
    stated: tuple[Stated, ...] = ()

    def at(self, position: Tensor, yaw: Tensor) -> Plan:
        """The same boxes at position (N, 3) and yaw (N,): whom each attends and what carries it stays as it is here."""
        out = replace(self, position=position, yaw=yaw)
        vars(out).update({name: getattr(self, name) for name in OF_WORDS})
        vars(out)["floor_points"] = vars(self).setdefault("floor_points", [])
        return out

    # -- words -------------------------------------------------------------------------------------------------------

    def of(self, *roles: str) -> Tensor:
        """(N,) bool, boxes with one of these roles."""
        return self._kept(("of", *roles), lambda: [kind.role in roles for kind in self.kinds])

    def stands(self, *stances: str) -> Tensor:
        """(N,) bool, boxes that stand so to what they attend (`stance`)."""
        return self._kept(("stands", *stances), lambda: [stance in stances for stance in self.stance])

    @cached_property
    def stance(self) -> tuple[str, ...]:
        """How each box stands to what it attends: `Category.stands`, and `with` for a sofa that joins a larger one."""
        joins = self.joins.tolist()
        return tuple("with" if j >= 0 else kind.stands for kind, j in zip(self.kinds, joins, strict=True))

    @cached_property
    def joins(self) -> Tensor:
        """(N,) int64, for sofas that share a coffee table with the first sofa of their room that sofa, -1 = none.

        The first is the one that most tables and screens are told to stand before or opposite, of these the largest.
        """
        out = torch.full((len(self),), -1, dtype=torch.int64)
        sofas = [k for k, kind in enumerate(self.kinds) if kind.role == "sofa" and kind.wall]
        tables = [k for k, kind in enumerate(self.kinds) if kind.stands == "before"]
        scene = self.scene.tolist()
        for room in {scene[k] for k in sofas}:
            here = [k for k in sofas if scene[k] == room]
            if len(here) < 2 or sum(scene[k] == room for k in tables) >= len(here):
                continue  # every sofa has a table of its own
            first = max(here, key=lambda k: (self._served(k), round(float(self.size[k, 0]), 2), -k))
            for k in here:
                out[k] = first if k != first else -1
        return out

    def _served(self, sofa: int) -> int:
        """How many tables and screens are told to stand before or opposite a sofa, not only near it."""
        near, served = vocabulary().predicate_id("close_by"), 0
        for a, predicate, b in self.triplets.tolist():
            other = b if a == sofa else a
            if sofa in (a, b) and predicate != near and self.kinds[other].stands in ("before", "opposite"):
                served += 1
        return served

    def which(self, asked: Callable[[Category], object]) -> Tensor:
        """(N,) bool, boxes whose row answers a question with yes."""
        return self._mask([bool(asked(kind)) for kind in self.kinds])

    def column(self, asked: Callable[[Category], Any]) -> Tensor:
        """(N, ...) float, what the rows of the boxes answer."""
        return self.numbers([asked(kind) for kind in self.kinds])

    def numbers(self, values: Sequence[Any]) -> Tensor:
        """Numbers as a tensor like the boxes."""
        return torch.tensor(values, dtype=self.size.dtype, device=self.size.device)

    # (N,) bool: seats that are moved aside to open or to reach something, and those without a front, stools;
    # boxes at whose front somebody works or takes things out, and those that have one; tables that people sit around
    movable = _answered(lambda kind: kind.role == "seat" and not kind.access)
    solid = _answered(lambda kind: kind.solid)
    works = _answered(lambda kind: kind.access > 0)
    fronts = _answered(lambda kind: kind.front)
    dining = _answered(lambda kind: kind.role == "board" and not (kind.access or kind.wall))

    @cached_property
    def smaller(self) -> Tensor:
        """(N,) int64, order of the boxes by volume, of equal ones the later first."""
        return torch.argsort(torch.argsort(self.size.detach().prod(1).flip(0), stable=True)).flip(0)

    def _kept(self, asked: tuple[str, ...], values: Callable[[], list[bool]]) -> Tensor:
        """A mask that is asked for again and again."""
        if asked not in self._masks:
            self._masks[asked] = self._mask(values())
        return self._masks[asked]

    @cached_property
    def _masks(self) -> dict[tuple[str, ...], Tensor]:
        return {}

    def _mask(self, values: Sequence[bool]) -> Tensor:
        return torch.tensor(values, dtype=torch.bool, device=self.size.device)

    @cached_property
    def standing(self) -> Tensor:
        """(N,) bool, boxes that stand on the floor and are in the way of legs and doors."""
        return self.which(lambda kind: kind.support == "floor") & (self.position[:, 1].detach() < 0.3)

    @cached_property
    def carrier(self) -> Tensor:
        """(N,) int64, what each box stands on, as `support.carriers`."""
        boxes = (value.detach().cpu().double().numpy() for value in (self.size, self.position, self.yaw))
        size, position, yaw = boxes
        scene, triplets = self.scene.numpy(), self.triplets.numpy()
        out = np.empty(len(self), int)
        for room in np.unique(scene):
            here = np.flatnonzero(scene == room)
            number = np.full(len(self), -1)
            number[here] = np.arange(len(here))
            told = triplets[(scene[triplets[:, 0]] == room)] if len(triplets) else triplets
            local = np.stack([number[told[:, 0]], told[:, 1], number[told[:, 2]]], 1) if len(told) else told
            found = carriers([self.kinds[k] for k in here], size[here], position[here], yaw[here], local)
            out[here] = np.where(found >= 0, here[found.clip(0)], found)
        return torch.from_numpy(out)

    @cached_property
    def rooms(self) -> list[tuple[Tensor, np.ndarray, tuple[Opening, ...]]]:
        """Numbers (s,) of the rooms that share a floor and its openings, its corners (k, 2), and these; known ones."""
        out = []
        for number, openings in enumerate(self.openings):
            corners = self.floor[number][torch.isfinite(self.floor[number]).all(1)].detach().cpu().numpy()
            if len(corners) > 2:
                out.append((torch.tensor([number]), corners, openings))
        return out

    @property
    def first(self) -> Plan:
        """The plan whose floors are these, and whose words are said of all copies of it."""
        return self

    @property
    def moved(self) -> Tensor:
        """(N,) bool, boxes that do not stand alike in all rooms."""
        return torch.ones(len(self), dtype=torch.bool)

    @cached_property
    def ceiling(self) -> Tensor:
        """(N,) float, height of the ceiling over each box, metres; NaN = unknown."""
        if self.height is None:
            return torch.full_like(self.yaw, torch.nan)
        return self.height.to(self.yaw)[self.scene]

    @cached_property
    def centres(self) -> Tensor:
        """(N, 3) float, middle of the bounding box of each box's floor, on the floor, metres; 0 where it is unknown."""
        corners = torch.where(torch.isfinite(self.floor), self.floor, self.floor[:, :1])
        middle = torch.nan_to_num((corners.amax(1) + corners.amin(1)) / 2).to(self.size)
        return torch.stack([middle[:, 0], torch.zeros_like(middle[:, 0]), middle[:, 1]], 1)[self.scene]

    def told(self, predicate: str) -> tuple[Tensor, Tensor]:
        """Subjects (P,) and objects (P,) of the relations of one name that the graphs state."""
        (i, _, j), rows = self.stated_pairs, self.rows_of(predicate)
        return i[rows], j[rows]

    @cached_property
    def stated_pairs(self) -> tuple[Tensor, Tensor, Tensor]:
        """Subjects, predicates and objects (E,) of all relations that the graphs state."""
        return self.triplets[:, 0], self.triplets[:, 1], self.triplets[:, 2]

    def rows_of(self, predicate: str) -> Tensor:
        """Which of the `stated_pairs` have a predicate."""
        return (self.stated_pairs[1] == vocabulary().predicate_id(predicate)).nonzero()[:, 0]

    @cached_property
    def pair_geometry(self) -> PairGeometry:
        """The geometry of the `stated_pairs`, which all relations share."""
        i, _, j = self.stated_pairs
        return pairs(self, i, j, self.centres, oriented=rule_set(self.rules).oriented, fronts=self.fronts)

    def everywhere(self, number: int) -> Tensor:
        """(1,) int64, a box of the first room; of copies of one room (K,), in each of them."""
        return torch.tensor([number])

    # -- pairs -------------------------------------------------------------------------------------------------------

    def those(self, mask: Tensor) -> Tensor:
        """(P,) int64, numbers of the boxes of a mask (N,) bool."""
        return mask.nonzero()[:, 0]

    def pairs(self, first: Tensor, second: Tensor, *, least: bool = False) -> tuple[Tensor, Tensor]:
        """Numbers (P,), (P,) of all ordered pairs of different boxes of one room, the first of `first` (N,) bool.

        Arguments:
            first, second: (N,) bool, by the words of boxes and what stands alike in copies, never by their poses.
            least: the rows go to `worst`, which alone knows what pairs are left out of copies of one room.
        """
        together = (self.scene[:, None] == self.scene[None]) & first[:, None] & second[None]
        together.fill_diagonal_(False)
        i, j = together.nonzero(as_tuple=True)
        return i, j

    def beside(self, i: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
        """Rows (Q,) of boxes i (P,), and the boxes (Q,) of others (N,) bool that stand in the same room."""
        row, k = ((self.scene[i][:, None] == self.scene[None]) & others).nonzero(as_tuple=True)
        return row, k

    def worst(self, who: Tensor, margin: Tensor, other: Tensor) -> tuple[Tensor, Tensor]:
        """Of the rows (P,) of each box the least margin (N,), `FAR` where it has none, and whom that is about."""
        return worst(who, margin, other, len(self), FAR)

    def local(self, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
        """(P,) and (P,): how far i's centre lies to j's +x side and before j's centre, metres."""
        dx, dz = self.position[i, 0] - self.position[j, 0], self.position[i, 2] - self.position[j, 2]
        cos, sin = self.turn[0][j], self.turn[1][j]
        return cos * dx - sin * dz, sin * dx + cos * dz

    @cached_property
    def turn(self) -> tuple[Tensor, Tensor]:
        """(N,) and (N,) float, cosine and sine of the headings."""
        return self.yaw.cos(), self.yaw.sin()

    def axes(self, who: Tensor) -> tuple[Tensor, Tensor]:
        """(P, 2) each, x and z: unit vectors to the +x side and to the front of boxes (P,)."""
        cos, sin = self.turn[0][who], self.turn[1][who]
        return torch.stack([cos, -sin], -1), torch.stack([sin, cos], -1)

    def seen(self, who: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """(...,) and (...,): how far points (..., 2) lie to the +x side of boxes (...,) and before them, metres."""
        off = points - self.position[who][..., [0, 2]]
        cos, sin = self.turn[0][who], self.turn[1][who]
        return cos * off[..., 0] - sin * off[..., 1], sin * off[..., 0] + cos * off[..., 1]

    def reach(self, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
        """(P,) and (P,): half extents of i along j's width and along j's front, metres."""
        turn = self.yaw[i] - self.yaw[j]
        cos, sin = turn.cos().abs(), turn.sin().abs()
        width, depth = self.size[i, 0] / 2, self.size[i, 2] / 2
        return cos * width + sin * depth, sin * width + cos * depth

    def nearest_point(self, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
        """(P,) and (P,): lateral and forward, in j's frame, from i's centre to the nearest point of j's footprint."""
        lateral, forward = self.local(i, j)
        half = self.size[j][:, [0, 2]] / 2
        aside = torch.minimum(torch.maximum(lateral, -half[:, 0]), half[:, 0]) - lateral
        return aside, torch.minimum(torch.maximum(forward, -half[:, 1]), half[:, 1]) - forward

    def gap(self, i: Tensor, j: Tensor) -> Tensor:
        """(P,): distance from i's centre to j's footprint, 0 inside it, metres."""
        lateral, forward = self.nearest_point(i, j)
        return (lateral.square() + forward.square()).clamp_min(1e-12).sqrt()

    def ahead(self, i: Tensor, j: Tensor, sign: float = 1.0) -> tuple[Tensor, Tensor, Tensor]:
        """(P,) each, metres: from i's front to j, of i's width that j covers, and how far j's middle lies before i's.

        `sign`: -1 looks at i's back.
        """
        lateral, forward = self.local(j, i)
        half_width, half_depth = self.reach(j, i)
        forward = sign * forward
        covered = torch.minimum(self.size[i, 0], self.size[i, 0] / 2 + half_width - lateral.abs())
        return forward - half_depth - self.size[i, 2] / 2, covered, forward

    def more_ahead(
        self, i: Tensor, j: Tensor, needed: float | Tensor, share: float, *, start: float = 0.0, sign: float = 1.0
    ) -> Tensor:
        """(P,): how much more than `needed` metres is free before i, where j covers more than a share of its width.

        Arguments:
            start: share of i's depth before its middle from which on j counts. sign: -1 looks at i's back.
        """
        clear, covered, forward = self.ahead(i, j, sign)
        beside = torch.maximum(clear - needed, share * self.size[i, 0] - covered)
        return torch.maximum(beside, start * self.size[i, 2] - forward)

    def nearest(self, i: Tensor, j: Tensor, margin: Tensor, needed: float) -> Found:
        """What a rule finds at boxes i (P,) that keep more than `needed` metres to j (P,), the least of each."""
        least, about = self.worst(i, margin, j)
        who = (least < FAR).nonzero()[:, 0]
        return found(who, least[who], other=about[who], measure=(least[who] + needed).clamp_min(0.0))

    @cached_property
    def couples(self) -> tuple[Tensor, Tensor, Tensor]:
        """Pairs (P,), (P,) of boxes, each once, none on the other, and metres (P,) that they may overlap."""
        every = torch.ones(len(self), dtype=torch.bool)
        i, j = self.pairs(every, every)
        keep = (i < j) & (self.carrier[i] != j) & (self.carrier[j] != i)
        i, j = i[keep], j[keep]
        known = {pair: shared_fraction(*pair) for pair in {(self.kinds[a], self.kinds[b]) for a, b in _listed(i, j)}}
        rows = [known[self.kinds[a], self.kinds[b]] for a, b in _listed(i, j)]
        share, owner = self.numbers([row[0] for row in rows]), torch.tensor([row[1] for row in rows], dtype=torch.bool)
        side = torch.where(owner, self.size[j][:, [0, 2]].amin(1), self.size[i][:, [0, 2]].amin(1)).detach()
        # chairs are tucked under their own table alone; a nightstand in its bed is moved off its wall later
        strange = (self.anchor[i] != j) & (self.anchor[j] != i)
        head = self.stands("head")
        return i, j, torch.where(strange | head[i] | head[j], 0.0, share * side)

    @cached_property
    def anchor(self) -> Tensor:
        """(N,) int64, the object that each one attends, -1 = none: as the graph states, else the nearest."""
        words = list(dict.fromkeys(self.kinds))
        number = {kind: k for k, kind in enumerate(words)}
        mine = torch.tensor([number[kind] for kind in self.kinds], dtype=torch.int64)
        table = self._mask([b.name in kind.belongs_to for kind in words for b in words])
        belongs = table.reshape(len(words), len(words))[mine[:, None], mine[None]]
        together = (self.scene[:, None] == self.scene[None]) & belongs
        together.fill_diagonal_(False)
        cost = torch.full(together.shape, torch.inf, dtype=self.size.dtype)
        i, j = together.nonzero(as_tuple=True)
        with torch.no_grad():
            centre = (self.position[i] - self.position[j])[:, [0, 2]].norm(dim=1)
            cost[i, j] = (self.gap(i, j) + 0.05 * centre).to(cost)
        joining = self.joins >= 0
        cost[:, joining] += torch.where(self.stands("before", "opposite"), torch.inf, 0.0)[:, None].to(cost)
        for predicate in NEARNESS:
            chosen = self.triplets[self.triplets[:, 1] == vocabulary().predicate_id(predicate)]
            for a, b in ((0, 2), (2, 0)):
                cost[chosen[:, a], chosen[:, b]] -= 100.0
        if not len(self):
            return torch.zeros(0, dtype=torch.int64)
        best, found = cost.min(1)
        return torch.where(joining, self.joins, torch.where(torch.isfinite(best), found, -1))

    @cached_property
    def group(self) -> Tensor:
        """(N,) int64, the box that each one's group is about: whom it attends, and whom that one attends in turn.

        The fitted units of a room are one group.
        """
        out = torch.arange(len(self))
        for _ in range(3):
            ahead = self.anchor[out]
            out = torch.where(ahead >= 0, ahead, out)
        row = self.stands("row")
        if bool(row.any()):
            for room in self.scene[row].unique():
                here = row & (self.scene == room)
                out[here[out]] = here.nonzero()[0, 0]
        return out

    def kin(self, i: Tensor, j: Tensor) -> Tensor:
        """(P,) bool: i and j are of one group and may come close; what is only near or opposite it keeps away."""
        away = self.stands("near", "opposite")
        return (self.group[i] == self.group[j]) & ~away[i] & ~away[j]

    def apart(self, i: Tensor, j: Tensor) -> Tensor:
        """(P,): metres between the footprints of i and j along the axis that parts them best, negative = overlap."""
        gaps = []
        for a, b in ((i, j), (j, i)):
            lateral, forward = self.local(a, b)
            half_width, half_depth = self.reach(a, b)
            gaps.append(lateral.abs() - half_width - self.size[b, 0] / 2)
            gaps.append(forward.abs() - half_depth - self.size[b, 2] / 2)
        return torch.stack(gaps, -1).amax(-1)

    def attended(self, *stances: str, to: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Numbers (P,), (P,) of boxes that stand so to what they attend, one of `to` (N,) bool, and of that."""
        attends = (self.anchor >= 0) & self.stands(*stances)
        i = self.those(attends if to is None else attends & to[self.anchor])
        return i, self.anchor[i]

    # -- walls -------------------------------------------------------------------------------------------------------

    @cached_property
    def walls(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Start (S, K, 2), direction (S, K, 2), inward normal (S, K, 2) and length (S, K) of the walls; 0 = none."""
        start, end = edges(self.floor)
        along = end - start
        length = along.norm(dim=-1)
        length = torch.where(length > 1e-3, length, torch.zeros_like(length))
        along = along / length.clamp_min(1e-3)[..., None]
        normal = torch.stack([-along[..., 1], along[..., 0]], -1) * torch.sign(signed_area(self.floor))[:, None, None]
        length = length * known(self.floor)[:, None]
        return start, along, normal, length

    @cached_property
    def walled(self) -> Tensor:
        """(N,) bool, boxes of rooms whose floor is known."""
        return known(self.floor)[self.scene]

    @cached_property
    def rectangle(self) -> tuple[Tensor, Tensor] | None:
        """Middle (2,) and half extents (2,), metres, of the floor of one room if that is a rectangle along x and z."""
        corners = self.floor[0][torch.isfinite(self.floor[0]).all(1)]
        if len(corners) != 4 or len(self.openings) > 1:
            return None
        low, high = corners.amin(0), corners.amax(0)
        square = bool(((corners == low) | (corners == high)).all()) and bool((high > low).all())
        return ((low + high) / 2, (high - low) / 2) if square else None

    def inside(self, points: Tensor, who: Tensor) -> Tensor:
        """(P, Q): metres from points (P, Q, 2) at boxes (P,) to the nearest wall, negative beyond it; `FAR` without."""
        return torch.where(self.walled[who, None], signed_distance(points, self.floor[self.scene[who]]), FAR)

    def back_gaps(self, who: Tensor) -> Tensor:
        """(P,): metres between the backs of some boxes and the wall behind them; `FAR` where there is none."""
        start, along, normal, length = (of[self.scene[who]] for of in self.walls)
        side, front = (axis[:, None] for axis in self.axes(who))
        offset = self.position[who][:, None, [0, 2]] - start
        reach = (normal * side).sum(-1).abs() * self.size[who, None, 0] / 2
        reach = reach + (normal * front).sum(-1).abs() * self.size[who, None, 2] / 2
        gap = (offset * normal).sum(-1) - reach
        at = (offset * along).sum(-1)
        behind = (length > 0) & ((normal * front).sum(-1) > FACING) & (at > -0.1) & (at < length + 0.1) & (gap > -1.0)
        return torch.where(behind, gap.abs(), torch.full_like(gap, FAR)).amin(1)

    def __len__(self) -> int:
        return len(self.kinds)


def plan_of(
    boxes: BoxesLike, categories: Sequence[str], floor: np.ndarray | Tensor | None = None,
    openings: Sequence[Opening] = (), relations: np.ndarray | Tensor | None = None, *, given: np.ndarray | None = None,
    height: float | None = None, rules: str = "strict", stated: Sequence[Stated] = (),
    dtype: torch.dtype = torch.float64,
) -> Plan:  # fmt: skip
    """The plan of one room.

    Arguments:
        boxes: N boxes, metres and radians, arrays or tensors. categories: N words; those outside the vocabulary are in
            the way of others and obey no rule.
        floor: (k, 2) float, corners (x, z) in the frame of the boxes, None = unknown.
        openings: doors and windows in its edges. relations: (E, 3) int, [subject, predicate id, object].
        given: (N,) bool, boxes that no term blames.
        height: of the ceiling, metres. rules, stated: as in `Plan`.
    """
    corners = torch.full((1, 4, 2), torch.nan, dtype=dtype)
    if floor is not None and len(floor):
        corners = torch.as_tensor(np.asarray(floor), dtype=dtype)[None]
    size = torch.as_tensor(boxes.size).to(dtype)
    none = np.zeros(len(size), bool)
    triplets = np.zeros((0, 3), int) if relations is None else np.asarray(relations)
    position, yaw = (torch.as_tensor(values).to(dtype) for values in (boxes.position, boxes.yaw))
    return Plan(
        kinds_of(categories, triplets), size, position, yaw, torch.zeros(len(size), dtype=torch.int64), corners,
        (tuple(openings),), torch.as_tensor(triplets, dtype=torch.int64).reshape(-1, 3),
        torch.as_tensor(none if given is None else np.asarray(given, bool)),
        None if height is None else torch.tensor([height], dtype=dtype), rules, tuple(stated),
    )  # fmt: skip


def plan_of_rooms(rooms: Sequence[RoomBoxes]) -> Plan:
    """The plan of many rooms at once, of what their relations state; float32, as sets of rooms are kept."""
    sizes = [len(room) for room in rooms]
    told = [np.zeros((0, 3), int) if room.relations is None else room.relations for room in rooms]
    shift = np.cumsum([0, *sizes[:-1]])
    columns = ((getattr(room, name) for room in rooms) for name in ("size", "position", "yaw"))
    size, position, yaw = (torch.as_tensor(np.concatenate(list(of)), dtype=torch.float32) for of in columns)
    floors = [torch.as_tensor(room.floor_polygon, dtype=torch.float32).reshape(1, -1, 2) for room in rooms]
    return Plan(
        tuple(kind for room, t in zip(rooms, told, strict=True) for kind in kinds_of(room.categories, t)),
        size, position, yaw, torch.arange(len(rooms)).repeat_interleave(torch.tensor(sizes)), padded(floors),
        tuple(tuple(room.openings) for room in rooms),
        torch.as_tensor(np.concatenate([t + np.array([k, 0, k]) for t, k in zip(told, shift, strict=True)])),
        torch.zeros(sum(sizes), dtype=torch.bool), torch.tensor([room.height for room in rooms]),
    )  # fmt: skip


def _listed(i: Tensor, j: Tensor) -> list[tuple[int, int]]:
    return list(zip(i.tolist(), j.tolist(), strict=True))


def kinds_of(categories: Sequence[str], triplets: np.ndarray | Tensor) -> tuple[Category, ...]:
    """The rows of N words; an armchair that is told to be at a desk where nobody else sits is a chair of that desk.

    Arguments:
        categories: N words. triplets: (E, 3) int, [subject, predicate id, object].
    """
    rows = [kind_of(word) for word in categories]
    near = {vocabulary().predicate_id(word) for word in ("close_by", "facing")}
    told = [(a, b) for a, predicate, b in np.asarray(triplets).reshape(-1, 3).tolist() if predicate in near]
    pairs = [(a, b) for a, b in (*told, *((b, a) for a, b in told)) if rows[b].role == "board" and rows[b].access]
    for seat, desk in pairs:
        others = any(b == desk and a != seat and rows[a].stands == "at" for a, b in pairs)
        if rows[seat].role == "seat" and rows[seat].stands == "company" and not others:
            rows[seat] = replace(rows[seat], stands="at", belongs_to=(rows[desk].name,))
    return tuple(rows)


def kind_of(word: str) -> Category:
    """The row of a word, `UNKNOWN` where the vocabulary has none."""
    try:
        return vocabulary().category(word)
    except ValueError:
        return UNKNOWN


def facing_angle(lateral: Tensor, forward: Tensor) -> Tensor:
    """Angle between a front and a direction in its frame, 0 to pi; smooth but at the front itself."""
    return torch.atan2((lateral.square() + 1e-12).sqrt(), forward)
