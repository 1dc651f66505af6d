"""What the shape echo is worth: python benchmarks/shape_echo.py DATA WEIGHTS_FOLDER [WEIGHTS_FOLDER ...].

Each folder holds weights of one training (latent graph, autoencoder, shape branch), with echoes or with
`model.shape.echo=false`, trained equally long. Two pieces of one class, told that they are of one style, start from
noise of their own here and are not made to agree, so that only the echo can tell one of the other.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from echomodel.compact.pairs import pairs_of
from echomodel.compact.shape import shape_predictor
from echomodel.data.shapeset import ShapeSet
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.samplers import sample
from echomodel.training.shape_stage import draw_suites, shape_loss
from echomodel.vocabulary import vocabulary

SUITES = 200


@dataclass(frozen=True)
class HeldOut:
    """Shapes of held-out styles: `latents` (H, ...), their `row` by shape number (-1 = not held out), `sizes`."""

    latents: torch.Tensor
    row: torch.Tensor
    sizes: torch.Tensor
    styles: torch.Tensor


@torch.no_grad()
def held_out(model: EchoModel, shapes: ShapeSet) -> HeldOut:
    """Encode the held-out part of a set."""
    numbers = np.flatnonzero(shapes.held_out)
    row = torch.full((len(shapes),), -1)
    row[numbers] = torch.arange(len(numbers))
    coder = model.model.autoencoder
    parts = np.array_split(numbers, len(numbers) // 16 + 1)
    latents = torch.cat([coder.encode(torch.from_numpy(shapes.tsdf(part))) for part in parts])
    styles = torch.from_numpy(np.unique(shapes.style[numbers]))
    return HeldOut(latents, row, torch.from_numpy(np.asarray(shapes.size, np.float32)), styles)


@torch.no_grad()
def denoising_loss(model: EchoModel, shapes: HeldOut) -> float:
    """Mean loss on suites of held-out styles, the same draws for every model."""
    generator, losses = torch.Generator().manual_seed(1), []
    for _ in range(24):
        batch = draw_suites(24, shapes.styles, generator)
        clean = model.model.shape.codes(shapes.latents[shapes.row[batch.shape]])
        losses.append(shape_loss(model.model, batch, clean, shapes.sizes[batch.shape], generator)[0])
    return float(torch.stack(losses).mean())


@torch.no_grad()
def likeness(model: EchoModel, shapes: HeldOut) -> float:
    """Distance of two pieces of one class told to be of one style, over that of pieces of different suites."""
    generator = torch.Generator().manual_seed(2)
    classes = len(model.config.categories)
    category = torch.randint(classes, (SUITES,), generator=generator)
    style = shapes.styles[torch.randint(len(shapes.styles), (SUITES,), generator=generator)]
    number = (style * classes + category).repeat_interleave(2)
    same_style = vocabulary().predicate_id("same_style_as")
    pair = GraphBatch.single([0, 0], [[0, same_style, 1], [1, same_style, 0]])
    graph = replace(GraphBatch.pack([pair] * SUITES), category=category.repeat_interleave(2))
    net, pairs = model.model, pairs_of(graph, model.config.predicates)
    predict = shape_predictor(net, graph, shapes.sizes[number], pairs, net.latent(graph.category, pairs))
    settings = model.config.shape
    noise = torch.randn(len(number), settings.components, generator=generator)
    codes = sample(settings.sampler, predict, noise, settings.steps, settings.objective, generator=generator)
    found = codes * net.shape.scale
    within = (found[0::2] - found[1::2]).norm(dim=1)
    apart = torch.cdist(found, found)
    owner = torch.arange(SUITES).repeat_interleave(2)
    same_class = graph.category[:, None] == graph.category
    other = same_class & (owner[:, None] != owner)
    return float(within.mean() / apart[other].mean())


def main() -> None:
    """Read the arguments and print one line per folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("weights", type=Path, nargs="+")
    options = parser.parse_args()
    encoded = None
    for folder in options.weights:
        model = EchoModel.load(folder)
        encoded = encoded or held_out(model, ShapeSet(options.data / "shapes"))
        print(
            f"{folder}: echo {model.config.shape.echo!s:5}  held denoising loss {denoising_loss(model, encoded):.4f}"
            f"  one style over one class {likeness(model, encoded):.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
