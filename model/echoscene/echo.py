"""The published networks behind the two calls of `EchoModel`: boxes for a graph and shapes for its boxes."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echomodel.protocols import touched_nodes
from echomodel.text import TextEncoder, encoder_named
from echomodel.vocabulary import vocabulary
from echoscene.editing import pack_changes, pack_scenes
from echoscene.encoder import SceneGraphTensors
from echoscene.grids import DISTANCE, LEVEL, published_grids, turned_back
from echoscene.model import STRUCTURE, GraphChange, ReleasedModel
from echoscene.scene import published_scene
from echoscene.weights import load_released

if TYPE_CHECKING:
    from echomodel.progress import StepListener
    from echomodel.protocols import GraphEdit

DECODED = 2  # shapes at a time: one takes 67 MB for every feature map of 64 channels


class ReleasedEcho:
    """Samples rooms with a `ReleasedModel`, in its vocabulary, with its floor and `_scene_` nodes.

    Arguments:
        model: the model, with class names; boxes need box statistics, too.
        text: encoder of class labels; None = the one that the model names, else OpenAI's CLIP (extra `text`) behind
            the cache on disk.
        hash: short hash of the weights it came from.

    Raises:
        ValueError: class names are missing, or the model's text encoder is unknown or has another width than it reads.
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
        try:
            return cls(model.to(device), text, hashlib.sha256(Path(path).read_bytes()).hexdigest()[:12])
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

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

    def sample_layout(
        self,
        graph: GraphBatch,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        known: Boxes | None = None,
        known_mask: Tensor | None = None,
        edit: GraphEdit | None = None,
        progress: StepListener | None = None,
    ) -> Boxes:
        """Boxes by ancestral steps.

        Arguments:
            steps: how many of the published 1,000 steps, evenly spread; None = all.
            known, known_mask: boxes that are put in afterwards: the published sampler cannot be told of them.
            others: as `EchoModel.sample_layout`.

        Raises:
            ValueError: no layout branch, no box statistics, too many steps, a category without a class, or no text
                features.
        """
        whole, change, objects = self._told(graph, edit)
        boxes = self.model.sample_layout(whole, generator=generator, steps=steps, change=change, progress=progress)[
            objects
        ]
        boxes = Boxes(boxes.size.clamp(0.01, 20.0), boxes.position, boxes.yaw)
        if known is None or known_mask is None:
            return boxes
        return boxes.replaced(known_mask.to(self.model.device), known.to(self.model.device))

    @torch.no_grad()
    def sample_shapes(
        self,
        graph: GraphBatch,
        boxes: Boxes,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        edit: GraphEdit | None = None,
        progress: StepListener | None = None,
    ) -> Tensor:
        """Signed distances of all objects, turned so that their front is +Z and their surface lies at zero.

        Arguments:
            boxes: not used, the published shapes do not know their boxes.
            steps: DDIM steps, None = the published 100.
            others: as `EchoModel.sample_shapes`.

        Returns:
            (N, R, R, R) float32, negative inside, in the published unit cube: stretch the mesh to its box.

        Raises:
            ValueError: no shape branch, a category without a class, or no text features.
        """
        whole, change, objects = self._told(graph, edit)
        latents = self.model.sample_shapes(
            whole, generator=generator, steps=steps or 100, change=change, progress=progress
        )[objects]
        return turned_back(torch.cat([self.model.vqvae.decode(part) for part in latents.split(DECODED)])) - LEVEL

    @torch.no_grad()
    def reconstruct(self, grids: Tensor) -> Tensor:
        """Grids (N, 64, 64, 64) in [-1, 1] through the autoencoder and back, turned as it knows them."""
        coder = self.model.vqvae
        if coder.config.resolution != grids.shape[1]:
            sides = f"{coder.config.resolution} voxels a side, not {grids.shape[1]}"
            raise ValueError(f"the grids of this model's autoencoder have {sides}")
        through = [coder(published_grids(part.to(self.model.device), part.shape[1])) for part in grids.split(DECODED)]
        return turned_back(torch.cat(through)) / DISTANCE

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every relation of the graph that SG-FRONT lacks; categories have classes, see `labels`."""
        words = vocabulary()
        return tuple(
            f"the weights do not know the relation {words.predicates[number].name}: repaired and checked, not generated"
            for number in sorted({*graph.triplets[:, 1].tolist()} - words.sgfront_predicates.keys())
        )

    def labels(self, graph: GraphBatch) -> list[str]:
        """The model's class of each node: the category's own name there, else its coarse class.

        Raises:
            ValueError: categories that the model has no class for; names them all and the nearest classes.
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

    def _told(self, graph: GraphBatch, edit: GraphEdit | None) -> tuple[SceneGraphTensors, GraphChange | None, Tensor]:
        """All scenes as the model takes them, the edit, and (M,) bool which nodes are objects; made on the CPU."""
        graph = in_published_words(graph.to("cpu"))
        scenes, objects = self._scenes(graph)
        change = None
        if edit is not None:
            change = self._change(graph, scenes, replace(edit, before=edit.before.cpu(), added=edit.added.cpu()))
        return pack_scenes(scenes)[0], change, objects.to(self.model.device)

    def _scenes(self, graph: GraphBatch) -> tuple[list[SceneGraphTensors], Tensor]:
        """Each scene with its floor and `_scene_` nodes, and which nodes of all of them are objects, (M,) bool."""
        labels, parts = self.labels(graph), graph.unpack()
        scenes, start = [], 0
        for part in parts:
            scenes.append(self._scene(labels[start : start + part.num_nodes], part.category, part.triplets))
            start += part.num_nodes
        objects = [[*[True] * part.num_nodes, *[False] * len(STRUCTURE)] for part in parts]
        return scenes, torch.tensor([flag for flags in objects for flag in flags])

    def _scene(self, labels: Sequence[str], nodes: Tensor, triplets: Tensor) -> SceneGraphTensors:
        if self.preset == "paper":  # trained here, on graphs that do not mention the floor
            return published_scene(labels, triplets, classes=self.classes, text=self.text, edges=True)
        triplets = torch.cat([triplets, floor_relations(nodes, triplets)])
        return published_scene(labels, triplets, classes=self.classes, text=self.text)

    def _change(self, graph: GraphBatch, scenes: Sequence[SceneGraphTensors], edit: GraphEdit) -> GraphChange:
        """The edit in the model's own form: the graph before without the nodes that were added."""
        changes, start = [], 0
        befores = in_published_words(replace(graph, triplets=edit.before)).unpack()
        touched = touched_nodes(graph, edit) & ~edit.added
        labels = self.labels(graph)
        for before in befores:
            stop = start + before.num_nodes
            new = edit.added[start:stop]
            place = torch.cumsum(~new, 0) - 1  # of the nodes that stay, in the graph before
            triplets = before.triplets.clone()
            triplets[:, [0, 2]] = place[triplets[:, [0, 2]]]
            names = [word for word, gone in zip(labels[start:stop], new.tolist(), strict=True) if not gone]
            old = self._scene(names, before.category[~new], triplets)
            added = tuple(int(node) - number for number, node in enumerate(new.nonzero()[:, 0]))
            changes.append(GraphChange(old, added, tuple(touched[start:stop].nonzero()[:, 0].tolist())))
            start = stop
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
