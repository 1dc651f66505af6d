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
from echousd.make.layouts import Draws, draft_rounds, sample_boxes
from echousd.progress import StageTimer
from echousd.reproducible import one_thread, rounded_boxes
from echousd.tensors import floor_centre, graph_batch, seeded

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

NODES = 512  # of one pass of the network: larger products, bounded memory


def sample_round(
    model: RoomModel,
    graphs: Sequence[SceneGraph],
    seeds: Sequence[int],
    drafts: Sequence[int],
    *,
    number: int = 0,
    steps: int | None = None,
    guided: bool = False,
) -> list[tuple[Boxes, ...]]:
    """The drafts of one round (`draft_rounds`) of the first layout of every graph, as `generate` takes them (`drawn`).

    A sum's rounding depends on what is packed together: boxes are those of single runs but for at most a few units of
    `reproducible.LENGTH`, and exactly the same for the same list of graphs and seeds.

    Arguments:
        model: any model; graphs that cannot be packed (with given boxes, or for other models) are sampled alone.
        graphs, seeds: as many of each. steps: sampling steps, None for the model's own. guided: as `Draws`.
        drafts: how many each graph gets at most in all rounds. number: of the round, 0 = the first draft.
    """
    starts, counts = zip(*(draft_rounds(most)[number] for most in drafts), strict=True)
    start = starts[0]
    found: dict[int, tuple[Boxes, ...]] = {}
    planned = [with_plan(graph, seed) for graph, seed in zip(graphs, seeds, strict=True)]
    together = [i for i, graph in enumerate(planned) if isinstance(model, EchoModel) and not _given(graph)]
    for pack in packs(together, [len(graph.nodes) * n for graph, n in zip(planned, counts, strict=True)]):
        owners = [i for i in pack for _ in range(counts[i])]
        batches = {i: graph_batch(planned[i]) for i in pack}
        generators = {i: seeded(seeds[i], "layout", start) for i in pack}  # one draws all drafts of its scene
        rows = [batches[i].num_nodes for i in owners]
        with one_thread():
            assert isinstance(model, EchoModel)
            drawn = model.sample_layout(
                GraphBatch.pack([batches[i] for i in owners]),
                generator=SceneGenerators([generators[i] for i in owners], rows),
                steps=steps,
                relation_guidance=None if guided else 0.0,
            )
        fields = (drawn.size.cpu().split(rows), drawn.position.cpu().split(rows), drawn.yaw.cpu().split(rows))
        for i, size, position, yaw in zip(owners, *fields, strict=True):
            graph = planned[i]
            boxes = rounded_boxes(graph, Boxes(size, position + floor_centre(graph), yaw))
            found[i] = (*found.get(i, ()), boxes)
    for i, graph in enumerate(planned):
        if i not in found:
            found[i] = tuple(
                sample_boxes(
                    model, graph, Draws(seeds[i], start, steps, guided=guided), count=counts[i], timer=StageTimer()
                )
            )
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
