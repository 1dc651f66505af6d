"""Rooms packed into tensors for training: relations as bits per ordered pair, drawn, mirrored and thinned per batch."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.pairs import Pairs, inverse_predicates, reverse_pairs
from echomodel.config import names_of
from echomodel.data.roomset import RoomSet
from echomodel.graph import GraphBatch, ordered_pairs
from echomodel.objective.plan import Plan, kinds_of
from echomodel.roomboxes import RoomBoxes
from echomodel.rules.telling import near_first
from echomodel.surroundings import padded, trimmed
from echomodel.vocabulary import vocabulary

PREDICATES = names_of("predicates")  # that networks are told, by their ids from 0 on; rules may measure more
DENSE = 0.25  # share of the training rooms whose graphs tell 30 to 100 % of all relations
UNKNOWN_FLOOR, UNKNOWN_OPENINGS = 0.1, 0.1
TOGETHER = 50  # rooms that are looked at at a time: their terms take a sixth of what they take one by one


@dataclass(frozen=True, eq=False)
class PackedRooms:
    """R labelled rooms behind one another.

    Arguments:
        category (N,) int64, size, position (N, 3), yaw (N,) float32: as in `Boxes`, room frame.
        style: (N,) int64, style group, -1 = unknown.
        count: (R,) int64 nodes per room.
        room_type: (R,) int64. floor: (R, K, 2), openings: (R, O, ROW) float32, as in `GraphBatch`.
        rules: (R,) int64, rule set of the labels.
        bits: (P,) int32 over the ordered pairs of each room, bit p set where predicate p holds from first to second.
        allowed: (P,) float32, metres that the two may run into each other, inf where one stands on the other.
    """

    category: Tensor
    size: Tensor
    position: Tensor
    yaw: Tensor
    style: Tensor
    count: Tensor
    room_type: Tensor
    floor: Tensor
    openings: Tensor
    rules: Tensor
    bits: Tensor
    allowed: Tensor

    def __len__(self) -> int:
        return len(self.count)

    @classmethod
    def build(cls, rooms: Sequence[RoomBoxes], rules: int) -> "PackedRooms":
        """Pack rooms whose `relations` are filled in; `rules` says by which rule set they were labelled."""
        graphs = [room.graph() for room in rooms]
        boxes = Boxes.cat([room.boxes() for room in rooms])
        return cls(
            category=torch.cat([g.category for g in graphs]), size=boxes.size, position=boxes.position, yaw=boxes.yaw,
            style=torch.tensor([s for room in rooms for s in (room.styles or (-1,) * len(room))]),
            count=torch.tensor([len(room) for room in rooms]), room_type=torch.cat([g.room_type for g in graphs]),
            floor=padded([g.floor for g in graphs]), openings=padded([g.openings for g in graphs]),
            rules=torch.full((len(rooms),), rules), bits=torch.cat([_bits(g) for g in graphs]),
            allowed=_allowed(rooms),
        )  # fmt: skip

    @classmethod
    def from_set(cls, rooms: RoomSet, rules: Sequence[str], *, held: bool) -> "PackedRooms":
        """One part of a room set, every room once per rule set; the last twentieth where nothing is held out."""
        mask = rooms.held_out if rooms.held_out.any() else np.arange(len(rooms)) >= len(rooms) * 19 // 20
        numbers = (mask == held).nonzero()[0]
        parts = [
            cls.build([rooms.room(int(n), rules=name) for n in some], number)
            for number, name in enumerate(rules)
            for some in np.split(numbers, range(500, len(numbers), 500))
        ]
        join = {"floor": padded, "openings": padded}
        joined = {f.name: [getattr(part, f.name) for part in parts] for f in fields(cls)}
        return cls(**{name: join.get(name, torch.cat)(of) for name, of in joined.items()})

    @property
    def boxes(self) -> Boxes:
        """All boxes."""
        return Boxes(self.size, self.position, self.yaw)


@dataclass(frozen=True, eq=False)
class LayoutBatch:
    """Scenes of one training step: `graph` without triplets, its stated predicates as pairs, and the true boxes.

    Arguments:
        predicates: (P, 16) bool, what the graph says of each pair before inverses are filled in.
        rules: (S,) int64. style: (N,) int64. allowed: (P,) float32, as in `PackedRooms`.
        before: relations of the pseudo graph before the edit (EchoScene 3.2, inverse strategy).
        added, touched: (N,) bool, nodes missing from the pseudo graph, and all nodes that the edit meets.
    """

    graph: GraphBatch
    boxes: Boxes
    pairs: Pairs
    predicates: Tensor
    rules: Tensor
    style: Tensor
    before: Pairs
    added: Tensor
    touched: Tensor
    allowed: Tensor

    def to(self, device: torch.device | str) -> "LayoutBatch":
        """The same batch on another device."""
        return LayoutBatch(**{f.name: vars(self)[f.name].to(device) for f in fields(self)})


def draw_batch(rooms: PackedRooms, node_budget: int, generator: torch.Generator) -> LayoutBatch:
    """Draw rooms until the node budget is reached, mirror them, thin their relations and make pseudo edits."""
    owner = torch.arange(len(rooms)).repeat_interleave(rooms.count)  # every object is drawn as often, not every room
    picked = owner[torch.randint(len(owner), (node_budget,), generator=generator)]
    fits = rooms.count[picked].cumsum(0) <= node_budget
    fits[0] = True
    return make_batch(rooms, picked[fits], generator)


def make_batch(rooms: PackedRooms, picked: Tensor, generator: torch.Generator, *, train: bool = True) -> LayoutBatch:
    """The batch of the picked rooms (K,); without `train` nothing is mirrored and half of the relations is dropped."""
    counts = rooms.count[picked]
    nodes = _ranges(rooms.count.cumsum(0)[picked] - counts, counts)
    all_pairs = rooms.count * (rooms.count - 1)
    pair_counts = all_pairs[picked]
    places = _ranges(all_pairs.cumsum(0)[picked] - pair_counts, pair_counts)
    bits = rooms.bits[places]
    scene = torch.arange(len(picked)).repeat_interleave(counts)
    holds = (bits[:, None] >> torch.arange(len(PREDICATES))) & 1 == 1
    position, yaw = rooms.position[nodes].clone(), rooms.yaw[nodes].clone()
    floor, openings = trimmed(rooms.floor[picked]).clone(), rooms.openings[picked].clone()
    pair_scene = torch.arange(len(picked)).repeat_interleave(pair_counts)
    receiver, sender, scale = ordered_pairs(counts)
    if train:
        holds = _mirror(holds, position, yaw, floor, openings, scene, pair_scene, generator)
        blind = torch.rand(len(picked), 2, generator=generator)
        floor[blind[:, 0] < UNKNOWN_FLOOR] = torch.nan
        openings[(blind[:, 0] < UNKNOWN_FLOOR) | (blind[:, 1] < UNKNOWN_OPENINGS)] = torch.nan
    boxes = Boxes(rooms.size[nodes], position, yaw)
    if train:
        predicates = _thinned(holds, boxes, receiver, sender, pair_scene, counts, generator)
    else:
        predicates = holds & (torch.rand(holds.shape, generator=generator) < 0.5)
    pairs = Pairs(receiver, sender, _stated(predicates.float(), receiver, sender, counts), scale)
    graph = GraphBatch(
        category=rooms.category[nodes], triplets=torch.zeros(0, 3, dtype=torch.int64), scene=scene,
        room_type=rooms.room_type[picked], floor=floor, openings=openings,
    )  # fmt: skip
    before, added, touched = _pseudo_edit(pairs, predicates, counts, generator)
    kinds = {"rules": rooms.rules[picked], "style": rooms.style[nodes]}
    allowed = rooms.allowed[places]
    return LayoutBatch(
        graph, boxes, pairs, predicates, before=before, added=added, touched=touched, allowed=allowed, **kinds
    )


def _bits(graph: GraphBatch) -> Tensor:
    counts = graph.node_counts
    receiver, sender, _ = ordered_pairs(counts)
    number = torch.full((graph.num_nodes, graph.num_nodes), -1)
    number[receiver, sender] = torch.arange(len(receiver))
    hot = torch.zeros(len(receiver), len(PREDICATES), dtype=torch.int32)
    kept = graph.triplets[graph.triplets[:, 1] < len(PREDICATES)]
    hot[number[kept[:, 0], kept[:, 2]], kept[:, 1]] = 1
    return (hot << torch.arange(len(PREDICATES), dtype=torch.int32)).sum(1, dtype=torch.int32)


def _allowed(rooms: Sequence[RoomBoxes]) -> Tensor:
    """(P,) float32, what the objective allows the ordered pairs of true rooms."""
    out = []
    for first in range(0, len(rooms), TOGETHER):
        part = rooms[first : first + TOGETHER]
        one, other, metres = map(torch.from_numpy, plan_of_rooms(part).couples)
        counts = torch.tensor([len(room) for room in part])
        table = torch.full((int(counts.sum()),) * 2, torch.inf)
        table[one, other] = table[other, one] = metres
        out.append(table[ordered_pairs(counts)[:2]])
    return torch.cat(out)


def _ranges(starts: Tensor, counts: Tensor) -> Tensor:
    total = int(counts.sum())
    return torch.arange(total) + (starts - counts.cumsum(0) + counts).repeat_interleave(counts)


def _mirror(
    holds: Tensor, position: Tensor, yaw: Tensor, floor: Tensor, openings: Tensor, scene: Tensor, pair_scene: Tensor,
    generator: torch.Generator,
) -> Tensor:  # fmt: skip
    """Flip rooms along x and z (`position`, `yaw`, `floor`, `openings` in place) and swap the words that change their
    meaning."""
    flip = torch.rand(int(scene[-1]) + 1, 2, generator=generator) < 0.5
    along_x, along_z = flip[:, 0], flip[:, 1]
    floor *= 1 - 2 * flip[:, None].float()
    openings[..., :6] *= (1 - 2 * flip[:, None].float()).repeat(1, 1, 3)
    position[:, 0] *= 1 - 2 * along_x[scene].float()
    position[:, 2] *= 1 - 2 * along_z[scene].float()
    # the front (sin yaw, cos yaw) of an object is mirrored with the room
    yaw *= 1 - 2 * along_x[scene].float()
    turned = torch.pi - yaw
    yaw.copy_(torch.where(along_z[scene], torch.remainder(turned + torch.pi, 2 * torch.pi) - torch.pi, yaw))
    words = vocabulary()
    for mask, axis in ((along_x[pair_scene], "mirror_x"), (along_z[pair_scene], "mirror_z")):
        order = [words.predicate_id(getattr(row, axis) or row.name) for row in words.predicates[: len(PREDICATES)]]
        holds = torch.where(mask[:, None], holds[:, order], holds)
    return holds


def _thinned(
    holds: Tensor, boxes: Boxes, receiver: Tensor, sender: Tensor, pair_scene: Tensor, counts: Tensor,
    generator: torch.Generator,
) -> Tensor:  # fmt: skip
    """(P, 16) bool, the relations that the graph tells: some rooms as dense as SG-FRONT, others as sparse as by hand.

    By hand people relate what stands close together, so sparse graphs tell near pairs first, each by one relation.
    """
    scenes = len(counts)
    dense = torch.rand(scenes, generator=generator) < DENSE
    share = (0.3 + 0.7 * torch.rand(scenes, generator=generator)) * dense
    kept = holds & (torch.rand(holds.shape, generator=generator) < share[pair_scene, None])
    kind, amount = torch.rand(scenes, generator=generator), torch.rand(scenes, generator=generator)
    each = torch.where(kind < 0.1, 0.0, torch.where(kind < 0.75, 0.4 + 1.6 * amount, 2 + 2 * amount))
    number = (each * counts).round().long() * ~dense
    ranked = near_first(holds & ~dense[pair_scene, None], boxes, receiver, sender, counts, generator)
    place = torch.arange(len(ranked))
    of = pair_scene[ranked[:, 0]]
    first = torch.full((scenes,), len(ranked)).scatter_reduce(0, of, place, "amin")
    chosen = ranked[place - first[of] < number[of]]
    kept[chosen[:, 0], chosen[:, 1]] = True
    return kept


def _stated(predicates: Tensor, receiver: Tensor, sender: Tensor, counts: Tensor) -> Tensor:
    """Fill in inverses: (P, 16) float -> (P, 32) as in `pairs_of`."""
    back = reverse_pairs(receiver, sender, counts)
    inverse = torch.from_numpy(inverse_predicates(PREDICATES))
    has = inverse >= 0
    flipped = torch.zeros_like(predicates)
    flipped[:, inverse[has]] = predicates[:, has]
    forward = torch.maximum(predicates, flipped[back])
    return torch.cat([forward, forward[back]], dim=1)


def _pseudo_edit(
    pairs: Pairs, predicates: Tensor, counts: Tensor, generator: torch.Generator
) -> tuple[Pairs, Tensor, Tensor]:
    """Draw per scene none, addition or relation change, and undo it in the pseudo graph (SPEC 4)."""
    scenes = len(counts)
    choice = torch.randint(3, (scenes,), generator=generator)
    starts = counts.cumsum(0) - counts
    removed = starts + (torch.rand(scenes, generator=generator) * counts).long()
    nodes = int(counts.sum())
    added = torch.zeros(nodes, dtype=torch.bool)
    added[removed[(choice == 1) & (counts > 1)]] = True
    touched = added.clone()
    pair_counts = counts * (counts - 1)
    first = pair_counts.cumsum(0) - pair_counts
    changed = first + (torch.rand(scenes, generator=generator) * pair_counts).long()
    changed = changed[(choice == 2) & (counts > 1)]
    touched[pairs.receiver[changed]] = True
    touched[pairs.sender[changed]] = True
    wrong = torch.zeros(len(changed), len(PREDICATES))
    wrong[torch.arange(len(changed)), torch.randint(1, 12, (len(changed),), generator=generator)] = 1
    pseudo = predicates.float()
    back = reverse_pairs(pairs.receiver, pairs.sender, counts)
    pseudo[back[changed]] = 0
    pseudo[changed] = wrong
    stated = _stated(pseudo, pairs.receiver, pairs.sender, counts)
    return pairs.without(~added, stated), added, touched


def draw_levels(count: int, generator: torch.Generator, device: torch.device | str = "cpu") -> Tensor:
    """Training levels, one per scene, stratified over (0, 1] so that every batch sees the whole range: (count,)."""
    offset = torch.rand(1, generator=generator)
    level = (torch.arange(count) + offset) / count
    return level[torch.randperm(count, generator=generator)].clamp(1e-3, 1.0).to(device)


def plan_of_rooms(rooms: Sequence[RoomBoxes]) -> Plan:
    """The plan of many rooms at once, of what their relations state; float32, as sets of rooms are kept."""
    sizes = [len(room) for room in rooms]
    stated = [np.zeros((0, 3), int) if room.relations is None else room.relations for room in rooms]
    shift = np.cumsum([0, *sizes[:-1]])
    columns = ((getattr(room, name) for room in rooms) for name in ("size", "position", "yaw"))
    size, position, yaw = (np.concatenate(list(of)).astype(np.float32) for of in columns)
    corners = [np.asarray(room.floor_polygon, np.float32).reshape(-1, 2) for room in rooms]
    floor = np.full((len(rooms), max(map(len, corners)), 2), np.nan, np.float32)
    for number, own in enumerate(corners):
        floor[number, : len(own)] = own
    return Plan(
        tuple(kind for room, t in zip(rooms, stated, strict=True) for kind in kinds_of(room.categories, t)),
        size, position, yaw, np.arange(len(rooms)).repeat(sizes), floor, tuple(tuple(room.openings) for room in rooms),
        np.concatenate([t + np.array([k, 0, k]) for t, k in zip(stated, shift, strict=True)]),
        np.zeros(sum(sizes), bool), np.array([room.height for room in rooms], np.float32),
    )  # fmt: skip
