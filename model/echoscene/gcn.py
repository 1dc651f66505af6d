"""The triplet graph convolution (EchoScene, equation 1, as the published networks wire it)."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn


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
            pooled = pooled / appearances(ends, len(x)).clamp_min(1).to(x)[:, None]
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

        Returns (N, out) node and (E, edges) edge features.
        Raises ValueError where a tensor has the wrong shape, an edge ends outside the nodes, or batch statistics are
        wanted of a single node or edge.
        """
        self._check(x, e, ends)
        for layer in self.gconvs:
            x, e = layer(x, e, ends)
        return x, e

    def _check(self, x: Tensor, e: Tensor, ends: Tensor) -> None:
        first: Any = self.gconvs[0]
        width = (first.net1[0].in_features - first.edges) // 2
        if x.ndim != 2 or x.shape[1] != width:
            raise ValueError(f"graph convolution: node features are {tuple(x.shape)}, expected (N, {width})")
        if tuple(e.shape) != (len(ends), first.edges):
            expected = (len(ends), first.edges)
            raise ValueError(f"graph convolution: edge features are {tuple(e.shape)}, expected {expected}")
        check_ends(ends, len(x))
        if self.training and (len(x) == 1 or len(e) == 1):
            what = "node" if len(x) == 1 else "edge"
            raise ValueError(f"graph convolution: one {what} has no batch statistics; train on larger batches")


def appearances(ends: Tensor, nodes: int) -> Tensor:
    """(N,) int64: how often each node is an end of an edge; `ends` (E, 2) int64."""
    return torch.bincount(ends.reshape(-1), minlength=nodes)


def check_ends(ends: Tensor, nodes: int) -> None:
    """Raises ValueError naming the first edge in `ends` (E, 2) that ends outside 0..nodes-1."""
    if ends.ndim != 2 or ends.shape[1] != 2:
        raise ValueError(f"edges are {tuple(ends.shape)}, expected (E, 2) [subject, object]")
    wrong = ((ends < 0) | (ends >= nodes)).any(1)
    if bool(wrong.any()):
        at = int(wrong.nonzero()[0])
        raise ValueError(f"edge {at} goes from node {int(ends[at, 0])} to {int(ends[at, 1])}, allowed: 0..{nodes - 1}")


def check_range(name: str, values: Tensor, size: int) -> None:
    """Raises ValueError naming the first of `values` (n,) that lies outside 0..size-1."""
    wrong = (values < 0) | (values >= size)
    if bool(wrong.any()):
        at = int(wrong.nonzero()[0])
        raise ValueError(f"{name} {at} is {int(values[at])}, allowed: 0..{size - 1}")
