"""Furniture made of parts: the model describes every piece, a program builds it, sharp and of several materials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.furniture import solids
from echomodel.furniture.style import WIDTH, piece_of
from echomodel.protocols import furnishes
from echomodel.vocabulary import vocabulary
from echousd.reproducible import one_thread, rounded_descriptions
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.joinery import assembled
from echousd.shapes.sources.source import ShapeRequest, Shapes, per_asset
from echousd.shapes.styles import told_styles
from echousd.tensors import floor_centre, graph_batch, seeded

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

ORIGIN = Origin("parts")


class AssembledParts:
    """The source `parts`; needs a model with a furniture branch."""

    title = "furniture made of parts"

    def check(self, model: RoomModel | None) -> None:
        """Raises ValueError for a model without a furniture branch, or one that describes furniture in other words."""
        if not furnishes(model):
            raise ValueError(
                "these weights have no furniture branch; use --shapes sdf, --shapes boxes or other weights"
            )
        if model.description_width != WIDTH:
            raise ValueError(
                f"these weights describe furniture by {model.description_width} numbers, this version by {WIDTH}; "
                "train them again or use --shapes sdf"
            )

    def shapes(self, request: ShapeRequest) -> Shapes:
        """Pieces built from sampled descriptions; those of an edited graph that stay are heard."""
        described = descriptions(request)
        size, named = np.asarray(request.boxes.size, float), told_styles(request.graph)

        def make(row: int) -> Geometry:
            told = tuple(round(float(v), 4) for v in described[row])
            style, choices = piece_of(np.array(told), named[request.graph.nodes[row].name])
            kind = vocabulary().category(request.graph.nodes[row].category)
            parts = solids(kind.name, style, choices, size[row])
            return assembled(
                parts, size[row], faces=request.faces, origin=ORIGIN, description=told, round=kind.round
            )  # fmt: skip

        return per_asset(request, make)


def descriptions(request: ShapeRequest) -> np.ndarray:
    """(n, WIDTH) float32: the model's description of every object, rounded (`echousd.reproducible`)."""
    graph, boxes, model = request.graph, request.boxes, request.model
    SOURCE.check(model)
    assert furnishes(model)
    centred = Boxes(boxes.size, boxes.position - floor_centre(graph), boxes.yaw)
    words = sorted(set(request.styles.values()))
    styles = torch.tensor([words.index(request.styles[name]) for name in graph.names])
    extra: dict[str, Any] = {} if request.change is None else {"edit": request.change}
    kept = {name: form.description for name, form in request.kept.items() if len(form.description) == WIDTH}
    if kept:
        extra["known"] = torch.tensor([kept.get(name, (0.0,) * WIDTH) for name in graph.names])
        extra["known_mask"] = torch.tensor([name in kept for name in graph.names])
    with request.timer.stage("shapes") as tell, one_thread():
        found = model.sample_furniture(
            graph_batch(graph), centred, generator=seeded(request.seed, "parts"), steps=request.steps,
            styles=styles, progress=tell, **extra,
        )  # fmt: skip
    return rounded_descriptions(np.asarray(found.cpu()))


SOURCE = AssembledParts()
