"""Where the layouts come from that an evaluation scores: a model, or the true boxes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.loading import load_model
from echomodel.metrics.layout_evaluation import EditedGraph, LayoutSource
from echomodel.metrics.room_figures import with_known_words
from echomodel.protocols import GraphEdit
from echomodel.roomboxes import RoomBoxes


def model_layouts(
    weights: str | Path | None, seed: int, rules: str, steps: int | None, relation_guidance: float | None = None
) -> LayoutSource:
    """Samples with the model; only compact weights understand `relation_guidance`."""
    model = load_model(weights)
    extra: dict[str, Any] = {}
    if isinstance(model, EchoModel):
        extra = {"rules": rules, "relation_guidance": relation_guidance}
    elif relation_guidance is not None:
        raise ValueError(f"--relation-guidance is for compact weights, found: {model.preset}")
    generator = torch.Generator().manual_seed(seed)

    def sample(edited: EditedGraph) -> Boxes:
        edit = None if edited.before is None else GraphEdit(before=edited.before, added=edited.added)
        return model.sample_layout(
            edited.graph,
            generator=generator,
            steps=steps,
            edit=edit,
            known=edited.known,
            known_mask=edited.known_mask,
            **extra,
        )

    return sample


def true_layouts(rooms: Sequence[RoomBoxes]) -> LayoutSource:
    """A sampler that knows the answer: what the scores are for the true boxes themselves."""
    boxes = [Boxes.from_room(room) for room in with_known_words(rooms) if len(room) > 1]
    given = 0

    def sample(edited: EditedGraph) -> Boxes:
        nonlocal given
        chosen = [boxes[(given + k) % len(boxes)] for k in range(edited.graph.num_scenes)]
        given += edited.graph.num_scenes
        return Boxes.cat(chosen)

    return sample
