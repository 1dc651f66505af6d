"""Scene graphs on stages against the barest Sdf code for the same specs: time ratios, and memory per relation.

python benchmarks/graph_stage.py            (about two minutes; targets: writing + reading at most 3, memory linear)

The floor writes the same prims, attributes and relationships by hand from ready strings and reads the same values back
from the layer without opening a stage, validating a word or building an object.
"""

from __future__ import annotations

import argparse
import gc
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.stage.graphs import save_layer
from echousd.stage.read import read_graph
from echousd.stage.write import graph_layer

WORDS = vocabulary()


def random_graph(nodes: int, relations: int, rng: np.random.Generator) -> SceneGraph:
    """A valid graph with sizes on every node; directions follow the nodes' order, so nothing contradicts."""
    categories = [entry.name for entry in WORDS.categories]
    objects = tuple(
        Node(f"object_{i}", categories[rng.integers(len(categories))], size=tuple(rng.uniform(0.3, 2, 3)))
        for i in range(nodes)
    )
    chosen: dict[tuple[int, str, int], Relation] = {}
    while len(chosen) < relations:
        low, high = sorted(rng.choice(nodes, 2, replace=False))
        predicate = WORDS.predicates[rng.integers(len(WORDS.predicates))]
        s, o = (low, high) if predicate.rank <= 0 else (high, low)
        chosen[s, predicate.name, o] = Relation(f"object_{s}", predicate.name, f"object_{o}")
    return SceneGraph(RoomSpec("bedroom", size=(4, 5)), objects, tuple(chosen.values()))


def floor_write(graph: SceneGraph, path: Path) -> None:
    """The same specs as `graph_layer` in as few Sdf calls as there are."""
    layer = Sdf.Layer.CreateAnonymous(path.suffix)
    types, uniform = Sdf.ValueTypeNames, Sdf.VariabilityUniform
    with Sdf.ChangeBlock():
        room = Sdf.PrimSpec(layer, "Room", Sdf.SpecifierDef, "Xform")
        room.kind = "assembly"
        layer.defaultPrim = "Room"
        layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
        layer.pseudoRoot.SetInfo("upAxis", "Y")
        parent = Sdf.PrimSpec(room, "SceneGraph", Sdf.SpecifierDef, "EchoSceneGraph")
        rel = Sdf.RelationshipSpec(parent, "echo:room", False, uniform)
        rel.targetPathList.explicitItems = ["/Room"]
        Sdf.AttributeSpec(parent, "echo:vocabulary", types.Token, uniform).default = "echo-1"
        Sdf.AttributeSpec(parent, "echo:roomType", types.Token, uniform).default = graph.room.type
        Sdf.AttributeSpec(parent, "echo:floorSize", types.Double2, uniform).default = Gf.Vec2d(*graph.room.size)
        for relation in graph.relations:
            name = f"{relation.subject}__{relation.predicate}__{relation.object}"
            spec = Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, "EchoRelation")
            rel = Sdf.RelationshipSpec(spec, "echo:subject", False, uniform)
            rel.targetPathList.explicitItems = [f"/Room/Objects/{relation.subject}"]
            rel = Sdf.RelationshipSpec(spec, "echo:object", False, uniform)
            rel.targetPathList.explicitItems = [f"/Room/Objects/{relation.object}"]
            Sdf.AttributeSpec(spec, "echo:predicate", types.Token, uniform).default = relation.predicate
        parent = Sdf.PrimSpec(room, "Objects", Sdf.SpecifierDef, "Xform")
        parent.kind = "group"
        for node in graph.nodes:
            spec = Sdf.PrimSpec(parent, node.name, Sdf.SpecifierDef, "Xform")
            apis = Sdf.TokenListOp.Create(prependedItems=["EchoNodeAPI", "SemanticsLabelsAPI:category"])
            spec.SetInfo("apiSchemas", apis)
            Sdf.AttributeSpec(spec, "echo:category", types.Token, uniform).default = node.category
            Sdf.AttributeSpec(spec, "echo:size", types.Double3, uniform).default = Gf.Vec3d(*node.size)
            labels = Sdf.AttributeSpec(spec, "semantics:labels:category", types.TokenArray)
            labels.default = Vt.TokenArray([node.category])
    layer.Export(str(path))


def floor_read(path: Path) -> int:
    """Every value of every spec by its known name, read from the layer and dropped."""
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    graph, objects = layer.GetPrimAtPath("/Room/SceneGraph"), layer.GetPrimAtPath("/Room/Objects")
    values = [graph.properties[name].default for name in ("echo:roomType", "echo:vocabulary", "echo:floorSize")]
    for spec in graph.nameChildren:
        properties = spec.properties
        values.append(properties["echo:subject"].targetPathList.explicitItems[0])
        values.append(properties["echo:object"].targetPathList.explicitItems[0])
        values.append(properties["echo:predicate"].default)
    for spec in objects.nameChildren:
        properties = spec.properties
        values.append(spec.GetInfo("apiSchemas"))
        values += [properties[name].default for name in ("echo:category", "echo:size", "semantics:labels:category")]
    return len(values)


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Process time of the fastest of `repeats` runs, so that other work on the machine counts as little as possible."""
    best = float("inf")
    for _ in range(repeats):
        gc.collect()
        start = time.process_time()
        action()
        best = min(best, time.process_time() - start)
    return best


def compare(title: str, graphs: list[SceneGraph], extension: str, folder: Path, repeats: int) -> list[float]:
    """Write and read `graphs` both ways; prints a line each and returns the three ratios: write, read, both."""
    paths = [folder / f"{number}{extension}" for number in range(len(graphs))]

    def each(action: Callable[..., object], *inputs: list) -> float:
        """Seconds for `action` on every item, its results dropped."""

        def run() -> None:
            for item in zip(*inputs, strict=True):
                action(*item)

        return seconds(run, repeats)

    bare = [each(floor_write, graphs, paths), each(floor_read, paths)]
    full = [
        each(lambda graph, path: save_layer(graph_layer(graph, identifier=extension), path), graphs, paths),
        each(read_graph, paths),
    ]
    assert read_graph(paths[-1]) == graphs[-1]
    ratios = []
    for name, ours, floor in zip(("write", "read", "both"), (*full, sum(full)), (*bare, sum(bare)), strict=True):
        times = f"{ours / len(graphs) * 1e3:8.2f} ms against {floor / len(graphs) * 1e3:8.2f} ms"
        print(f"{title:34} {extension[1:]:5} {name:6} {times}   ratio {ours / floor:.2f}", flush=True)
        ratios.append(ours / floor)
    return ratios


def memory(relations: int) -> float:
    """MiB that a process grows by when it authors a graph, reads it again and keeps layer, stage and graph (Linux)."""
    rng = np.random.default_rng(0)
    graph = random_graph(max(2, relations // 10), relations, rng)
    read_graph(Usd.Stage.Open(graph_layer(random_graph(2, 2, rng))))
    gc.collect()
    before = resident()
    layer = graph_layer(graph)
    stage = Usd.Stage.Open(layer)
    again = read_graph(stage)
    gc.collect()
    grown = resident() - before
    assert again == graph
    return grown


def resident() -> float:
    """Resident memory of this process in MiB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--graphs", type=int, default=1000, help="small graphs (12 nodes, 60 relations)")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--memory", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.memory:
        print(memory(options.memory))
        return
    rng = np.random.default_rng(7)
    small = [random_graph(12, 60, rng) for _ in range(options.graphs)]
    large = [random_graph(1000, 10_000, rng)]
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for extension in (".usda", ".usdc"):
            for title, graphs in (
                (f"{options.graphs} x 12 nodes, 60 relations", small),
                ("1 x 1,000 nodes, 10,000 relations", large),
            ):
                worst = max(worst, compare(title, graphs, extension, Path(folder), options.repeats)[-1])
    print(f"largest ratio of authoring and reading {worst:.2f} (target 3)")
    for relations in (5_000, 10_000, 20_000, 40_000):  # a process each, so that the peaks do not mix
        command = [sys.executable, __file__, "--memory", str(relations)]
        grown = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        print(f"{relations:6} relations: {grown:6.1f} MiB, {grown * 1024 / relations:.2f} KiB each", flush=True)


if __name__ == "__main__":
    main()
