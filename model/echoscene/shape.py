"""The shape branch: noise of shape latents from latents, objects and relations (EchoScene, section 3.4)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from echoscene.config import UNetConfig
from echoscene.gcn import TripletGCN
from echoscene.layout import check_inputs, edge_input
from echoscene.unet import UNet


class ShapeUNet(UNet):
    """The shape denoiser with its echo; parameters are named as in the published files, less `diffusion_net.`.

    Arguments:
        config: sizes; the ablations `time_in_echo=False`, `echo=False` and `conditioning="concat"` are the rows of
            the paper's table 4. With `concat` the context has grid^3 numbers and becomes one more input channel.
    """

    def __init__(self, config: UNetConfig) -> None:
        concat = config.conditioning == "concat"
        super().__init__(3, config, extra=1 if concat else 0)
        volume = config.grid**3
        if not config.echo:
            if concat and config.objects != volume:
                raise ValueError(f"concat without echo: objects is {config.objects}, expected {volume} (grid^3)")
            return
        self.pred_embeddings = nn.Embedding(config.predicates, config.predicate)
        flat = 64 * (((config.grid // 2) - 2) // 4 + 1) ** 3
        self.shape_embeddings = nn.Sequential(
            nn.Conv3d(config.channels, 32, 3, padding=1),
            nn.MaxPool3d(2, 2),
            nn.Conv3d(32, 64, 3, padding=1),
            nn.MaxPool3d(2, stride=4),  # the published stride: three quarters of the voxels are never looked at
            nn.Flatten(),
            nn.Linear(flat, config.code),
        )
        if config.time_in_echo:
            self.shape_time_emb = nn.Linear(4 * config.width, config.code)
        nodes = config.objects + config.code * (2 if config.time_in_echo else 1)
        edges = config.predicate + config.edge_features
        out = volume if concat else config.context
        self.shape_code_graph_cov = TripletGCN(nodes, edges, config.hidden, config.layers, out, config.residual)

    def echo(self, x: Tensor, objects: Tensor, triples: Tensor, embedding: Tensor, edge_attr: Tensor | None) -> Tensor:
        """Exchange of the noisy latents along the relations: (N, context), arguments as in `forward`."""
        if not self.config.echo:
            return objects
        node = [objects, self.shape_embeddings(x)]
        if self.config.time_in_echo:
            node.append(self.shape_time_emb(embedding))
        edge = edge_input(self.pred_embeddings, triples, edge_attr, self.config)
        return self.shape_code_graph_cov(torch.cat(node, dim=1), edge, triples[:, [0, 2]])[0]

    def forward(
        self, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, edge_attr: Tensor | None = None
    ) -> Tensor:
        """Predict the noise in shape latents.

        Arguments:
            x: (N, 3, 16, 16, 16) float32, noisy latents of all nodes, floor and `_scene_` included.
            objects: (N, objects) float32, node conditions.
            triples: (E, 3) int64 [subject, predicate, object].
            t: (N,) int64, step of each node, 0..999.
            edge_attr: (E, edge_features) float32, further edge features (`paper` preset).

        Returns:
            (N, 3, 16, 16, 16) float32.

        Raises:
            ValueError: wrong shapes, an unknown predicate, an edge outside the nodes, NaN in a condition.
        """
        grid = (self.config.grid,) * 3
        if tuple(x.shape[2:]) != grid:
            raise ValueError(f"shape latents are {tuple(x.shape)}, expected (N, {self.config.channels}, {grid})")
        check_inputs(x, objects, triples, t, self.config)
        embedding = self.embed_time(t)
        context = self.echo(x, objects, triples, embedding, edge_attr)
        if self.config.conditioning == "concat":
            return self.denoise(torch.cat([x, context.reshape(-1, 1, *grid)], dim=1), embedding, None)
        return self.denoise(x, embedding, context)


class ShapeNet(nn.Module):
    """`ShapeUNet` under the prefix `diffusion_net.` that the published files have."""

    def __init__(self, config: UNetConfig) -> None:
        super().__init__()
        self.diffusion_net = ShapeUNet(config)

    def forward(
        self, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, edge_attr: Tensor | None = None
    ) -> Tensor:
        """As `ShapeUNet.forward`."""
        return self.diffusion_net(x, objects, triples, t, edge_attr)
