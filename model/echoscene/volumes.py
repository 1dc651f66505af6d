"""Convolutions of volumes with fewer multiplications than they are written with, exact but for rounding."""

from __future__ import annotations

from itertools import product

import torch
from torch import Tensor
from torch.nn import functional as F

from echomodel.packed import PackedLinear


def convolve_repeated(x: Tensor, weight: Tensor, bias: Tensor | None, doubled: tuple[bool, bool, bool]) -> Tensor:
    """A 3x3x3 convolution (padding 1) of a volume whose voxels are first repeated twice along some axes.

    Neighbouring output voxels see the same input voxel twice, so that along a doubled axis each parity is a
    convolution with two taps, sums of the three: 12 multiplications instead of 27 for two axes, 8 for three.

    Arguments:
        x: (N, C, D, H, W) float32. weight: (O, C, 3, 3, 3). bias: (O,) or None.
        doubled: which of the axes D, H, W are repeated.

    Returns:
        (N, O, D', H', W') float32, doubled axes twice as long.
    """
    size = x.shape[2:]
    padded = F.pad(x, tuple(int(twice) for twice in reversed(doubled) for _ in range(2)))
    out = x.new_empty(len(x), len(weight), *(n * 2 if twice else n for n, twice in zip(size, doubled, strict=True)))
    if x.requires_grad or weight.requires_grad:
        out = torch.zeros_like(out)
    for parity in product(*((0, 1) if twice else (0,) for twice in doubled)):
        kernel, window, place = weight, padded, out
        for axis, (odd, twice) in enumerate(zip(parity, doubled, strict=True), start=2):
            if not twice:
                continue
            first, middle, final = kernel.split(1, dim=axis)
            kernel = torch.cat([first + middle, final] if odd else [first, middle + final], dim=axis)
            window = window.narrow(axis, odd, size[axis - 2] + 1)
            place = place[(slice(None),) * axis + (slice(odd, None, 2),)]
        place.copy_(F.conv3d(window, kernel, bias, padding=[0 if twice else 1 for twice in doubled]))
    return out


class WinogradConv:
    """A 3x3x3 convolution (padding 1) by Winograd's F(2, 3) along each axis: 64 multiplications where 216 are written.

    The transformed weights take 2.4 times the memory of the plain ones. It pays where channels outweigh voxels; axes
    must be even.

    Arguments:
        weight: (O, C, 3, 3, 3) float32. bias: (O,) or None.
        tiles: about as many 2x2x2 output tiles are worked on at a time, so that they stay in the cache.
    """

    def __init__(self, weight: Tensor, bias: Tensor | None, tiles: int = 512) -> None:
        rise = weight.new_tensor([[1, 0, 0], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0, 0, 1]], dtype=torch.float64)
        lifted = weight.detach().double()
        for axis in (2, 3, 4):
            lifted = torch.movedim(torch.tensordot(lifted, rise, dims=([axis], [1])), -1, axis)  # type: ignore[arg-type]
        self.products = [PackedLinear(matrix) for matrix in lifted.flatten(2).permute(2, 0, 1)]
        self.bias, self.out, self.tiles = None if bias is None else bias.detach(), len(weight), tiles

    def __call__(self, x: Tensor) -> Tensor:
        """(N, C, D, H, W) float32 -> (N, O, D, H, W), both channels last in memory."""
        size = x.shape[2:]
        if any(n % 2 for n in size):
            raise ValueError(f"Winograd convolution: axes {tuple(size)} must be even")
        chunk = max(1, self.tiles * 8 // (size[0] * size[1] * size[2]))
        parts = [self._part(part) for part in x.permute(0, 2, 3, 4, 1).split(chunk)]
        return (parts[0] if len(parts) == 1 else torch.cat(parts)).permute(0, 4, 1, 2, 3)

    def _part(self, x: Tensor) -> Tensor:
        x = F.pad(x, (0, 0, 1, 1, 1, 1, 1, 1))
        for axis in (3, 3, 3):  # W, then H, then D: each transform puts its four parts in front
            x = _input_parts(x, axis)
        tiles = x.shape[3:7]
        flat = x.reshape(64, -1, x.shape[-1])
        y = torch.stack([multiply(part) for multiply, part in zip(self.products, flat, strict=True)])
        y = y.reshape(4, 4, 4, *tiles, self.out)
        for axis in (4, 4, 4):
            y = _output_pairs(y, axis)
        return y if self.bias is None else y.add_(self.bias)


def _input_parts(x: Tensor, axis: int) -> Tensor:
    half = (x.shape[axis] - 2) // 2
    d0, d1, d2, d3 = (x[(slice(None),) * axis + (slice(o, o + 2 * half - 1, 2),)] for o in range(4))
    out = x.new_empty(4, *d0.shape)
    torch.sub(d0, d2, out=out[0])
    torch.add(d1, d2, out=out[1])
    torch.sub(d2, d1, out=out[2])
    torch.sub(d1, d3, out=out[3])
    return out


def _output_pairs(y: Tensor, axis: int) -> Tensor:
    even = y[0] + y[1]
    even += y[2]
    odd = y[1] - y[2]
    odd -= y[3]
    return torch.stack([even, odd], dim=axis).flatten(axis - 1, axis)
