"""Arrange: choose for every piece, in turn, the cheapest of the poses that a person would try, near the draft.

Greedy with a squeaky wheel (Joslin and Clements 1999): what ends badly comes earlier in the next round; the best round
counts. Then each piece is offered a better place among all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echousd.repair.arrange.attending import expect_followers
from echousd.repair.arrange.costs import least, price, soon_told
from echousd.repair.arrange.groups import make_way, paid_by, slide_groups
from echousd.repair.arrange.overlaps import depths
from echousd.repair.arrange.places import places
from echousd.repair.arrange.seating import seat_evenly
from echousd.repair.arrange.setting import Poses, Setting, State
from echousd.repair.arrange.spread import bareness

ROUNDS = 4  # orders that are tried
CROWD = 200  # boxes of all rounds together
SWEEPS = 1  # times that every piece is offered a better place
BLOCK, FEW = 64, 24  # poses that are looked at together at first, and those that are priced before the others
HAIR = 1e-9  # of rounding in sums of the same costs in another order
CLOSE = 0.5  # metres: what is so near is in the way
BAD = 1.8  # a piece that pays more comes earlier in the next round
SCREEN = 0.3  # of what a screen stands on: right after its sofa or bed, before all that keeps out of the view
FIRST = {"bed": 0.0, "sofa": 1.0, "board": 3.0, "storage": 4.0, "seat": 6.0, "screen": 7.0, "decor": 8.5, "light": 8.0}


@dataclass(frozen=True, eq=False)
class Arranged:
    """Where the boxes stand: position (n, 3), yaw (n,), what each one pays there (n,), and what bare floor costs."""

    position: np.ndarray
    yaw: np.ndarray
    paid: np.ndarray
    bare: float

    @property
    def total(self) -> float:
        """What all pay together."""
        return float(self.paid.sum()) + self.bare


def arrange(setting: Setting, *, rounds: int | None = None) -> Arranged:
    """The best arrangement of some rounds; the same for equal settings.

    Arguments:
        setting: the room, its boxes and where they were drawn.
        rounds: orders to try; None = `ROUNDS`, fewer for very many boxes.
    """
    rounds = rounds or max(1, min(ROUNDS, CROWD // max(len(setting.size), 1)))
    rank = np.array([_rank(setting, i) for i in range(len(setting.size))])
    regrets: dict[int, list[tuple[float, float, float, float]]] = {}
    best: Arranged | None = None
    for number in range(rounds):
        found = _built(setting, np.argsort(rank, kind="stable"), regrets, shoved=number == 0)
        if best is None or found.total < best.total - 1e-9:
            best = found
        bad = found.paid > BAD
        if not bad.any():
            break
        rank = rank - np.where(bad, 2.5, 0.0)
        for i, paid in _blamed(setting, found).items():
            x, _, z = found.position[i].tolist()
            regrets.setdefault(i, []).append((x, z, float(found.yaw[i]), paid))
    assert best is not None
    return best


def _blamed(setting: Setting, found: Arranged) -> dict[int, float]:
    """Boxes whose poses led to what bad ones pay: what they attend, are told of or have in their way."""
    out: dict[int, float] = {}
    for i in np.flatnonzero(found.paid > BAD).tolist():
        ties = setting.triplets[(setting.triplets[:, [0, 2]] == i).any(1)][:, [0, 2]]
        tied = {int(setting.anchor[i]), *ties.ravel().tolist()} - {-1, i}
        for j in tied | _crowding(setting, found, i):
            if not setting.fixed[j]:
                share = 0.6 if j == setting.anchor[i] else 0.3
                out[j] = min(out.get(j, 0.0) + share * float(found.paid[i]), 6.0)
    return out


def _crowding(setting: Setting, found: Arranged, i: int) -> set[int]:
    """What stands close to a box and is of another group."""
    if not setting.standing(i):
        return set()
    here = Poses(found.position[i : i + 1], found.yaw[i : i + 1], np.zeros(1))
    gap = -depths(setting.size[i], here, setting.size, found.position, found.yaw)[0]
    near = (gap < CLOSE) & (setting.group != setting.group[i])
    return {j for j in np.flatnonzero(near).tolist() if setting.standing(j)}


def _rank(setting: Setting, i: int) -> float:
    """Fixed things first, then what others attend, the large before the small, what stands on others last."""
    if setting.fixed[i]:
        return -100.0
    kind = setting.kinds[i]
    rank = (SCREEN if setting.stances[i] == "opposite" else FIRST.get(kind.role, 6.0)) - 0.3 * min(
        float(setting.size[i, 0] * setting.size[i, 2]), 3.0
    )
    steps, at = 0, i
    while setting.anchor[at] >= 0 and steps < 4:
        steps, at = steps + 1, int(setting.anchor[at])
    if setting.carrier[i] >= 0:
        return 20.0 + steps
    return (15.0 if kind.support == "ceiling" else 0.0) + rank + 0.5 * steps


def _built(
    setting: Setting,
    order: np.ndarray,
    regrets: dict[int, list[tuple[float, float, float, float]]],
    *,
    shoved: bool,
) -> Arranged:
    n = len(setting.size)
    state = State(setting.draft.copy(), setting.heading.copy(), np.zeros(n, bool), regrets)
    own, paid = np.zeros(n), np.zeros(n)
    order = np.array(_anchors_first(setting, order), int)
    for i in order:
        own[i], _ = _put(setting, state, int(i))
        expect_followers(setting, state, int(i))
    attended = set(setting.anchor.tolist()) | set(setting.carrier.tolist())
    for _ in range(SWEEPS):  # what others attend stays: they would not follow
        for i in order:
            if int(i) not in attended:
                own[i], _ = _put(setting, state, int(i))
    state.regrets = {}  # what others paid in earlier rounds is no part of what this one costs
    state.placed[setting.hanging] = False
    slide_groups(setting, state, own)
    seat_evenly(setting, state, own)
    if shoved:  # in other rounds another order does
        make_way(setting, state, own)
    for i in order:  # lamps follow what they light
        if setting.hanging[i]:
            own[i], _ = _put(setting, state, int(i))
    for i in order:
        paid[i] = paid_by(setting, state, int(i), own)
    return Arranged(state.position, state.yaw, paid, bareness(setting, state))


def _anchors_first(setting: Setting, order: np.ndarray) -> list[int]:
    """The order, but nothing before what it attends, stands on or must stand between."""
    out: list[int] = []

    def add(i: int, path: tuple[int, ...] = ()) -> None:
        if i in out or i in path:
            return
        named = [k for one in setting.stated if one.subject == i for k in one.others]
        for before in (int(setting.carrier[i]), int(setting.anchor[i]), *named):
            if before >= 0:
                add(before, (*path, i))
        out.append(i)

    for i in order:
        add(int(i))
    return out


def _put(setting: Setting, state: State, i: int) -> tuple[float, float]:
    """Put box i at its cheapest pose; what that pose costs by itself, and what it costs among the others.

    Poses are looked at in the order of what they cost at the least, until none that is left can be cheaper; of a block
    those alone are priced whose parts that are soon told leave that open. Of equal ones the first counts.
    """
    poses = places(setting, state, i)
    bound = least(setting, state, i, poses)
    order = np.argsort(bound, kind="stable")
    best, rank, start, count = np.inf, 0, 0, BLOCK
    while start < len(order) and bound[order[start]] < best:
        rows = order[start : start + count]
        block = poses.take(rows)
        known = soon_told(setting, state, i, block, bound[rows])
        promising = np.argsort(known.floor, kind="stable")
        for few in (promising[:FEW], promising[FEW:]):
            few = np.sort(few[known.floor[few] < best + HAIR])
            if not len(few):
                break
            cost = price(setting, state, i, block.take(few), known.take(few), best + HAIR)
            best, rank = min((best, rank), (float(cost.min()), start + int(few[cost.argmin()])))
        start, count = start + count, 4 * count
    at = int(order[rank])
    state.position[i], state.yaw[i], state.placed[i] = poses.position[at], poses.yaw[at], True
    return float(poses.price[at]), best
