"""One way to write what runs on numpy arrays, quick where they are small, and on torch tensors, which have gradients.

Both call most functions alike (`kit(x).where(...)`, `maximum`, `stack`, `concat`, `amin`, `atan2`); here is the rest.
"""

import sys
from collections.abc import Callable
from contextlib import nullcontext
from functools import wraps
from typing import Any, TypeVar

import numpy as np

Array = Any  # np.ndarray or torch.Tensor
NUMPY: Any = (np.ndarray, np.generic, float)
Function = TypeVar("Function", bound=Callable[..., Any])


def kit(values: Array) -> Any:
    """The library whose functions take these values: `numpy` or `torch`, which is not imported for numpy's."""
    if isinstance(values, NUMPY):
        return np
    import torch

    return torch


def held(values: Array) -> Array:
    """Values through which no gradient goes."""
    return values if isinstance(values, NUMPY) else values.detach()


def on_device(values: Any, device: Any) -> Array:
    """Values of either library as a tensor of its own on a device, or with None as an array of numpy."""
    if device is None:
        return values.detach().cpu().numpy() if hasattr(values, "detach") else np.asarray(values)
    import torch

    return values.to(device) if isinstance(values, torch.Tensor) else torch.tensor(values, device=device)


def device_of(values: Array) -> Any:
    """Where a tensor is; None for an array of numpy."""
    return None if isinstance(values, NUMPY) else values.device


def beside(values: Any, other: Array) -> Array:
    """Values of either library in that of another array, on its device."""
    return on_device(values, device_of(other))


def without_slopes(function: Function) -> Function:
    """The function, run without keeping what gradients would need; torch is not loaded for it."""

    @wraps(function)
    def run(*arguments: Any, **named: Any) -> Any:
        torch = sys.modules.get("torch")
        with torch.no_grad() if torch else nullcontext():
            return function(*arguments, **named)

    return run  # type: ignore[return-value]


def once(function: Function) -> Function:
    """The function of one object, run once for each, which keeps what it gave."""

    @wraps(function)
    def run(of: Any) -> Any:
        if function.__name__ not in vars(of):
            vars(of)[function.__name__] = function(of)
        return vars(of)[function.__name__]

    return run  # type: ignore[return-value]


def rows(mask: Array) -> Array:
    """(k,) int64, where a mask (n,) is true."""
    return mask.nonzero()[0] if isinstance(mask, NUMPY) else mask.nonzero()[:, 0]


def pairs_in(mask: Array) -> tuple[Array, Array]:
    """(k,) and (k,) int64, rows and columns where a mask (n, m) is true."""
    return mask.nonzero() if isinstance(mask, NUMPY) else mask.nonzero(as_tuple=True)


def at_least(values: Array, low: float) -> Array:
    """The larger one of each value and a number."""
    return np.maximum(values, low) if isinstance(values, NUMPY) else values.clamp_min(low)


def at_most(values: Array, high: float) -> Array:
    """The smaller one of each value and a number."""
    return np.minimum(values, high) if isinstance(values, NUMPY) else values.clamp_max(high)


def clipped(values: Array, low: float, high: float) -> Array:
    """Values no less than one number and no more than another."""
    return kit(values).clip(values, low, high)


def picked(values: Array, at: Array) -> Array:
    """Of each row (n, k, ...) the entry that `at` (n,) int64 says: (n, ...)."""
    return values[beside(np.arange(len(at)), at), at]


def dot(one: Array, other: Array) -> Array:
    """Products of vectors (..., 2): (...); of so few numbers a sum takes many times as long."""
    return one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]


def norm(values: Array) -> Array:
    """Length of vectors (..., 2): (...)."""
    return np.sqrt(dot(values, values)) if isinstance(values, NUMPY) else values.norm(dim=-1)


def cast(values: Any, like: Array) -> Array:
    """Values of either library, or plain numbers, as an array of the library and type of another, where that is."""
    if isinstance(like, NUMPY):
        return np.asarray(values, like.dtype)
    return values.to(like) if isinstance(values, kit(like).Tensor) else like.new_tensor(values)


def full(like: Array, shape: int | tuple[int, ...], value: float) -> Array:
    """An array of one value, of the same type as another."""
    shape = (shape,) if isinstance(shape, int) else shape
    if not isinstance(like, NUMPY):
        return like.new_full(shape, value)
    out = np.empty(shape, like.dtype)  # `np.full` takes three times as long for so few
    out.fill(value)
    return out


def repeat(values: Array, times: int | Array) -> Array:
    """Every row (n, ...) so many times, one after the other."""
    return values.repeat(times, 0) if isinstance(values, NUMPY) else values.repeat_interleave(times, 0)


def put(values: Array, at: Array, others: Array) -> Array:
    """The values with others where a mask or numbers say; gradients go through both."""
    if not isinstance(values, NUMPY):
        return values.index_put((at,), others)
    out = values.copy()
    out[at] = others
    return out


def least_of(who: Array, values: Array, count: int, nothing: float) -> Array:
    """(count,): of the values (k,) of each of `who` (k,) int64 the least, and none more than `nothing`."""
    out = full(values, count, nothing)
    if not isinstance(values, NUMPY):
        return out.scatter_reduce(0, who, values, "amin")
    np.minimum.at(out, who, values)
    return out


def least_so_far(values: Array) -> Array:
    """Of rows (n, k, ...) each and those before it the least: (n, k, ...)."""
    return np.minimum.accumulate(values, 1) if isinstance(values, NUMPY) else values.cummin(1).values


def sum_of(who: Array, values: Array, count: int) -> Array:
    """(count, ...): the sum of the values (k, ...) of each of `who` (k,) int64."""
    if not isinstance(values, NUMPY):
        return values.new_zeros(count, *values.shape[1:]).index_add(0, who, values)
    if values.ndim == 1:
        return np.bincount(who, values, count).astype(values.dtype)
    if (np.diff(who) < 0).any():
        order = np.argsort(who, kind="stable")
        who, values = who[order], values[order]
    out, starts = full(values, (count, *values.shape[1:]), 0.0), np.flatnonzero(np.diff(who, prepend=-1))
    if len(starts):
        out[who[starts]] = np.add.reduceat(values, starts)
    return out


def silu(values: Array) -> Array:
    """Each value times its logistic function."""
    if not isinstance(values, NUMPY):
        return kit(values).nn.functional.silu(values)
    return values * (0.5 + 0.5 * np.tanh(0.5 * values))


def parted(values: Array, count: int) -> Any:
    """So many equal parts of the columns of values (n, c)."""
    if not isinstance(values, NUMPY):
        return values.chunk(count, 1)
    width = values.shape[1] // count
    return [values[:, first : first + width] for first in range(0, count * width, width)]


def softmax(values: Array) -> Array:
    """Shares (..., k) that numbers (..., k) stand for as logarithms."""
    if not isinstance(values, NUMPY):
        return values.softmax(-1)
    odds = np.exp(values - values.max(-1, keepdims=True))
    return odds / odds.sum(-1, keepdims=True)
