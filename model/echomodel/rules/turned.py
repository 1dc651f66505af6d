"""Relations beyond SG-FRONT that ask how objects are turned: facing, opposite, aligned with, centered on.

They are measured, repaired and guided to, but rooms are not labelled with them, so that the networks do not know them.
"""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.rules.geometry import TINY, PairGeometry
from echomodel.rules.sets import LOOK, rule

LINE = 0.1  # metres beside the line


def _faces(yaw: Tensor, way: Tensor) -> Tensor:
    """(P,) how much better than `LOOK` a front at `yaw` (P,) points along `way` (P, 2)."""
    front = torch.stack([yaw.sin(), yaw.cos()], -1)
    return (front * way).sum(-1) / way.square().sum(-1).clamp_min(TINY).sqrt() - LOOK


def _local(pair: PairGeometry) -> Tensor:
    """(P, 2) the subject's centre in the object's frame: along its width, along its front."""
    cos, sin = pair.yaw_o.cos(), pair.yaw_o.sin()
    x, z = pair.offset[:, 0], pair.offset[:, 2]
    return torch.stack([cos * x - sin * z, sin * x + cos * z], -1)


@rule("facing")
def facing(pair: PairGeometry) -> Tensor:
    """The subject's front looks at the object's centre, to 30 degrees, or straight ahead at any part of it."""
    way = -pair.offset[:, [0, 2]]
    cos, sin = pair.yaw_s.cos(), pair.yaw_s.sin()
    aside = (cos * way[:, 0] - sin * way[:, 1]).abs()
    ahead = sin * way[:, 0] + cos * way[:, 1]
    turn = pair.yaw_o - pair.yaw_s
    half = pair.footprint_o[0]
    across = turn.cos().abs() * half[:, 0] + turn.sin().abs() * half[:, 1]
    return torch.maximum(_faces(pair.yaw_s, way), torch.minimum(across - aside, ahead))


@rule("opposite")
def opposite(pair: PairGeometry) -> Tensor:
    """Both look at each other."""
    way = pair.offset[:, [0, 2]]
    return torch.minimum(_faces(pair.yaw_s, -way), _faces(pair.yaw_o, way))


@rule("aligned_with")
def aligned(pair: PairGeometry) -> Tensor:
    """The subject's centre lies in line with the object's, beside it or before it."""
    return LINE - _local(pair).abs().amin(-1)


@rule("centered_on")
def centred(pair: PairGeometry) -> Tensor:
    """The subject's centre lies on the line through the object's middle along its front."""
    return LINE - _local(pair)[:, 0].abs()
