"""Graph convolution (equation 1), embedding, graph encoder E_r and graph manipulator (EchoScene, section 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn

from echomodel.graph import within
from echomodel.randomness import Randomness, normal
from echoscene.config import EncoderConfig


def _mlp(*widths: int) -> nn.Sequential:
    """Linear, BatchNorm1d and ReLU for each consecutive pair of widths."""
    parts: list[nn.Module] = []
    for width, following in pairwise(widths):
        linear = nn.Linear(width, following)
        nn.init.kaiming_normal_(linear.weight)
        parts += [linear, nn.BatchNorm1d(following), nn.ReLU()]
    return nn.Sequential(*parts)


class TripletConvolution(nn.Module):
    """One exchange of messages along [subject, edge, object] triplets.

    `net1` turns each triplet into a message to the subject, a new edge and a message to the object; the messages that a
    node receives are averaged over all its appearances and go through `net2`. With `residual`, linear maps of the old
    features are added. A self edge counts twice, a node without edges averages to zero.

    Arguments:
        nodes, edges: widths of node and edge features.
        hidden: width of the messages.
        out: width of the new node features.
        residual: add linear maps of the old node and edge features.
    """

    def __init__(self, nodes: int, edges: int, hidden: int, out: int, residual: bool = True) -> None:
        super().__init__()
        self.hidden, self.edges = hidden, edges
        self.net1 = _mlp(2 * nodes + edges, hidden, 2 * hidden + edges)
        self.net2 = _mlp(hidden, hidden, out)
        self.residual = residual
        if residual:
            self.linear_projection = nn.Linear(nodes, out)
            self.linear_projection_pred = nn.Linear(edges, edges)

    def forward(self, x: Tensor, e: Tensor, ends: Tensor) -> tuple[Tensor, Tensor]:
        """Node features (N, nodes) and edge features (E, edges), `ends` (E, 2) int64 -> (N, out), (E, edges)."""
        subject, target = ends[:, 0], ends[:, 1]
        pooled = x.new_zeros(len(x), self.hidden)
        new_e = e
        if len(e):
            triplet = self.net1(torch.cat([x[subject], e, x[target]], dim=1))
            to_subject, new_e, to_target = triplet.split([self.hidden, self.edges, self.hidden], dim=1)
            pooled = pooled.index_add(0, subject, to_subject).index_add(0, target, to_target)
            pooled = pooled / torch.bincount(ends.reshape(-1), minlength=len(x)).clamp_min(1).to(x)[:, None]
        new_x = self.net2(pooled)
        if self.residual:
            new_x = new_x + self.linear_projection(x)
            new_e = new_e + self.linear_projection_pred(e)
        return new_x, new_e


class TripletGCN(nn.Module):
    """A stack of triplet convolutions; only the last one changes the node width (EchoScene, equation 1).

    Arguments:
        nodes, edges: widths of node and edge features.
        hidden: width of the messages.
        layers: number of convolutions.
        out: node width after the last one.
        residual: add linear maps of the old features in every layer.
    """

    def __init__(self, nodes: int, edges: int, hidden: int, layers: int, out: int, residual: bool = True) -> None:
        super().__init__()
        widths = [nodes] * (layers - 1) + [out]
        self.gconvs = nn.ModuleList([TripletConvolution(nodes, edges, hidden, w, residual) for w in widths])

    def forward(self, x: Tensor, e: Tensor, ends: Tensor) -> tuple[Tensor, Tensor]:
        """Pass messages.

        Arguments:
            x: (N, nodes) float, node features.
            e: (E, edges) float, edge features; E may be 0.
            ends: (E, 2) int64, subject and object of each edge.

        Returns (N, out) node and (E, edges) edge features; in training of two nodes and edges or more (ValueError).
        """
        for layer in self.gconvs:
            x, e = layer(x, e, ends)
        return x, e


@dataclass(frozen=True, eq=False)
class SceneGraphTensors:
    """A labelled graph as the published model takes it.

    Arguments:
        classes: (N,) int64, class ids; each scene ends by its floor and its `_scene_` node (class 0).
        triples: (E, 3) int64 [subject, predicate, object]; every node has an `in` (0) triple to its `_scene_`.
        node_text: (N, text) float32, text features of the class labels.
        edge_text: (E, text) float32, text features of "subject predicate object", or None (zeros).
    """

    classes: Tensor
    triples: Tensor
    node_text: Tensor
    edge_text: Tensor | None = None

    def to(self, device: torch.device | str) -> SceneGraphTensors:
        """The same graph on a device."""
        text = None if self.edge_text is None else self.edge_text.to(device)
        return SceneGraphTensors(self.classes.to(device), self.triples.to(device), self.node_text.to(device), text)

    def check(self, config: EncoderConfig) -> None:
        """Raises ValueError naming the first class, predicate, end or text feature that the model cannot use."""
        nodes = len(self.classes)
        if not nodes:
            raise ValueError("graph has no nodes, at least one is needed")
        within("class of node", self.classes, config.classes)
        within("subject of triplet", self.triples[:, 0], nodes)
        within("predicate of triplet", self.triples[:, 1], config.predicates)
        within("object of triplet", self.triples[:, 2], nodes)
        for name, text, count in (("node", self.node_text, nodes), ("edge", self.edge_text, len(self.triples))):
            if text is None:
                continue
            if tuple(text.shape) != (count, config.text):
                raise ValueError(f"text features of {name}s are {tuple(text.shape)}, expected {(count, config.text)}")
            bad = ~torch.isfinite(text).all(1)
            if bool(bad.any()):
                raise ValueError(f"text feature of {name} {int(bad.nonzero()[0])} is not finite")


class GraphEncoder(nn.Module):
    """Embedding tables, encoder and manipulator, under the published parameter names.

    Arguments:
        config: sizes.
        branches: branches that `config.separated` stores an unused graph convolution for (`l`, `s`).
    """

    def __init__(self, config: EncoderConfig, branches: Sequence[str] = ("s", "l")) -> None:
        super().__init__()
        self.encoder_config = config
        node, sizes = config.node, (config.hidden, config.layers, config.node, config.residual)
        self.obj_embeddings_ec = nn.Embedding(config.classes + 1, config.learned)
        self.pred_embeddings_ec = nn.Embedding(config.predicates, config.learned)
        self.obj_embeddings_dc = nn.Embedding(config.classes + 1, config.learned)  # never used by the published code
        self.pred_embeddings_man_dc = nn.Embedding(config.predicates, config.learned)
        self.gconv_net_ec = TripletGCN(node, node, *sizes)
        self.gconv_net_manipulation = TripletGCN(2 * node + config.flag, node, *sizes)
        if config.separated:
            for branch in branches:
                self.add_module(f"gconv_net_ec_rel_{branch}", TripletGCN(2 * node, node, *sizes))

    def embed(self, graph: SceneGraphTensors, *, manipulator: bool = False) -> tuple[Tensor, Tensor]:
        """Node (N, node) and edge (E, node) features: text, then learned; `manipulator` picks its predicate table."""
        own = manipulator and self.encoder_config.own_manipulator_table
        table = self.pred_embeddings_man_dc if own else self.pred_embeddings_ec
        predicates = table(graph.triples[:, 1])
        text = graph.edge_text
        if text is None:
            text = predicates.new_zeros(len(predicates), self.encoder_config.text)
        nodes = torch.cat([graph.node_text, self.obj_embeddings_ec(graph.classes)], dim=1)
        return nodes, torch.cat([text, predicates], dim=1)

    def encode(self, graph: SceneGraphTensors) -> tuple[Tensor, Tensor]:
        """Latents of nodes and edges, (N, node) and (E, node) float32 (E_r)."""
        graph.check(self.encoder_config)
        return self.gconv_net_ec(*self.embed(graph), graph.triples[:, [0, 2]])

    def manipulate(
        self, latent: Tensor, graph: SceneGraphTensors, *, added: Sequence[int] = (), touched: Sequence[int] = (),
        generator: Randomness | None = None,
    ) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
        """Latents of an edited graph from those of the graph before (generation: no edit).

        Arguments:
            latent: (M, node) float32, encoder output of the graph before the edit.
            graph: the graph after the edit.
            added: nodes missing before, each the index that the node has before later ones are inserted; a zero
                latent is inserted there.
            touched: ends of changed triples, in the numbering after the edit.
            generator: draws change flags (added and touched nodes, flag) float32, a row a node in ascending order of
                the nodes after the edit.

        Returns (N, node) latents, (E, node) edge latents and (N,) bool, the nodes that were kept.
        Raises ValueError where the counts do not add up, or the graph is one that `SceneGraphTensors.check` refuses.
        """
        config = self.encoder_config
        graph.check(config)
        places = [index + number for number, index in enumerate(added)]
        for place in places:
            if not 0 <= place <= len(latent):
                raise ValueError(f"added node {place} lies outside 0..{len(latent)}")
            latent = torch.cat([latent[:place], latent.new_zeros(1, latent.shape[1]), latent[place:]])
        count = len(graph.classes)
        if len(latent) != count:
            raise ValueError(f"{len(latent)} latents with {len(places)} added nodes for a graph of {count} nodes")
        edited = sorted({*places, *touched})  # the published code draws node by node
        noise = normal((len(edited), config.flag), generator, latent.device)
        flags = latent.new_zeros(count, config.flag)
        keep = torch.ones(count, dtype=torch.bool, device=latent.device)
        for row, node in enumerate(edited):
            flags[node], keep[node] = noise[row], False
        nodes, edges = self.embed(graph, manipulator=True)
        new, new_edges = self.gconv_net_manipulation(
            torch.cat([latent, flags, nodes], dim=1), edges, graph.triples[:, [0, 2]]
        )
        return new, new_edges, keep
