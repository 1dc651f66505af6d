"""A room built up again: pieces taken out and put in one after the other, seats anew, storage along its walls."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby, product

import numpy as np

from echomodel.boxes2d import hull
from echomodel.compiled import linear_sum_assignment
from echomodel.objective import Plan
from echomodel.objective.sizes import places_of
from echousd.place.geometry import depths, gaps
from echousd.place.problem import Problem
from echousd.place.proposals import along_walls, out_of, proposals, slot_role, slots_at
from echousd.place.search import DEEP, FARTHEST, GRAIN, HIT, JUDGED, LIKED, NEXT, Search, State
from echousd.place.slots import Row


def rebuilt(search: Search, state: State, out: list[int]) -> State:
    """The state with some boxes taken out and put in again, one after the other.

    With each come those who attend it, at the first of their slots, so that room is found for them, too.
    """
    there = np.ones(len(state.yaw), bool)
    there[out] = False
    there |= search.problem.fixed
    for i in search.order([k for k in out if not there[k]]):
        if there[i] and search.seated[i]:  # with its table
            continue
        there[i] = True
        state = expecting(search, state, there, i)
        state = search.reseated(search.moved(state, there, i), there, i)
    return state


def expecting(search: Search, state: State, there: np.ndarray, i: int) -> State:
    """The state with those who attend box i, and are not there, at their slots; they are there then.

    So are screens, and what is told near it, which go to the walls that are near each of its poses.
    """
    problem, attending = search.problem, search.children[i]
    for k in [*attending, *search.screens[i], *(k for k, _ in search.alongside[i])]:
        slots = sorted(slots_at(problem, k, i), key=lambda slot: slot[3]) if k in attending else []
        if there[k] or (k in attending and not slots):
            continue
        rows = np.array([out_of(state.position[i], float(state.yaw[i]), slot) for slot in slots]).reshape(-1, 4)
        if len(rows):
            group = search.group(k, there, state)
            at, turn = search.carried(state, k, group, rows)
            others = np.setdiff1d(np.flatnonzero(there), group)
            deep = depths(problem.size[k], at[:, k], turn[:, k], problem.size[others], state.position[others],
                          state.yaw[others])  # fmt: skip
            hit = np.maximum(deep - problem.shared[k, others], 0.0).max(1, initial=0.0)
            best = int(np.round(hit * 100).argmin())
            state = State(at[best], turn[best], state.taste)
        there[k] = True
    return state


def involved(search: Search, boxes: list[int]) -> list[int]:
    """Boxes, whom they attend, and who attends these."""
    out = list(boxes)
    for i in boxes:
        anchor = int(search.problem.anchor[i])
        out += [anchor] if anchor >= 0 else []
        out += search.children[anchor if anchor >= 0 else i] + search.children[i]
    return [i for n, i in enumerate(out) if i not in out[:n]]


def filled(search: Search, state: State) -> State:
    """The state with that piece, and its group, elsewhere that makes most of the floor, if all is better so."""
    problem, every, number = search.problem, np.ones(len(state.yaw), bool), np.arange(len(state.yaw))
    pieces = [i for i in number.tolist() if problem.standing(i) and not (problem.fixed[i] or search.seated[i])]
    tried = [(state.position[None], state.yaw[None], np.zeros((1, len(number))))]
    for i in pieces:
        group = search.group(i, every, state)
        rows = proposals(problem, state.position, state.yaw, every, i)
        alone = search.hits(state, every, i, group, rows, [i])
        rows, alone = rows[alone < HIT], alone[alone < HIT]
        cost = search.unlikely(state, every, i, group, rows, alone)
        rows, cost = rows[cost < HIT], cost[cost < HIT]
        if len(rows):
            taste, (position, yaw) = search.tastes(i, rows), search.carried(state, i, group, rows)
            cost = cost + taste + search.costs(every, position, yaw, np.isin(number, group), floor=True)
            few = np.argsort(np.round(cost * GRAIN), kind="stable")[: max(2, JUDGED // len(pieces))]  # judged in full
            tried.append((position[few], yaw[few], np.outer(taste[few] - state.taste[i], number == i)))
    position, yaw, taste = (np.concatenate(part) for part in zip(*tried, strict=True))
    changed = (position != state.position).any((0, 2)) | (yaw != state.yaw).any(0)
    best = search.cheapest(every, position, yaw, changed, taste.sum(1))
    return State(position[best], yaw[best], state.taste + taste[best])


def reseated(search: Search, state: State, there: np.ndarray, i: int, seats: list[int]) -> State:
    """The state with those of `seats` who stand around box i at one of the ways in which as many sit there."""
    problem = search.problem
    if (i, *seats) not in search.ways:
        search.ways[i, *seats] = seatings(problem, i, seats)
    around, ways = search.ways[i, *seats]
    if not ways:
        return state
    position, yaw = np.repeat(state.position[None], len(ways) + 1, 0), np.repeat(state.yaw[None], len(ways) + 1, 0)
    wide = problem.size[around, 0]
    rows = np.array([[out_of(state.position[i], float(state.yaw[i]), slot) for slot in way] for way in ways])
    far = np.linalg.norm(state.position[around][:, None, ::2] - rows[:, None, :, :2], axis=-1)
    far += FARTHEST * abs(wide[:, None] - wide)  # no chair goes to the slot of a bench, nor where it shall not be
    loads = [[lamp for lamp in search.children[k] if there[lamp]] for k in around]  # which are told to be over it
    for at, k in enumerate(around):
        broken = search.broken(state, there, k, rows.reshape(-1, 4), [*around, *loads[at]])
        far[:, at] += broken.reshape(len(ways), -1)
    for number, slots in enumerate(rows, 1):
        _, other = linear_sum_assignment(np.round(far[number - 1], 6))
        position[number, around, ::2], yaw[number, around] = slots[other, :2], slots[other, 2]
        for k, load in zip(around, loads, strict=True):
            position[number, load] += position[number, k] - state.position[k]
    changed = np.isin(np.arange(len(state.yaw)), [*around, *(lamp for load in loads for lamp in load)])
    likes = [LIKED * sum(slot[3] for slot in slots) + 0.001 * number for number, slots in enumerate(ways)]
    taste = np.array([state.taste[around].sum(), *likes])
    best = search.cheapest(there, position, yaw, changed, taste)
    own = state.taste.copy()
    own[around] = 0.0
    return State(position[best], yaw[best], own) if best else state


def part_of(room: Plan, there: np.ndarray) -> Plan:
    """The plan of some boxes of a room, who attend and stand on each other as in the whole."""
    keep = np.flatnonzero(there)
    number = np.full(len(there) + 3, -1)
    number[keep] = np.arange(len(keep))

    def mapped(of: np.ndarray) -> np.ndarray:
        return np.where(of < 0, of, number[np.maximum(of, 0)])[keep]

    triplets = room.triplets[there[room.triplets[:, ::2]].all(1)]
    triplets = np.stack([number[triplets[:, 0]], triplets[:, 1], number[triplets[:, 2]]], 1)
    stated = tuple(
        replace(one, subject=int(number[one.subject]), others=tuple(int(number[k]) for k in one.others))
        for one in room.stated
        if there[[one.subject, *one.others]].all()
    )
    out = Plan(
        tuple(room.kinds[k] for k in keep.tolist()), room.size[keep], room.position[keep], room.yaw[keep],
        room.scene[keep], room.floor, room.openings, triplets, room.fixed[keep], room.height, room.rules, stated,
    )  # fmt: skip
    vars(out).update(
        anchor=mapped(room.anchor), carrier=mapped(room.carrier), joins=mapped(room.joins),
        slot_role=tuple(room.slot_role[k] for k in keep.tolist()),
    )  # fmt: skip
    return out


def with_along(
    search: Search, state: State, there: np.ndarray, i: int, group: list[int], rows: np.ndarray,
    along: list[tuple[int, int]],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """As `carried`, and storage `along` walls where it is near whom it is told to, and runs into the least."""
    problem, met = search.problem, [m for m in group if search.problem.standing(m)]
    position, yaw = search.carried(state, i, group, rows)
    for k, at in along:
        walls = np.array(along_walls(problem, k, 0.0)).reshape(-1, 4)
        if not len(walls):  # it is longer than each
            continue
        cost = search.hits(state, there, k, [*group, *(other for other, _ in along)], walls, [k])
        here = np.insert(walls[:, :2], 1, 0.0, 1)
        for m in met:
            gap = gaps(problem.size[m], position[:, None, m], yaw[:, None, m], problem.size[k], here, walls[:, 2])
            cost = cost + HIT * (gap < -0.01) + DEEP * np.maximum(-gap, 0.0) + np.maximum(gap, 0.0) * (m == at)
        next_to = np.argsort(np.round(cost * GRAIN), 1, kind="stable")[:, :NEXT]
        count, where = next_to.shape[1], walls[next_to]
        then = State(position.repeat(count, 0), yaw.repeat(count, 0), state.taste)
        cost = np.take_along_axis(cost, next_to, 1)
        cost += search.broken(then, there, k, where.reshape(-1, 4), []).reshape(cost.shape)
        best = where[np.arange(len(where)), np.round(cost * GRAIN).argmin(1)]
        position[:, k, ::2], yaw[:, k] = best[:, :2], best[:, 2]
        met.append(k)
    return position, yaw


def seatings(problem: Problem, i: int, seats: Sequence[int]) -> tuple[list[int], list[list[Row]]]:
    """Who of some boxes stands around box i, wide ones first, and ways to do so: a slot for each, the best ways first.

    Benches take the middle of a long side, chairs what is left.
    """
    places = places_of(problem.size)
    seats = sorted((k for k in seats if slot_role(problem, k, i) == "around"), key=lambda k: -places[k])
    ways: list[list[tuple[Row, np.ndarray]]] = [[]] if len(seats) > 1 else []
    for alike in (list(group) for _, group in groupby(seats, key=lambda k: places[k])):
        largest = max(alike, key=lambda k: float(problem.size[k, 0]))
        slots = sorted(slots_at(problem, largest, i), key=lambda slot: slot[3])
        table = np.array(slots).reshape(-1, 4)
        room = np.concatenate([table[:, :2], hull(problem.size[largest, ::2][None] / 2, table[:, 2])], 1)
        first = 2 if places[largest] > 1 and len(alike) < len(seats) else len(slots)
        after = []
        for begun, start in product(ways, range(min(first, len(slots)))):  # those that go with each, its likes first
            chosen, free = [*begun], np.ones(len(slots), bool)
            for _, taken in begun:
                free &= _clear_of(room, taken)
            for k in (start, *np.flatnonzero(table[:, 3] == table[start, 3]).tolist(), *range(len(slots))):
                if free[k] and len(chosen) < len(begun) + len(alike):
                    chosen.append((slots[k], room[k]))
                    free &= _clear_of(room, room[k])
            after += [chosen] * (len(chosen) == len(begun) + len(alike))
        ways = after
    found = [[slot for slot, _ in way] for way in ways]
    return seats, [way for number, way in enumerate(found) if not any({*way} == {*one} for one in found[:number])]


def _clear_of(room: np.ndarray, taken: np.ndarray) -> np.ndarray:
    """(k,) bool: which rectangles (k, 4), middles and half extents, another one leaves free."""
    return np.asarray((abs(room[:, :2] - taken[:2]) - room[:, 2:] - taken[2:]).max(1) > -0.01)
