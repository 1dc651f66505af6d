"""The margins of the relations of a graph with their gradients: one pass per family of predicates.

The margins are those of `echomodel.rules`. Those of SG-FRONT's predicates are written out here with their gradients in
closed form (a test compares both, values and gradients), because the automatic gradients of many small tensors take
twelve times as long; any other predicate's gradient is torch's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from echomodel.boxes2d import hull, seen
from echomodel.vocabulary import Predicate, vocabulary
from echousd.place.footprints import (
    FIRST,
    PLAN,
    SECOND,
    Pairs,
    Values,
    centre_inside,
    corner_distance,
    mirror_distance,
    mirror_likeness,
    overlap_ratio,
    pairs_of,
    penetration,
)
from echousd.place.geometry import COLUMNS, axes

if TYPE_CHECKING:
    from echomodel.rules.sets import RuleSet

Family = Callable[[Pairs, Sequence[Predicate], bool], Values]


def relation_margins(
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    triplets: np.ndarray,
    *,
    rules: str,
    centre: np.ndarray,
    fronts: np.ndarray | None = None,
    slopes: bool = True,
) -> Values:
    """The margins of the relations and their gradients; 0 where the rules do not measure the predicate.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians; triplets: (e, 3) int.
        rules: `strict` or `sgfront`; centre: (2,) float, x and z of the room's centre.
        fronts: (n,) bool, boxes that have a front; None = none.
        slopes: False where nobody asks for the gradients, which are then not right.

    Returns: margins (e,) float and gradients (e, 2, 6) float by the two boxes of each relation, in the columns of
        `geometry` (`spread` puts them at the boxes).
    """
    from echomodel.rules import sets

    told = sets.rule_set(rules)
    strict = told is sets.STRICT
    ends, predicate = triplets[:, [0, 2]], triplets[:, 1]
    every = pairs_of(size, position - (centre[0], 0.0, centre[1]), yaw, ends, oriented=told.oriented, fronts=fronts)
    value, gradient = np.zeros(len(triplets)), every.zeros()
    words = vocabulary().predicates
    rows = {number: words[number] for number in sorted(set(predicate.tolist())) if _measured(told, words[number])}
    for margin in {CLOSED[row.name]: None for row in rows.values() if row.name in CLOSED}:
        family = [number for number, row in rows.items() if CLOSED.get(row.name) is margin]
        chosen = _of(predicate, family)
        relations = [rows[i] for i in predicate[chosen].tolist()]
        value[chosen], gradient[chosen] = margin(every.take(chosen), relations, strict)
    chosen = _of(predicate, [number for number, row in rows.items() if row.name not in CLOSED])
    if not slopes and strict:  # torch takes twenty times as long for a few rows
        looks = np.array([words[number].name == "facing" for number in predicate[chosen].tolist()], bool)
        value[chosen[looks]] = _facing(size, position, yaw, triplets[chosen[looks]])
        chosen = chosen[~looks]
    if len(chosen):
        value[chosen], gradient[chosen] = _automatic((size, position, yaw), triplets[chosen], rules, centre, slopes)
    return value, gradient


def margins_at(
    i: int,
    poses: tuple[np.ndarray, np.ndarray],
    triplets: np.ndarray,
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    *,
    rules: str,
    centre: np.ndarray,
    fronts: np.ndarray,
) -> np.ndarray:
    """(K, e) float: the margins of relations of box i with it at each of K poses and all others where they are.

    Arguments:
        poses: position (K, 3) and yaw (K,) of box i. triplets: (e, 3) int, box i at one end of each.
        The others as `relation_margins`.
    """
    from echomodel.rules import sets

    told = sets.rule_set(rules)
    strict, count, row = told is sets.STRICT, len(poses[1]), np.arange(len(triplets))
    mine = np.where(triplets[:, 0] == i, FIRST, SECOND)
    other = triplets[row, np.where(mine == FIRST, 2, 0)]

    def paired(own: np.ndarray, theirs: np.ndarray) -> np.ndarray:
        out = np.empty((count, len(row), 2, *theirs.shape[1:]))
        out[:, row, mine], out[:, row, 1 - mine] = own[:, None], theirs
        return out

    sizes, turn = paired(size[i : i + 1], size[other]), paired(poses[1], yaw[other])
    middle = np.array((centre[0], 0.0, centre[1]))
    places = paired(poses[0] - middle, position[other] - middle)
    axis = paired(axes(poses[1]), axes(yaw[other])) if told.oriented else axes(np.zeros(turn.size))
    half = 0.5 * sizes[..., PLAN if told.oriented else PLAN[::-1]]
    every = Pairs(
        sizes.reshape(-1, 2, 3), places.reshape(-1, 2, 3), axis.reshape(-1, 2, 2, 2), half.reshape(-1, 2, 2),
        (3, 5) if told.oriented else (5, 3), np.tile(fronts[i] & fronts[other], count),
    )  # fmt: skip
    value, words = np.zeros((count, len(row))), vocabulary().predicates
    relations = [words[number] for number in triplets[:, 1].tolist()]
    families: dict[Family | str, list[int]] = {}
    for number, relation in enumerate(relations):
        if _measured(told, relation):
            looks = "looks" if strict and relation.name == "facing" else "torch"
            families.setdefault(CLOSED.get(relation.name, looks), []).append(number)
    for family, columns in families.items():
        if not isinstance(family, str):
            chosen = (len(row) * np.arange(count)[:, None] + columns).ravel()
            pair = replace(every.take(chosen), slopes=family not in ALONE)
            found, _ = family(pair, [relations[number] for number in columns] * count, strict)
        else:
            where = paired(poses[0], position[other])[:, columns].reshape(-1, 3)
            boxes = sizes[:, columns].reshape(-1, 3), where, turn[:, columns].ravel()
            ends = np.arange(0, 2 * count * len(columns), 2)
            pairs = np.stack([ends, np.tile(triplets[columns, 1], count), ends + 1], 1)
            found = _facing(*boxes, pairs) if family == "looks" else _automatic(boxes, pairs, rules, centre, False)[0]
        value[:, columns] = found.reshape(count, -1)
    return value


def _measured(told: RuleSet, relation: Predicate) -> bool:
    rule = told.rules.get(relation.name)
    return rule is not None and rule.margin is not None


def _of(predicate: np.ndarray, numbers: Sequence[int]) -> np.ndarray:
    """Rows of the predicates with these numbers."""
    asked = np.zeros(len(vocabulary().predicates), bool)
    asked[list(numbers)] = True
    return np.flatnonzero(asked[predicate])


def _smaller(one: Values, two: Values) -> Values:
    return _where(one[0] <= two[0], one, two)


def _larger_of(one: Values, two: Values) -> Values:
    return _where(one[0] >= two[0], one, two)


def _where(chosen: np.ndarray, one: Values, two: Values) -> Values:
    value = np.where(chosen, one[0], two[0])
    return (value, np.where(chosen[:, None, None], one[1], two[1])) if len(one[1]) else (value, one[1])


def _automatic(
    placed: Sequence[np.ndarray], triplets: np.ndarray, rules: str, centre: np.ndarray, slopes: bool
) -> Values:
    """Margins (e,) by `echomodel.rules` and torch's gradients (e, 2, 6) by the two boxes of each relation."""
    import torch

    from echomodel.boxes import Boxes
    from echomodel.rules import margins

    ends, row = triplets[:, [0, 2]].ravel(), torch.arange(len(triplets))
    boxes = Boxes(*(torch.from_numpy(np.asarray(values[ends], float)) for values in placed))
    apart = torch.stack([2 * row, torch.from_numpy(triplets[:, 1].astype(np.int64)), 2 * row + 1], 1)
    if not slopes:
        with torch.no_grad():
            margin = margins(boxes, apart, rules=rules, center=torch.from_numpy(np.asarray(centre, float)))
        return margin.numpy(), np.zeros((len(triplets), 2, COLUMNS))
    free = boxes.size.requires_grad_(), boxes.position.requires_grad_()
    margin = margins(boxes, apart, rules=rules, center=torch.from_numpy(np.asarray(centre, float)))
    by_size, by_position = torch.autograd.grad(margin.sum(), free, allow_unused=True, materialize_grads=True)
    gradient = torch.cat([by_position, by_size * boxes.size.detach()], 1)
    return margin.detach().numpy(), gradient.reshape(-1, 2, COLUMNS).numpy()


def _facing(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, triplets: np.ndarray) -> np.ndarray:
    """Margins (e,) of `facing` as `echomodel.rules.labels` has them."""
    from echomodel.rules.geometry import TINY
    from echomodel.rules.sets import LOOK

    i, j = triplets[:, 0], triplets[:, 2]
    way = (position[j] - position[i])[:, [0, 2]]
    aside, ahead = seen(way, yaw[i]).T
    across = hull(size[j][:, [0, 2]] / 2, yaw[j] - yaw[i])[:, 0]
    looks = ahead / np.sqrt(np.maximum((way * way).sum(1), TINY)) - LOOK
    return np.maximum(looks, np.minimum(across - np.abs(aside), ahead))


def _beside(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    """On the side that is asked for and not running into the object."""
    from echomodel.rules.sets import APART, OVERLAP

    r = np.arange(len(pair))
    step = np.array([relation.step for relation in relations])
    by_x, sign = step[:, 0] != 0, step.sum(1)
    gradient = pair.zeros()
    gradient[r, FIRST, np.where(by_x, 0, 2)] = sign
    gradient[r, SECOND, np.where(by_x, 0, 2)] = -sign
    along = sign * np.where(by_x, *pair.flat().T)
    ratio, by_box = overlap_ratio(pair)
    return _smaller((along - np.where(by_x & (not strict), -APART, APART), gradient), (OVERLAP - ratio, -by_box))


def _close(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import NEAR, SIDES

    distance, gradient = corner_distance(pair)
    corners = NEAR - distance, -gradient
    if not strict:
        return corners
    over, by_over = _rise(pair, to_top=True)
    gap, by_gap = penetration(pair)
    under, by_under = _rise(pair.swapped(), to_top=True)
    level = _larger_of((over, by_over), (under, by_under[:, ::-1]))
    return _larger_of(corners, _smaller((SIDES + gap, by_gap), (NEAR - level[0], -level[1])))


def _symmetrical(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import LOOK, NEAR

    distance, gradient = mirror_distance(pair, images=(0, 1) if strict else (0, 1, 2))
    near = NEAR - distance, -gradient
    if not strict or pair.fronts is None:
        return near
    images = []
    for number, like in enumerate(mirror_likeness(pair)):
        distance, gradient = mirror_distance(pair, images=(number,))
        images.append(_smaller((NEAR - distance, -gradient), (like - LOOK, pair.zeros())))
    return _where(pair.fronts, _larger_of(*images), near)


def _above(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import TOUCH

    value, gradient = _rise(pair, to_top=True)
    return _smaller((value - TOUCH, gradient), penetration(pair))


def _standing_on(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import TOUCH

    value, gradient = _rise(pair, to_top=strict)
    level = TOUCH - np.abs(value), -np.sign(value)[:, None, None] * gradient if pair.slopes else gradient
    return _smaller(level, centre_inside(pair)) if strict else level


def _rise(pair: Pairs, *, to_top: bool) -> Values:
    """Height of the subject's bottom over the object's top, or over its bottom."""
    gradient = pair.zeros()
    if pair.slopes:
        gradient[:, FIRST, 1], gradient[:, SECOND, 1] = 1.0, -1.0
        if to_top:
            gradient[:, SECOND, 4] = -pair.size[:, SECOND, 1]
    return pair.position[:, FIRST, 1] - (pair.top() if to_top else pair.position[..., 1])[:, SECOND], gradient


def _volumes(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import VOLUME

    volume, gradient = pair.size.prod(-1), pair.zeros()
    gradient[:, :, 3:] = volume[..., None]
    return _larger(volume, gradient, relations, VOLUME, strict)


def _tops(pair: Pairs, relations: Sequence[Predicate], strict: bool) -> Values:
    from echomodel.rules.sets import HEIGHT

    gradient = pair.zeros()
    gradient[..., 1], gradient[..., 4] = 1.0, pair.size[..., 1]
    return _larger(pair.top(), gradient, relations, HEIGHT, strict)


def _larger(
    quantity: np.ndarray, gradient: np.ndarray, relations: Sequence[Predicate], needed: float, strict: bool
) -> Values:
    """How much more (or less) the subject has of a quantity than the object: (s - o) / larger, as published / s."""
    s, o = quantity.T
    by = np.where(s >= o, FIRST, SECOND) if strict else np.full(len(s), FIRST)
    base = quantity[np.arange(len(s)), by]
    base = np.maximum(base, 1e-6) if strict else np.where(np.abs(base) < 1e-12, 1e-12, base)
    ratio, sign = (s - o) / base, np.array([float(relation.rank) for relation in relations])
    weight = np.stack((1.0 - ratio * (by == FIRST), -1.0 - ratio * (by == SECOND)), 1)
    return sign * ratio - needed, (sign / base)[:, None, None] * (weight[..., None] * gradient)


CLOSED: dict[str, Family] = {
    **dict.fromkeys(("left", "right", "front", "behind"), _beside),
    "close_by": _close,
    "above": _above,
    "standing_on": _standing_on,
    **dict.fromkeys(("bigger_than", "smaller_than"), _volumes),
    **dict.fromkeys(("taller_than", "shorter_than"), _tops),
    "symmetrical_to": _symmetrical,
}
ALONE = (_close, _above, _standing_on, _symmetrical)  # whose values can be had without their gradients
