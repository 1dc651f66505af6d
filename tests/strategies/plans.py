"""Plans in torch, as guidance and losses have them."""

from dataclasses import replace

import torch


def tensors_of(plan, *, free=False):
    """The same plan in torch; `free`: gradients go to its sizes, positions and headings."""
    arrays = ("size", "position", "yaw", "scene", "floor", "triplets", "fixed", "height")
    of = {name: None if getattr(plan, name) is None else torch.tensor(getattr(plan, name)) for name in arrays}
    for name in ("size", "position", "yaw") if free else ():
        of[name].requires_grad_()
    return replace(plan, **of)
