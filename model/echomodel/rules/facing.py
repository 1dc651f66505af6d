"""Rules of where furniture looks and what it stands in line with."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes2d import axes, hull, seen
from echomodel.rules.geometry import TINY, PairGeometry
from echomodel.rules.sets import LOOK, rule

LINE = 0.1  # metres beside the line


def _faces(yaw: Tensor, way: Tensor) -> Tensor:
    """(P,) how much better than `LOOK` a front at `yaw` (P,) points along `way` (P, 2)."""
    return (axes(yaw)[1] * way).sum(-1) / way.square().sum(-1).clamp_min(TINY).sqrt() - LOOK


@rule("facing")
def facing(pair: PairGeometry) -> Tensor:
    """The subject's front looks at the object's centre, to 30 degrees, or straight ahead at any part of it."""
    way = -pair.offset[:, [0, 2]]
    aside, ahead = seen(way, pair.yaw_s).unbind(-1)
    across = hull(pair.footprint_o[0], pair.yaw_o - pair.yaw_s)[:, 0]
    return torch.maximum(_faces(pair.yaw_s, way), torch.minimum(across - aside.abs(), ahead))


@rule("opposite")
def opposite(pair: PairGeometry) -> Tensor:
    """Both look at each other."""
    way = pair.offset[:, [0, 2]]
    return torch.minimum(_faces(pair.yaw_s, -way), _faces(pair.yaw_o, way))


@rule("aligned_with")
def aligned(pair: PairGeometry) -> Tensor:
    """The subject's centre lies in line with the object's, beside it or before it."""
    return LINE - pair.local.abs().amin(-1)


@rule("centered_on")
def centred(pair: PairGeometry) -> Tensor:
    """The subject's centre lies on the line through the object's middle along its front."""
    return LINE - pair.local[:, 0].abs()
