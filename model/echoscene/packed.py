"""Matrix products with weights that are laid out once for the processor (inference only)."""

from __future__ import annotations

from functools import cache
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F


class PackedLayer(nn.Linear):
    """A linear layer for inference alone; its parameters stay, for looking at and saving.

    On a CPU the weight goes into oneDNN's blocked layout, which reads it two to three times faster than a plain
    product does for a handful of rows; elsewhere, or where torch lacks the operator, it is an ordinary linear map.

    `layer`: with floating-point weights, which are computed with in float32.
    """

    def __init__(self, layer: nn.Linear) -> None:
        nn.Module.__init__(self)
        self.in_features, self.out_features = layer.in_features, layer.out_features
        self.weight, self.bias = layer.weight, layer.bias
        self.train(layer.training)
        self._pack()

    def _pack(self) -> None:
        self._product, self._added = (
            None if part is None else part.detach().float().contiguous() for part in (self.weight, self.bias)
        )
        self._packed = self.weight.device.type == "cpu" and packing_available()
        if self._packed:
            self._product = torch.ops.mkldnn._reorder_linear_weight(self._product, None)

    def forward(self, x: Tensor) -> Tensor:
        """(..., in) float32 -> (..., out)."""
        if not self._packed:
            return F.linear(x, self._product, self._added)
        return torch.ops.mkldnn._linear_pointwise(x, self._product, self._added, "none", [], "")

    def __getstate__(self) -> dict[str, Any]:  # packed weights are of this process
        return {key: value for key, value in vars(self).items() if key != "_product"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._pack()


def pack_linear_maps(net: nn.Module) -> None:
    """Put a `PackedLayer` in the place of every linear layer inside."""
    for module in list(net.modules()):
        for name, layer in list(module.named_children()):
            if type(layer) is nn.Linear:
                setattr(module, name, PackedLayer(layer))


@cache
def packing_available() -> bool:
    """Whether this build of torch multiplies with oneDNN-packed weights, tried once on a small product."""
    try:
        with torch.inference_mode():
            x, weight = torch.eye(8), torch.arange(64.0).reshape(8, 8)
            packed = torch.ops.mkldnn._reorder_linear_weight(weight, None)
            return torch.equal(torch.ops.mkldnn._linear_pointwise(x, packed, None, "none", [], ""), weight.t())
    except (RuntimeError, AttributeError, NotImplementedError):
        return False
