"""Scene graphs as tensors: many rooms packed as one disjoint graph."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from torch import Tensor

from echomodel.floors import area
from echomodel.openings import Opening
from echomodel.roomboxes import RoomBoxes
from echomodel.surroundings import ROW, centred, extents, opening_rows, padded, padded_rows, trimmed
from echomodel.vocabulary import vocabulary


@dataclass(frozen=True, eq=False)
class GraphBatch:
    """S scene graphs with N nodes and E triplets in all, packed as one disjoint graph.

    Arguments:
        category: (N,) int64, class id of each node (position in the vocabulary's categories).
        triplets: (E, 3) int64, [subject, predicate, object]; subject and object index the packed nodes.
        scene: (N,) int64, number of the scene that a node belongs to, never decreasing.
        room_type: (S,) int64, position in the vocabulary's room types.
        floor: (S, K, 2) float32, x and z of each floor's corners about the centre of their bounding box, metres; padded
            with NaN, all NaN = unknown.
        names: N node names, or None.
        openings: (S, O, ROW) float32, doors and windows (`echomodel.floors`), padded with NaN; None = none.
        placements: (P, 4) int64, [subject, position in the vocabulary's placements, and the two other nodes that it
            names, -1 where it names none]; None = none.
        height: (S,) float32, of the ceilings, metres, NaN = unknown, which None is for all; no network hears it.

    Raises ValueError where a tensor has the wrong shape, dtype or device.
    """

    category: Tensor
    triplets: Tensor
    scene: Tensor
    room_type: Tensor
    floor: Tensor
    names: tuple[str, ...] | None = None
    openings: Tensor = None  # type: ignore[assignment]
    placements: Tensor = None  # type: ignore[assignment]
    height: Tensor = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        nodes, scenes = len(self.category), len(self.room_type)
        if self.openings is None:
            object.__setattr__(self, "openings", self.floor.new_zeros(scenes, 0, ROW))
        if self.placements is None:
            object.__setattr__(self, "placements", self.triplets.new_zeros(0, 4))
        if self.height is None:
            object.__setattr__(self, "height", self.floor.new_full((scenes,), torch.nan))
        expected: dict[str, tuple[tuple[int, ...], torch.dtype]] = {
            "category": ((nodes,), torch.int64),
            "triplets": ((len(self.triplets), 3), torch.int64),
            "placements": ((len(self.placements), 4), torch.int64),
            "scene": ((nodes,), torch.int64),
            "room_type": ((scenes,), torch.int64),
            "floor": ((scenes, max(1, self.floor.shape[1] if self.floor.ndim == 3 else 4), 2), torch.float32),
            "height": ((scenes,), torch.float32),
            "openings": ((scenes, self.openings.shape[1] if self.openings.ndim == 3 else 0, ROW), torch.float32),
        }
        for name, (shape, dtype) in expected.items():
            tensor = getattr(self, name)
            if tuple(tensor.shape) != shape or tensor.dtype != dtype:
                found = f"{tuple(tensor.shape)} {tensor.dtype}"
                raise ValueError(f"GraphBatch.{name} is {found}, expected {shape} {dtype}")
            if tensor.device != self.category.device:
                raise ValueError(f"GraphBatch.{name} is on {tensor.device}, category on {self.category.device}")
        if self.names is not None and len(self.names) != nodes:
            raise ValueError(f"GraphBatch.names has {len(self.names)} names for {nodes} nodes")

    @classmethod
    def single(
        cls, category: Sequence[int] | Tensor, triplets: Sequence[Sequence[int]] | Tensor = (), *, room_type: int = 0,
        floor: Sequence[float] | Sequence[Sequence[float]] | np.ndarray | None = None,
        names: Sequence[str] | None = None, openings: Sequence[Opening] = (),
        placements: Sequence[Sequence[int]] | Tensor = (), height: float | None = None,
    ) -> GraphBatch:  # fmt: skip
        """One scene graph from plain lists; arguments as in the class.

        `floor` is None where unknown, two extents (x, z) of a rectangle, or corners in any frame. `openings` lie in the
        edges of its corners, those of `echomodel.openings.rectangle` for extents; where it is unknown they are too.
        """
        nodes = torch.as_tensor(category, dtype=torch.int64).reshape(-1)
        return cls(
            category=nodes, triplets=torch.as_tensor(triplets, dtype=torch.int64).reshape(-1, 3),
            scene=torch.zeros_like(nodes), room_type=torch.tensor([room_type]), floor=(corners := centred(floor))[None],
            names=None if names is None else tuple(names),
            openings=opening_rows(() if floor is None else openings, corners.numpy())[None],
            placements=torch.as_tensor(placements, dtype=torch.int64).reshape(-1, 4),
            height=torch.tensor([torch.nan if height is None else height]),
        )  # fmt: skip

    @classmethod
    def from_room(cls, room: RoomBoxes, *, triplets: Sequence[Sequence[int]] | Tensor | None = None) -> GraphBatch:
        """The graph of a labelled room (`triplets` overrides its relations); raises `UnknownWord`."""
        words = vocabulary()
        relations = room.relations if triplets is None else triplets
        return cls.single(
            [words.category_id(word) for word in room.categories],
            torch.as_tensor([] if relations is None else relations, dtype=torch.int64).reshape(-1, 3),
            room_type=words.room_type_id(room.room_type),
            floor=room.floor_polygon if len(room.floor_polygon) else None,
            openings=room.openings, height=room.height,
        )  # fmt: skip

    @classmethod
    def pack(cls, graphs: Iterable[GraphBatch]) -> GraphBatch:
        """Put graphs behind one another as one disjoint graph; names survive when every graph has them."""
        graphs = list(graphs)
        if not graphs:
            raise ValueError("GraphBatch.pack needs at least one graph, got none")
        triplets, placements, scenes, nodes, count = [], [], [], 0, 0
        for graph in graphs:
            triplets.append(graph.triplets + graph.triplets.new_tensor([nodes, 0, nodes]))
            placements.append(_shifted(graph.placements, nodes))
            scenes.append(graph.scene + count)
            nodes += graph.num_nodes
            count += graph.num_scenes
        names = [graph.names for graph in graphs]
        return cls(
            category=torch.cat([graph.category for graph in graphs]), triplets=torch.cat(triplets),
            scene=torch.cat(scenes), room_type=torch.cat([graph.room_type for graph in graphs]),
            floor=padded([graph.floor for graph in graphs]),
            names=None if any(n is None for n in names) else tuple(name for n in names for name in n or ()),
            openings=padded_rows([graph.openings for graph in graphs]), placements=torch.cat(placements),
            height=torch.cat([graph.height for graph in graphs]),
        )  # fmt: skip

    def unpack(self) -> list[GraphBatch]:
        """One graph per scene, the inverse of `pack`."""
        owner, placed = self.scene[self.triplets[:, 0]], self.scene[self.placements[:, 0]]
        out, start = [], 0
        for number, count in enumerate(self.node_counts.tolist()):
            nodes, room = slice(start, start + count), slice(number, number + 1)
            triplets = self.triplets[owner == number] - self.triplets.new_tensor([start, 0, start])
            names = None if self.names is None else self.names[nodes]
            graph = GraphBatch(
                self.category[nodes], triplets, torch.zeros_like(self.scene[nodes]), self.room_type[room],
                trimmed(self.floor[room]), names, _there(self.openings[room]),
                _shifted(self.placements[placed == number], -start), self.height[room],
            )  # fmt: skip
            out.append(graph)
            start += count
        return out

    @property
    def num_nodes(self) -> int:
        """N."""
        return len(self.category)

    @property
    def num_scenes(self) -> int:
        """S."""
        return len(self.room_type)

    @property
    def node_counts(self) -> Tensor:
        """(S,) int64, nodes of each scene."""
        return torch.bincount(self.scene, minlength=self.num_scenes)

    def to(self, device: torch.device | str) -> GraphBatch:
        """The same batch on another device."""
        moved = {f.name: getattr(self, f.name).to(device) for f in fields(self) if f.name != "names"}
        return replace(self, **moved)

    def with_triplets(self, triplets: Tensor) -> GraphBatch:
        """The same nodes with other relations; `triplets` (E, 3) int64."""
        return replace(self, triplets=triplets)

    def check(self) -> None:
        """Check the values against the vocabulary.

        Raises ValueError for no node, an unknown class, predicate or room type id, an end that is no node, a relation
        of an object to itself or across scenes, scenes out of order, or a floor that is none; the message names the
        entry at fault.
        """
        words = vocabulary()
        categories, predicates, room_types = len(words.categories), len(words.predicates), len(words.room_types)
        if not self.num_nodes:
            raise ValueError("graph has no nodes, at least one is needed")
        within("category of node", self.category, categories)
        within("room type of scene", self.room_type, room_types)
        within("scene of node", self.scene, self.num_scenes)
        if bool((self.scene[1:] < self.scene[:-1]).any()):
            raise ValueError("GraphBatch.scene decreases: the nodes of a scene must stand together, in scene order")
        within("predicate of triplet", self.triplets[:, 1], predicates)
        within("subject of triplet", self.triplets[:, 0], self.num_nodes)
        within("object of triplet", self.triplets[:, 2], self.num_nodes)
        within("subject of placement", self.placements[:, 0], self.num_nodes)
        within("word of placement", self.placements[:, 1], len(words.placements))
        within("other object of placement", self.placements[:, 2:].clamp_min(0), self.num_nodes)
        subject, target = self.triplets[:, 0], self.triplets[:, 2]
        for text, wrong in (
            ("relates a node to itself", subject == target),
            ("crosses scenes", self.scene[subject] != self.scene[target]),
        ):
            if bool(wrong.any()):
                at = int(wrong.nonzero()[0])
                raise ValueError(f"triplet {at} {self.triplets[at].tolist()} {text}")
        for at, corners in enumerate(self.floor):
            there = torch.isfinite(corners).all(1)
            used = corners[: int(there.sum())]
            if not bool(torch.isnan(corners[len(used) :]).all()) or len(used) in (1, 2):
                raise ValueError(f"floor of scene {at} has corners {corners.tolist()} m, expected 3 or more, then NaN")
            if len(used) and float(area(used[None])) < 1e-6:
                raise ValueError(f"floor of scene {at} spans {extents(used[None])[0].tolist()} m and encloses no area")
            middle = (used.amax(0) + used.amin(0)) / 2 if len(used) else used.new_zeros(2)
            if float(middle.abs().max()) > 1e-3:
                raise ValueError(f"floor of scene {at} has its middle at {middle.tolist()} m, expected [0.0, 0.0]")


def _shifted(placements: Tensor, nodes: int) -> Tensor:
    """Placements whose nodes are counted from elsewhere."""
    moved = placements + placements.new_tensor([nodes, 0, nodes, nodes])
    return torch.where(placements < 0, placements, moved)


def _there(rows: Tensor) -> Tensor:
    """The rows (1, O, ROW) of one scene without padding."""
    return rows[:, : int(torch.isfinite(rows[0, :, 0]).sum())]


def within(what: str, values: Tensor, size: int) -> None:
    """Raises ValueError naming the first of `values` (n,) that lies outside 0..size-1."""
    wrong = (values < 0) | (values >= size)
    if bool(wrong.any()):
        at = int(wrong.nonzero()[0])
        raise ValueError(f"{what} {at} is {int(values[at])}, allowed: 0..{size - 1}")
