"""The layout branch: noise of box vectors from boxes, objects and relations (EchoScene, section 3.3)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from echoscene.config import UNetConfig
from echoscene.gcn import TripletGCN
from echoscene.unet import UNet


class LayoutNet(UNet):
    """The layout denoiser with its echo; parameters are named as in the published files.

    Arguments:
        config: sizes; `config.channels` is 8, [sx, sy, sz, px, py, pz, sin, cos].
    """

    def __init__(self, config: UNetConfig) -> None:
        if config.conditioning != "crossattn":
            raise ValueError(f"layout branch: conditioning is {config.conditioning!r}, allowed: crossattn")
        super().__init__(1, config)
        if config.echo:
            self.pred_embeddings = nn.Embedding(config.predicates, config.predicate)
            self.box_embeddings = nn.Linear(config.channels, config.code)
            if config.time_in_echo:
                self.box_time_emb = nn.Linear(4 * config.width, config.code)
            nodes = config.objects + config.code * (2 if config.time_in_echo else 1)
            edges = config.predicate + config.edge_features
            self.box_graph_cov = TripletGCN(nodes, edges, config.hidden, config.layers, config.context, config.residual)

    def echo(self, x: Tensor, objects: Tensor, triples: Tensor, embedding: Tensor, edge_attr: Tensor | None) -> Tensor:
        """Exchange of the noisy boxes along the relations, the context of the denoiser: (N, context).

        Arguments:
            x: (N, 8) float32, noisy boxes.
            objects: (N, objects) float32, node conditions.
            triples: (E, 3) int64.
            embedding: (N, 4 width) float32, time.
            edge_attr: (E, edge_features) float32, or None where the config has none.
        """
        if not self.config.echo:
            return objects
        node = [objects, self.box_embeddings(x)]
        if self.config.time_in_echo:
            node.append(self.box_time_emb(embedding))
        edge = edge_input(self.pred_embeddings, triples, edge_attr, self.config)
        return self.box_graph_cov(torch.cat(node, dim=1), edge, triples[:, [0, 2]])[0]

    def forward(
        self, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, edge_attr: Tensor | None = None
    ) -> Tensor:
        """Predict the noise in boxes.

        Arguments:
            x: (N, 8) float32, noisy normalised boxes of all scenes.
            objects: (N, objects) float32, node conditions.
            triples: (E, 3) int64 [subject, predicate, object].
            t: (N,) int64, step of each node, 0..999.
            edge_attr: (E, edge_features) float32, further edge features (`paper` preset).

        Returns:
            (N, 8) float32.

        Raises:
            ValueError: wrong shapes, an unknown predicate, an edge outside the nodes, NaN in a condition.
        """
        check_inputs(x, objects, triples, t, self.config)
        embedding = self.embed_time(t)
        return self.denoise(x, embedding, self.echo(x, objects, triples, embedding, edge_attr))


def edge_input(table: nn.Embedding, triples: Tensor, edge_attr: Tensor | None, config: UNetConfig) -> Tensor:
    """Edge features of an echo: the predicate's embedding, and `edge_attr` where the config has further features."""
    if (edge_attr is None) != (config.edge_features == 0):
        found = "none" if edge_attr is None else f"width {edge_attr.shape[-1]}"
        raise ValueError(f"edge features: {found} given, config wants width {config.edge_features}")
    embedded = table(triples[:, 1])
    return embedded if edge_attr is None else torch.cat([edge_attr, embedded], dim=1)


def check_inputs(x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, config: UNetConfig) -> None:
    """Raises ValueError naming the first thing that a denoiser cannot use; see `LayoutNet.forward`."""
    nodes = len(x)
    if not nodes:
        raise ValueError("graph has no nodes, at least one is needed")
    for name, tensor, shape in (
        ("noisy state", x, (nodes, config.channels)),
        ("node condition", objects, (nodes, config.objects)),
        ("steps", t, (nodes,)),
        ("triples", triples, (len(triples), 3)),
    ):
        if tuple(tensor.shape[: len(shape)]) != shape:
            raise ValueError(f"{name} has shape {tuple(tensor.shape)}, expected {shape}")
    for name, values, size in (
        ("subject of triplet", triples[:, 0], nodes),
        ("predicate of triplet", triples[:, 1], config.predicates),
        ("object of triplet", triples[:, 2], nodes),
    ):
        wrong = (values < 0) | (values >= size)
        if bool(wrong.any()):
            at = int(wrong.nonzero()[0])
            raise ValueError(f"{name} {at} is {int(values[at])}, allowed: 0..{size - 1}")
    for name, tensor in (("noisy state", x), ("node condition", objects)):
        bad = ~torch.isfinite(tensor).flatten(1).all(1)
        if bool(bad.any()):
            raise ValueError(f"{name} of node {int(bad.nonzero()[0])} is not finite")
