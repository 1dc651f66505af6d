"""The published networks behind the two calls of `EchoModel`: boxes for a graph and shapes for its boxes."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from echomodel.arrays import cast, on_device
from echomodel.boxes import Boxes
from echomodel.files import raising
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.samplers import Sampling
from echomodel.scene_noise import SceneGenerators
from echomodel.text import TextEncoder, edge_text, encoder_named, node_text
from echomodel.vocabulary import vocabulary
from echoscene.checkpoint import load_released
from echoscene.encoder import SceneGraphTensors
from echoscene.model import STRUCTURE, GraphChange, ReleasedModel

DECODED = 2  # shapes at a time: one takes 67 MB for every feature map of 64 channels


class ReleasedEcho:
    """Samples rooms with a `ReleasedModel`, in its vocabulary, with its floor and `_scene_` nodes.

    Arguments:
        model: the model, with class names; boxes need box statistics, too.
        text: encoder of class labels; None = the one that the model names, else OpenAI's CLIP (extra `text`) behind
            the cache on disk.
        hash: short hash of the weights it came from.

    Raises ValueError where class names are missing, or the model's text encoder is unknown or has another width than it
    reads.
    """

    def __init__(self, model: ReleasedModel, text: TextEncoder | None = None, hash: str = "") -> None:
        self.text = text or encoder_named(model.text_encoder)
        if model.classes is None:
            count = model.encoder_config.classes
            raise ValueError(f"names of the model's {count} classes are unknown: convert with --classes FILE")
        self.classes: tuple[str, ...] = model.classes
        wanted = model.encoder_config.text
        if self.text.width != wanted:
            raise ValueError(
                f"text features of {self.text.name} have {self.text.width} numbers, the model reads {wanted}"
            )
        self.model, self.hash = model.eval(), hash

    @classmethod
    def load(
        cls, path: str | Path, text: TextEncoder | None = None, *, device: torch.device | str = "cpu"
    ) -> ReleasedEcho:
        """Load a file that `echousd convert` wrote; raises ValueError naming the file where that cannot work."""
        model = load_released(path)
        if not isinstance(model, ReleasedModel):
            raise ValueError(f"{path}: holds the autoencoder alone, rooms need the model with its graph encoder")
        with raising(f"{path}:"):
            return cls(model.to(device), text, hashlib.sha256(Path(path).read_bytes()).hexdigest()[:12])

    @property
    def preset(self) -> str:
        """`released` or `paper`."""
        return self.model.config.preset

    @property
    def branches(self) -> frozenset[str]:
        """`layout` and, with its autoencoder, `shape`: those that the file holds."""
        config = self.model.config
        shape = config.shape is not None and config.vqvae is not None
        return frozenset(name for name, there in (("layout", config.layout is not None), ("shape", shape)) if there)

    def sample_layout(self, graph: GraphBatch, **how: Any) -> Boxes:
        """Boxes by ancestral steps, as many of the published 1,000 as `steps` says, evenly spread.

        `how`: fields of `Sampling`; known boxes are put in afterwards: the published sampler cannot be told of them.

        Raises ValueError for no layout branch, no box statistics, too many steps, a category without a class, or no
        text features.
        """
        by, whole, change, objects = self._asked(graph, how)
        boxes = self.model.sample_layout(
            whole, generator=by.generator, steps=by.steps, change=change, progress=by.progress
        )[objects]
        boxes = Boxes(boxes.size.clamp(0.01, 20.0), boxes.position, boxes.yaw)
        if by.known is None or by.known_mask is None:
            return boxes
        return boxes.replaced(on_device(by.known_mask, self.model.device), by.known.to(self.model.device))

    @torch.no_grad()
    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Tensor:
        """Signed distances of all objects, turned so that their front is +Z and their surface lies at zero.

        Arguments:
            boxes: not used, the published shapes do not know their boxes.
            how: fields of `Sampling`; the published steps are 100 of DDIM, shapes that are known are not looked at.

        Returns (N, R, R, R) float32, negative inside, in the published unit cube: stretch the mesh to its box.
        Raises ValueError for no shape branch, a category without a class, or no text features.
        """
        by, whole, change, objects = self._asked(graph, how)
        latents = self.model.sample_shapes(
            whole, generator=by.generator, steps=by.steps or 100, change=change, progress=by.progress
        )[objects]
        return turned_back(torch.cat([self.model.vqvae.decode(part) for part in latents.split(DECODED)])) - LEVEL

    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Tensor:
        """Raises ValueError: the published networks describe no furniture."""
        raise ValueError(f"weights of the preset {self.preset} have no furniture branch")

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every relation of the graph that SG-FRONT lacks; categories have classes, see `labels`."""
        words = vocabulary()
        return tuple(
            f"the weights do not know the relation {words.predicates[number].name}: placed and checked, not generated"
            for number in sorted({*graph.triplets[:, 1].tolist()} - words.sgfront_predicates.keys())
        )

    def labels(self, graph: GraphBatch) -> list[str]:
        """The model's class of each node: the category's own name there, else its coarse class.

        Raises ValueError for categories that the model has no class for; names them all and the nearest classes.
        """
        known, categories = set(self.classes) - {*STRUCTURE}, vocabulary().categories
        found, missing = {}, []
        for number in dict.fromkeys(graph.category.tolist()):
            category = categories[number]
            names = [word for word in (category.sgfront, category.name, category.coarse) if word in known]
            if names:
                found[number] = names[0]
            else:
                near = difflib.get_close_matches(category.name, sorted(known), 1, 0.5)
                missing.append(category.name + (f" (nearest: {near[0]})" if near else ""))
        if missing:
            raise ValueError(f"this model has no class for {', '.join(missing)}; allowed: {', '.join(sorted(known))}")
        return [found[number] for number in graph.category.tolist()]

    def _asked(
        self, graph: GraphBatch, how: dict[str, Any]
    ) -> tuple[Sampling, SceneGraphTensors, GraphChange | None, Tensor]:
        """How to sample, all scenes as the model takes them, the edit, and (M,) bool which nodes are objects."""
        by = Sampling(**how)
        assert not isinstance(by.generator, SceneGenerators)  # scenes of their own seeds are for compact weights
        graph = in_published_words(graph.to("cpu"))
        scenes, objects = self._scenes(graph)
        change = None
        if by.edit is not None:
            there = replace(by.edit, before=on_device(by.edit.before, "cpu"), added=on_device(by.edit.added, "cpu"))
            change = self._change(graph, scenes, there)
        return by, pack_scenes(scenes)[0], change, objects.to(self.model.device)

    def _scenes(self, graph: GraphBatch) -> tuple[list[SceneGraphTensors], Tensor]:
        """Each scene with its floor and `_scene_` nodes, and which nodes of all of them are objects, (M,) bool."""
        labels, scenes, objects = self.labels(graph), list[SceneGraphTensors](), list[bool]()
        for nodes, triplets in by_scene(graph):
            scenes.append(self._scene(labels[nodes], graph.category[nodes], triplets))
            objects += [True] * len(labels[nodes]) + [False] * len(STRUCTURE)
        return scenes, torch.tensor(objects)

    def _scene(self, labels: Sequence[str], nodes: Tensor, triplets: Tensor) -> SceneGraphTensors:
        if self.preset == "paper":  # trained here, on graphs that do not mention the floor
            return published_scene(labels, triplets, classes=self.classes, text=self.text, edges=True)
        triplets = torch.cat([triplets, floor_relations(nodes, triplets)])
        return published_scene(labels, triplets, classes=self.classes, text=self.text)

    def _change(self, graph: GraphBatch, scenes: Sequence[SceneGraphTensors], edit: GraphEdit) -> GraphChange:
        """The edit in the model's own form: the graph before without the nodes that were added."""
        touched, labels, changes = edit.touched(graph) & ~edit.added, self.labels(graph), []
        for nodes, triplets in by_scene(in_published_words(replace(graph, triplets=edit.before))):
            new = edit.added[nodes]
            place = torch.cumsum(~new, 0) - 1  # of the nodes that stay, in the graph before
            triplets[:, [0, 2]] = place[triplets[:, [0, 2]]]
            names = [word for word, gone in zip(labels[nodes], new.tolist(), strict=True) if not gone]
            old = self._scene(names, graph.category[nodes][~new], triplets)
            added = tuple(int(node) - number for number, node in enumerate(new.nonzero()[:, 0]))
            changes.append(GraphChange(old, added, tuple(touched[nodes].nonzero()[:, 0].tolist())))
        return pack_changes(scenes, changes)


def in_published_words(graph: GraphBatch) -> GraphBatch:
    """The graph without the relations that SG-FRONT lacks."""
    known = graph.triplets.new_tensor(list(vocabulary().sgfront_predicates))
    return graph.with_triplets(graph.triplets[torch.isin(graph.triplets[:, 1], known)])


def floor_relations(category: Tensor, triplets: Tensor) -> Tensor:
    """(N, 3) int64: every object stands on the floor or is above it, as published graphs say of all objects.

    Arguments:
        category: (N,) int64, categories of one scene; the floor is node N.
        triplets: (E, 3) int64; what stands on or hangs above something else is above the floor.
    """
    words = vocabulary()
    on, above = words.predicate_id("standing_on"), words.predicate_id("above")
    raised = {int(s) for s, predicate, _ in triplets.tolist() if predicate in (on, above)}
    hung = [words.categories[number].support not in ("floor", "table") for number in category.tolist()]
    floor = len(hung)
    return torch.tensor(
        [[i, above if hangs or i in raised else on, floor] for i, hangs in enumerate(hung)], dtype=torch.int64
    ).reshape(-1, 3)


def published_scene(
    labels: Sequence[str], triples: Tensor, *, classes: Sequence[str], text: TextEncoder, edges: bool = False
) -> SceneGraphTensors:
    """One scene as the published model takes it.

    A floor and a `_scene_` node are put behind the objects, and every node but the last gets an `in` relation to it,
    behind the given ones (SPEC: section 1.3). The compact vocabulary's `Category.coarse` is the label of a class in
    the published weights of 14 classes.

    Arguments:
        labels: class names of the objects. triples: (E, 3) int64 [subject, predicate id, object] among them.
        classes: class names in the order of their ids (`ReleasedModel.classes`).
        text: encoder of labels and relations.
        edges: encode relations too (`paper` preset; the published weights never use them).

    Returns N + 2 nodes and E + N + 1 triples.
    Raises ValueError for a label that is no class; names it.
    """
    index = {name: number for number, name in enumerate(classes)}
    names = [*labels, *STRUCTURE]
    for position, name in enumerate(names):
        if name not in index or (name in STRUCTURE and position < len(labels)):
            allowed = ", ".join(sorted(set(classes) - {*STRUCTURE}))
            raise ValueError(f"label of node {position} is {name!r}, allowed: {allowed}")
    predicates, last = vocabulary().sgfront_predicates, len(names) - 1
    triples = torch.as_tensor(triples, dtype=torch.int64).reshape(-1, 3)
    inside = torch.tensor([[node, 0, last] for node in range(last)])
    triples = torch.cat([triples, inside])
    features = None
    if edges:
        features = text([edge_text(names[s], predicates[p], names[o]) for s, p, o in triples.tolist()])
    ids = torch.tensor([index[name] for name in names])
    return SceneGraphTensors(ids, triples, text([node_text(name) for name in names]), features)


DISTANCE = 4 / 64  # our grids hold distances over 4 voxels, the published ones in sides of the grid
LEVEL = 0.02  # the published iso value of the truncated distance


def published_grids(grids: Tensor, side: int = 64) -> Tensor:
    """Our grids (K, 64, 64, 64) in the published frame, whose +X is an object's front, and unit: (K, 1, R, R, R).

    `side` is R, 64 or a part of it for a smaller autoencoder, whose voxels are means.
    """
    turned = (grids.flip(1).transpose(1, 3) * DISTANCE)[:, None].contiguous()
    return turned if side == grids.shape[1] else torch.nn.functional.avg_pool3d(turned, grids.shape[1] // side)


def turned_back(grids: Tensor) -> Tensor:
    """Published grids (K, 1, R, R, R) in our frame, (K, R, R, R): the point (x, y, z) of theirs is (-z, y, x) in its
    box, a quarter turn."""
    return grids[:, 0].transpose(1, 3).flip(1).contiguous()


CHANGEABLE = range(1, 12)  # predicates that a relation is changed into, as published

RelationText = Callable[[int, int, int], Tensor]  # (subject node, predicate id, object node) -> (text,) float32


def pseudo_graph(
    graph: SceneGraphTensors, generator: torch.Generator, relation_text: RelationText | None = None
) -> GraphChange:
    """The graph from which an edit would have led to `graph`: a node less, another relation, or the same graph.

    The three are equally likely; a scene without an object or a relation to change stays as it is.

    Arguments:
        graph: one scene, its floor and `_scene_` node last. generator: source of the choice.
        relation_text: text features of a changed relation; needed where the graph has edge texts.

    Raises ValueError where the graph has edge texts and `relation_text` is missing.
    """
    if graph.edge_text is not None and relation_text is None:
        raise ValueError("a graph with edge texts needs relation_text for the relations that are changed")
    kind = int(torch.randint(3, (), generator=generator))
    objects, triples = len(graph.classes) - 2, graph.triples
    if kind == 0 and objects > 0:
        node = int(torch.randint(objects, (), generator=generator))
        return GraphChange(without_node(graph, node), added=(node,))
    eligible = ((triples[:, 1] != 0) & (triples[:, [0, 2]] < objects).all(1)).nonzero()[:, 0]
    if kind == 1 and len(eligible):
        row = int(eligible[torch.randint(len(eligible), (), generator=generator)])
        subject, old, target = triples[row].tolist()
        others = [p for p in CHANGEABLE if p != old]
        new = others[int(torch.randint(len(others), (), generator=generator))]
        changed, text = triples.clone(), graph.edge_text
        changed[row, 1] = new
        if text is not None and relation_text is not None:
            text = text.clone()
            text[row] = relation_text(subject, new, target)
        return GraphChange(replace(graph, triples=changed, edge_text=text), touched=(subject, target))
    return GraphChange(graph)


def without_node(graph: SceneGraphTensors, node: int) -> SceneGraphTensors:
    """The graph without a node and its relations."""
    keep = torch.arange(len(graph.classes)) != node
    rows = (graph.triples[:, [0, 2]] != node).all(1)
    triples = graph.triples[rows].clone()
    for column in (0, 2):
        triples[:, column] -= (triples[:, column] > node).long()
    text = None if graph.edge_text is None else graph.edge_text[rows]
    return SceneGraphTensors(graph.classes[keep], triples, graph.node_text[keep], text)


def pack_scenes(graphs: Sequence[SceneGraphTensors]) -> tuple[SceneGraphTensors, Tensor]:
    """Scenes behind one another as one disjoint graph, and the scene (N,) int64 of each node."""
    counts = [len(graph.classes) for graph in graphs]
    starts = [0, *accumulate(counts)]
    texts = [graph.edge_text for graph in graphs]
    whole = SceneGraphTensors(
        torch.cat([graph.classes for graph in graphs]),
        torch.cat([g.triples + torch.tensor([s, 0, s]) for g, s in zip(graphs, starts, strict=False)]),
        torch.cat([graph.node_text for graph in graphs]),
        None if any(text is None for text in texts) else torch.cat([text for text in texts if text is not None]),
    )
    return whole, torch.repeat_interleave(torch.arange(len(graphs)), torch.tensor(counts))


def pack_changes(graphs: Sequence[SceneGraphTensors], changes: Sequence[GraphChange]) -> GraphChange:
    """The changes that lead to `graphs`, for the packed graph.

    Added nodes are counted in the packed graph before, touched ones in the packed graph after; the published code
    counts both in the graph before, and flags the wrong nodes once an earlier scene of the batch has an addition.
    """
    before, _ = pack_scenes([change.before for change in changes])
    old = [0, *accumulate(len(change.before.classes) for change in changes)]
    new = [0, *accumulate(len(graph.classes) for graph in graphs)]
    return GraphChange(
        before,
        added=tuple(start + node for start, change in zip(old, changes, strict=False) for node in change.added),
        touched=tuple(start + node for start, change in zip(new, changes, strict=False) for node in change.touched),
    )


def by_scene(graph: GraphBatch) -> Iterator[tuple[slice, Tensor]]:
    """The nodes of every scene, and a copy of its triplets (E, 3) among them."""
    owner, start = graph.scene[graph.triplets[:, 0]], 0
    for number, count in enumerate(graph.node_counts.tolist()):
        yield slice(start, start + count), graph.triplets[owner == number] - cast([start, 0, start], graph.triplets)
        start += count
