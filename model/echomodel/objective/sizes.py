"""Rule of scale: nothing is larger or smaller than such furniture comes."""

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from echomodel.arrays import Array, at_least, rows
from echomodel.boxes2d import seen
from echomodel.objective.plan import Found, Plan, found, kind_of, nobody
from echomodel.sizes import size_statistics, usual_range
from echomodel.vocabulary import Category

LARGEST, SMALLEST = 1.2, 0.5  # times the 95th and 5th percentile of the class: 97 % of real pieces lie between
SHORTER = 0.85  # times the least usual side, where the row of a category names usual sizes
LARGER = 1.3  # times the largest one, for what is told to be larger or smaller than something
USUAL = 0.6  # power of the ratio of the 5th and 95th percentile to the median

PLACE = 0.62  # metres at a table that one who sits there takes: two on a bench
ELBOW = 0.55  # metres of a table's edge a seat: 96 % of real sides with two seats or more (0.6 m in DIN 68880)
ELBOWS = 0.14  # metres of a table's side for each chair beyond its width: 80 % of real sides have more
TUCKED = 0.15  # metres by which chairs at the ends of a table keep off those at its sides
LEAST_DEPTH, MOST_DEPTH = 0.75, 1.05  # metres of a table at which people sit opposite each other
CHAIR = ELBOW + 0.01  # metres of a table's side for each chair there
SPARE = 0.8  # and in all beside that, at most
EDGE = 0.02  # metres of a top that stay free around what stands on it
FEET = 0.18  # metres, depth of the feet on which a screen stands
SHRUNK = 0.85  # of its width and depth: what a piece becomes at the least where the room is too full for it


def places_of(size: Array) -> Array:
    """(...,) how many sit on seats of sizes (..., 3)."""
    return at_least((size[..., 0] / PLACE).round(), 1.0)


@cache
def size_range(category: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Smallest and largest side lengths x, y, z in metres that a person takes for one of the category."""
    table, usual = size_statistics(category), usual_range(category)
    low, high = table.low * SMALLEST, table.high * LARGEST
    if usual and kind_of(category).role == "bed":  # one of 1.5 m is longer than half of few beds; nobody sleeps in it
        low = np.maximum(low, np.array([side[0] for side in usual]) * SHORTER)
    if usual:
        high = np.maximum(high, np.array([side[1] for side in usual]))
    return tuple(low.tolist()), tuple(high.tolist())


def usual_sizes(categories: Sequence[str], size: np.ndarray, *, lenient: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes and proportions that most of their kind have; words outside the vocabulary keep theirs.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        lenient: (n, 3) bool, sides that are only brought into what the rule of scale allows.
    """
    out = size.copy()
    for number, word in enumerate(categories):
        if not kind_of(word).name:
            continue
        table, usual = size_statistics(word), usual_range(word)
        low, high = (np.array(side) for side in size_range(word))
        if usual:  # no lamp becomes two metres wide because it is told to be larger than something
            low = np.maximum(low, np.array([side[0] for side in usual]) * SHORTER)
            high = np.minimum(high, np.array([side[1] for side in usual]) * LARGER)
        ends = zip(*usual, strict=True) if usual else (table.low, table.high)
        middle = np.sqrt(np.prod(usual, 1)) if usual else table.median
        most = [middle * (np.array(end) / middle) ** (1.0 if usual else USUAL) for end in ends]
        out[number] = np.clip(size[number], *np.where(lenient[number], (low, high), most))
    return in_proportion(categories, out, np.ones(len(out), bool))


def in_proportion(categories: Sequence[str], size: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes in which what is round is as wide as deep, of the same volume, and screens are no portraits.

    Arguments:
        categories: n words. size: (n, 3) float, metres. free: (n,) bool, sizes that may change.
    """
    out = size.copy()
    for i, kind in _kinds(categories, free):
        if kind.round:
            out[i, [0, 2]] = np.sqrt(size[i, 0] * size[i, 2])
        if kind.aspect:
            out[i, 1] = np.clip(size[i, 1], size[i, 0] / kind.aspect[1], size[i, 0] / kind.aspect[0])
    return out


def smaller_sizes(categories: Sequence[str], size: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes of what a person would choose for a room that is too full: less wide and deep, yet usual.

    Arguments:
        categories: n words. size: (n, 3) float, metres. free: (n,) bool, sizes that may change.
    """
    out = size.copy()
    for i, kind in _kinds(categories, free):
        if kind.name and kind.support == "floor":
            table, usual = size_statistics(kind.name), usual_range(kind.name)
            least = np.array([side[0] for side in usual]) if usual else np.sqrt(table.low * table.median)
            out[i] = np.minimum(size[i], np.maximum(SHRUNK * size[i], least))
    out[:, 1] = size[:, 1]
    return out


def laid_tables(categories: Sequence[str], size: np.ndarray, anchor: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes in which every table suits the chairs around it: long and deep enough, and no hall's.

    What hangs over something is no wider than that.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        anchor: (n,) int, whom each attends (`Plan.anchor`). free: (n,) bool, sizes that may change.
    """
    out = size.copy()
    kinds = [kind_of(word) for word in categories]
    for i in (i for i, kind in enumerate(kinds) if kind.stands == "over" and anchor[i] >= 0 and free[i]):
        out[i, 0] = min(size[i, 0], max(size[anchor[i], 0], size_range(categories[i])[0][0]))
    for table in np.unique(anchor[anchor >= 0]).tolist():
        chairs = [i for i in np.flatnonzero(anchor == table).tolist() if kinds[i].role == "seat"]
        if not free[table] or kinds[table].role != "board" or kinds[table].access or len(chairs) < 2:
            continue
        places = places_of(size[chairs])
        wide, count = places > 1, int(places.sum())  # benches; all who sit there
        width = float(np.median(np.minimum(size[chairs, 0], 0.7)[~wide] if not wide.all() else [PLACE - ELBOWS]))
        if kinds[table].wall:  # they sit along its front
            out[table, 0] = max(size[table, 0], count * (width + ELBOWS))
            continue
        # of six, three sit at each long side where no end is free; nobody sits beside a bench
        at_ends = count > 6 or (wide.any() and len(chairs) > 2)
        a_side = max(-(-(count - 2 * at_ends) // 2), (~wide).sum() - 2 * at_ends if wide.sum() == 1 else 0)
        long = 0 if size[table, 0] >= size[table, 2] else 2
        ends = 2 * TUCKED * at_ends
        least = max(a_side * max(CHAIR, width + ELBOWS) + ends, float(size[chairs, 0].max() * wide.any()))
        out[table, long] = np.clip(size[table, long], least, least + SPARE)
        if not kinds[table].like:  # a child's table is as it comes
            out[table, 2 - long] = np.clip(size[table, 2 - long], LEAST_DEPTH, MOST_DEPTH)
    return out


def fitting_loads(categories: Sequence[str], size: np.ndarray, carrier: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes in which nothing reaches over the edge of what carries it, where its kind allows.

    What carries something is low enough for a plane top, and its loads have room side by side there.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        carrier: (n,) int, what each stands on, negative = no other box. free: (n,) bool, sizes that may change.
    """
    out = size.copy()
    for below in np.unique(carrier[carrier >= 0]).tolist():
        if free[below] and kind_of(categories[below]).bears:
            out[below, 1] = min(out[below, 1], kind_of(categories[below]).bears)
    for load in np.flatnonzero((carrier >= 0) & free).tolist():
        if kind_of(categories[load]).name:
            low, room = np.array(size_range(categories[load])[0]), out[carrier[load]] - 2 * EDGE
            room[0] *= size[load, 0] / size[carrier == carrier[load], 0].sum()
            plan = np.minimum(out[load], np.maximum(room, low))[[0, 2]]
            if kind_of(categories[load]).aspect:
                plan[1] = np.clip(FEET, plan[1], max(plan[1], out[carrier[load], 2] - 2 * EDGE))
            out[load, [0, 2]] = plan.min() if kind_of(categories[load]).round else plan
    return in_proportion(categories, out, free & (carrier >= 0))


def hung_lamps(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, free: np.ndarray
) -> np.ndarray:
    """(n, 3) float: sizes in which no lamp of the ceiling is wider than what it hangs over.

    Arguments:
        categories: n words. size, position: (n, 3) float, metres, yaw: (n,) float, radians, of the room as arranged.
        free: (n,) bool, sizes that may change.
    """
    out, kinds = size.copy(), [kind_of(word) for word in categories]
    lit = np.array([kind.role in ("board", "bed", "sofa") and kind.support == "floor" for kind in kinds], bool)
    for lamp in (i for i, kind in enumerate(kinds) if kind.role == "light" and kind.support == "ceiling" and free[i]):
        local = seen((position[lamp] - position)[:, [0, 2]], yaw)
        under = lit & (np.abs(local) <= size[:, [0, 2]] / 2).all(1)
        if under.any():
            out[lamp, [0, 2]] *= min(1.0, size[under][:, [0, 2]].min() / size[lamp, [0, 2]].max())
    return out


def scale(plan: Plan) -> Found:
    """A piece has the size of its kind; boards and seats may be turned by a quarter."""
    known = [number for number in rows(plan.moved).tolist() if plan.kinds[number].name]
    if not known:
        return nobody(plan.size)
    who, xp = plan.kit.asarray(known), plan.kit
    limits = plan.numbers([size_range(plan.kinds[number].name) for number in known])
    size = at_least(plan.size[who], 1e-3)
    margin = xp.log(xp.minimum(size / limits[:, 0], limits[:, 1] / size))
    at = xp.arange(len(known)), margin.argmin(1)
    return found(who, margin[at], measure=size[at], words=at[1])


def _kinds(categories: Sequence[str], some: np.ndarray) -> Iterator[tuple[int, Category]]:
    return ((i, kind_of(categories[i])) for i in np.flatnonzero(some).tolist())
