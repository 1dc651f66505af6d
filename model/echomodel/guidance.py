"""Guidance: boxes are moved down the slope of what the terms of the objective miss, while and after they are drawn.

This is reconstruction guidance (Chung et al. 2023, posterior sampling) with the objective as the measurement. None is
asked to grow or shrink, each stands at the height of what carries it, and what is almost square to a wall ends so.
"""

import math
from collections.abc import Collection

from echomodel.arrays import Array, full, kit
from echomodel.boxes import Boxes, BoxScale
from echomodel.objective import BY_EYE, KINDS, TERMS, Plan
from echomodel.objective.faults import MOST
from echomodel.objective.table import COST
from echomodel.samplers import Predict
from echomodel.standing import placed, standing

LATE = 0.3  # level of noise below which boxes are where they will be, but for what guidance moves
MOMENTS = (0.8, 0.95)  # of Adam
LEAST = 0.02  # share of the first step that the last one has
BEYOND = 0.01  # metres or ratio that is asked for beyond a term's slack


def guided(predict: Predict, plan: Plan, scale: BoxScale, *, strength: float, rounds: int) -> Predict:
    """Follow `predict` by steps on what its clean boxes miss, from `LATE` on; nodes at level 0 stay as they are.

    Arguments:
        predict: the denoiser's clean sample (N, 8). plan: of the rooms (`plan_of_graph`), wherever its boxes stand.
        scale: what the numbers of the boxes stand for. strength, rounds: as in `mended`.
    """

    def pulled(x: Array, level: Array) -> Array:
        clean = predict(x, level)
        if not rounds or bool((level > LATE).any()):
            return clean
        drawn = Boxes.decode(clean, scale)
        there = mended(plan, drawn, strength=strength, rounds=rounds, fixed=level == 0).encode(scale)
        xp = kit(x)
        return xp.where((level > 0)[:, None], xp.concat([clean[:, :3], there[:, 3:]], 1), clean)

    return pulled


def mended(plan: Plan, boxes: Boxes, *, strength: float, rounds: int, fixed: Array | None = None) -> Boxes:
    """Boxes after so many steps of Adam (Kingma & Ba 2015) on their places and headings, down what all terms miss.

    Arguments:
        plan: of N boxes of S rooms, of torch, wherever they stand.
        boxes: N, where they are drawn.
        strength: of the first step, metres and radians; the steps become shorter and shorter.
        rounds: how many.
        fixed: (N,) bool, boxes that stay; None = none.
    """
    start = standing(plan, boxes, fixed)
    xp, height = kit(start.yaw), start.position[:, 1]
    place = xp.concat([start.position[:, ::2], start.yaw[:, None]], 1)
    mean, square = xp.zeros_like(place), xp.zeros_like(place)
    for number in range(rounds):
        with xp.enable_grad():
            free = place.detach().requires_grad_()
            pull = missed(start.at(xp.stack([free[:, 0], height, free[:, 1]], 1), free[:, 2]), KINDS, BEYOND)
            (slope,) = xp.autograd.grad(pull, free, allow_unused=True, materialize_grads=True)
        mean = MOMENTS[0] * mean + (1 - MOMENTS[0]) * slope
        square = MOMENTS[1] * square + (1 - MOMENTS[1]) * slope.square()
        step = mean / (1 - MOMENTS[0] ** (number + 1)) / ((square / (1 - MOMENTS[1] ** (number + 1))).sqrt() + 1e-8)
        rate = strength * (1 - (1 - LEAST) * number / rounds)
        place = xp.where(start.fixed[:, None], place, place - rate * step)
    return placed(boxes, xp.stack([place[:, 0], height, place[:, 1]], 1), place[:, 2])


def missed(plan: Plan, kinds: Collection[str] = BY_EYE, beyond: float = -math.inf) -> Array:
    """() float, what the missed margins of the terms of some kinds cost, differentiable.

    `beyond`: what is asked for beyond the slack of each term, in its unit; by default nothing, not even that.
    """
    total = full(plan.size, (), 0.0)
    for term in TERMS:
        seen = term.find(plan) if term.kind in kinds else None
        if seen is None or not len(seen.who):
            continue
        miss = (max(term.slack + beyond, 0.0) - seen.margin).clip(0.0, MOST)
        if term.kind in BY_EYE:
            miss = miss * ~plan.fixed[seen.who]
        total = total + COST[term.kind][1] * term.weight * miss.sum()
    return total
