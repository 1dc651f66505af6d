"""What this machine can do, measured: matrix products and reading memory."""

from __future__ import annotations

import time
from collections.abc import Callable

import torch

from echoscene.unet import PackedLayer

CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}
clock = "wall"  # "cpu" with one thread counts this process alone, whatever else runs on the machine


def alternate(runs: dict[str, Callable[[], object]], repeats: int, warm: bool = True) -> dict[str, float]:
    """Best time in seconds of each run, taken in turns so that a busy machine slows all of them alike."""
    now = CLOCKS[clock]
    best = dict.fromkeys(runs, float("inf"))
    if warm:
        for run in runs.values():
            run()
    for _ in range(repeats):
        for name, run in runs.items():
            start = now()
            run()
            best[name] = min(best[name], now() - start)
    return best


def matmul_rate(side: int = 2048) -> float:
    """FLOP/s of a large float32 matrix product, the better of torch's own and oneDNN's packed one."""
    a, b = torch.randn(side, side), torch.randn(side, side)
    packed = PackedLayer(b, None)
    best = alternate({"own": lambda: a @ b, "packed": lambda: packed(a)}, repeats=5)
    return 2 * side**3 / min(best.values())


def report_machine(threads: int) -> tuple[float, float]:
    """Print and return the matrix-product rate and the read bandwidth."""
    rate, bandwidth = matmul_rate(), read_bandwidth()
    numbers = f"{rate / 1e9:.0f} GFLOP/s in matrix products, reads {bandwidth / 1e9:.1f} GB/s"
    print(f"{threads} thread(s), {clock} clock; machine: {numbers}", flush=True)
    return rate, bandwidth


def read_bandwidth(megabytes: int = 512) -> float:
    """Bytes/s of summing a tensor that fits no cache."""
    data = torch.randn(megabytes * 250_000)
    return data.numel() * 4 / alternate({"sum": data.sum}, repeats=5)["sum"]
