"""A second device without a second device: tensors that compute on the CPU but refuse to meet the CPU's."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_flatten, tree_map

SECOND = torch.device("meta")  # the one name of a device that needs no driver


class Elsewhere(torch.Tensor):
    """A tensor on `SECOND`, whose numbers lie in `held`."""

    held: torch.Tensor

    @staticmethod
    def __new__(cls, held: torch.Tensor) -> Elsewhere:
        made = torch.Tensor._make_wrapper_subclass(
            cls,
            held.shape,
            strides=held.stride(),
            dtype=held.dtype,
            device=SECOND,
            storage_offset=held.storage_offset(),
        )
        made.held = held
        return made

    def tolist(self):
        return self.held.tolist()

    def new_tensor(self, data, *, dtype=None):
        return Elsewhere(self.held.new_tensor(data, dtype=dtype))

    @classmethod
    def __torch_dispatch__(cls, func, types, args=(), kwargs=None):
        return _run(func, args, kwargs or {})


@contextmanager
def second_device() -> Iterator[None]:
    """While it is open, what asks for `SECOND` gets tensors that lie there."""
    with _Numbers(), _Tensors():
        yield


class _Numbers(TorchFunctionMode):
    """Numbers and lists of Python's become tensors where no dispatch sees it."""

    def __torch_function__(self, func, types, args=(), kwargs=None):
        kwargs = kwargs or {}
        if func is torch.tensor and kwargs.get("device") is not None:
            return torch.tensor(*args, **{**kwargs, "device": None}).to(kwargs["device"])
        if func in (torch.Tensor.__getitem__, torch.Tensor.__setitem__):  # lists become tensors out of sight, too
            index = args[1] if isinstance(args[1], tuple) else (args[1],)
            index = tuple(torch.tensor(part) if isinstance(part, list) else part for part in index)
            args = (args[0], index if isinstance(args[1], tuple) else index[0], *args[2:])
        return func(*args, **kwargs)


class _Tensors(TorchDispatchMode):
    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        return _run(func, args, kwargs or {})


def _run(func, args, kwargs):
    flat, _ = tree_flatten((args, kwargs))
    tensors = [value for value in flat if isinstance(value, torch.Tensor)]
    there = any(isinstance(tensor, Elsewhere) for tensor in tensors)
    if any(tensor.is_meta and not isinstance(tensor, Elsewhere) for tensor in tensors):
        raise AssertionError(f"{func}: a tensor was made on the second device out of sight")
    target = kwargs.get("device")
    moving = func in (torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default)
    indexing = func in (
        torch.ops.aten.index.Tensor,
        torch.ops.aten.index_put_.default,
        torch.ops.aten.index_put.default,
    )
    if there and not moving:
        # numbers without a dimension may meet any device, and indices on the CPU may pick from any
        strangers = [t for t in tensors if not isinstance(t, Elsewhere) and t.ndim]
        if indexing:
            strangers = [t for t in strangers if t is args[0]]
        if strangers:
            raise RuntimeError(f"{func}: tensors on two devices, {[tuple(t.shape) for t in strangers]} on the CPU")
    if target is not None:
        there = torch.device(target).type == SECOND.type
        kwargs = {**kwargs, "device": torch.device("cpu")}
    inner_args, inner = tree_map(_inside, (args, kwargs))
    out = func(*inner_args, **inner)
    if func._schema.is_mutable and isinstance(args[0], torch.Tensor):
        return args[0]
    return tree_map(lambda value: Elsewhere(value) if isinstance(value, torch.Tensor) else value, out) if there else out


def _inside(value):
    return value.held if isinstance(value, Elsewhere) else value
