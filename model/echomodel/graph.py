"""Scene graphs as arrays of numpy or torch: many rooms packed as one disjoint graph."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from echomodel.arrays import Array, beside, cast, full, kit, on_device
from echomodel.floors import area
from echomodel.openings import Opening
from echomodel.surroundings import ROW, centred, extents, opening_rows, padded
from echomodel.vocabulary import vocabulary


@dataclass(frozen=True)
class Stated:
    """A placement of one box.

    Arguments:
        placement: name of its row. subject: number of the box. others: numbers of the boxes that it names.
    """

    placement: str
    subject: int
    others: tuple[int, ...] = ()


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
        openings: (S, O, ROW) float32, doors and windows (`echomodel.floors`), padded with NaN; None = none.
        placements: (P, 4) int64, [subject, position in the vocabulary's placements, and the two other nodes that it
            names, -1 where it names none]; None = none.
        height: (S,) float32, of the ceilings, metres, NaN = unknown, which None is for all; no network hears it.

    Raises ValueError where a tensor has the wrong shape, dtype or device.
    """

    category: Array
    triplets: Array
    scene: Array
    room_type: Array
    floor: Array
    openings: Array = None
    placements: Array = None
    height: Array = None

    def __post_init__(self) -> None:
        nodes, scenes = len(self.category), len(self.room_type)
        if self.openings is None:
            object.__setattr__(self, "openings", full(self.floor, (scenes, 0, ROW), 0.0))
        if self.placements is None:
            object.__setattr__(self, "placements", full(self.triplets, (0, 4), 0))
        if self.height is None:
            object.__setattr__(self, "height", full(self.floor, scenes, np.nan))
        expected: dict[str, tuple[tuple[int, ...], str]] = {
            "category": ((nodes,), "int64"),
            "triplets": ((len(self.triplets), 3), "int64"),
            "placements": ((len(self.placements), 4), "int64"),
            "scene": ((nodes,), "int64"),
            "room_type": ((scenes,), "int64"),
            "floor": ((scenes, max(1, self.floor.shape[1] if self.floor.ndim == 3 else 4), 2), "float32"),
            "height": ((scenes,), "float32"),
            "openings": ((scenes, self.openings.shape[1] if self.openings.ndim == 3 else 0, ROW), "float32"),
        }
        for name, (shape, dtype) in expected.items():
            array = getattr(self, name)
            if tuple(array.shape) != shape or str(array.dtype).removeprefix("torch.") != dtype:
                found = f"{tuple(array.shape)} {array.dtype}"
                raise ValueError(f"GraphBatch.{name} is {found}, expected {shape} {dtype}")
            if array.device != self.category.device:
                raise ValueError(f"GraphBatch.{name} is on {array.device}, category on {self.category.device}")

    @classmethod
    def single(
        cls, category: Sequence[int] | Array, triplets: Sequence[Sequence[int]] | Array = (), *, room_type: int = 0,
        floor: Sequence[float] | Sequence[Sequence[float]] | np.ndarray | None = None,
        openings: Sequence[Opening] = (), placements: Sequence[Sequence[int]] | Array = (),
        height: float | None = None, device: Any = "cpu",
    ) -> GraphBatch:  # fmt: skip
        """One scene graph from plain lists; arguments as in the class.

        `floor` is None where unknown, two extents (x, z) of a rectangle, or corners in any frame. `openings` lie in the
        edges of its corners, those of `echomodel.openings.rectangle` for extents; where it is unknown they are too.
        `device`: as of `to`.
        """
        nodes, corners = np.asarray(category, np.int64).reshape(-1), centred(floor)
        return cls(
            category=nodes, triplets=np.asarray(triplets, np.int64).reshape(-1, 3),
            scene=np.zeros_like(nodes), room_type=np.array([room_type], np.int64), floor=corners[None],
            openings=opening_rows(() if floor is None else openings, corners)[None],
            placements=np.asarray(placements, np.int64).reshape(-1, 4),
            height=np.array([np.nan if height is None else height], np.float32),
        ).to(device)  # fmt: skip

    @classmethod
    def pack(cls, graphs: Iterable[GraphBatch]) -> GraphBatch:
        """Put graphs behind one another as one disjoint graph."""
        graphs = list(graphs)
        if not graphs:
            raise ValueError("GraphBatch.pack needs at least one graph, got none")
        triplets, placements, scenes, nodes, count = [], [], [], 0, 0
        for graph in graphs:
            triplets.append(graph.triplets + cast([nodes, 0, nodes], graph.triplets))
            placements.append(shifted(graph.placements, nodes))
            scenes.append(graph.scene + count)
            nodes += graph.num_nodes
            count += graph.num_scenes
        xp = kit(graphs[0].floor)
        return cls(
            category=xp.concat([graph.category for graph in graphs]), triplets=xp.concat(triplets),
            scene=xp.concat(scenes), room_type=xp.concat([graph.room_type for graph in graphs]),
            floor=padded([graph.floor for graph in graphs]),
            openings=padded([graph.openings for graph in graphs]), placements=xp.concat(placements),
            height=xp.concat([graph.height for graph in graphs]),
        )  # fmt: skip

    @property
    def num_nodes(self) -> int:
        """N."""
        return len(self.category)

    @property
    def num_scenes(self) -> int:
        """S."""
        return len(self.room_type)

    @property
    def node_counts(self) -> Array:
        """(S,) int64, nodes of each scene."""
        return kit(self.scene).bincount(self.scene, minlength=self.num_scenes)

    def to(self, device: Any) -> GraphBatch:
        """The same batch as tensors on a device, or with None as arrays of numpy."""
        moved = {f.name: on_device(getattr(self, f.name), device) for f in fields(self)}
        return replace(self, **moved)

    def with_triplets(self, triplets: Array) -> GraphBatch:
        """The same nodes with other relations; `triplets` (E, 3) int64."""
        return replace(self, triplets=triplets)

    def check(self) -> None:
        """Check the values against the vocabulary.

        Raises ValueError for no node, an unknown class, predicate or room type id, an end that is no node, a relation
        of an object to itself or across scenes, scenes out of order, or a floor that is none; the message names the
        entry at fault.
        """
        own, words = self.to(None), vocabulary()
        categories, predicates, room_types = len(words.categories), len(words.predicates), len(words.room_types)
        if not own.num_nodes:
            raise ValueError("graph has no nodes, at least one is needed")
        within("category of node", own.category, categories)
        within("room type of scene", own.room_type, room_types)
        within("scene of node", own.scene, own.num_scenes)
        if (own.scene[1:] < own.scene[:-1]).any():
            raise ValueError("GraphBatch.scene decreases: the nodes of a scene must stand together, in scene order")
        within("predicate of triplet", own.triplets[:, 1], predicates)
        within("subject of triplet", own.triplets[:, 0], own.num_nodes)
        within("object of triplet", own.triplets[:, 2], own.num_nodes)
        within("subject of placement", own.placements[:, 0], own.num_nodes)
        within("word of placement", own.placements[:, 1], len(words.placements))
        within("other object of placement", own.placements[:, 2:].max(1, initial=0), own.num_nodes)
        subject, target = own.triplets[:, 0], own.triplets[:, 2]
        for text, wrong in (
            ("relates a node to itself", subject == target),
            ("crosses scenes", own.scene[subject] != own.scene[target]),
        ):
            if wrong.any():
                at = int(wrong.argmax())
                raise ValueError(f"triplet {at} {own.triplets[at].tolist()} {text}")
        for at, corners in enumerate(own.floor):
            used = corners[: int(np.isfinite(corners).all(1).sum())]
            if not np.isnan(corners[len(used) :]).all() or len(used) in (1, 2):
                raise ValueError(f"floor of scene {at} has corners {corners.tolist()} m, expected 3 or more, then NaN")
            if len(used) and float(area(used[None])[0]) < 1e-6:
                raise ValueError(f"floor of scene {at} spans {extents(used[None])[0].tolist()} m and encloses no area")
            middle = (used.max(0) + used.min(0)) / 2 if len(used) else np.zeros(2)
            if float(abs(middle).max()) > 1e-3:
                raise ValueError(f"floor of scene {at} has its middle at {middle.tolist()} m, expected [0.0, 0.0]")


@dataclass(frozen=True, eq=False)
class GraphEdit:
    """How a graph came about by editing another one over the same nodes (EchoScene 3.2).

    Arguments:
        before: (E, 3) int64, the triplets before the edit.
        added: (N,) bool, nodes that were not there before; triplets of `before` do not touch them.
    """

    before: Array
    added: Array

    def touched(self, graph: GraphBatch) -> Array:
        """(N,) bool: nodes that were added, and both ends of every triplet that came or went; `graph`: as it is now."""
        nodes = np.array(self.added.tolist(), bool)
        now, before = ({tuple(row) for row in triplets.tolist()} for triplets in (graph.triplets, self.before))
        for subject, _, target in now ^ before:
            nodes[[subject, target]] = True
        return beside(nodes, graph.category)

    def repeated(self, count: int) -> GraphEdit:
        """That of so many copies of the graph behind one another."""
        nodes = len(self.added)
        shift = np.arange(count)[:, None, None] * [nodes, 0, nodes]
        return GraphEdit((self.before + shift).reshape(-1, 3), np.tile(self.added, count))


def ordered_pairs(counts: Array) -> tuple[Array, Array, Array]:
    """Receiver (P,), sender (P,) and scale (N, 1) of all ordered pairs of scenes with `counts` (S,) int64 nodes."""
    each = np.asarray(on_device(counts, None))
    per_node = each.repeat(each)
    receiver = np.arange(len(per_node)).repeat(per_node)
    first = (each.cumsum() - each).repeat(each).repeat(per_node)
    sender = first + np.arange(len(receiver)) - (per_node.cumsum() - per_node).repeat(per_node)
    different = receiver != sender
    scale = 1 / np.sqrt(np.maximum(per_node - 1, 1).astype(np.float32))[:, None]
    return beside(receiver[different], counts), beside(sender[different], counts), beside(scale, counts)


def shifted(placements: Array, nodes: int) -> Array:
    """Placements whose nodes are counted from elsewhere."""
    moved = placements + cast([nodes, 0, nodes, nodes], placements)
    return kit(moved).where(placements < 0, placements, moved)


def within(what: str, values: Array, size: int) -> None:
    """Raises ValueError naming the first of `values` (n,) that lies outside 0..size-1."""
    wrong = (values < 0) | (values >= size)
    if wrong.any():
        at = int(wrong.nonzero()[0][0])
        raise ValueError(f"{what} {at} is {int(values[at])}, allowed: 0..{size - 1}")
