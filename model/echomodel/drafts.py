"""Drafts of layouts: the room generator's own arrangement of a graph's furniture, for the denoiser to begin with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.floors import known
from echomodel.graph import GraphBatch
from echomodel.randomness import Randomness, whole_numbers
from echomodel.rooms.arranging import arranged
from echomodel.rooms.floor import Floor
from echomodel.rooms.outline import floor_of
from echomodel.rules import measured, verdicts
from echomodel.vocabulary import vocabulary

PLACED = 2.0  # relations that a piece is worth which found a place of its own
DEALS = 4  # ways in which equal pieces are dealt to the nodes
EXCHANGES = 3  # rounds in which two equal pieces may change places
MOST_PAIRS = 400  # of them that are tried, each a whole layout to judge
TOGETHER = 4  # arrangements that are drawn before they are judged
CROWD = 480  # pieces of all arrangements of a scene together
MIRRORS = ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))


@dataclass(frozen=True, eq=False)
class _Candidate:
    """One arrangement of n pieces: (n, 3), (n, 3), (n,) float, and how many found a place of their own."""

    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    placed: int


def drafted(graph: GraphBatch, generator: Randomness, *, rules: str, draws: int = 8) -> tuple[Boxes, Tensor]:
    """Arrange the furniture of S scenes by the groups of the room generator, on their floors.

    Arrangements are drawn, mirrored where they still fit the floor, and equal pieces dealt to their nodes in a few
    ways, until one finds every piece a place and keeps every told relation; else the one that comes nearest is taken.

    Arguments:
        graph: scenes whose floors are known. generator: source of all randomness.
        rules: the rule set that the relations are meant in.
        draws: most arrangements of a scene; fewer are drawn of scenes with more than 30 pieces.

    Returns:
        N boxes, in the room frame, and (S,) float32, the share of the told relations that each scene's draft keeps.

    Raises:
        ValueError: a floor is not known.
    """
    if not bool(known(graph.floor).all()):
        raise ValueError("a scene without a floor cannot be arranged")
    scenes = graph.to("cpu").unpack()
    drawn = [
        _scene(scene, np.random.Generator(np.random.PCG64(list(seed))), rules, draws)
        for scene, seed in zip(scenes, whole_numbers(generator, len(scenes)), strict=True)
    ]
    return Boxes.cat([boxes for boxes, _ in drawn]), torch.tensor([share for _, share in drawn])


def _scene(graph: GraphBatch, rng: np.random.Generator, rules: str, draws: int) -> tuple[Boxes, float]:
    words = vocabulary()
    category = graph.category.numpy()
    categories = [words.categories[k].name for k in category.tolist()]
    room_type = words.room_types[int(graph.room_type[0])].name
    corners = graph.floor[0]
    floor = floor_of(corners[torch.isfinite(corners).all(1)].double().numpy(), graph.openings[0].double().numpy())
    triplets = graph.triplets[torch.isin(graph.triplets[:, 1], torch.tensor(sorted(measured(rules))))]
    deals = DEALS if len(triplets) and len(set(categories)) < len(categories) else 1
    together = TOGETHER if len(triplets) else 1
    draws = max(together, min(draws, CROWD // max(len(category), 1)))
    best, most, share = None, -1.0, 1.0
    for start in range(0, draws, together):
        found = []
        for _ in range(min(together, draws - start)):
            size, position, yaw, placed = arranged(categories, room_type, floor, rng)
            for mirrored in _mirrored(size, position, yaw, placed, floor):
                found += [_dealt(mirrored, category, rng) if k else mirrored for k in range(deals)]
        kept = _kept(found, triplets, rules)
        merit = kept + PLACED * np.array([candidate.placed for candidate in found])
        number = int(merit.argmax())
        chosen, count = _exchanged(found[number], float(kept[number]), category, triplets, rules)
        if count + PLACED * chosen.placed > most:
            best, most, share = chosen, count + PLACED * chosen.placed, count / max(len(triplets), 1)
        if most >= len(triplets) + PLACED * len(categories):
            break
    assert best is not None
    return _boxes([best]), share if len(triplets) else 1.0


def _mirrored(
    size: np.ndarray, position: np.ndarray, yaw: np.ndarray, placed: np.ndarray, floor: Floor
) -> list[_Candidate]:
    """The arrangement, and its mirror images along x, along z and both that fit the floor as well."""
    cos, sin = np.abs(np.cos(yaw)), np.abs(np.sin(yaw))
    half = np.stack([cos * size[:, 0] + sin * size[:, 2], sin * size[:, 0] + cos * size[:, 2]], 1) / 2
    top = position[:, 1] + size[:, 1]
    out: list[_Candidate] = []
    for x, z in MIRRORS:
        there = position * [x, 1.0, z]
        if out and not all(_fits(there[k, [0, 2]], half[k], float(top[k]), floor) for k in np.flatnonzero(placed)):
            continue
        out.append(_Candidate(size, there, np.arctan2(x * np.sin(yaw), z * np.cos(yaw)), int(placed.sum())))
    return out


def _fits(middle: np.ndarray, half: np.ndarray, top: float, floor: Floor) -> bool:
    """Whether a hull stands on the floor, out of the way of doors and windows."""
    (x0, z0), (x1, z1) = (middle - half).tolist(), (middle + half).tolist()
    before = [*floor.doors, *(window for window, height in floor.windows if top > height)]
    return floor.holds(x0, z0, x1, z1) and not any(x0 < b[2] and x1 > b[0] and z0 < b[3] and z1 > b[1] for b in before)


def _dealt(one: _Candidate, category: np.ndarray, rng: np.random.Generator) -> _Candidate:
    """The same arrangement with the pieces of each class dealt to its nodes anew."""
    order = np.lexsort((rng.random(len(category)), category))
    places = np.argsort(category, kind="stable")
    deal = np.empty(len(category), int)
    deal[places] = order
    return _Candidate(one.size[deal], one.position[deal], one.yaw[deal], one.placed)


def _exchanged(
    one: _Candidate, kept: float, category: np.ndarray, triplets: Tensor, rules: str
) -> tuple[_Candidate, float]:
    """The arrangement after equal pieces changed places as long as that keeps more relations, and how many it keeps."""
    pairs = [(i, k) for i in range(len(category)) for k in range(i) if category[i] == category[k]][:MOST_PAIRS]
    for _ in range(EXCHANGES):
        if kept >= len(triplets) or not pairs:
            break
        order = np.tile(np.arange(len(category)), (len(pairs), 1))
        for row, (i, k) in enumerate(pairs):
            order[row, [i, k]] = k, i
        others = [_Candidate(one.size[o], one.position[o], one.yaw[o], one.placed) for o in order]
        counts = _kept(others, triplets, rules)
        number = int(counts.argmax())
        if counts[number] <= kept:
            break
        one, kept = others[number], float(counts[number])
    return one, kept


def _kept(candidates: list[_Candidate], triplets: Tensor, rules: str) -> np.ndarray:
    """(C,) float, how many relations each of C candidates for the boxes of a scene keeps."""
    count, nodes = len(candidates), len(candidates[0].yaw)
    if not len(triplets):
        return np.zeros(count)
    shift = torch.arange(count)[:, None, None] * torch.tensor([nodes, 0, nodes])
    told = verdicts(_boxes(candidates), (triplets[None] + shift).reshape(-1, 3), rules=rules)
    return (told == 1).reshape(count, -1).sum(1).double().numpy()


def _boxes(candidates: list[_Candidate]) -> Boxes:
    parts = ([getattr(candidate, name) for candidate in candidates] for name in ("size", "position", "yaw"))
    return Boxes(*(torch.from_numpy(np.concatenate(part)).float() for part in parts))
