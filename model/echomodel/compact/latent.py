"""The latent graph: nodes that know their relations, before and after an edit (EchoScene 3.2)."""

from __future__ import annotations

from echomodel.arrays import Array, kit
from echomodel.compact.pairs import Layers, Pairs


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
