"""One layout denoising step at the published sizes: the network as written against the fast path, in one run.

    python benchmarks/layout_step.py [--repeats 5] [--threads 2] [--clock wall|cpu]

Wanted: at least 2.5x for one scene of 12 nodes and 51 edges, at least 4x for 32 such scenes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import torch

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "parity"))

import machine
from literal_networks import literal_layout
from machine import alternate, report_machine, scene_graph, tally

from echoscene.compiled_layout import CompiledLayout
from echoscene.config import UNetConfig
from echoscene.layout import LayoutNet


def main() -> int:
    """Print the ratios; exit code 1 if one is missed."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--repeats", type=int, default=5)
    arguments.add_argument("--threads", type=int, default=2)
    arguments.add_argument("--clock", choices=machine.CLOCKS, default="wall", help="cpu: for one thread, busy machine")
    options = arguments.parse_args()
    machine.clock = options.clock
    torch.set_num_threads(options.threads)
    rate, bandwidth = report_machine(options.threads)
    generator = torch.Generator().manual_seed(0)
    net = LayoutNet(UNetConfig()).eval()
    with torch.no_grad():  # the last layers start at zero: fill everything, so that outputs can be compared
        for parameter in net.parameters():
            parameter.add_(0.02 * torch.randn(parameter.shape, generator=generator))
    compiled = CompiledLayout(net)
    missed = 0
    for scenes, wanted in ((1, 2.5), (32, 4.0)):
        nodes = 12 * scenes
        x = torch.randn(nodes, 8, generator=generator)
        objects = torch.randn(nodes, 640, generator=generator)
        triples, t = scene_graph(scenes, generator), torch.full((nodes,), 500)
        bound = compiled.bind(objects, triples)
        with tally() as counts:
            fast = bound(x, t)
        error = float((fast - literal_layout(net, x, objects, triples, t)).abs().max())
        inner = 10 if scenes == 1 else 1  # a single fast step is too short to time

        def run_fast(bound=bound, x=x, t=t, inner=inner) -> None:
            for _ in range(inner):
                bound(x, t)

        def run_literal(x=x, objects=objects, triples=triples, t=t) -> None:
            literal_layout(net, x, objects, triples, t)

        best = alternate({"literal": run_literal, "fast": run_fast}, options.repeats)
        seconds = best["fast"] / inner
        ratio = best["literal"] / seconds
        missed += ratio < wanted
        print(
            f"{scenes} scene(s), {nodes} nodes, {len(triples)} edges: as written {best['literal'] * 1e3:.1f} ms, "
            f"fast {seconds * 1e3:.1f} ms, ratio {ratio:.1f} (wanted {wanted}), largest difference {error:.1e}\n"
            f"  fast: {counts['flops'] / seconds / rate:.0%} of the matrix-product rate, "
            f"{counts['bytes'] / seconds / bandwidth:.0%} of the memory bandwidth "
            f"({counts['bytes'] / 1e6:.0f} MB of weights)"
        )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
