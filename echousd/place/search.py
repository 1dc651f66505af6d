"""Search: pieces and groups are moved to the poses that the objective finds cheapest, all candidates judged at once.

First every piece, anchors before those who attend them, in rooms of many pieces one put in after the other; then what
the terms that are still missed are about: single pieces and groups; then such pieces are taken out and put in anew, the
worst first. Where nothing is wrong any longer, what has little room is moved to where there is more (`Term.ease`).
The same for equal settings on any machine: costs are compared to a ten-thousandth, of equal ones the first
counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.arrays import rows, sum_of
from echomodel.boxes2d import axes
from echomodel.late import lates
from echomodel.objective import TERMS, Plan, Term, unreached
from echomodel.objective.access import to_wall
from echomodel.objective.copies import copies_of, looks_at
from echomodel.objective.table import COST, costs_of
from echomodel.rules import margins
from echomodel.rules.geometry import Spread
from echomodel.vocabulary import vocabulary
from echousd.place.geometry import beyond, depths
from echousd.place.problem import Problem
from echousd.place.proposals import SLIDES, Row, aside, height_of, out_of, out_of_habit, proposals, slots_at, twins
from echousd.place.solver import PlaceConfig

filled, involved, part_of, rebuilt, reseated, with_along = lates(
    "echousd.place.building", "filled", "involved", "part_of", "rebuilt", "reseated", "with_along"
)

JUDGED = 48  # poses that are judged at once
MANY = 12  # pieces from which on a room is built up, one piece after the other
SWEEPS = 3  # times that what misses something is looked at after the first time
EASED = 3  # times that what has little room is looked at where nothing is wrong
BUDGET, PIECES = 4500, 15  # poses that are judged in all, each a whole room; more in halls, of more pieces than that
GAIN = 1e-3  # by which a move must be better
WORTH = 0.5  # that a sweep must gain for another one
WRONG, UNEASY = 0.5, 0.1  # what a term costs that is broken, or kept so barely that it shows
GRAIN = 1e4  # costs are compared to so many parts of one
PULL, FARTHEST, TURN = 0.08, 4.0, 0.1  # for a metre from the draft, up to so many, and for looking the other way
ATTENDING = 0.25  # share of that for pieces that attend another
OF_GRAPHS = frozenset({"floor_filled"})  # terms that only more furniture meets, no other place
WHOLE = ("floor_used", "corners_used", "floor_served", "each_served")  # of all pieces, in halls of those there
FIRST = {"bed": 0.0, "sofa": 1.0, "board": 3.0, "storage": 4.0, "seat": 6.0, "screen": 7.0, "decor": 8.5, "light": 8.0}
HIT, DEEP, MISSED = 1.0, 4.0, 3.0  # before anything is judged: for running into something, per metre, and relations
WALKS = 24  # states of those judged at once that are walked through, where something cannot be walked to
ASIDE = 0.1  # metres from its axis of a group within which nobody stands to one side
ASTRAY = 1.0  # metres from its slots beyond which a box is no longer at what it attends
LIKED = 0.05  # of what slots are liked less, where chairs are seated together
NEXT = 8  # places at walls, the nearest to whom storage is told near, at which that relation is looked at
HAIR = 1e-3  # metres beyond which what a term just missed is kept
LIT = 0.35  # metres between the middles of a lamp and of what it hangs over


@dataclass(frozen=True, eq=False)
class State:
    """Where the boxes stand: position (n, 3), yaw (n,), and how much better another such pose would be liked (n,)."""

    position: np.ndarray
    yaw: np.ndarray
    taste: np.ndarray


@dataclass(frozen=True, eq=False)
class Arranged:
    """What was found: where the boxes stand; what it costs; poses judged.

    `wrong`: boxes that broken terms are about, the worst first.
    """

    state: State
    cost: float
    judged: int
    wrong: tuple[int, ...]


class Search:
    """One search in a problem; for terms that yield it does not begin anew."""

    def __init__(self, problem: Problem, terms: tuple[Term, ...] = TERMS, yields: frozenset[str] = frozenset()) -> None:
        self.problem, self.judged, self.walked, self.bare = problem, 0, False, False
        self.fine = False  # whether little moves are looked at before all others
        self.short: dict[int, list[float]] = {}  # metres by which terms about a box are just missed
        self.budget = round(BUDGET * max(1.0, len(problem.size) / PIECES))
        numbers, words = {int(number) for number in problem.triplets[:, 1]}, vocabulary().predicates
        stated = {row.name for row in words if row.id in numbers} | {"placed"}
        sizes = {row.name for row in words if row.measures == "size"} | {"scale"} | OF_GRAPHS  # of no pose
        self.terms = tuple(t for t in terms if t.name not in sizes and (t.kind != "relations" or t.name in stated))
        self.firm = np.array([term.name not in yields for term in self.terms])
        self.whole = np.array([term.name in WHOLE for term in self.terms])
        self.rooms: dict[bytes, Plan] = {}
        self.slots: dict[tuple[int, int], np.ndarray] = {}
        self.ways: dict[tuple[int, ...], tuple[list[int], list[list[Row]]]] = {}
        self.lost: dict[bytes, list[int]] = {}
        self.looks = np.array([looks_at(problem.plan, term.find) for term in self.terms])
        self.urgent: list[int] = []
        n = len(problem.size)
        at = (np.array(problem.slot_roles) == "at") & (problem.anchor >= 0)
        self.seated = at & (np.bincount(problem.anchor[at], minlength=n)[problem.anchor] > 1)  # together at a table
        self.children: list[list[int]] = [[] for _ in range(n)]
        self.screens: list[list[int]] = [[] for _ in range(n)]
        near, opposed, above = map(vocabulary().predicate_id, ("close_by", "opposite", "above"))
        kinds, stated = problem.kinds, problem.triplets.tolist()
        beside = {one: other for one, word, other in stated if word == near and kinds[one].role in ("decor", "light")}
        either = [pair for one, word, other in stated if word == opposed for pair in ((one, other), (other, one))]
        ahead = {k: i for k, i in either if kinds[k].role == "storage" and kinds[i].role in ("bed", "sofa")}
        over = {one: other for one, word, other in stated if word == above and problem.hanging[one]}
        self.alongside = self._alongside()
        for k in range(n):
            parent = int(problem.carrier[k]) if problem.carrier[k] >= 0 else int(problem.anchor[k])
            parent = ahead.get(k, beside.get(k, over.get(k, -1))) if parent < 0 else parent
            if parent >= 0 and not problem.fixed[k] and problem.slot_roles[k] != "near":
                looked_at = problem.slot_roles[k] == "opposite" or ahead.get(k) == parent
                (self.screens if looked_at else self.children)[parent].append(k)

    def _alongside(self) -> list[list[tuple[int, int]]]:
        """For each table and piece of storage the storage of walls told near it, or near such, and near whom."""
        problem, kinds = self.problem, self.problem.kinds
        near, stated = vocabulary().predicate_id("close_by"), problem.triplets.tolist()
        edges = [pair for one, word, other in stated if word == near for pair in ((one, other), (other, one))]
        walled = {
            k for k, kind in enumerate(kinds)
            if kind.wall and kind.role == "storage" and problem.standing(k) and problem.slot_roles[k] != "opposite"
            and not (problem.fixed[k] or problem.turned[k])
        }  # fmt: skip
        out: list[list[tuple[int, int]]] = [[] for _ in kinds]
        for i, kind in enumerate(kinds):
            met = [i] if i in walled or (kind.role == "board" and not kind.wall) else []
            for one in met:
                new = [k for a, k in edges if a == one and k in walled and k not in met]
                met += new
                out[i] += [(k, one) for k in new]
        return out

    # -- what it costs -----------------------------------------------------------------------------------------------

    def costs(
        self, there: np.ndarray, position: np.ndarray, yaw: np.ndarray, moved: np.ndarray, floor: bool = False
    ) -> np.ndarray:
        """(K,) float: what rooms of boxes `there` (n,) bool cost: position (K, n, 3), yaw (K, n), moved (n,) bool; for
        the use of their `floor` alone, which is quick and counts as no pose."""
        self.judged += 0 if floor else len(yaw)
        key, whole = there.tobytes(), len(there) > PIECES or bool(there.all())
        if key not in self.rooms:
            self.rooms[key] = self.problem.plan if there.all() else part_of(self.problem.plan, there)
        copies = copies_of(self.rooms[key], position[:, there], yaw[:, there], moved[there])
        asked = self.looks[:, moved].any(1) & (self.whole if floor else ~self.whole | whole)
        seen, cost = costs_of([(t, t.find(copies)) for t, ask in zip(self.terms, asked, strict=True) if ask], copies)
        return np.asarray(sum_of(copies.scene[seen.who], cost, len(yaw)))

    def faults(self, state: State, least: float = WRONG) -> tuple[float, list[int]]:
        """What a room costs in all, and the boxes that terms of at least such a cost are about, the worst first."""
        worst: dict[int, float] = {}
        room = copies_of(self.problem.plan, state.position[None], state.yaw[None], np.ones_like(self.problem.fixed))
        every = [term.find(room) for term in self.terms]
        seen, cost = costs_of(list(zip(self.terms, every, strict=True)), room)
        total = float(cost.sum())
        firm, whole = (of.repeat([len(found.who) for found in every]) for of in (self.firm, self.whole))
        self.bare = len(state.yaw) >= MANY and bool((cost[whole] > WRONG).any())
        self.short = {}
        for row in rows(firm & (cost > least)).tolist():
            for box in {int(seen.who[row]), int(seen.other[row])} - {-1}:
                worst[box] = worst.get(box, 0.0) + float(cost[row])
                if 0.0 < -seen.margin[row] < SLIDES[0]:
                    self.short.setdefault(box, []).append(HAIR - float(seen.margin[row]))
        lost = self._unreached(state.position, state.yaw)
        self.walked = bool(lost)
        for box in lost:
            worst[box] = worst.get(box, 0.0) + COST["living"][0]
            total += COST["living"][0]
        return total, sorted(worst, key=lambda box: (-round(worst[box], 4), box))

    # -- moves -------------------------------------------------------------------------------------------------------

    def group(self, i: int, there: np.ndarray, state: State) -> list[int]:
        """A box, whoever attends or stands on it and is not astray, and the lamps that hang over them."""
        out, at = [i], 0
        while at < len(out):
            for k in self.children[out[at]]:
                if there[k] and k not in out and not self._astray(state, k, out[at]):
                    out.append(k)
            at += 1
        under = [k for k in out if not self.problem.hanging[k]]
        for k in np.flatnonzero(self.problem.hanging & there).tolist() if under else ():
            away = (state.position[under] - state.position[k])[:, ::2]
            if k not in out and np.hypot(*away.T).min() < LIT:
                out.append(k)
        return out

    def _astray(self, state: State, k: int, i: int) -> bool:
        """Whether a box stands too far from where it belongs at another one to go with it."""
        if (k, i) not in self.slots:
            self.slots[k, i] = np.array(slots_at(self.problem, k, i)).reshape(-1, 4)
        side, front = axes(state.yaw[i])
        away = (state.position[k] - state.position[i])[::2]
        off = self.slots[k, i][:, :2] - (away @ side, away @ front)
        return bool(len(off)) and float(np.hypot(*off.T).min()) > ASTRAY

    def _joining(self, state: State, there: np.ndarray, i: int) -> np.ndarray:
        """(K, 4) float: poses at which those who attend a box, and are astray, stand right where they are."""
        rows = [
            out_of(state.position[k], float(state.yaw[k]) - turn, (-lateral, -forward, 0.0, more))
            for k in self.children[i]
            if there[k] and self._astray(state, k, i)
            for lateral, forward, turn, more in self.slots[k, i].tolist()
        ]
        return np.array(rows).reshape(-1, 4)

    def moved(self, state: State, there: np.ndarray, i: int) -> State:
        """The state with box i, and its group with it, at the best of its poses."""
        problem = self.problem
        if problem.fixed[i]:
            return state
        group = self.group(i, there, state)
        drawn = proposals(problem, state.position, state.yaw, there, i)
        rows = np.concatenate([drawn, self._joining(state, there, i)])
        near = aside(problem, state.position, state.yaw, i, self.fine, self.short.get(i, ()))
        little = state.taste[i] + 0.3 * near[:, 3]
        first = np.concatenate([self.tastes(i, rows), little * (not self.fine)])
        taste = np.concatenate([first[: len(rows)], little])
        rows = np.concatenate([rows, near])
        keep = self._promising(state, there, i, group, rows, first)
        rows, taste = rows[keep], taste[keep]
        states = [(state.position[None], state.yaw[None]), self.carried(state, i, group, rows)]
        tastes = [state.taste[i : i + 1], taste]
        screens = [self.group(k, there, state) for k in self.screens[i] if there[k]]
        if screens:  # it takes them along to the wall ahead
            states.append(self.carried(state, i, group, rows, screens))
            tastes.append(taste)
        along = [(k, at) for k, at in self.alongside[i] if there[k] and k not in group]
        if along:
            states.append(with_along(self, state, there, i, group, rows, along))
            tastes.append(taste)
        mirrored = self._mirrored(state, i, group)
        if mirrored is not None:  # who attends it changes sides
            here = np.array([[*state.position[i, ::2], state.yaw[i], 0.0]])
            states.append(self.carried(mirrored, i, group, np.concatenate([here, rows])))
            tastes += [state.taste[i : i + 1], taste]
        changed = np.zeros(len(state.yaw), bool)
        for stand, beds in self._beside_twin(state, there, i):
            states.append(beds)
            tastes.append(np.zeros(len(beds[1])))
            changed[stand] = True
        position, yaw = (np.concatenate(part) for part in zip(*states, strict=True))
        every = np.concatenate(tastes)
        changed[[*group, *(k for loads in screens for k in loads), *(k for k, _ in along)]] = True
        best = self.cheapest(there, position, yaw, changed, every)
        if best == 0:
            return state
        own = state.taste.copy()
        own[i] = every[best]
        return State(position[best], yaw[best], own)

    def _mirrored(self, state: State, i: int, group: list[int]) -> State | None:
        """The state with a box's group on its other sides; None where nobody of it stands to one side."""
        side, front = axes(state.yaw[i])
        others = [k for k in group if k != i and not self.problem.turned[k]]
        away = (state.position[others] - state.position[i])[:, ::2]
        if not (abs(away @ side) > ASIDE).any():
            return None
        position, yaw = state.position.copy(), state.yaw.copy()
        position[others, ::2] = state.position[i, ::2] + 2 * (away @ front)[:, None] * front - away
        yaw[others] = 2 * state.yaw[i] - state.yaw[others]
        return State(position, yaw, state.taste)

    def _beside_twin(self, state: State, there: np.ndarray, i: int) -> list[tuple[int, tuple[np.ndarray, np.ndarray]]]:
        """For a bed that shares a nightstand: that one, and the states with it between both, side by side."""
        problem, out = self.problem, []
        rows = np.array(twins(problem, state.position, state.yaw, i)).reshape(-1, 4)
        for one in problem.stated if len(rows) else ():
            stand = one.subject
            if i in one.others and there[[stand, *one.others]].all() and not problem.fixed[stand]:
                other = next(k for k in one.others if k != i)
                position, yaw = self.carried(state, i, [k for k in self.group(i, there, state) if k != stand], rows)
                level = (problem.size[stand, 2] - problem.size[[i, other], 2].mean()) / 2
                front = axes(rows[:, 2])[1]
                middle = (rows[:, :2] + state.position[other, [0, 2]]) / 2
                position[:, stand, 0], position[:, stand, 2] = (middle + level * front).T
                yaw[:, stand] = rows[:, 2]
                out.append((stand, (position, yaw)))
        return out

    def cheapest(
        self, there: np.ndarray, position: np.ndarray, yaw: np.ndarray, moved: np.ndarray, taste: np.ndarray
    ) -> int:
        """Number of the cheapest of K states, the first one where none is better by enough."""
        cost = np.round((self.costs(there, position, yaw, moved) + taste) * GRAIN)
        if self.walked and there.all():  # a walk takes as long as many poses
            first = np.argsort(cost, kind="stable")[:WALKS].tolist()
            least = np.inf
            for k in dict.fromkeys([0, *first]):
                if cost[k] <= least:  # else it is dearer even if all is reached
                    cost[k] += GRAIN * COST["living"][0] * len(self._unreached(position[k], yaw[k]))
                    least = min(least, cost[k])
                cost[k] -= GRAIN * 10.0
        best = int(cost.argmin())
        return best if cost[best] < cost[0] - GAIN * GRAIN else 0

    def _unreached(self, position: np.ndarray, yaw: np.ndarray) -> list[int]:
        key = position.tobytes() + yaw.tobytes()
        if key not in self.lost:
            self.lost[key] = [fault.object for fault in unreached(self.problem.plan.at(position, yaw))]
        return self.lost[key]

    def reseated(self, state: State, there: np.ndarray, i: int) -> State:
        """The state with those who stand around box i at one of the ways in which as many sit there."""
        seats = [k for k in self.children[i] if there[k] and not self.problem.turned[k]]
        if len(seats) < 2 or self.problem.kinds[i].role != "board":
            return state
        return reseated(self, state, there, i, seats)

    def tastes(self, i: int, rows: np.ndarray) -> np.ndarray:
        """(K,) float: how much others are liked better than these poses of a box."""
        problem = self.problem
        off = np.minimum(np.hypot(rows[:, 0] - problem.position[i, 0], rows[:, 1] - problem.position[i, 2]), FARTHEST)
        turned = 0.5 * (1 - np.cos(rows[:, 2] - problem.yaw[i]))
        hangs = problem.hanging[i]  # which no one sees turned
        share = ATTENDING if problem.anchor[i] >= 0 or hangs else 1.0
        return np.asarray(share * (PULL * off + TURN * turned * ~hangs) + 0.3 * rows[:, 3])

    def carried(
        self, state: State, i: int, group: list[int], rows: np.ndarray, screens: Sequence[list[int]] = ()
    ) -> tuple[np.ndarray, np.ndarray]:
        """(K, n, 3) and (K, n): the boxes with one at each of K poses, and its group with it as one.

        Arguments:
            screens: groups of what it looks at, that first, which go to the wall ahead of it.
        """
        problem = self.problem
        position, yaw = np.repeat(state.position[None], len(rows), 0), np.repeat(state.yaw[None], len(rows), 0)
        self._carry(position, yaw, state, i, group, rows)
        position[:, i, 1] = height_of(problem, state.position, i)
        for k, *others in screens:
            front = axes(rows[:, 2])[1]
            free = to_wall(problem.plan, np.zeros(len(rows), int), rows[:, :2], front)
            free = free - problem.size[k, 2] / 2 - problem.behind[k]
            at = np.concatenate([rows[:, :2] + free[:, None] * front, rows[:, 2:3] + np.pi], 1)
            self._carry(position, yaw, state, k, [k, *others], at)
        return position, yaw

    def _carry(
        self, position: np.ndarray, yaw: np.ndarray, state: State, i: int, group: list[int], rows: np.ndarray
    ) -> None:
        """Put box i at K poses in K states, and a group with it."""
        turn = (rows[:, 2] - state.yaw[i]) * (self.problem.slot_roles[i] != "before")  # seats stay at its sofa's sides
        cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
        away = (state.position[group] - state.position[i])[:, [0, 2]]
        position[:, group, 0] = rows[:, :1] + cos * away[:, 0] + sin * away[:, 1]
        position[:, group, 2] = rows[:, 1:2] - sin * away[:, 0] + cos * away[:, 1]
        free = np.array(group)[~self.problem.turned[group]]
        yaw[:, free] = state.yaw[free] + turn[:, None]
        yaw[:, i] = state.yaw[i] if self.problem.turned[i] else rows[:, 2]

    def _promising(
        self, state: State, there: np.ndarray, i: int, group: list[int], rows: np.ndarray, taste: np.ndarray
    ) -> np.ndarray:
        """(k,) int: the poses that run into the least, leave the floor least and break the fewest relations."""
        keep, half, alone = np.arange(len(rows)), JUDGED // 2, None
        if len(rows) > 2 * JUDGED:  # what is lost for where the box itself stands is not looked at with its group
            alone = self.hits(state, there, i, group, rows, [i])
            first = np.argsort(alone + taste, kind="stable")[:JUDGED]
            likely = self.unlikely(state, there, i, group, rows[first], alone[first])
            most = np.sort(likely + taste[first])[half - 1]
            keep = np.flatnonzero((alone < HIT) | (alone + taste <= most + 1 / GRAIN))
            alone = alone[keep]
        cost = self.unlikely(state, there, i, group, rows[keep], alone)
        order = np.argsort(np.round((cost + taste[keep]) * GRAIN), kind="stable")
        if len(order) > JUDGED:
            free = order[half:]  # some of all the others that are free, too
            free = free[cost[free] < HIT]
            some = free[np.linspace(0, len(free) - 1, half).round().astype(int)] if len(free) else free
            order = np.concatenate([order[:half], some])
            order = order[np.sort(np.unique(order, return_index=True)[1])]
        return keep[order]

    def unlikely(
        self, state: State, there: np.ndarray, i: int, group: list[int], rows: np.ndarray,
        alone: np.ndarray | None = None,
    ) -> np.ndarray:  # fmt: skip
        """(K,) float: what a box with its group runs into, leaves of the floor and breaks of relations at K poses.

        `alone`: (K,) float, `hits` of the box itself where somebody asked for them before.
        """
        along = [*group, *self.screens[i], *(k for k, _ in self.alongside[i])]  # which may go to walls
        if alone is None or len(group) > 1:
            alone = self.hits(state, there, i, group, rows, group)
        return alone + self.broken(state, there, i, rows, along)

    def broken(self, state: State, there: np.ndarray, i: int, rows: np.ndarray, along: list[int]) -> np.ndarray:
        """(K,) float: what a box at K poses breaks of its relations to those who do not go along with it."""
        edges = self.problem.triplets_of(i)
        other = np.where(edges[:, 0] == i, edges[:, 2], edges[:, 0])
        edges = edges[there[edges[:, ::2]].all(1) & ~np.isin(other, along)]
        if not len(edges):
            return np.zeros(len(rows))
        at = np.stack([rows[:, 0], np.full(len(rows), height_of(self.problem, state.position, i)), rows[:, 1]], 1)
        margin = self.margins_at(state, i, at, rows[:, 2], edges)
        return np.asarray(MISSED * (np.maximum(-margin, 0.0) + (margin < 0)).sum(1))

    def hits(
        self, state: State, there: np.ndarray, i: int, group: list[int], rows: np.ndarray, which: list[int]
    ) -> np.ndarray:
        """(K,) float: what some boxes of a group run into and leave of the floor where one of it is at K poses."""
        problem = self.problem
        position, yaw = (of[:, which] for of in self.carried(state, i, which, rows))
        apart = there.copy()
        apart[group] = False
        others, size = np.flatnonzero(apart), problem.size[which]
        deep = depths(size, position, yaw, problem.size[others], state.position[others], state.yaw[others])
        deep = np.maximum(deep - problem.shared[which][:, others], 0.0)
        out = np.maximum(beyond(problem.floor, size, position, yaw), 0.0)
        return np.asarray(((HIT * (deep > 0.01) + DEEP * deep).sum(2) + HIT * (out > 0.01) + DEEP * out).sum(1))

    def margins_at(self, state: State, i: int, at: np.ndarray, turn: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """(K, e) float: margins of relations (e, 3) of box i at poses (K, 3) and (K,), the others as in the state or in
        K states at once."""
        problem, ends, count = self.problem, stated[:, [0, 2]], len(turn) * len(stated)
        own = (ends == i)[None]
        position = np.where(own[..., None], at[:, None, None], state.position[..., ends, :]).reshape(-1, 3)
        yaw = np.where(own, turn[:, None, None], state.yaw[..., ends]).ravel()
        size, fronts = (np.tile(of[ends], (len(turn), *[1] * of.ndim)) for of in (problem.size, problem.fronts))
        asked = np.stack([2 * np.arange(count), np.tile(stated[:, 1], len(turn)), 2 * np.arange(count) + 1], 1)
        found = margins(Spread(size.reshape(-1, 3), position, yaw), asked, rules=problem.rules, center=problem.centre,
                        fronts=fronts.ravel())  # fmt: skip
        return np.asarray(found.reshape(len(turn), len(stated)))

    # -- the whole ---------------------------------------------------------------------------------------------------

    def order(self, boxes: list[int]) -> list[int]:
        """Anchors first, the large before the small, what stands on others and what hangs last."""
        problem = self.problem

        def rank(i: int) -> tuple[float, int]:
            kind, steps, at = problem.kinds[i], 0, i
            while problem.anchor[at] >= 0 and steps < 4:
                steps, at = steps + 1, int(problem.anchor[at])
            area = float(problem.size[i, 0] * problem.size[i, 2])
            first = 0.3 if problem.slot_roles[i] == "opposite" else FIRST.get(kind.role, 6.0)
            late = 20.0 if problem.carrier[i] >= 0 else 15.0 if kind.support == "ceiling" else 0.0
            late -= 5.0 * (i in self.urgent)
            return late + first + 0.5 * steps - 0.3 * min(area, 3.0), i

        return sorted(boxes, key=rank)

    def swept(self, state: State, boxes: list[int]) -> State:
        """The state after all of some boxes were moved to better places."""
        every = np.ones(len(state.yaw), bool)
        for i in self.order(boxes):
            if self.judged < self.budget:
                state = self.reseated(self.moved(state, every, i), every, i)
        return state

    def mended(self, state: State, total: float, wrong: list[int]) -> tuple[State, float, list[int]]:
        """A state after what its broken terms are about was moved, what it costs, and what still is broken."""
        for _ in range(SWEEPS):
            if not wrong or self.judged >= self.budget:
                break
            anchors = [k for k in self.problem.anchor[wrong].tolist() if k >= 0]
            after = self.swept(state, list(dict.fromkeys([*wrong, *anchors])))
            after = filled(self, after) if self.bare else after  # perhaps by who is not next to it
            before, (cost, still) = total, self.faults(after)
            if cost < before - GAIN:
                state, total, wrong = after, cost, still
            if cost > before - WORTH:
                break
        return state, total, wrong

    def run(self, anew: int = PlaceConfig.anew, begun: Arranged | None = None) -> Arranged:
        """The best state that the budget finds, pieces taken out and put in again so many times.

        `begun`: what the same search found before, from where it goes on.
        """
        state, total, wrong = self._first() if begun is None else (begun.state, *self.faults(begun.state))
        for number in range(anew):
            if not wrong or self.judged >= self.budget:
                break
            out = list(range(len(state.yaw))) if number else involved(self, wrong)
            self.urgent = wrong if number else []  # the worst first
            built = rebuilt(self, state, out)
            self.urgent = []
            after = self.swept(built, [i for i in out if not self.seated[i]])
            cost, still = self.faults(after)
            if cost < total - GAIN:
                state, total, wrong = self.mended(after, cost, still)
        if not wrong:
            state, total = self.eased(state, total)
        return Arranged(state, total, self.judged, tuple(wrong))

    def eased(self, state: State, total: float) -> tuple[State, float]:
        """A state where nothing is wrong after what has little room was moved to where there is more, and its cost."""
        usual, self.fine = self.terms, True
        eased = tuple(term.eased for term in usual)
        for _ in range(EASED):
            self.terms = eased
            before, uneasy = self.faults(state, UNEASY)
            anchors = [k for k in self.problem.anchor[uneasy].tolist() if k >= 0]
            boxes = [i for i in dict.fromkeys([*anchors, *uneasy]) if not self.seated[i]]  # who sits goes along
            after = self.swept(state, boxes)
            gained = before - self.faults(after)[0]
            self.terms = usual
            cost, wrong = self.faults(after)
            if wrong or gained < GAIN:
                break
            state, total = after, cost
            if gained < UNEASY:
                break
        self.fine = False
        return state, total

    def _first(self) -> tuple[State, float, list[int]]:
        """Where all were moved once from where they were drawn and what is missed was mended, as `mended`."""
        problem, n = self.problem, len(self.problem.size)
        at = problem.position.copy(), problem.yaw.copy()
        state = State(*at, np.array([0.02 + 0.3 * out_of_habit(problem, i, *at) for i in range(n)]))
        if n < MANY:
            state = self.swept(state, [i for i in range(n) if not self.seated[i]])
        else:  # drafts of so many pieces are too far from what is asked to begin from
            state = rebuilt(self, state, list(range(n)))
        return self.mended(state, *self.faults(state))
