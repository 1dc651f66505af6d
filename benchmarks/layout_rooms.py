"""What the layout of a room takes, best of its drafts included: in a cold run of 12 objects, and in batches of 64.

    OMP_NUM_THREADS=1 python benchmarks/layout_rooms.py [--cold 3] [--rooms 64] [--first 0] [--only cold|batch]

Wanted: at most 1 s in a cold run of 12 objects. CPU seconds of one thread: a
busy machine changes those least; beside them what they are in matrix products of 2048 x 2048 on the same machine.
`cold`: new processes that import, load the model and lay out one graph as `generate` does, the graphs of 12 objects in
turns; the median of each part. `batch`: rooms of the room generator as `echousd batch` samples them, in one process.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml

OBJECTS, ROOMS = 12, 64
TYPES = ("bedroom", "living_room", "dining_room", "living_dining_room", "study")
PARTS = ("start of Python", "imports", "load", "denoising", "arranging", "solving", "judging", "rest")
LAYOUT = PARTS[3:]  # of a layout; the others are what any run needs


@contextmanager
def parted() -> Iterator[dict[str, float]]:
    """CPU seconds by `PARTS` of what runs inside the block, each without the parts that run within it."""
    from echomodel.compact import sampling
    from echousd.make import layouts
    from echousd.place import living, placing, search

    spent: dict[str, float] = defaultdict(float)
    within = [0.0]

    def timed(part: str, of: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            within.append(0.0)
            began = time.process_time()
            try:
                return of(*given, **more)
            finally:
                whole = time.process_time() - began
                spent[part] += whole - within.pop()
                within[-1] += whole

        return call

    places = (
        (sampling, "sample_boxes", "denoising"), (search.Search, "run", "arranging"),
        (placing, "solve", "solving"), (living, "living_faults", "judging"), (layouts, "layout_outcome", "judging"),
    )  # fmt: skip
    kept = [(module, name, getattr(module, name)) for module, name, _ in places]
    for (module, name, of), (_, _, part) in zip(kept, places, strict=True):
        setattr(module, name, timed(part, of))
    try:
        yield spent
    finally:
        for module, name, of in kept:
            setattr(module, name, of)


def cold(text: str, seed: int) -> dict[str, float]:
    """CPU seconds by part of this process, which has done nothing yet, for one graph as JSON; and drafts placed."""
    out = {"start of Python": time.process_time()}
    from echomodel.loading import load_model
    from echomodel.progress import StageTimer
    from echousd.graph import SceneGraph
    from echousd.graph.floors import with_plan
    from echousd.make.layouts import LayoutSearch, most_drafts

    out["imports"] = time.process_time() - sum(out.values())
    model = load_model(None)
    out["load"] = time.process_time() - sum(out.values())
    graph = SceneGraph.from_json(text)
    began = time.process_time()
    with parted() as spent:
        planned = with_plan(graph, seed)
        most, proposed = most_drafts(model, len(planned.nodes)), not graph.room.openings
        LayoutSearch(model, seed, StageTimer(), drafts=most, proposed=proposed).best(planned)
    whole = time.process_time() - began
    return {**out, **spent, "rest": whole - sum(spent.values())}


def graphs_of_twelve() -> dict[str, str]:
    """JSON of the graphs of 12 objects among those that people wrote, and of some of the room generator."""
    from echousd.batches.sources import sampled_graph
    from echousd.graph import SceneGraph

    out = {}
    for file in ("people_graphs", "more_graphs"):
        for name, entry in yaml.safe_load((Path(__file__).parent / f"{file}.yaml").read_text("utf-8")).items():
            graph = SceneGraph.from_yaml(yaml.safe_dump(entry, sort_keys=False))
            if len(graph.nodes) == OBJECTS:
                out[name] = graph.to_json()
    for word in TYPES:
        found = [sampled_graph(word, 5, number, 1.0) for number in range(60)]
        twelve = [graph for graph in found if len(graph.nodes) == OBJECTS][:2]
        out |= {f"{word}_{number}": graph.to_json() for number, graph in enumerate(twelve)}
    return out


def show(title: str, parts: dict[str, list[float]], product: float) -> None:
    """Print the median of each part, and of what a layout takes in all."""
    print(title)
    for part in PARTS:
        if part in parts:
            print(f"  {part:16s} {np.median(parts[part]):7.3f} s   at most {max(parts[part]):7.3f}")
    layout = np.sum([parts[part] for part in LAYOUT if part in parts], 0)
    print(
        f"  the layout       {np.median(layout):7.3f} s   at most {layout.max():7.3f}   mean {layout.mean():.3f}"
        f"   = {np.median(layout) / product:.1f} matrix products; at most 1 s: {(layout <= 1.0).mean():.0%}"
    )


def cold_runs(times: int, first: int, product: float) -> None:
    """Print what cold processes take for the graphs of 12 objects."""
    parts: dict[str, list[float]] = {}
    graphs = graphs_of_twelve()
    for number in range(times):
        for text in graphs.values():
            script = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import layout_rooms as here; "
            script += f"print(here.json.dumps(here.cold(sys.stdin.read(), {first + number})))"
            ran = subprocess.run([sys.executable, "-c", script], input=text, capture_output=True, text=True, check=True)
            found = json.loads(ran.stdout.splitlines()[-1])
            for part in PARTS:
                parts.setdefault(part, []).append(found.get(part, 0.0))
    show(f"cold runs of {OBJECTS} objects: {len(graphs)} graphs, {times} seeds each", parts, product)


def batch(rooms: int, first: int, product: float) -> None:
    """Print what a room takes in one process that makes many."""
    from echomodel.loading import load_model
    from echomodel.progress import StageTimer
    from echousd.batches.sources import sampled_graph
    from echousd.graph.floors import with_plan
    from echousd.make.layouts import LayoutSearch, most_drafts

    model = load_model(None)
    graphs = [sampled_graph(TYPES[n % len(TYPES)], first, n // len(TYPES), 1.0) for n in range(rooms)]
    seeds = [first + number for number in range(rooms)]
    drafts = [most_drafts(model, len(graph.nodes)) for graph in graphs]
    alone = sum(best_of_one(model, graph, first) for graph in graphs[:6]) / 6  # and warms
    with parted() as spent:
        began = time.process_time()
        for graph, seed, most in zip(graphs, seeds, drafts, strict=True):
            planned = with_plan(graph, seed)
            LayoutSearch(model, seed, StageTimer(), drafts=most, proposed=True).best(planned)
        whole = time.process_time() - began
    objects = sum(len(graph.nodes) for graph in graphs)
    print(f"batch of {rooms} rooms, {objects} objects")
    spent = {**spent, "rest": whole - sum(spent.values())}
    for part in LAYOUT:
        print(f"  {part:16s} {spent[part] / rooms * 1e3:7.1f} ms a room")
    print(f"  the layout       {whole / rooms * 1e3:7.1f} ms a room = {whole / rooms / product:.2f} matrix products")
    print(f"  alone            {alone * 1e3:7.1f} ms a room, the first six with one draft")


def best_of_one(model: Any, graph: Any, seed: int) -> float:
    """CPU seconds of one draft of a warm model, placed."""
    from echomodel.progress import StageTimer
    from echousd.graph.floors import with_plan
    from echousd.make.layouts import LayoutSearch

    planned = with_plan(graph, seed)
    began = time.process_time()
    LayoutSearch(model, seed, StageTimer()).best(planned)
    return time.process_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cold", type=int, default=3, metavar="SEEDS")
    parser.add_argument("--rooms", type=int, default=ROOMS)
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--only", choices=("cold", "batch"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    import machine
    import torch

    torch.set_num_threads(1)
    machine.clock = "cpu"
    rate, _ = machine.report_machine(1)
    product = 2 * 2048**3 / rate
    if options.only != "batch":
        cold_runs(options.cold, options.first, product)
    if options.only != "cold":
        batch(options.rooms, options.first, product)


if __name__ == "__main__":
    main()
