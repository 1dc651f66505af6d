"""Relation guidance: at every step boxes are nudged towards the relations, onto the floor and out of doorways."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxScale
from echomodel.floors import footprint, signed_distance
from echomodel.openingrows import kept_free
from echomodel.rules import margins, measured
from echomodel.samplers import Predict
from echomodel.vocabulary import vocabulary

SLACK = 0.03  # metres or ratio that the guidance asks for beyond what the rule does


def relation_guided(
    predict: Predict,
    triplets: Tensor,
    scale: BoxScale,
    *,
    rules: str,
    strength: float,
    rounds: int = 2,
    floor: Tensor | None = None,
    openings: Tensor | None = None,
) -> Predict:
    """Follow `predict` by gradient steps on the missed margins of the relations, in the normalised box space.

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
        openings: (N, O, ROW) float32, what each node must keep out of the way of (`echomodel.openingrows`), NaN = none;
            None = no node of any.
    """
    known = torch.tensor(sorted(measured(rules)), device=triplets.device)
    wanted = triplets[torch.isin(triplets[:, 1], known)]
    if not len(wanted) and floor is None and openings is None:
        return predict
    weights = [entry.emphasis for entry in vocabulary().predicates]
    emphasis = torch.tensor(weights, device=wanted.device)[wanted[:, 1]]

    def guided(x: Tensor, level: Tensor) -> Tensor:
        clean = predict(x, level)
        weight = ((1 - level) * (level > 0))[:, None]
        for _ in range(rounds):
            with torch.enable_grad():
                free = clean.detach().requires_grad_()
                boxes = Boxes.decode(free, scale)
                missed = (SLACK - margins(boxes, wanted, rules=rules, rigid=True)).clamp(min=0)
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
                (slope,) = torch.autograd.grad(pull * SLACK, free)
            norm = slope.norm(dim=1, keepdim=True).clamp_min(1e-6)
            clean = clean - strength * weight * slope * (1 / norm).clamp(max=1 / 0.05)
        return clean

    return guided


def outside(boxes: Boxes, floor: Tensor) -> Tensor:
    """How far the corners and the middles of the sides lie beyond the walls: (N, 8) metres, 0 where unknown.

    Arguments:
        boxes: N boxes; none is asked to shrink. floor: (N, K, 2) float32, corners of the floor under each.
    """
    return (-signed_distance(footprint(boxes.size.detach(), boxes.position, boxes.yaw), floor)).clamp_min(0)
