"""Guidance: at every step boxes are nudged towards relations and placements, onto the floor, out of doorways, apart.

Margins of the objective that losses use as well: `echomodel.objective.physics.apart` (collisions, metres) here and in
`training`, all others by `TERMS` in `training/living_loss.py`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxScale
from echomodel.floors import footprint, kept_free, signed_distance
from echomodel.objective import physics
from echomodel.objective.plan import Plan
from echomodel.rules import fronts, margins, measured
from echomodel.rules.placements import Spread, Stated, Walls, margin_of
from echomodel.samplers import Predict
from echomodel.vocabulary import vocabulary

SLACK = 0.03  # metres or ratio that the guidance asks for beyond what the rule does


def relation_guided(
    predict: Predict, triplets: Tensor, scale: BoxScale, *, rules: str, strength: float, rounds: int = 2,
    floor: Tensor | None = None, openings: Tensor | None = None, category: Tensor | None = None,
    placements: Tensor | None = None, scene: Tensor | None = None,
) -> Predict:  # fmt: skip
    """Follow `predict` by gradient steps on the missed margins of relations and placements, in the normalised space.

    This is reconstruction guidance (Chung et al. 2023, posterior sampling) with the rules' margins as the measurement;
    nodes at level 0 stay as they are, and the noisier a node the smaller its step.

    Arguments:
        predict: the denoiser's clean sample (N, 8).
        triplets: (E, 3) int64; those that the rules do not measure are ignored.
        scale: what the numbers of the boxes stand for.
        rules: name of the rule set.
        strength: length of a step, 0.1 is a good start.
        rounds: steps after each call of the denoiser.
        floor: (N, K, 2) float32, corners of the floor under each node (`GraphBatch.floor`), NaN = unknown; None = all
            unknown.
        openings: (N, O, ROW) float32, what each node must keep out of the way of (`echomodel.floors`), NaN = none;
            None = no node of any.
        category: (N,) int64, whose fronts `symmetrical_to` and the placements ask for; None = none has one.
        placements: (P, 4) int64 (`GraphBatch.placements`), which need `category`; None = none.
        scene: (N,) int64, the room of each node: nodes of one room are kept apart; needs `category`; None = none are.
    """
    known = torch.tensor(sorted(measured(rules)), device=triplets.device)
    wanted = triplets[torch.isin(triplets[:, 1], known)]
    stated = [] if placements is None or category is None else _stated(placements, category, floor)
    if not len(wanted) and floor is None and openings is None and not stated and scene is None:
        return predict
    words = vocabulary()
    headed = None
    if category is not None:
        headed = fronts(words.categories[k].name for k in category.tolist()).to(category.device)
    weights = [entry.emphasis for entry in words.predicates]
    emphasis = torch.tensor(weights, device=wanted.device)[wanted[:, 1]]

    def guided(x: Tensor, level: Tensor) -> Tensor:
        clean = predict(x, level)
        weight = ((1 - level) * (level > 0))[:, None]
        if not bool(weight.any()):  # in nothing but noise no step has a length
            return clean
        strangers = None
        if scene is not None and category is not None:
            strangers = _strangers(Boxes.decode(clean.detach(), scale), category, scene, triplets)
        for _ in range(rounds):
            with torch.enable_grad():
                free = clean.detach().requires_grad_()
                boxes = Boxes.decode(free, scale)
                missed = (SLACK - margins(boxes, wanted, rules=rules, fronts=headed, rigid=True)).clamp(min=0)
                # the logarithm bounds the pull of a relation that is missed by far
                pull = (torch.log1p(missed / SLACK) * emphasis).sum()
                if floor is not None:
                    # one pull a box: it may overhang twice
                    beyond = (outside(boxes, floor).square().sum(1) + 1e-12).sqrt()
                    pull = pull + torch.log1p(beyond / SLACK).sum()
                if openings is not None:
                    rigid = Boxes(boxes.size.detach(), boxes.position, boxes.yaw)  # none is asked to shrink
                    blocked = (SLACK - kept_free(rigid, openings)).clamp_min(0)
                    pull = pull + torch.log1p(blocked / SLACK).sum()
                if strangers is not None:  # a room's pieces run into each other where it is nearly drawn
                    plan = replace(strangers, size=boxes.size.detach(), position=boxes.position, yaw=boxes.yaw)
                    vars(plan).update(couples=tuple(found.to(free.device) for found in strangers.couples))
                    seen = physics.apart(plan)
                    near = (1 - level[seen.who]).square()
                    pull = pull + (torch.log1p((SLACK - seen.margin).clamp_min(0) / SLACK) * near).sum()
                for group in stated:
                    pull = pull + torch.log1p((SLACK - group(boxes)).clamp_min(0) / SLACK).sum()
                (slope,) = torch.autograd.grad(pull * SLACK, free)
            norm = slope.norm(dim=1, keepdim=True).clamp_min(1e-6)
            clean = clean - strength * weight * slope * (1 / norm).clamp(max=1 / 0.05)
        return clean

    return guided


def _strangers(boxes: Boxes, category: Tensor, scene: Tensor, triplets: Tensor) -> Plan:
    """The plan of boxes as they were drawn last, which says what belongs together and may overlap; on the CPU."""
    boxes = boxes.to("cpu")
    rows, rooms = vocabulary().categories, int(scene.max()) + 1 if len(scene) else 0
    return Plan(
        tuple(rows[number] for number in category.tolist()), boxes.size, boxes.position, boxes.yaw, scene.cpu(),
        torch.full((rooms, 4, 2), torch.nan), ((),) * rooms, triplets.cpu(), torch.zeros(len(scene), dtype=torch.bool),
    )  # fmt: skip


def _stated(placements: Tensor, category: Tensor, floor: Tensor | None) -> list[Callable[[Boxes], Tensor]]:
    """The margins (K,) of all placements as functions of the boxes; those of one kind and floor are measured at once.

    What needs walls where none are known is left out.
    """
    words, groups = vocabulary(), defaultdict(list)
    for row in placements.tolist():
        corners = None if floor is None else floor[row[0]].double().cpu().numpy()
        key = b"" if corners is None else corners[np.isfinite(corners).all(1)].tobytes()
        groups[row[1], int(category[row[0]]), key].append(row)
    out: list[Callable[[Boxes], Tensor]] = []
    for (kind, number, key), rows in groups.items():
        corners = np.frombuffer(key).reshape(-1, 2).copy()
        walls = Walls(corners).to(category.device) if len(corners) else None
        if walls is None and not words.placements[kind].others:
            continue
        nodes = [torch.tensor(column, device=category.device) for column in zip(*rows, strict=True)]
        named = [n for n in (nodes[0], *nodes[2:]) if int(n[0]) >= 0]
        told = Stated(words.placements[kind].name, 0, tuple(range(1, len(named))))
        out.append(partial(_placement_margin, told, named, walls, words.categories[number].name))
    return out


def _placement_margin(told: Stated, nodes: list[Tensor], walls: Walls | None, word: str, boxes: Boxes) -> Tensor:
    size = boxes.size.detach()  # none is asked to shrink
    every = [Spread(size[n].double(), boxes.position[n].double(), boxes.yaw[n].double()) for n in nodes]
    return margin_of(told, every, walls, [word]).float()


def outside(boxes: Boxes, floor: Tensor) -> Tensor:
    """How far the corners and the middles of the sides lie beyond the walls: (N, 8) metres, 0 where unknown.

    Arguments:
        boxes: N boxes; none is asked to shrink. floor: (N, K, 2) float32, corners of the floor under each.
    """
    return (-signed_distance(footprint(boxes.size.detach(), boxes.position, boxes.yaw), floor)).clamp_min(0)
