"""One shape denoising step of ten objects at the published sizes: the network as written against the fast path.

    python benchmarks/shape_step.py [--objects 10] [--repeats 1] [--threads 2] [--no-winograd] [--clock wall|cpu]

Wanted: at least 1.3x. The step as written takes about a minute on two cores; memory peaks near 9 GB.
"""

from __future__ import annotations

import argparse
import resource
import sys
from pathlib import Path

import torch
from torch.utils.flop_counter import FlopCounterMode

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "parity"))

import machine
from literal_networks import literal_shape
from machine import alternate, report_machine

from echoscene.compiled_shape import CompiledShape
from echoscene.config import shape_unet
from echoscene.shape import ShapeUNet


def main() -> int:
    """Print the ratio; exit code 1 if it is missed."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--objects", type=int, default=10)
    arguments.add_argument("--repeats", type=int, default=1)
    arguments.add_argument("--threads", type=int, default=2)
    arguments.add_argument("--no-winograd", action="store_true")
    arguments.add_argument("--clock", choices=machine.CLOCKS, default="wall", help="cpu: for one thread, busy machine")
    options = arguments.parse_args()
    machine.clock = options.clock
    torch.set_num_threads(options.threads)
    rate, bandwidth = report_machine(options.threads)
    config, count = shape_unet(), options.objects
    with torch.device("meta"), FlopCounterMode(display=False) as counter:
        embedding, token = torch.zeros(1, 4 * config.width), torch.zeros(1, config.context)
        ShapeUNet(config).denoise(torch.zeros(1, 3, 16, 16, 16), embedding, token)
    generator = torch.Generator().manual_seed(0)
    with torch.device("meta"):
        net = ShapeUNet(config)
    net.to_empty(device="cpu")
    with torch.no_grad():
        for name, tensor in net.state_dict().items():
            if tensor.is_floating_point():
                tensor.normal_(0.0, 0.02, generator=generator)
                if tensor.ndim == 1 and not name.endswith("bias"):
                    tensor.abs_().add_(1.0)
    net.eval()
    x = torch.randn(count, 3, 16, 16, 16, generator=generator)
    objects = torch.randn(count, config.objects, generator=generator)
    triples = torch.randint(0, count, (4 * count, 3), generator=generator)
    t = torch.full((count,), 501)
    bound = CompiledShape(net, winograd=not options.no_winograd).bind(objects, triples)
    outputs: dict[str, torch.Tensor] = {}
    runs = {
        "literal": lambda: outputs.update(literal=literal_shape(net, x, objects, triples, t)),
        "fast": lambda: outputs.update(fast=bound(x, t)),
    }
    best = alternate(runs, options.repeats, warm=False)
    error = float((outputs["fast"] - outputs["literal"]).abs().max())
    ratio = best["literal"] / best["fast"]
    flops = counter.get_total_flops() * count
    weights = 4.0 * sum(p.numel() for p in net.parameters())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{count} objects: as written {best['literal']:.1f} s, fast {best['fast']:.1f} s, ratio {ratio:.2f} "
        f"(wanted 1.3), largest difference {error:.1e}\n"
        f"  {flops / 1e12:.2f} TFLOP as the modules count: as written {flops / best['literal'] / rate:.0%}, "
        f"fast {flops / best['fast'] / rate:.0%} of the matrix-product rate; "
        f"plain weights once: {weights / best['fast'] / bandwidth:.1%} of the memory bandwidth; peak {peak:.1f} GB"
    )
    return int(ratio < 1.3)


if __name__ == "__main__":
    sys.exit(main())
