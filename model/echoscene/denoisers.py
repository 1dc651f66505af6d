"""Both branches: the noise of boxes and of shape latents, each by objects and relations (EchoScene 3.3, 3.4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import torch
from torch import Tensor, nn

from echoscene.config import UNetConfig
from echoscene.encoder import TripletGCN
from echoscene.unet import UNet


class Denoiser(UNet):
    """A U-Net with its echo, the context of its cross-attention; parameters are named as in the published files.

    Arguments:
        config: sizes; `time_in_echo=False` and `echo=False` are rows of the paper's table 4.
        code: makes the network whose code of a node's noisy state the others hear.
        out: width of the echo's output.
        others: as for `UNet`.
    """

    names: ClassVar[tuple[str, str, str]]  # of the parameters of code, time and graph convolution

    def __init__(
        self, dims: int, config: UNetConfig, code: Callable[[], nn.Module], out: int, *, extra: int = 0
    ) -> None:
        super().__init__(dims, config, extra)
        if not config.echo:
            return
        self.pred_embeddings = nn.Embedding(config.predicates, config.predicate)
        coded, timed, convolution = self.names
        self.add_module(coded, code())
        if config.time_in_echo:
            self.add_module(timed, nn.Linear(4 * config.width, config.code))
        nodes = config.objects + config.code * (2 if config.time_in_echo else 1)
        edges = config.predicate + config.edge_features
        self.add_module(convolution, TripletGCN(nodes, edges, config.hidden, config.layers, out, config.residual))

    def echo(self, x: Tensor, objects: Tensor, triples: Tensor, embedding: Tensor, edge_attr: Tensor | None) -> Tensor:
        """Exchange of the noisy states along the relations, (N, context); `embedding` (N, 4 width) is the time's."""
        config = self.config
        if not config.echo:
            return objects
        coded, timed, convolution = self.names
        nodes = [objects, getattr(self, coded)(x)]
        if config.time_in_echo:
            nodes.append(getattr(self, timed)(embedding))
        edges = self.pred_embeddings(triples[:, 1])
        edges = edges if edge_attr is None else torch.cat([edge_attr, edges], dim=1)
        return getattr(self, convolution)(torch.cat(nodes, dim=1), edges, triples[:, [0, 2]])[0]

    def forward(
        self, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, edge_attr: Tensor | None = None
    ) -> Tensor:
        """Predict the noise in boxes or latents.

        Arguments:
            x: noisy normalised boxes (N, 8) or latents (N, 3, 16, 16, 16) of all nodes, float32, floor and `_scene_`
                included.
            objects: (N, objects) float32, node conditions.
            triples: (E, 3) int64 [subject, predicate, object].
            t: (N,) int64, step of each node, 0..999.
            edge_attr: (E, edge_features) float32, further edge features (`paper` preset).

        Returns the noise, as large as x. What the graph is was looked at by `SceneGraphTensors.check`.
        """
        embedding = self.embed_time(t)
        context = self.echo(x, objects, triples, embedding, edge_attr)
        if self.config.conditioning == "concat":
            return self.denoise(torch.cat([x, context.reshape(-1, 1, *x.shape[2:])], dim=1), embedding, None)
        return self.denoise(x, embedding, context)


class LayoutNet(Denoiser):
    """The denoiser of boxes: `config.channels` is 8, [sx, sy, sz, px, py, pz, sin, cos]."""

    names = ("box_embeddings", "box_time_emb", "box_graph_cov")

    def __init__(self, config: UNetConfig) -> None:
        if config.conditioning != "crossattn":
            raise ValueError(f"layout branch: conditioning is {config.conditioning!r}, allowed: crossattn")
        super().__init__(1, config, lambda: nn.Linear(config.channels, config.code), config.context)


class ShapeUNet(Denoiser):
    """The denoiser of shape latents, under the published names less `diffusion_net.`.

    With `conditioning="concat"` (a row of table 4) the context has grid^3 numbers and becomes one more input channel.
    """

    names = ("shape_embeddings", "shape_time_emb", "shape_code_graph_cov")

    def __init__(self, config: UNetConfig) -> None:
        concat, volume = config.conditioning == "concat", config.grid**3
        super().__init__(3, config, self._coder, volume if concat else config.context, extra=int(concat))
        if not config.echo and concat and config.objects != volume:
            raise ValueError(f"concat without echo: objects is {config.objects}, expected {volume} (grid^3)")

    def _coder(self) -> nn.Module:
        flat = 64 * (((self.config.grid // 2) - 2) // 4 + 1) ** 3
        return nn.Sequential(
            nn.Conv3d(self.config.channels, 32, 3, padding=1),
            nn.MaxPool3d(2, 2),
            nn.Conv3d(32, 64, 3, padding=1),
            nn.MaxPool3d(2, stride=4),  # the published stride: three quarters of the voxels are never looked at
            nn.Flatten(),
            nn.Linear(flat, self.config.code),
        )


class ShapeNet(nn.Module):
    """`ShapeUNet` under the prefix `diffusion_net.` that the published files have."""

    def __init__(self, config: UNetConfig) -> None:
        super().__init__()
        self.diffusion_net = ShapeUNet(config)

    def forward(self, *state: Tensor | None) -> Tensor:
        """As `ShapeUNet.forward`."""
        return self.diffusion_net(*state)
