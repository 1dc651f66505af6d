"""The shape autoencoder: signed distance grids to quantised latents and back (EchoScene, section 3.4)."""

from collections import OrderedDict

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from echoscene.config import VQConfig


def _norm(channels: int) -> nn.GroupNorm:
    groups = channels // 4 if channels <= 32 else 32 if channels % 32 == 0 else 30
    return nn.GroupNorm(groups, channels, eps=1e-6)


class _Residual(nn.Module):
    def __init__(self, cin: int, cout: int) -> None:
        super().__init__()
        self.norm1, self.conv1 = _norm(cin), nn.Conv3d(cin, cout, 3, padding=1)
        self.norm2, self.conv2 = _norm(cout), nn.Conv3d(cout, cout, 3, padding=1)
        if cin != cout:
            self.nin_shortcut = nn.Conv3d(cin, cout, 1)

    def forward(self, x: Tensor) -> Tensor:
        h = self.conv1(F.silu(self.norm1(x)))
        h = self.conv2(F.silu(self.norm2(h)))
        return h + (self.nin_shortcut(x) if hasattr(self, "nin_shortcut") else x)


class _VoxelAttention(nn.Module):
    """Single-head attention over all voxels."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.norm = _norm(channels)
        self.q, self.k, self.v, self.proj_out = (nn.Conv3d(channels, channels, 1) for _ in range(4))

    def forward(self, x: Tensor) -> Tensor:
        h = self.norm(x)
        q, k, v = (f(h).flatten(2).transpose(1, 2)[:, None] for f in (self.q, self.k, self.v))
        h = F.scaled_dot_product_attention(q, k, v)[:, 0].transpose(1, 2).reshape(x.shape)
        return x + self.proj_out(h)


def _named(**parts: nn.Module) -> nn.Sequential:
    """Parts that are called one after another, under their published names."""
    return nn.Sequential(OrderedDict(parts))


def _middle(channels: int) -> nn.Sequential:
    first, attention = _Residual(channels, channels), _VoxelAttention(channels)
    return _named(block_1=first, attn_1=attention, block_2=_Residual(channels, channels))


def _level(cin: int, cout: int, blocks: int) -> nn.Sequential:
    return _named(block=nn.Sequential(*(_Residual(cin if i == 0 else cout, cout) for i in range(blocks))))


def _encoder(config: VQConfig) -> nn.Sequential:
    enter = nn.Conv3d(1, config.channels, 3, padding=1)
    levels, current = [], config.channels
    for number, factor in enumerate(config.mult):
        width = config.channels * factor
        level = _level(current, width, config.blocks)
        if number < len(config.mult) - 1:
            pad = nn.ConstantPad3d((0, 1, 0, 1, 0, 1), 0.0)  # the published padding: one voxel at the far ends only
            level.add_module("downsample", _named(pad=pad, conv=nn.Conv3d(width, width, 3, stride=2)))
        levels.append(level)
        current = width
    middle, norm = _middle(current), _norm(current)
    leave = nn.Conv3d(current, config.latent, 3, padding=1)
    down = nn.Sequential(*levels)
    return _named(conv_in=enter, down=down, mid=middle, norm_out=norm, act=nn.GELU(), conv_out=leave)


class _Decoder(nn.Module):
    def __init__(self, config: VQConfig) -> None:
        super().__init__()
        widths = [config.channels * m for m in config.mult]
        current = widths[-1]
        self.conv_in = nn.Conv3d(config.latent, current, 3, padding=1)
        self.mid = _middle(current)
        levels: list[nn.Sequential] = []
        for number, width in reversed(list(enumerate(widths))):
            level = _level(current, width, config.blocks)
            if number:
                conv = nn.Conv3d(width, width, 3, padding=1)
                level.add_module("upsample", _named(larger=nn.Upsample(scale_factor=2.0), conv=conv))
            levels.insert(0, level)  # stored from fine to coarse
            current = width
        self.up = nn.ModuleList(levels)
        self.norm_out, self.conv_out = _norm(current), nn.Conv3d(current, 1, 3, padding=1)

    def forward(self, z: Tensor) -> Tensor:
        h = self.mid(self.conv_in(z))
        for level in reversed(self.up):  # type: ignore[call-overload]
            h = level(h)
        return self.conv_out(F.gelu(self.norm_out(h)))


class VQVAE(nn.Module):
    """The published shape autoencoder, under its published parameter names.

    `config`: sizes.
    """

    def __init__(self, config: VQConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder, self.decoder = _encoder(config), _Decoder(config)
        codebook = nn.Embedding(config.codes, config.latent)
        nn.init.uniform_(codebook.weight, -1.0 / config.codes, 1.0 / config.codes)
        self.quantize = _named(embedding=codebook)
        self.quant_conv = nn.Conv3d(config.latent, config.latent, 1)
        self.post_quant_conv = nn.Conv3d(config.latent, config.latent, 1)

    def encode(self, sdf: Tensor) -> Tensor:
        """The diffusion's target: (N, 1, R, R, R) float32 distances -> (N, 3, R/4, R/4, R/4), not yet quantised."""
        size = self.config.resolution
        if sdf.ndim != 5 or tuple(sdf.shape[1:]) != (1, size, size, size):
            raise ValueError(f"distance grids are {tuple(sdf.shape)}, expected (N, 1, {size}, {size}, {size})")
        return self.quant_conv(self.encoder(sdf))

    def indices(self, z: Tensor, chunk: int = 4096) -> Tensor:
        """Nearest codes, (N d h w,) int64 of (N, 3, d, h, w) latents, by |z|^2 + |e|^2 - 2 z.e in float32.

        Distances are computed for `chunk` latents at a time: all at once would be 1.3 GB for ten objects.
        """
        codes = self.quantize.get_parameter("embedding.weight")
        squares = codes.square().sum(1)
        flat = z.movedim(1, -1).reshape(-1, codes.shape[1])
        near = [
            (part.square().sum(1, keepdim=True) + squares - 2 * part @ codes.t()).argmin(1)
            for part in flat.split(chunk)
        ]
        return torch.cat(near)

    def quantise(self, z: Tensor) -> tuple[Tensor, Tensor]:
        """(N, 3, d, h, w) -> the nearest codes in place, gradients passed straight through, and the codes alone."""
        codes = self.quantize(self.indices(z)).reshape(*z.shape[:1], *z.shape[2:], -1).movedim(-1, 1)
        return z + (codes - z).detach(), codes

    def decode(self, z: Tensor) -> Tensor:
        """(N, 3, d, h, w) float32 latents, quantised first -> (N, 1, R, R, R) float32 distances."""
        return self.decoder(self.post_quant_conv(self.quantise(z)[0]))

    def forward(self, sdf: Tensor) -> Tensor:
        """Reconstruct (N, 1, R, R, R) distances."""
        return self.decode(self.encode(sdf))

    def loss(self, sdf: Tensor) -> Tensor:
        """Training loss: mean L1 + codebook + commitment, both with weight 1 (van den Oord et al. 2017, equation 3)."""
        z = self.encode(sdf)
        straight, codes = self.quantise(z)
        decoded = self.decoder(self.post_quant_conv(straight))
        return (decoded - sdf).abs().mean() + F.mse_loss(codes, z.detach()) + F.mse_loss(codes.detach(), z)
