"""A whole piece as a set of part tokens: mirror copies folded into one, moving bodies told, in one order; and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echomodel.data.furniture.solids import Array, Joint, Solid
from echomodel.data.furniture.tokens import (
    BODY,
    CENTRE,
    EXTENT,
    HOT,
    KINDS,
    KNOTS,
    SHAPE,
    STARTS,
    TURN,
    WIDTH,
    WORDS,
    say,
    solid_of,
    token_of,
    word,
)  # fmt: skip

MOST = 64  # tokens of a piece; of what has more, the largest
SAME = 2e-3  # difference of numbers that are one
APART = 0.08  # distance between centres of moving bodies that are one, in half boxes
_RUNS = [KINDS.index(name) for name in ("rod", "bent", "double", "curve")]
_FRONTED = [KINDS.index(name) for name in ("blade", "shell")]
_OF_X, _OF_Z = np.array([-1.0, 1, 1]), np.array([1.0, 1, -1])


def tokens_of(solids: Sequence[Solid], size: Array) -> Array:
    """(T, WIDTH) float32, T <= MOST: what is seen of a piece, the same whatever the order of its solids.

    Arguments:
        solids: of a furniture program. size: (3,) metres, the box that they stand in.
    """
    size = np.asarray(size, float)
    seen = [solid for solid in solids if not solid.core]
    tokens = np.stack([token_of(solid, size) for solid in seen])
    _tell_bodies(tokens, seen, size)
    tokens = _folded(tokens[_order(tokens)])
    if len(tokens) > MOST:
        volume = ((tokens[:, EXTENT] + 1) ** 2).prod(1)
        tokens = tokens[np.sort(np.argsort(-volume, kind="stable")[:MOST])]
    return tokens.clip(-1.5, 1.5).astype(np.float32)


def solids_of(tokens: Array, size: Array) -> list[Solid]:
    """The solids that tokens (T, WIDTH) say, mirror copies unfolded, joints in place; arguments as `tokens_of`."""
    size = np.asarray(size, float)
    every = unfolded(np.asarray(tokens, float))
    return jointed([solid_of(token, size) for token in every], every, size)


def copies(tokens: Array) -> tuple[Array, Array]:
    """Number of the token behind every one of `unfolded`, and (T', 3) signs by which that one mirrors it."""
    flag, every = _numbers(tokens, "mirror"), np.arange(len(tokens))
    found = [every, every[np.isin(flag, (1, 3))], every[np.isin(flag, (2, 3))], every[flag == 3]]
    signs = np.array([[1, 1, 1], [-1, 1, 1], [1, 1, -1], [-1, 1, -1]])
    return np.concatenate(found), np.repeat(signs, [len(some) for some in found], axis=0)


def unfolded(tokens: Array) -> Array:
    """(T', WIDTH): all tokens and then their mirror copies, none with a mirror flag."""
    owner, signs = copies(tokens)
    out = tokens[owner]
    for token in out:
        say(token, "mirror", "none")
    for axis in (0, 2):
        there = signs[:, axis] < 0
        out[there] = mirrored(out[there], axis)
    return out


def mirrored(tokens: Array, axis: int) -> Array:
    """Tokens (T, WIDTH) on the other side of the middle of the box, along x (0) or z (2)."""
    out, flip = tokens.copy(), _OF_X if axis == 0 else _OF_Z
    kind, joint = _numbers(tokens, "kind"), _numbers(tokens, "joint")
    out[:, CENTRE] *= flip
    turn = tokens[:, TURN].reshape(-1, 2, 3) * flip
    # about the local axis of the mirror, or the width of what has a front
    about = np.full(len(tokens), axis == 0) | np.isin(kind, _FRONTED)
    turn[about, 0] *= -1
    out[:, TURN] = turn.reshape(-1, 6)
    run = np.isin(kind, _RUNS)
    out[run, TURN] = tokens[run, TURN]
    knots = out[run, SHAPE][:, 1:].reshape(-1, KNOTS, 3) * flip
    for number, line in enumerate(knots):
        if KINDS[kind[run][number]] != "curve" and tuple(line[-1]) < tuple(line[0]):
            knots[number] = line[::-1]
    out[run, SHAPE.start + 1 : SHAPE.stop] = knots.reshape(len(knots), 3 * KNOTS)
    moves = joint > 0
    out[moves, BODY.start : BODY.start + 3] *= flip
    # doors of the other side open to the other side; what slides out does so towards the front alone
    turned = (joint > 1) if axis == 0 else moves
    out[turned, BODY.start + 3] *= -1
    return out


def _numbers(tokens: Array, name: str) -> Array:
    """(T,) number of the word that each token says."""
    return tokens[:, STARTS[name] : STARTS[name] + len(WORDS[name])].argmax(1)


def jointed(solids: Sequence[Solid], tokens: Array, size: Array) -> list[Solid]:
    """The solids with the joints of their bodies: what moves alike about one place is one body.

    Arguments:
        solids, tokens: n of them, none folded.
    """
    out = list(solids)
    bodies: list[tuple[int, list[int]]] = []
    for number, token in enumerate(tokens):
        kind = word(token, "joint")
        if kind == "fixed":
            continue
        for first, members in bodies:
            near = np.abs(tokens[first][BODY][:3] - token[BODY][:3]).max() < APART
            if near and word(tokens[first], "joint") == kind and tokens[first][BODY][3] * token[BODY][3] > 0:
                members.append(number)
                break
        else:
            bodies.append((number, [number]))
    for count, (first, members) in enumerate(bodies):
        joint = _joint(tokens[members], [solids[m] for m in members], size, count + 1, word(tokens[first], "joint"))
        for member in members:
            out[member] = replace(out[member], joint=joint)
    return out


def _joint(tokens: Array, solids: Sequence[Solid], size: Array, number: int, kind: str) -> Joint:
    points = np.concatenate([solid.mesh(0)[0] for solid in solids])
    low, high = points.min(0), points.max(0)
    sign = 1.0 if tokens[:, BODY][:, 3].mean() > 0 else -1.0
    share = float((tokens[:, BODY][:, 4].mean().clip(-0.9, 1) + 1) / 2)
    fronts = [solid for solid in solids if solid.role in ("door", "drawer")] or list(solids)
    face = max(float(solid.mesh(0)[0][:, 2].max()) for solid in fronts)
    if kind == "turns":
        anchor = (float(low[0] if sign < 0 else high[0]), float(low[1]), face)
        return Joint(f"door_{number}", "revolute", (0.0, sign, 0.0), anchor, share * np.pi)
    if kind == "slides across":
        return Joint(
            f"door_{number}", "prismatic", (sign, 0.0, 0.0), (float(low[0]), float(low[1]), face), share * size[0]
        )
    return Joint(f"drawer_{number}", "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, face), share * size[2])


def _tell_bodies(tokens: Array, solids: Sequence[Solid], size: Array) -> None:
    bodies: dict[str, list[int]] = {}
    for number, solid in enumerate(solids):
        if solid.joint is not None:
            bodies.setdefault(solid.joint.body, []).append(number)
    for members in bodies.values():
        joint = solids[members[0]].joint
        assert joint is not None
        points = np.concatenate([solids[m].mesh(0)[0] for m in members])
        centre = (points.min(0) + points.max(0)) / size - [0, 1, 0]
        across = abs(joint.axis[0]) > 0.5
        kind = "turns" if joint.kind == "revolute" else "slides across" if across else "slides"
        sign = joint.axis[1] if kind == "turns" else joint.axis[0] if across else 1.0
        most = np.pi if kind == "turns" else size[0] if across else size[2]
        for member in members:
            say(tokens[member], "joint", kind)
            tokens[member][BODY] = [*centre, sign, 2 * joint.reach / most - 1]


def _order(tokens: Array) -> Array:
    """Numbers of tokens from the first role to the last, within a role by kind, material, size and place."""
    numbers = np.round(tokens[:, HOT:], 2)
    size = -numbers[:, 9:12].sum(1).round(1)
    place = [numbers[:, i] for i in (1, 2, 0)]
    words = [_numbers(tokens, name) for name in ("role", "kind", "material")]
    return np.lexsort([*[tokens[:, i] for i in range(WIDTH - 1, HOT - 1, -1)], *place[::-1], size, *words[::-1]])


def _folded(tokens: Array) -> Array:
    """The tokens without mirror copies; what stays says so, and lies where x and z are positive."""
    count = len(tokens)
    across, along = mirrored(tokens, 0), mirrored(tokens, 2)
    both = mirrored(across, 2)
    left = np.ones(count, bool)

    def twin(of: Array, besides: list[int]) -> int:
        near = left & (np.abs(tokens - of).max(1) < SAME)
        near[besides] = False
        return int(near.argmax()) if near.any() else -1

    out = []
    for i in range(count):
        if not left[i]:
            continue
        x, z, xz = twin(across[i], [i]), twin(along[i], [i]), twin(both[i], [i])
        if min(x, z, xz) >= 0 and len({x, z, xz}) == 3:
            flag, gone = "both", [i, x, z, xz]
        elif x >= 0:
            flag, gone = "x", [i, x]
        elif z >= 0:
            flag, gone = "z", [i, z]
        else:
            flag, gone = "none", [i]
        left[gone] = False
        kept = tokens[max(gone, key=lambda n: (tokens[n][CENTRE][[0, 2]].sum(), -n))].copy()
        say(kept, "mirror", flag)
        out.append(kept)
    return np.stack(out)
