"""Layouts of many graphs in one pass of the network: each scene draws from its own seed, as it would alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.randomness import SceneGenerators
from echousd.graph import SceneGraph
from echousd.graph.floors import with_plan
from echousd.make.layouts import Draws, sample_boxes
from echousd.progress import StageTimer
from echousd.reproducible import one_thread, rounded_boxes
from echousd.tensors import floor_centre, graph_batch, seeded

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

NODES = 512  # of one pass of the network: larger products, bounded memory


def first_drafts(
    model: RoomModel,
    graphs: Sequence[SceneGraph],
    seeds: Sequence[int],
    *,
    steps: int | None = None,
    guided: bool = False,
) -> list[Boxes]:
    """The first draft of the first layout of every graph, as `generate` takes it (`first`).

    A sum's rounding depends on what is packed together: boxes are those of single runs but for at most a few units of
    `reproducible.LENGTH`, and exactly the same for the same list of graphs and seeds.

    Arguments:
        model: any model; graphs that cannot be packed (with given boxes, or for other models) are sampled alone.
        graphs, seeds: as many of each. steps: sampling steps, None for the model's own. guided: as `Draws`.
    """
    found: dict[int, Boxes] = {}
    planned = [with_plan(graph, seed) for graph, seed in zip(graphs, seeds, strict=True)]
    together = [i for i, graph in enumerate(planned) if isinstance(model, EchoModel) and not _given(graph)]
    for pack in packs(together, [len(graph.nodes) for graph in planned]):
        batches = [graph_batch(planned[i]) for i in pack]
        rows = [batch.num_nodes for batch in batches]
        with one_thread():
            assert isinstance(model, EchoModel)
            drawn = model.sample_layout(
                GraphBatch.pack(batches),
                generator=SceneGenerators([seeded(seeds[i], "layout", 0) for i in pack], rows),
                steps=steps,
                relation_guidance=None if guided else 0.0,
            )
        fields = (drawn.size.cpu().split(rows), drawn.position.cpu().split(rows), drawn.yaw.cpu().split(rows))
        for i, size, position, yaw in zip(pack, *fields, strict=True):
            found[i] = rounded_boxes(planned[i], Boxes(size, position + floor_centre(planned[i]), yaw))
    for i, graph in enumerate(planned):
        if i not in found:
            draws = Draws(seeds[i], steps=steps, guided=guided)
            (found[i],) = sample_boxes(model, graph, draws, timer=StageTimer())
    return [found[i] for i in range(len(graphs))]


def packs(numbers: Iterable[int], nodes: Sequence[int], most: int = NODES) -> list[list[int]]:
    """The numbers in their order, in groups whose nodes are at most `most` together; a larger one stands alone."""
    out: list[list[int]] = []
    held = 0
    for number in numbers:
        if not out or held + nodes[number] > most:
            out.append([])
            held = 0
        out[-1].append(number)
        held += nodes[number]
    return out


def _given(graph: SceneGraph) -> bool:
    return any(None not in (node.size, node.position, node.yaw) for node in graph.nodes)
