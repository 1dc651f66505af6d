"""Shapes: an autoencoder of signed distances, the denoiser of its latents, joined by an echo (EchoScene 3.4), draws.

The autoencoder is a PCA of 4^3 patches, refined by convolutions over the latent grid; the denoiser a small transformer
per object on principal components.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.boxes2d import seen
from echomodel.compact.modules import EchoLayer, WordTable, silence
from echomodel.compact.pairs import Pairs, level_features, pairs_of
from echomodel.compact.sampling import CompactSampling, Latent, agreeing, group_means
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch
from echomodel.progress import part_of
from echomodel.samplers import Predict
from echomodel.tsdf import FILLED
from echomodel.vocabulary import vocabulary

if TYPE_CHECKING:
    from echomodel.compact.model import CompactModel

GRID = 64
TOGETHER = 256  # objects that are denoised at a time when several draws are made: larger products, bounded memory
# Steps of what one stage hands to the next, coarser than the noise of sums in another order: equal bytes follow.
CODE, DISTANCE = 1e-3, 1e-4


class Autoencoder(nn.Module):
    """Grids (N, 64, 64, 64) in [-1, 1] <-> latents (N, C, G, G, G), G = 64 / patch.

    The encoder is a PCA of patches, fitted once by `initialise` and fixed: the decoder can be trained further without
    spoiling a denoiser trained on its latents. The decoder is the PCA's inverse plus residual convolutions over the
    latent grid, which see the neighbouring patches.
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        settings = config.autoencoder
        self.patch, self.channels = settings.patch, settings.channels
        voxels = self.patch**3
        self.register_buffer("basis", torch.zeros(settings.channels, voxels))
        self.register_buffer("offset", torch.zeros(settings.channels))
        self.decode_patch = nn.Linear(settings.channels, voxels)
        self.synthesis = _Refiner(settings.channels, settings.width, voxels, settings.blocks)

    basis: Tensor
    offset: Tensor

    @property
    def cells(self) -> int:
        """Cells of the latent grid along a side."""
        return GRID // self.patch

    @torch.no_grad()
    def initialise(self, grids: Tensor) -> None:
        """Fit the PCA to the patches of grids (M, X, Y, Z), scaled so that latents have unit power."""
        patches = to_patches(grids, self.patch).flatten(2).transpose(1, 2).reshape(-1, self.patch**3).double()
        mean = patches.mean(0)
        centred = patches - mean
        values, vectors = torch.linalg.eigh(centred.T @ centred / len(centred))
        basis = vectors[:, -self.channels :].flip(1)
        scale = values[-self.channels :].mean().sqrt()
        self.basis.copy_((basis / scale).T)
        self.offset.copy_(-(mean @ basis) / scale)
        self.decode_patch.weight.copy_(basis * scale)
        self.decode_patch.bias.copy_(mean)

    def encode(self, grids: Tensor) -> Tensor:
        """Latents of grids: (N, X, Y, Z) -> (N, C, X/p, Y/p, Z/p); any multiples of the patch."""
        patches = to_patches(grids, self.patch)
        return nn.functional.conv3d(patches, self.basis[:, :, None, None, None], self.offset)

    def decode(self, latent: Tensor) -> Tensor:
        """Grids of latents: (N, C, G, G, G) -> (N, 64, 64, 64) in [-1, 1]."""
        linear = self.decode_patch
        patches = nn.functional.conv3d(latent, linear.weight[:, :, None, None, None], linear.bias)
        return from_patches(patches + self.synthesis(latent), self.patch).clamp(-1, 1)

    def forward(self, grids: Tensor, noise: Tensor | float = 0.0) -> Tensor:
        """Reconstruction of grids, with noise added to the latent in between."""
        return self.decode(self.encode(grids) + noise)


class _Refiner(nn.Module):
    """Residual convolutions on the latent grid, each block seeing twice as far; the last map starts at zero.

    With two blocks a cell hears of almost the whole grid: a leg's foot of its seat, a cord of what hangs on it.
    """

    def __init__(self, inputs: int, width: int, outputs: int, blocks: int) -> None:
        super().__init__()
        self.enter = nn.Conv3d(inputs, width, 3, padding=1)
        self.blocks = nn.ModuleList(
            nn.Sequential(
                nn.SiLU(),
                nn.Conv3d(width, width, 3, padding=1),
                nn.SiLU(),
                nn.Conv3d(width, width, 3, padding=reach, dilation=reach),
            )
            for reach in (2 ** (number + 1) for number in range(blocks))
        )
        self.leave = nn.Conv3d(width, outputs, 1, bias=False)
        nn.init.zeros_(self.leave.weight)

    def forward(self, x: Tensor) -> Tensor:
        x = self.enter(x)
        for block in self.blocks:
            x = x + block(x)
        return self.leave(nn.functional.silu(x))


def to_patches(grids: Tensor, patch: int) -> Tensor:
    """Cut grids into cubes of `patch` voxels a side: (N, X, Y, Z) -> (N, patch^3, X/p, Y/p, Z/p)."""
    n, x, y, z = grids.shape
    cut = grids.reshape(n, x // patch, patch, y // patch, patch, z // patch, patch)
    return cut.permute(0, 2, 4, 6, 1, 3, 5).reshape(n, patch**3, x // patch, y // patch, z // patch)


def from_patches(patches: Tensor, patch: int) -> Tensor:
    """The inverse of `to_patches`."""
    n, _, x, y, z = patches.shape
    cut = patches.reshape(n, patch, patch, patch, x, y, z).permute(0, 4, 1, 5, 2, 6, 3)
    return cut.reshape(n, x * patch, y * patch, z * patch)


ShapeContext = tuple[Tensor, Tensor, Pairs]  # over all steps: nodes (N, width), echo nodes (N, echo width), pairs


class ShapeDenoiser(nn.Module):
    """Predicts the clean codes of every object; each has its own level, 0 = known.

    A code holds the K principal components of a latent grid over the whole training set. Furniture on the
    box-normalised grid lies close to so few directions that noise in all others would only have to be learnt away.

    Shapes:
        codes (N, K), level (N,) in [0, 1], `ShapeContext` -> (N, K)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        shape, width, channels = config.shape, config.shape.width, config.autoencoder.channels
        if shape.components % shape.tokens:
            raise ValueError(f"shape.components {shape.components} is no multiple of shape.tokens {shape.tokens}")
        self.settings = shape
        cells = GRID // config.autoencoder.patch
        self.grid = (channels, cells, cells, cells)
        self.register_buffer("mean", torch.zeros(channels * cells**3))
        self.register_buffer("basis", torch.zeros(shape.components, channels * cells**3))
        self.register_buffer("scale", torch.ones(shape.components))
        values = shape.components // shape.tokens
        self.category = WordTable("categories", config.categories, width)
        self.size = nn.Sequential(nn.Linear(3, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)
        self.level = nn.Sequential(nn.Linear(64, width), nn.SiLU(), nn.Linear(width, width))
        self.token = nn.Parameter(torch.randn(shape.tokens, values, width) * values**-0.5)
        self.place = nn.Parameter(torch.randn(shape.tokens, width) * 0.02)
        echo = shape.echo_width
        self.echo_node = nn.Linear(width, echo)
        self.echo_code = nn.Linear(shape.components, echo)
        self.echo_level = nn.Linear(64, echo)
        self.echo_layers = nn.ModuleList(EchoLayer(echo, 2 * len(config.predicates)) for _ in range(shape.echo_layers))
        self.echo_out = nn.Sequential(nn.LayerNorm(echo), nn.Linear(echo, width))
        self.blocks = nn.ModuleList(_Block(width, shape.heads) for _ in range(shape.layers))
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.scale_shift = nn.Linear(width, 2 * width)
        self.head = nn.Parameter(torch.zeros(shape.tokens, width, values))
        nn.init.normal_(self.category.weight, std=0.3)
        silence(self.scale_shift)

    mean: Tensor
    basis: Tensor
    scale: Tensor

    @torch.no_grad()
    def initialise(self, latents: Tensor, generator: torch.Generator) -> None:
        """Fit the principal components of latents (M, C, G, G, G) by a randomised range finder (Halko et al. 2011).

        Codes keep the square root of each component's spread, so that weak ones are not drowned by the noise at once;
        their mean power is one. Fewer shapes than components leave the last ones empty.
        """
        rows = latents.flatten(1).float()
        mean = rows.mean(0)
        rows = rows - mean
        count = min(len(self.basis), len(rows), rows.shape[1])
        wide = min(count + 60, len(rows))
        sketch = rows @ torch.randn(rows.shape[1], wide, generator=generator)
        for _ in range(2):
            left = torch.linalg.qr(sketch)[0]
            sketch = rows @ torch.linalg.qr((left.T @ rows).T)[0]
        left = torch.linalg.qr(sketch)[0]
        _, values, directions = torch.linalg.svd(left.T @ rows, full_matrices=False)
        spread = (values[:count] / len(rows) ** 0.5).clamp_min(1e-4)
        scale = spread.sqrt()
        scale = scale * (spread / scale).square().mean().sqrt()
        self.mean.copy_(mean)
        self.basis.zero_()
        self.basis[:count] = directions[:count]
        self.scale.fill_(1.0)
        self.scale[:count] = scale

    def codes(self, latents: Tensor) -> Tensor:
        """Codes of latent grids: (N, C, G, G, G) -> (N, K)."""
        return (latents.flatten(1) - self.mean) @ self.basis.T / self.scale

    def latents(self, codes: Tensor) -> Tensor:
        """Latent grids of codes: (N, K) -> (N, C, G, G, G)."""
        return (self.mean + (codes * self.scale) @ self.basis).reshape(-1, *self.grid)

    def context(self, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor) -> ShapeContext:
        """Everything that does not depend on the step.

        Arguments:
            graph: N nodes.
            size: (N, 3) float32, extents of the boxes in metres.
            pairs: the merged relations of the graph.
            latent: (N, latent width), output of the graph manipulator.
        """
        nodes = self.category(graph.category) + self.size(size.clamp_min(0.01).log()) + self.latent(latent)
        return nodes, self.echo_node(nodes), pairs

    def forward(self, x: Tensor, level: Tensor, context: ShapeContext) -> Tensor:
        sinusoids, nodes = level_features(level), context[0]
        condition = nn.functional.silu(nodes + self.level(sinusoids))
        heard = self._echo(x, sinusoids, context) if self.settings.echo else torch.zeros_like(nodes)
        h = torch.einsum("ntv,tvw->ntw", x.reshape(len(x), self.settings.tokens, -1), self.token) + self.place
        sources = torch.stack([heard, nodes, condition], dim=1)
        for block in self.blocks:
            h = block(h, condition, sources)
        scale, shift = self.scale_shift(condition)[:, None].chunk(2, dim=2)
        return torch.einsum("ntw,twv->ntv", self.norm(h) * (1 + scale) + shift, self.head).flatten(1)

    def _echo(self, x: Tensor, sinusoids: Tensor, context: ShapeContext) -> Tensor:
        """What each object hears of the others' current shapes: (N, width)."""
        _, nodes, pairs = context
        nodes = nodes + self.echo_code(x) + self.echo_level(sinusoids)
        for layer in self.echo_layers:
            nodes = layer(nodes, pairs)
        return self.echo_out(nodes)


class _Block(nn.Module):
    """Self-attention, cross-attention to the told tokens, perceptron; all gated by the condition (Peebles 2023)."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.modulation = nn.Linear(width, 6 * width)
        self.qkv = nn.Linear(width, 3 * width)
        self.attended = nn.Linear(width, width)
        self.cross_q = nn.Linear(width, width)
        self.cross_kv = nn.Linear(width, 2 * width)
        self.cross_out = nn.Linear(width, width)
        self.mlp = nn.Sequential(nn.Linear(width, 4 * width), nn.GELU(approximate="tanh"), nn.Linear(4 * width, width))
        silence(self.modulation)

    def forward(self, h: Tensor, condition: Tensor, sources: Tensor) -> Tensor:
        scale_a, shift_a, gate_a, scale_m, shift_m, gate_m = self.modulation(condition)[:, None].chunk(6, dim=2)
        normed = self.norm(h) * (1 + scale_a) + shift_a
        q, k, v = (self._split(part) for part in self.qkv(normed).chunk(3, dim=2))
        attended = nn.functional.scaled_dot_product_attention(q, k, v)
        h = h + (1 + gate_a) * self.attended(attended.transpose(1, 2).flatten(2))
        k, v = (self._split(part) for part in self.cross_kv(sources).chunk(2, dim=2))
        crossed = nn.functional.scaled_dot_product_attention(self._split(self.cross_q(self.norm(h))), k, v)
        h = h + self.cross_out(crossed.transpose(1, 2).flatten(2))
        return h + (1 + gate_m) * self.mlp(self.norm(h) * (1 + scale_m) + shift_m)

    def _split(self, x: Tensor) -> Tensor:
        return x.unflatten(2, (self.heads, -1)).transpose(1, 2)


def shape_predictor(model: CompactModel, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor) -> Predict:
    """Clean codes (N, K) in noisy ones; arguments as for `ShapeDenoiser.context`."""
    context = model.shape.context(graph, size, pairs, latent)
    return lambda x, level: model.shape(x, level, context)


TOP = 58  # voxel from which on a column counts as reaching the top of the box
PLAY = 0.1  # metres between the bottom of one and the top of the other


def wholeness(grids: Tensor) -> Tensor:
    """Share of a shape's volume in its largest piece times the shares of its box's sides that it spans.

    `grids`: (N, 64, 64, 64) float signed distances, negative inside.

    Returns (N,) float32 in [0, 1]: 1 for one piece that fills its box, 0 for an empty grid.
    """
    return torch.tensor([_whole(grid.cpu().numpy() < 0) for grid in grids], dtype=torch.float32, device=grids.device)


def _whole(inside: np.ndarray) -> float:
    parts, count = ndimage.label(inside)
    if not count:
        return 0.0
    volume = np.bincount(parts.ravel())[1:]
    spans = 1.0
    for axis in range(3):
        used = np.flatnonzero(inside.any(axis=tuple(other for other in range(3) if other != axis)))
        spans *= min((used[-1] - used[0] + 1) / FILLED, 1.0)
    return float(volume.max() / volume.sum() * spans)


def bearing(grids: Tensor, boxes: Boxes, triplets: Tensor) -> Tensor:
    """How much of the ground under what stands on each shape is really there, at the top of its box.

    A desk with a shelf at its back fills its box as well as a plain one, but a lamp in its middle would float.

    Arguments:
        grids: (N, 64, 64, 64) float signed distances, negative inside.
        boxes: N boxes.
        triplets: (E, 3) int64; `standing_on` with the subject at the object's top counts.

    Returns (N,) float32 in [0, 1]; 1 for whatever bears nothing.
    """
    out = torch.ones(len(grids), device=grids.device)
    high = (grids[:, :, TOP:] < 0).any(2)  # (N, x, z): columns that reach the top
    resting = [predicate.id for predicate in vocabulary().predicates if predicate.rests]
    for above, _, below in triplets[torch.isin(triplets[:, 1], triplets.new_tensor(resting))].tolist():
        gap = boxes.position[above, 1] - boxes.position[below, 1] - boxes.size[below, 1]
        if above == below or abs(float(gap)) > PLAY:
            continue
        place = seen((boxes.position[above] - boxes.position[below])[[0, 2]], boxes.yaw[below]).cpu().numpy()
        extent = boxes.size[below][[0, 2]].cpu().numpy()
        foot = float(boxes.size[above][[0, 2]].min()) / 4
        first = np.round((place - foot) / extent * FILLED + 31.5).clip(2, 61).astype(int)
        last = np.round((place + foot) / extent * FILLED + 31.5).clip(2, 61).astype(int)
        ground = high[below, first[0] : last[0] + 1, first[1] : last[1] + 1]
        out[below] = torch.minimum(out[below], ground.float().mean())
    return out


def repeated(values: Tensor | None, count: int) -> Tensor | None:
    """(N, ...) behind itself `count` times."""
    return None if values is None else torch.cat([values] * count)


@torch.no_grad()
def sample_shapes(
    model: CompactModel, latent: Latent, graph: GraphBatch, boxes: Boxes, equal: Tensor, how: CompactSampling
) -> Tensor:  # fmt: skip
    """Truncated signed distances (N, 64, 64, 64) float32 of all objects of S scenes, drawn from noise.

    Arguments:
        model: with a shape branch. latent: the latent graph of some scenes before and after an edit.
        graph: checked and on the model's device. boxes: N, that the shapes will fill.
        equal: (N,) int64, number of each object's group in [0, N); a group agrees on one shape.
        how: to sample; what is known is checked.
    """
    settings = model.config.shape
    known = None if how.known is None else model.shape.codes(model.autoencoder.encode(how.known))
    tries = 1 if how.noise is not None else how.candidates or settings.candidates
    width = max(1, min(tries, TOGETHER // graph.num_nodes))
    rounds = [min(width, tries - start) for start in range(0, tries, width)]
    grids, best = torch.empty(0), torch.empty(0)
    for number, count in enumerate(rounds):
        starts = [how.start(graph.num_nodes, settings.components, model.device) for _ in range(count)]
        if how.noise is None:
            starts = [x[equal] for x in starts]
        masks, progress = repeated(how.known_mask, count), part_of(how.progress, number, len(rounds))
        here = replace(how, known=repeated(known, count), known_mask=masks, progress=progress)
        many, nodes = GraphBatch.pack([graph] * count), latent(graph, how.edit).repeat(count, 1)
        pairs = pairs_of(many, model.config.predicates)
        predict = shape_predictor(model, many, boxes.size.repeat(count, 1), pairs, nodes)
        first = torch.arange(count, device=equal.device).repeat_interleave(len(equal)) * len(equal)
        codes = here.denoised(agreeing(predict, equal.repeat(count) + first), torch.cat(starts), settings)
        for draw in codes.chunk(count):
            drawn = _decoded(model, draw)
            if tries > 1:  # whole shapes that bear what stands on them first
                merit = wholeness(drawn) * (0.1 + 0.9 * bearing(drawn, boxes, graph.triplets))
            whole = group_means(merit, equal) if tries > 1 else best
            if not len(grids):
                grids, best = drawn, whole
                continue
            better = whole > best
            grids, best = torch.where(better[:, None, None, None], drawn, grids), torch.maximum(best, whole)
    if how.known is None or how.known_mask is None:
        return grids
    return torch.where(how.known_mask[:, None, None, None], how.known, grids)


def _decoded(model: CompactModel, codes: Tensor) -> Tensor:
    """Signed distances (N, 64, 64, 64) float32 of codes, a few objects at a time; both are rounded."""
    latents, decode = model.shape.latents, model.autoencoder.decode
    grids = torch.cat([decode(latents(part)).float() for part in _rounded(codes, CODE).split(4)])
    return _rounded(grids, DISTANCE)


def _rounded(values: Tensor, step: float) -> Tensor:
    return (values / step).round() * step
