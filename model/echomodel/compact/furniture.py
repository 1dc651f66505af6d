"""Furniture denoiser: descriptions of all pieces of a scene at once; at every step each hears the others (3.4).

A description (`echomodel.furniture.style`) has the same places in all classes, so what a chair hears of its
table it can say of itself: legs, edges, fronts, how soft, how slender.
"""

from itertools import accumulate, pairwise

from echomodel.arrays import Array, at_least, cast, clipped, kit, parted, softmax, sum_of
from echomodel.compact.pairs import Layers, Pairs
from echomodel.config import FurnitureConfig
from echomodel.graph import GraphBatch

FurnitureContext = tuple[Array, Pairs]  # what stays the same over all steps: nodes (N, width) and pairs


class Furniture(Layers):
    """Says the clean description of every object in a noisy one; each has its own level, 0 = known.

    Kinds are said as the probabilities of their words, so that the mean of what fits is a mixture and no third thing.

    Shapes:
        descriptions (N, D), level (N,) in [0, 1], `FurnitureContext` -> (N, D)
    """

    settings: FurnitureConfig

    def context(self, graph: GraphBatch, size: Array, pairs: Pairs, latent: Array) -> FurnitureContext:
        """Everything that does not depend on the step; arguments as for `ShapeDenoiser.context`."""
        nodes = self.category(graph.category) + self.size(kit(size).log(at_least(size, 0.01))) + self.latent(latent)
        return nodes + self.room_type(graph.room_type)[graph.scene], pairs

    def forward(self, x: Array, level: Array, context: FurnitureContext) -> Array:
        """The clean descriptions."""
        return self.clean(self.scores(x, level, context))

    def clean(self, scores: Array) -> Array:
        """(..., D) that scores (..., D) stand for: each word's probability on [-1, 1], numbers cut."""
        ends = [0, *accumulate(self.settings.kinds)]
        parts = [2 * softmax(scores[..., start:end]) - 1 for start, end in pairwise(ends)]
        return kit(scores).concat([*parts, clipped(scores[..., ends[-1] :], -1.0, 1.0)], -1)

    def scores(self, x: Array, level: Array, context: FurnitureContext) -> Array:
        """Logarithms of the words' odds, and the numbers as they are: (N, D)."""
        nodes, pairs = context
        h = nodes + self.own(x)
        if self.settings.echo:
            h = h + self.heard(self._voices(x, level, pairs))
        for layer, own in zip(self.layers, parted(self.modulated(level), self.settings.layers), strict=True):
            h = layer(h, pairs, own)
        return self.head(self.norm(h))

    def _voices(self, x: Array, level: Array, pairs: Pairs) -> Array:
        """Means of the others' descriptions, weighted by what is told of the pair and by how clear they are.

        Shapes:
            x (N, D), level (N,) -> (N, voices * (D + 1)), the last number of each voice its weight
        """
        xp = kit(x)
        clear = xp.log1p(2 * (1 - level) / (level + 0.05))  # 0 for pure noise, 3.7 for a known piece
        weight = cast(1 / (1 + xp.exp(-self.trust(pairs.stated))), x) * clear[pairs.sender, None]
        total = sum_of(pairs.receiver, weight, len(x))
        out = []
        for voice in range(weight.shape[1]):
            spoken = sum_of(pairs.receiver, weight[:, voice, None] * x[pairs.sender], len(x))
            out += [spoken / (total[:, voice, None] + 0.05), xp.tanh(total[:, voice, None])]
        return xp.concat(out, 1)
