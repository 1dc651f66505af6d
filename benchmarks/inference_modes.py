"""Ways to run the networks at inference against plain float32 eager, in one process.

    python benchmarks/inference_modes.py [--subjects layout,shape,decode,released] [--repeats 5] [--threads 2]

Modes: `packed` (linear maps with weights laid out for oneDNN, what the published layout uses on a CPU), `compile`
(torch.compile), `bf16` (autocast), `last` (channels_last_3d), and for the released shape U-Net its own fast path.
Each line holds the time, the ratio to eager float32 (above one is faster) and the largest absolute difference of the
outputs beside the largest output. CUDA graphs need a GPU and are not run here.
"""

from __future__ import annotations

import argparse
import copy
import os
import shutil
import sys
import time
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import machine
import torch
from compact_budget import dense_graph
from machine import alternate, report_machine
from torch import Tensor, nn

from echomodel.compact.model import load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echoscene import unet
from echoscene.config import shape_unet
from echoscene.model import ShapeUNet

Run = Callable[[], Tensor]
LAST = torch.channels_last_3d
COMPILE = True


def bf16(run: Run) -> Run:
    """The same under autocast to bfloat16."""

    def inner() -> Tensor:
        with torch.autocast("cpu", torch.bfloat16):
            return run()

    return inner


def packed(net: nn.Module, *arguments: object) -> Run:
    """A copy of the network with packed linear maps."""
    own = unet.packed(net)
    return lambda: own(*arguments)


def compiled(function: Callable[..., Tensor]) -> Callable[..., Tensor] | None:
    """The compiled function, or None where torch.compile is not wanted or finds no C++ compiler."""
    if not COMPILE or not any(shutil.which(name) for name in (os.environ.get("CXX", "g++"), "g++", "clang++")):
        return None
    return torch.compile(function)


def step_modes(net: nn.Module, x: Tensor, context: object) -> dict[str, Run | None]:
    """One step of a denoiser at level 0.5."""
    level, faster = torch.full((len(x),), 0.5), compiled(net)

    def run() -> Tensor:
        return net(x, level, context)

    return {
        "eager": run,
        "compile": None if faster is None else lambda: faster(x, level, context),
        "packed": packed(net, x, level, context),
        "bf16": bf16(run),
        "compile+bf16": None if faster is None else bf16(lambda: faster(x, level, context)),
    }


def layout_modes(model: EchoModel, scenes: int) -> dict[str, Run | None]:
    """One layout step of rooms with 12 objects, every ordered pair related."""
    graph = GraphBatch.pack([dense_graph(12)] * scenes)
    pairs, net = pairs_of(graph), model.model.layout
    rules = torch.zeros(scenes, dtype=torch.int64)
    context = net.context(graph, pairs, model.graph_latent(graph), rules, model.model.statistics.scale(graph.category))
    return step_modes(net, torch.randn(graph.num_nodes, 8), context)


def shape_modes(model: EchoModel, objects: int) -> dict[str, Run | None]:
    """One shape step of a room."""
    graph, net = dense_graph(objects), model.model.shape
    context = net.context(graph, torch.ones(objects, 3), pairs_of(graph), model.graph_latent(graph))
    return step_modes(net, torch.randn(objects, model.config.shape.components), context)


def decode_modes(model: EchoModel, objects: int) -> dict[str, Run | None]:
    """Decoding latents to 64^3 distances."""
    coder, net = model.model.autoencoder, model.model.shape
    latent = net.latents(torch.randn(objects, model.config.shape.components))
    last = copy.deepcopy(coder).to(memory_format=LAST)
    latent_last = latent.contiguous(memory_format=LAST)
    faster = compiled(coder.decode)
    return {
        "eager": lambda: coder.decode(latent),
        "compile": None if faster is None else lambda: faster(latent),
        "bf16": bf16(lambda: coder.decode(latent)),
        "last": lambda: last.decode(latent_last),
        "bf16+last": bf16(lambda: last.decode(latent_last)),
    }


def released_modes(objects: int) -> dict[str, Run | None]:
    """One step of the released shape U-Net at its published size."""
    generator = torch.Generator().manual_seed(0)
    with torch.device("meta"):
        net = ShapeUNet(shape_unet())
    net.to_empty(device="cpu").eval()
    for name, tensor in net.state_dict().items():
        if tensor.is_floating_point():
            tensor.normal_(0.0, 0.02, generator=generator)
            if tensor.ndim == 1 and not name.endswith("bias"):
                tensor.abs_().add_(1.0)
    x = torch.randn(objects, 3, 16, 16, 16, generator=generator)
    condition = torch.randn(objects, net.config.objects, generator=generator)
    triples = torch.randint(0, objects, (4 * objects, 3), generator=generator)
    t = torch.full((objects,), 501)
    last = copy.deepcopy(net).to(memory_format=LAST)
    x_last = x.contiguous(memory_format=LAST)
    faster = compiled(net)
    return {
        "eager": lambda: net(x, condition, triples, t),
        "compile": None if faster is None else lambda: faster(x, condition, triples, t),
        "bf16": bf16(lambda: net(x, condition, triples, t)),
        "last": lambda: last(x_last, condition, triples, t),
        "bf16+last": bf16(lambda: last(x_last, condition, triples, t)),
    }


def report(title: str, modes: dict[str, Run | None], repeats: int) -> None:
    """Print one line per mode; a mode that cannot run says why."""
    print(f"{title}:")
    runs, warm_up = {}, {}
    for name, run in modes.items():
        if run is None:
            print(f"  {name:13} skipped: no C++ compiler, or --no-compile")
            continue
        started = time.perf_counter()
        try:
            run()
        except Exception as error:  # a mode that this torch or machine cannot run is a finding, not a failure
            print(f"  {name:13} fails: {type(error).__name__}: {str(error).strip().splitlines()[0][:120]}")
            continue
        runs[name], warm_up[name] = run, time.perf_counter() - started
    plain = runs["eager"]()
    best = alternate(runs, repeats)
    for name, seconds in best.items():
        error = float((runs[name]().float() - plain).abs().max())
        print(
            f"  {name:13} {seconds * 1e3:9.2f} ms  ratio {best['eager'] / seconds:5.2f}  "
            f"largest difference {error:.1e} of {float(plain.abs().max()):.1f}  first call {warm_up[name]:.1f} s",
            flush=True,
        )


@torch.no_grad()
def main() -> None:
    """Read the arguments and print a table per subject."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--subjects", default="layout,shape,decode,released")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--released-objects", type=int, default=1)
    parser.add_argument("--clock", choices=machine.CLOCKS, default="wall", help="cpu: for one thread, busy machine")
    parser.add_argument("--no-compile", action="store_true", help="leave torch.compile out: it takes minutes")
    options = parser.parse_args()
    global COMPILE
    COMPILE = not options.no_compile
    machine.clock = options.clock
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    report_machine(options.threads)
    subjects = options.subjects.split(",")
    paths = sorted(Path(str(resources.files("echomodel") / "weights")).glob("*.safetensors"))
    model = EchoModel(*load_weights(paths))
    if "layout" in subjects:
        report("compact layout step, 1 room of 12", layout_modes(model, 1), options.repeats * 5)
        report("compact layout step, 16 rooms of 12", layout_modes(model, 16), options.repeats)
    if "shape" in subjects:
        report("compact shape step, 8 objects", shape_modes(model, 8), options.repeats * 5)
        report("compact shape step, 64 objects", shape_modes(model, 64), options.repeats)
    if "decode" in subjects:
        report("compact decoding, 4 objects", decode_modes(model, 4), options.repeats)
    if "released" in subjects:
        count = options.released_objects
        report(f"released shape step, {count} object(s)", released_modes(count), max(1, options.repeats // 5))
    if not torch.cuda.is_available():
        print("CUDA graphs: no GPU here, not measured")


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    main()
