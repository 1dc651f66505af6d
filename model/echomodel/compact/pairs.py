"""Relations as merged messages, one per ordered pair of objects with its predicates multi-hot, one echo of them, and
the latent graph, whose nodes know their relations, before and after an edit (EchoScene 3.2).

In an echo every node hears the merged messages of its scene and updates itself (EchoScene Eq. 1, section 3.3).
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.arrays import NUMPY, Array, beside, cast, full, kit, on_device, parted, repeat, rows, silu, sum_of
from echomodel.compact.learned import table_of
from echomodel.config import names_of
from echomodel.graph import GraphBatch, ordered_pairs
from echomodel.vocabulary import vocabulary

CACHED = 1024  # pairs whose messages a processor's cache holds


@dataclass(frozen=True, eq=False)
class Pairs:
    """All P ordered pairs of different nodes of one scene, sorted by receiver.

    Every object hears every other object of its room, as the published graph's `in` relations to the scene node make
    possible; what the graph states of a pair is in `stated`.

    Arguments:
        receiver, sender: (P,) int64, nodes.
        stated: (P, 2R) float32, predicates that hold from receiver to sender, then from sender to receiver; a branch
            may put more channels behind them.
        scale: (N, 1) float32, 1 / sqrt(number of senders), the weight of a node's summed messages.
    """

    receiver: Array
    sender: Array
    stated: Array
    scale: Array

    def to(self, device: Any) -> "Pairs":
        """The same pairs as tensors on a device, or with None as arrays of numpy."""
        return Pairs(*(on_device(of, device) for of in (self.receiver, self.sender, self.stated, self.scale)))

    def without(self, node_mask: Array, stated: Array) -> "Pairs":
        """The pairs between the nodes where `node_mask` (N,) bool is true, with `stated` (P, 2R) instead of theirs."""
        keep = rows(node_mask[self.receiver] & node_mask[self.sender])
        return Pairs(self.receiver[keep], self.sender[keep], stated[keep], self.scale)


def pairs_of(graph: GraphBatch, predicates: tuple[str, ...] | None = None) -> Pairs:
    """The pairs of a graph, told those of its relations that are among R `predicates`, None = all that networks learn.

    Parallel triplets merge, repeated ones count once, inverses are filled in.
    """
    predicates = names_of("predicates") if predicates is None else predicates
    counts = graph.node_counts
    receiver, sender, scale = ordered_pairs(counts)
    row = beside(table_of("predicates", predicates), graph.triplets)[graph.triplets[:, 1]]
    graph, predicate = graph.with_triplets(graph.triplets[row >= 0]), row[row >= 0]
    ends = [(graph.triplets[:, 0], graph.triplets[:, 2]), (graph.triplets[:, 2], graph.triplets[:, 0])]
    index = [_pair_number(*pair, graph.scene, counts) for pair in ends]
    # an inverse relation says the same the other way round: left(a, b) = right(b, a)
    forward = full(scale, (len(receiver), len(predicates)), 0.0)
    inverse = beside(inverse_predicates(predicates), row)[predicate]
    forward[index[0], predicate] = 1
    forward[index[1][inverse >= 0], inverse[inverse >= 0]] = 1
    backward = forward[reverse_pairs(receiver, sender, counts)]
    return Pairs(receiver, sender, kit(forward).concat([forward, backward], 1), scale)


def reverse_pairs(receiver: Array, sender: Array, counts: Array) -> Array:
    """(P,) int64, number of the pair that goes the other way."""
    scene = repeat(beside(np.arange(len(counts)), counts), counts)
    return _pair_number(sender, receiver, scene, counts)


def _pair_number(receiver: Array, sender: Array, scene: Array, counts: Array) -> Array:
    starts, before = counts.cumsum(0) - counts, (counts * (counts - 1)).cumsum(0) - counts * (counts - 1)
    of = scene[receiver]
    row, column = receiver - starts[of], sender - starts[of]
    return before[of] + row * (counts[of] - 1) + column - 1 * (column > row)


def inverse_predicates(predicates: tuple[str, ...]) -> np.ndarray:
    """(R,) int64, which of R predicates holds from object to subject where one holds, -1 where none follows."""
    words, names = vocabulary(), [vocabulary().name_of("predicates", name) for name in predicates]
    inverses = [words.predicate(name).inverse for name in names]
    return np.array([names.index(name) if name in names else -1 for name in inverses])


class Layers:
    """A network of torch or numpy, whose layers are called by their names."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    def modulated(self, level: Array) -> Array:
        """What each node's noise level (N,) does to its channels: (N, C); equal levels are looked at once."""
        once, of = kit(level).unique(level, return_inverse=True)
        return self.modulation(silu(self.level[0](level_features(once))))[of]


class Echo(Layers):
    """Triplet message passing with a residual, then a two-layer perceptron.

    m_i = W / sqrt(n_i) * sum_j silu(A x_i + B x_j + P p_ij),  x_i <- x_i + m_i,  x_i <- x_i + MLP(x_i),
    with x normalised before use and modulated by the noise level. As the last map of the message network is linear it
    is applied to the sum, so that no matrix product runs over pairs except the small one with the predicates.

    Shapes:
        x (N, width), pairs of the batch, modulation (N, 2 width) or None -> (N, width)
    """

    def forward(self, x: Array, pairs: Pairs, modulation: Array | None = None) -> Array:
        """The nodes after they heard one another."""
        normed = self.norm(x)
        if modulation is not None:
            scale, shift = parted(modulation, 2)
            normed = normed * (1 + scale) + shift
        here, there = parted(self.ends(normed), 2)
        x = x + self.message(self._heard(here, there, pairs) * pairs.scale)
        return x + self.mlp(self.norm_mlp(x))

    def _heard(self, a: Array, b: Array, pairs: Pairs) -> Array:
        """Summed messages, of numpy for so many receivers at once as the cache holds what is between the steps of."""
        some = len(a) * CACHED // max(1, len(pairs.receiver)) + 1
        if some >= len(a) or not isinstance(a, NUMPY):
            return pair_messages(a, b, self.told(pairs.stated), pairs.receiver, pairs.sender)
        cuts = pairs.receiver.searchsorted(range(some, len(a), some))
        split = (np.split(of, cuts) for of in (pairs.receiver, pairs.sender, pairs.stated))
        blocks = zip(range(0, len(a), some), *split, strict=True)
        return np.concatenate([pair_messages(a[k : k + some], b, self.told(p), i - k, j) for k, i, j, p in blocks])


class Latents(Layers):
    """Encodes the graph before an edit and carries its latents over to the edited graph.

    Encoder: z = GCN(category | relations). Manipulator: z' = GCN(z, touched, category | edited relations), where added
    nodes enter with z = 0 and nodes whose relations changed are marked as touched.

    Shapes:
        category (N,) int64 of the edited graph, `Pairs` over the same N nodes, added, touched (N,) -> (N, width)
    """

    def forward(
        self, category: Array, pairs: Pairs, *, before: Pairs | None = None, added: Array | None = None,
        touched: Array | None = None,
    ) -> Array:  # fmt: skip
        """Latent nodes of the edited graph.

        Arguments:
            category: (N,) int64, classes of the edited graph's nodes.
            pairs: relations of the edited graph.
            before: relations before the edit over the same nodes, None = there was no edit.
            added: (N,) bool, nodes that were not there before.
            touched: (N,) bool, nodes that were added or that an edited relation meets.
        """
        classes = self.category(category)
        z = classes
        source = pairs if before is None else before
        for layer in self.encoder:
            z = layer(z, source)
        if added is not None:
            z = z * ~added[:, None]
        known = classes if touched is None else classes + touched[:, None] * self.touched
        z = self.mix(kit(z).concat([z, known], 1))
        for layer in self.manipulator:
            z = layer(z, pairs)
        return self.norm(z)


def pair_messages(a: Array, b: Array, e: Array, receiver: Array, sender: Array) -> Array:
    """Summed messages sum_j silu(a_i + b_j + e_ij): a, b (N, C), e (P, C), receiver, sender (P,) -> (N, C)."""
    return sum_of(receiver, silu(a[receiver] + b[sender] + e), len(a))


def level_features(level: Array) -> Array:
    """Sinusoids of a noise level in [0, 1]: (N,) -> (N, 64)."""
    frequencies = np.exp(np.linspace(math.log(1.0), math.log(200.0), 32))
    angles = level[:, None] * cast(frequencies, level)
    return kit(level).concat([kit(level).cos(angles), kit(level).sin(angles)], 1)
