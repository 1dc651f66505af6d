"""The convolution of a volume with repeated voxels, with fewer multiplications than it is written with."""

from __future__ import annotations

from itertools import product

import torch
from torch import Tensor
from torch.nn import functional as F


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
