"""A judge of rooms: a small classifier that tells layouts of one source from real ones of the same furniture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.compact.draft import measurable, seen_from, wall_features
from echomodel.floors import centred
from echomodel.roomboxes import RoomBoxes
from echomodel.sizes import size_score
from echomodel.vocabulary import vocabulary

WIDTH, STEPS, RATE, DECAY = 48, 160, 3e-3, 3e-3
RUNS = 4  # half of them each way round
NEIGHBOURS = 5  # of each object that are looked at
SCORES = 3.0  # standard scores beyond which a size is told no further


class _Judge(nn.Module):
    """Looks at every object and at every pair of a room, and pools what it saw."""

    def __init__(self, own: int, pair: int) -> None:
        super().__init__()
        classes = len(vocabulary().categories)
        self.word = nn.Embedding(classes, 12)
        self.own = nn.Sequential(nn.Linear(own + 12, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH), nn.SiLU())
        self.pair = nn.Sequential(nn.Linear(pair + 24, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH), nn.SiLU())
        self.says = nn.Sequential(nn.Dropout(0.3), nn.Linear(4 * WIDTH, WIDTH), nn.SiLU(), nn.Linear(WIDTH, 1))

    def forward(self, rooms: _Packed) -> Tensor:
        words = self.word(rooms.category)
        own = self.own(torch.cat([rooms.own, words], 1))
        pair = self.pair(torch.cat([rooms.pair, words[rooms.ends[:, 0]], words[rooms.ends[:, 1]]], 1))
        seen = [_pooled(own, rooms.scene, rooms.count), _pooled(pair, rooms.scene[rooms.ends[:, 0]], rooms.count)]
        return self.says(torch.cat(seen, 1))[:, 0]


class _Packed:
    """Rooms as features of their objects (N, F) and ordered pairs (P, G)."""

    def __init__(self, rooms: Sequence[RoomBoxes]) -> None:
        words = vocabulary()
        own, pair, ends, category, first = [], [], [], [], 0
        for room in rooms:
            boxes = measurable(Boxes.from_room(room))
            floor = centred(room.floor_polygon if len(room.floor_polygon) else None)[None].expand(len(room), -1, -1)
            scores = [size_score(word, room.size[k : k + 1])[0] for k, word in enumerate(room.categories)]
            lift = boxes.position[:, 1:2]
            told = torch.from_numpy(np.array(scores)).float().clamp(-SCORES, SCORES)
            own.append(torch.cat([wall_features(boxes, floor), told, torch.tanh(lift), torch.tanh(20 * lift)], 1))
            near = _neighbours(boxes)
            pair.append(near[1])
            ends.append(near[0] + first)
            category += [words.category_id(word) for word in room.categories]
            first += len(room)
        self.own, self.pair, self.ends = torch.cat(own), torch.cat(pair), torch.cat(ends)
        self.category, self.count = torch.tensor(category), len(rooms)
        self.scene = torch.arange(len(rooms)).repeat_interleave(torch.tensor([len(room) for room in rooms]))


def judged(real: Sequence[RoomBoxes], made: Sequence[RoomBoxes], seed: int = 0) -> float:
    """How often the judge is right about rooms that it was not trained on: 0.5 = it cannot tell them apart.

    Trained on every other pair of rooms, tested on the rest, and the other way round.

    Arguments:
        real, made: n rooms each, of the same furniture in the same order, in the vocabulary's words.
    """
    parts = [[_Packed([*real[k::2], *made[k::2]]), len(real[k::2])] for k in (0, 1)]
    right = [_accuracy(parts[run % 2], parts[1 - run % 2], seed + run) for run in range(RUNS)]
    return float(np.mean(right))


def _accuracy(train: list, test: list, seed: int) -> float:
    (rooms, count), (others, number) = train, test
    with torch.random.fork_rng(), torch.enable_grad():
        torch.manual_seed(seed)
        judge = _Judge(rooms.own.shape[1], rooms.pair.shape[1])
        optimizer = torch.optim.AdamW(judge.parameters(), lr=RATE, weight_decay=DECAY)
        truth = (torch.arange(rooms.count) < count).float()
        for _ in range(STEPS):
            loss = nn.functional.binary_cross_entropy_with_logits(judge(rooms), truth)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    with torch.no_grad():
        said = judge.eval()(others) > 0
    return float((said == (torch.arange(others.count) < number)).float().mean())


def _neighbours(boxes: Boxes) -> tuple[Tensor, Tensor]:
    """Each object with its nearest ones, (P, 2), and how those stand in its frame, (P, 13)."""
    apart = torch.cdist(boxes.position[:, [0, 2]], boxes.position[:, [0, 2]]).fill_diagonal_(torch.inf)
    j = apart.topk(min(NEIGHBOURS, len(boxes) - 1), largest=False).indices
    i, j = torch.arange(len(boxes)).repeat_interleave(j.shape[1]), j.flatten()
    turn = boxes.yaw[j] - boxes.yaw[i]
    told = torch.cat([seen_from(boxes, i, j), torch.stack([turn.sin(), turn.cos(), (4 * turn).sin()], 1)], 1)
    return torch.stack([i, j], 1), told


def _pooled(seen: Tensor, scene: Tensor, count: int) -> Tensor:
    """Mean and largest of what was seen of each room: (M, W) -> (S, 2 W)."""
    many = torch.zeros(count, 1).index_add_(0, scene, torch.ones(len(scene), 1)).clamp_min(1)
    mean = torch.zeros(count, seen.shape[1]).index_add(0, scene, seen) / many
    most = torch.zeros(count, seen.shape[1]).scatter_reduce(0, scene[:, None].expand_as(seen), seen, "amax")
    return torch.cat([mean, most], 1)
