"""What every node hears of the room around it: each wall, door, passage and window, from where the node stands now."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.floors import edges, known, signed_area

SCALES = (3.0, 0.4, 0.08)  # metres at which a gap is told
SIDE = 10  # start and end (x, z), inward normal (x, z), depth that stays free, sill, top, kind
WALL, DOOR, WINDOW = 0.0, 1.0, 2.0  # kinds of sides
SIDE_FEATURES = 4 * len(SCALES) + 15


class RoomEcho(nn.Module):
    """An echo of the room: x_i <- x_i + W / sqrt(m_i) * sum_k silu(A x_i + P f_ik) over the m_i sides of i's room.

    It begins at zero, so that weights that know no sides stay what they are until it is trained.

    Arguments:
        width: channels of a node.

    Shapes:
        x (N, width), features (N, M, SIDE_FEATURES), there (N, M) -> (N, width)
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.node = nn.Linear(width, width)
        self.told = nn.Linear(SIDE_FEATURES, width, bias=False)
        self.message = nn.Linear(width, width)
        nn.init.normal_(self.told.weight, std=0.3)
        nn.init.zeros_(self.message.weight)
        nn.init.zeros_(self.message.bias)

    def forward(self, x: Tensor, features: Tensor, there: Tensor) -> Tensor:
        heard = nn.functional.silu(self.node(self.norm(x))[:, None] + self.told(features))
        return x + self.message((heard * there[..., None]).sum(1) * there.sum(1, keepdim=True).clamp_min(1).rsqrt())


def sides_of(floor: Tensor, openings: Tensor) -> Tensor:
    """The walls and openings of rooms: floor (S, K, 2), openings (S, O, ROW) in metres -> (S, M, SIDE), NaN = none."""
    start, end = edges(floor)
    along = end - start
    length = along.norm(dim=-1, keepdim=True)
    inward = torch.stack([-along[..., 1], along[..., 0]], -1) / length.clamp_min(1e-6)
    inward = inward * torch.where(signed_area(floor) < 0, -1.0, 1.0)[:, None, None]
    walls = torch.cat([start, end, inward, torch.zeros_like(length).expand(-1, -1, 4)], -1)
    there = (length > 1e-3) & known(floor)[:, None, None]
    kinds = torch.where(openings[..., 9:] > 0.5, WINDOW, DOOR)
    return torch.cat([torch.where(there, walls, torch.nan), torch.cat([openings[..., :9], kinds], -1)], 1)


def side_features(boxes: Boxes, sides: Tensor) -> tuple[Tensor, Tensor]:
    """Every side as each node finds it: in the side's own frame, so that it is alike at all walls, and by the compass.

    Told are the gap between the box and the side's line, and the way to both of its ends along it, and to its nearest
    point; where that lies in the room; how the box is turned to it; how long, deep and high it is.

    Arguments:
        boxes: N boxes. sides: (N, M, SIDE), those of the room of each, NaN = none.

    Returns (N, M, SIDE_FEATURES) and (N, M) float32, 1 for those that are there; the others are zero.
    """
    there = torch.isfinite(sides[..., 0])
    sides = torch.where(there[..., None], sides, 0.0)
    start, end, inward = sides[..., 0:2], sides[..., 2:4], sides[..., 4:6]
    along = torch.stack([inward[..., 1], -inward[..., 0]], -1)
    one, other = ((point * along).sum(-1) for point in (start, end))
    place = boxes.position[:, None, [0, 2]]
    sin, cos = boxes.yaw.sin()[:, None], boxes.yaw.cos()[:, None]
    front = torch.stack([sin * inward[..., 0] + cos * inward[..., 1], sin * along[..., 0] + cos * along[..., 1]], -1)
    half = boxes.size[:, None, [0, 2]] / 2
    reach_in = front[..., 1].abs() * half[..., 0] + front[..., 0].abs() * half[..., 1]
    reach_along = front[..., 0].abs() * half[..., 0] + front[..., 1].abs() * half[..., 1]
    at = (place * along).sum(-1)
    gap = ((place - start) * inward).sum(-1) - reach_in
    first = at - torch.minimum(one, other) - reach_along
    last = torch.maximum(one, other) - at - reach_along
    run = end - start
    length = run.square().sum(-1)
    share = (((place - start) * run).sum(-1) / length.clamp_min(1e-6)).clamp(0, 1)
    way = start + share[..., None] * run - place
    gaps = torch.stack([gap, first, last, (way.square().sum(-1) + 1e-9).sqrt()], -1)
    under = sides[..., 7] - (boxes.position[:, 1] + boxes.size[:, 1])[:, None]
    kind = sides[..., 9:]
    told = [torch.tanh(gaps / scale) for scale in SCALES] + [torch.tanh(way / scale) for scale in SCALES[:2]]
    told += [inward, front, length.clamp_min(1e-9).sqrt()[..., None] / 3, sides[..., 6:9]]
    told += [torch.tanh(under / SCALES[1])[..., None], (kind == DOOR).to(gaps), (kind == WINDOW).to(gaps)]
    return torch.cat(told, -1) * there[..., None], there.to(gaps)
