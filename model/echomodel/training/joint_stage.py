"""The joint stage: both branches learn at once on one shared latent graph (EchoScene 3.5, Supplement)."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.training.layout_stage import LayoutStage, edited_latent
from echomodel.training.rooms import draw_batch
from echomodel.training.shape_stage import ShapeStage, room_shapes, shape_loss


class JointStage:
    """What the trainer needs to know about joint training.

    A batch of scenes feeds the layout branch and a smaller one, within the node budget of shapes, the shape branch
    (Supplement, batch size definition); both pass the same encoder and manipulator.

    Arguments:
        layout, shape: the two stages, with their data and budgets.
    """

    trained = saved = ("latent", "layout", "shape")

    def __init__(self, layout: LayoutStage, shape: ShapeStage) -> None:
        self.layout, self.shape = layout, shape

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Sum of both branches' losses on one random batch."""
        batch = draw_batch(self.layout.rooms, self.layout.nodes, generator)
        layout, parts = self.layout.scored(model, batch, generator)
        few = draw_batch(self.layout.rooms, self.shape.batch, generator)
        objects = room_shapes(few, self.shape.shapes)
        clean = self.shape.codes(model)[objects.shape]
        sizes = self.shape.shapes.sizes[objects.shape]
        shape, more = shape_loss(model, objects, clean, sizes, generator, edited_latent(model, few))
        return layout + shape, {**parts, **more}

    def validate(self, model: CompactModel) -> dict[str, float]:
        """Both branches' validation."""
        return {**self.layout.validate(model), **self.shape.validate(model)}
