"""The joint stage: both branches learn at once on one shared latent graph (EchoScene 3.5, Supplement)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.training.layout_stage import LayoutStage, edited_latent
from echomodel.training.rooms import draw_batch
from echomodel.training.shape_stage import ShapeStage, room_shapes, shape_loss
from echomodel.training.start import Start


class JointStage:
    """What the trainer needs to know about joint training.

    A batch of scenes feeds the layout branch and a smaller one, within the node budget of shapes, the shape branch
    (Supplement, batch size definition); both pass the same encoder and manipulator.

    Arguments:
        layout, shape: the two stages, with their data and budgets.
    """

    trained = saved = ("latent", "layout", "shape")
    parts: ClassVar[tuple[str, ...]] = ("latent", "layout", "autoencoder", "shape")
    needs: ClassVar[tuple[str, ...]] = ("autoencoder",)

    def __init__(self, layout: LayoutStage, shape: ShapeStage) -> None:
        self.layout, self.shape = layout, shape

    @classmethod
    def open(cls, start: Start) -> JointStage:
        """Both stages of a recipe, on the same rooms."""
        layout = LayoutStage.open(start)
        return cls(layout, ShapeStage.on(layout.rooms, start))

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Sum of both branches' losses on one random batch."""
        batch = draw_batch(self.layout.rooms, self.layout.nodes, generator).to(model.device)
        layout, parts = self.layout.scored(model, batch, generator)
        few = draw_batch(self.layout.rooms, self.shape.batch, generator)
        objects = room_shapes(few, self.shape.shapes).to(model.device)
        latent = edited_latent(model, few.to(model.device))
        shape, more = shape_loss(model, objects, *self.shape.truth(model, objects), generator, latent)
        return layout + shape, {**parts, **more}

    def validate(self, model: CompactModel) -> dict[str, float]:
        """Both branches' validation."""
        return {**self.layout.validate(model), **self.shape.validate(model)}
