"""Drafts of layouts: the room generator's own arrangement of a graph's furniture, for the denoiser to begin with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.data.rooms.arranging import arranged
from echomodel.data.rooms.floor import Floor
from echomodel.data.rooms.outline import floor_of
from echomodel.floors import footprint, known
from echomodel.graph import GraphBatch
from echomodel.rules import measured, verdicts
from echomodel.vocabulary import vocabulary

PLACED = 2.0  # relations that a piece is worth which found a place of its own
SHUFFLES = 4  # ways in which equal pieces are dealt to the nodes


def drafted(graph: GraphBatch, generator: torch.Generator, *, rules: str, draws: int = 8) -> tuple[Boxes, Tensor]:
    """Arrange the furniture of S scenes by the groups of the room generator, on their floors.

    Arrangements are drawn, mirrored where they still fit the floor, and equal pieces dealt to their nodes in a few
    ways, until one finds every piece a place and keeps every told relation; else the one that comes nearest is taken.

    Arguments:
        graph: scenes whose floors are known. generator: source of all randomness.
        rules: the rule set that the relations are meant in. draws: most arrangements of a scene.

    Returns:
        N boxes, in the room frame, and (S,) float32, the share of the told relations that each scene's draft keeps.

    Raises:
        ValueError: a floor is not known.
    """
    if not bool(known(graph.floor).all()):
        raise ValueError("a scene without a floor cannot be arranged")
    seed = int(torch.randint(2**62, (1,), generator=generator))
    drawn = [
        _scene(scene, np.random.Generator(np.random.PCG64([seed, number])), rules, draws)
        for number, scene in enumerate(graph.to("cpu").unpack())
    ]
    return Boxes.cat([boxes for boxes, _ in drawn]), torch.tensor([share for _, share in drawn])


def _scene(graph: GraphBatch, rng: np.random.Generator, rules: str, draws: int) -> tuple[Boxes, float]:
    words = vocabulary()
    categories = [words.categories[k].name for k in graph.category.tolist()]
    room_type = words.room_types[int(graph.room_type[0])].name
    corners = graph.floor[0]
    floor = floor_of(corners[torch.isfinite(corners).all(1)].double().numpy(), graph.openings[0].double().numpy())
    triplets = graph.triplets[torch.isin(graph.triplets[:, 1], torch.tensor(sorted(measured(rules))))]
    deals = SHUFFLES if len(triplets) and len(set(categories)) < len(categories) else 1
    best, most, share = None, -1.0, 1.0
    for _ in range(draws):
        size, position, yaw, found = arranged(categories, room_type, floor, rng)
        drawn = Boxes(*(torch.from_numpy(part).float() for part in (size, position, yaw)))
        fitting = [(boxes, found & _fitting(boxes, floor)) for boxes in _mirrored(drawn)]
        fitting = [(boxes, float(fits.sum())) for boxes, fits in fitting if fits.sum() == (found & fitting[0][1]).sum()]
        candidates = [b[_dealt(graph.category, rng)] if k else b for b, _ in fitting for k in range(deals)]
        kept = _kept(candidates, triplets, rules)
        merit = kept + PLACED * torch.tensor([count for _, count in fitting]).repeat_interleave(deals)
        number = int(merit.argmax())
        if float(merit[number]) > most:
            best, most, share = candidates[number], float(merit[number]), float(kept[number]) / max(len(triplets), 1)
        if most >= len(triplets) + PLACED * len(categories):
            break
    assert best is not None
    return best, share if len(triplets) else 1.0


def _kept(candidates: list[Boxes], triplets: Tensor, rules: str) -> Tensor:
    """(C,) float32, how many relations each of C candidates for the boxes of a scene keeps."""
    count, nodes = len(candidates), len(candidates[0])
    shift = torch.arange(count)[:, None, None] * torch.tensor([nodes, 0, nodes])
    told = verdicts(Boxes.cat(candidates), (triplets[None] + shift).reshape(-1, 3), rules=rules)
    return (told == 1).reshape(count, -1).sum(1).float()


def _mirrored(boxes: Boxes) -> list[Boxes]:
    """The boxes, and mirrored along x, along z, and both."""
    out = []
    for x, z in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        front = torch.atan2(x * boxes.yaw.sin(), z * boxes.yaw.cos())
        out.append(Boxes(boxes.size, boxes.position * torch.tensor([x, 1.0, z]), front))
    return out


def _fitting(boxes: Boxes, floor: Floor) -> np.ndarray:
    """(N,) bool, which boxes stand on the floor, out of the way of doors and windows."""
    reach = footprint(boxes.size, boxes.position, boxes.yaw).numpy()
    out = []
    for (x0, z0), (x1, z1), top in zip(reach.min(1), reach.max(1), (boxes.position + boxes.size)[:, 1], strict=True):
        before = list(floor.doors) + [w for w, height in floor.windows if top > height]
        free = not any(x0 < b[2] and x1 > b[0] and z0 < b[3] and z1 > b[1] for b in before)
        out.append(free and floor.holds(x0, z0, x1, z1))
    return np.array(out)


def _dealt(category: Tensor, rng: np.random.Generator) -> Tensor:
    """(N,) int64, a permutation of the nodes among those of their class."""
    order = torch.arange(len(category))
    for number in category.unique():
        own = (category == number).nonzero()[:, 0]
        order[own] = own[torch.from_numpy(rng.permutation(len(own)))]
    return order
