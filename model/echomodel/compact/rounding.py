"""Tensors that weights files keep in 8 bits, each row with a scale of its own."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

ROUNDED = ("shape.basis",)  # nearly half of all weights; its rows are directions, which two digits tell well enough
SCALES = ".scales"


def rounded(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors as a file keeps them: those in `ROUNDED` (rows, n) as int8, with float32 scales (rows,) beside."""
    out = dict(tensors)
    for name in ROUNDED:
        if name in out:
            rows = out[name].float()
            scale = rows.abs().amax(1) / 127
            steps = rows / scale.clamp_min(torch.finfo(scale.dtype).tiny)[:, None]
            out[name], out[name + SCALES] = steps.round().clamp(-127, 127).to(torch.int8), scale
    return out


def restored(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of a file as numbers; those that are not rounded, as in older files, as they are.

    Raises ValueError for rows and scales that are not of a kind or do not fit.
    """
    out = dict(tensors)
    for name in ROUNDED:
        scales = out.pop(name + SCALES, None)
        if scales is None:
            continue
        rows = out.get(name)
        if rows is None or rows.dtype != torch.int8 or scales.dtype != torch.float32:
            raise ValueError(f"{name + SCALES} is {scales.dtype}, {name} {rows if rows is None else rows.dtype}, "
                             "allowed: float32 scales of int8 rows")  # fmt: skip
        if rows.ndim != 2 or scales.shape != rows.shape[:1]:
            shapes = f"{tuple(scales.shape)} and {tuple(rows.shape)}"
            raise ValueError(f"{name + SCALES} and {name} have shapes {shapes}, allowed: (r,) and (r, n)")
        out[name] = rows.float() * scales[:, None]
    return out
