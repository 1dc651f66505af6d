"""Drafts of layouts: the room generator's own arrangement of a graph's furniture, for the denoiser to begin with."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.data.rooms.arranging import arranged
from echomodel.data.rooms.outline import floor_of
from echomodel.floors import known
from echomodel.graph import GraphBatch
from echomodel.rules import measured, verdicts
from echomodel.vocabulary import vocabulary

PLACED = 2.0  # relations that a piece is worth which found a place of its own
SHUFFLES = 4  # ways in which equal pieces are dealt to the nodes


def drafted(graph: GraphBatch, generator: torch.Generator, *, rules: str, draws: int = 3) -> Boxes:
    """Arrange the furniture of S scenes by the groups of the room generator, on their floors.

    Of a few arrangements, each with the equal pieces dealt to their nodes in a few ways, the one is taken that finds
    most pieces a place and keeps most of the told relations.

    Arguments:
        graph: scenes whose floors are known. generator: source of all randomness.
        rules: the rule set that the relations are meant in. draws: arrangements of a scene.

    Returns:
        N boxes, in the room frame.

    Raises:
        ValueError: a floor is not known.
    """
    if not bool(known(graph.floor).all()):
        raise ValueError("a scene without a floor cannot be arranged")
    seed = int(torch.randint(2**62, (1,), generator=generator))
    kept = torch.tensor(sorted(measured(rules)))
    return Boxes.cat(
        [
            _scene(scene, np.random.Generator(np.random.PCG64([seed, number])), rules, draws, kept)
            for number, scene in enumerate(graph.to("cpu").unpack())
        ]
    )


def _scene(graph: GraphBatch, rng: np.random.Generator, rules: str, draws: int, kept: Tensor) -> Boxes:
    words = vocabulary()
    categories = [words.categories[k].name for k in graph.category.tolist()]
    room_type = words.room_types[int(graph.room_type[0])].name
    corners = graph.floor[0]
    floor = floor_of(corners[torch.isfinite(corners).all(1)].double().numpy(), graph.openings[0].double().numpy())
    triplets = graph.triplets[torch.isin(graph.triplets[:, 1], kept)]
    candidates, merit = [], []
    for _ in range(draws):
        size, position, yaw, found = arranged(categories, room_type, floor, rng)
        boxes = Boxes(*(torch.from_numpy(part).float() for part in (size, position, yaw)))
        for shuffle in range(SHUFFLES if len(triplets) and len(set(categories)) < len(categories) else 1):
            candidates.append(boxes[_dealt(graph.category, rng)] if shuffle else boxes)
            merit.append(PLACED * float(found.sum()))
        if found.all() and not len(triplets):
            break
    many = Boxes.cat(candidates)
    if len(triplets) and len(candidates) > 1:
        count, nodes = len(candidates), graph.num_nodes
        shift = torch.arange(count)[:, None, None] * torch.tensor([nodes, 0, nodes])
        told = verdicts(many, (triplets[None] + shift).reshape(-1, 3), rules=rules).reshape(count, -1)
        merit = (torch.tensor(merit) + (told == 1).sum(1)).tolist()
    return candidates[int(np.argmax(merit))]


def _dealt(category: Tensor, rng: np.random.Generator) -> Tensor:
    """(N,) int64, a permutation of the nodes among those of their class."""
    order = torch.arange(len(category))
    for number in category.unique():
        own = (category == number).nonzero()[:, 0]
        order[own] = own[torch.from_numpy(rng.permutation(len(own)))]
    return order
