"""Part tokens made exact: straight what is nearly straight, in the middle, on the floor, and nothing in the air."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from echomodel.data.furniture.mirroring import copies, solids_of
from echomodel.data.furniture.solids import Array, Solid
from echomodel.data.furniture.tokens import (
    CENTRE,
    EXTENT,
    HOT,
    IDENTITY,
    STARTS,
    TURN,
    WORDS,
    reach_of,
    root_of,
    say,
    share_of,
    turn_of,
    word,
)  # fmt: skip
from echomodel.data.furniture.touching import group_of, surface_of

STRAIGHT = np.cos(np.radians(4))  # turns of less are none
NEAR = 0.02  # metres to a side of the box, or between a middle and the middle, that are none
CLOSE, FAR = 0.08, 0.15  # metres of air that a part is lengthened over, and over which it is moved; others go
OVERLAP = 0.004  # metres that parts reach into each other
ROUNDS = 4
FREE = ("rod", "bent", "double", "curve", "ring")  # kinds without faces to lengthen


def snapped(tokens: Array, size: Array) -> Array:
    """Tokens (T', WIDTH), T' <= T, that stand on the floor of the box `size` (3,), metres, and all hang together."""
    size = np.asarray(size, float)
    out = np.stack([_straightened(token, size) for token in np.asarray(tokens, float)])
    for _ in range(ROUNDS):
        built = _Built.of(out, size)
        if not built.loose:
            return out
        out = _joined(out, size, built)
    while (built := _Built.of(out, size)).loose:
        out = _without(out, built)
    return out


def loose_tokens(tokens: Array, size: Array) -> set[int]:
    """Numbers of the tokens of which a copy touches nothing that hangs together with the bulkiest body."""
    return _Built.of(tokens, size).loose


@dataclass(frozen=True, eq=False)
class _Built:
    """Solids of tokens, the tokens behind them and their signs (`copies`), and the bodies that hang together.

    The main body is the bulkiest and not, as for `group_of`, that of most solids: a top and not a leg in the air.
    """

    solids: list[Solid]
    owner: Array
    signs: Array
    group: Array
    main: int

    @classmethod
    def of(cls, tokens: Array, size: Array) -> _Built:
        solids = solids_of(tokens, size)
        group, _ = group_of(solids)
        bulk = [np.prod(np.ptp(solid.mesh(0)[0], axis=0)) for solid in solids]
        return cls(solids, *copies(tokens), group, int(np.bincount(group, bulk).argmax()))

    @property
    def loose(self) -> set[int]:
        return {int(self.owner[number]) for number in np.flatnonzero(self.group != self.main)}

    def points(self, group: int) -> Array:
        """Points on the surfaces of a body."""
        return np.concatenate([surface_of(self.solids[i]) for i in np.flatnonzero(self.group == group)])


def _straightened(token: Array, size: Array) -> Array:
    """Words as words, small turns undone, what is nearly in the middle there, sides on the box's; in the box."""
    out, metre = token.copy(), 2 / size
    for name, words in WORDS.items():
        start = STARTS[name]
        say(out, name, words[int(out[start : start + len(words)].argmax())])
    out[HOT:] = out[HOT:].clip(-1.3, 1.3)
    kind, flag = word(out, "kind"), word(out, "mirror")
    turn = turn_of(out)
    straight = min(turn[0, 0], turn[1, 1], turn[2, 2]) > STRAIGHT or kind in FREE[:-1]
    turn = IDENTITY if straight else turn
    out[TURN] = turn[:, :2].T.ravel()
    for axis, flags in ((0, ("none", "z")), (2, ("none", "x"))):
        if abs(out[CENTRE][axis]) < NEAR * metre[axis] and flag in flags:
            out[CENTRE.start + axis] = 0.0
    half = share_of(out[EXTENT].clip(-1, 1)) * reach_of(turn, size) * metre  # of local axes
    if straight:
        low, high = out[CENTRE] - half, out[CENTRE] + half
        low = np.where(low < -1 + NEAR * metre, -1.0, low).clip(-1, 0.98)
        high = np.where(high > 1 - NEAR * metre, 1.0, high).clip(-0.98, 1)
        high = np.maximum(high, low + 1e-3 * metre)
        out[CENTRE] = (low + high) / 2
        out[EXTENT] = root_of((high - low) / 2)
    else:
        out[CENTRE] = out[CENTRE].clip(-1, 1)
    return out


def _joined(tokens: Array, size: Array, built: _Built) -> Array:
    """Tokens whose copies hang in the air lengthened, moved or left out, by how far away the rest is."""
    ground = built.points(built.main)
    tree = cKDTree(ground)
    out, gone = tokens.copy(), []
    for number in sorted(built.loose):
        copy = int(np.flatnonzero((built.owner == number) & (built.group != built.main))[0])
        # all that hangs together with it moves alike: the way of the nearest of them
        points = built.points(built.group[copy])
        distance, to = tree.query(points)
        nearest = int(distance.argmin())
        if distance[nearest] > FAR:
            gone.append(number)
            continue
        way = (ground[to[nearest]] - points[nearest]) * built.signs[copy]
        way = way * (1 + OVERLAP / max(float(np.linalg.norm(way)), 1e-9))
        if (built.group == built.group[copy]).sum() > 1 or not _lengthened(out[number], way, size):
            out[number, CENTRE] += way * 2 / size
    return np.delete(out, gone, axis=0) if len(gone) < len(out) else out[:1]


def _without(tokens: Array, built: _Built) -> Array:
    """Fewer tokens: those loose ones that hold on their own lose their mirror copies, the others go; one stays."""
    out = tokens.copy()
    held = [number for number in built.loose if built.group[number] == built.main]
    for number in held:
        say(out[number], "mirror", "none")
    gone = sorted(built.loose - set(held))
    if len(gone) < len(out):
        return np.delete(out, gone, axis=0)
    say(out[0], "mirror", "none")
    return out[:1]


def _lengthened(token: Array, way: Array, size: Array) -> bool:
    """Whether a token could be made longer by `way` (3,), metres, along one of its own axes, and is, in place."""
    turn = turn_of(token)
    local = turn.T @ way
    axis = int(np.abs(local).argmax())
    if word(token, "kind") in FREE or abs(local[axis]) > CLOSE or abs(local[axis]) < 0.8 * np.linalg.norm(way):
        return False
    half = share_of(token[EXTENT][axis]) + abs(local[axis]) / 2 / reach_of(turn, size)[axis]
    token[EXTENT.start + axis] = root_of(np.minimum(half, 1.0))
    token[CENTRE] += turn[:, axis] * local[axis] / size
    return True
