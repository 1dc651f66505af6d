"""The devices of this machine that a run's network may use, each with a process of its own."""

from __future__ import annotations

import os

CPU = "cpu"
VISIBLE = "CUDA_VISIBLE_DEVICES"


def network_processes(device: str) -> list[dict[str, str]]:
    """The environment of every process that runs the network alone: one a device; none where the workers run it.

    Arguments:
        device: `cpu`, `cuda` (every one that is visible) or `mps`.

    Raises ValueError where torch finds no such device.
    """
    if device == CPU:
        return []
    import torch

    if device == "cuda" and torch.cuda.is_available():
        count = torch.cuda.device_count()
        named = [word.strip() for word in os.environ.get(VISIBLE, "").split(",") if word.strip()]
        return [{VISIBLE: name} for name in (named or map(str, range(count)))][:count]
    if device == "mps" and torch.backends.mps.is_available():
        return [{}]
    found = [CPU, *["cuda"] * torch.cuda.is_available(), *["mps"] * torch.backends.mps.is_available()]
    raise ValueError(f"device is {device!r}, which torch {torch.__version__} finds none of; here: {', '.join(found)}")
