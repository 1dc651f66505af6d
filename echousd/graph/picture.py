"""A picture of a scene graph (matplotlib) and its Graphviz text: objects as boxes, relations as arrows."""

from __future__ import annotations

import os
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.files import whole_file
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import Node
from echousd.graph.placing import HEIGHT, WIDTH, distinct, places
from echousd.graph.scene import SceneGraph

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABELLED = 80  # arrows that still carry their words; more would cover each other


@dataclass(frozen=True)
class Arrow:
    """All relations of one kind from one node to another."""

    subject: str
    object: str
    kind: str
    words: tuple[str, ...]
    both_ways: bool


def arrows(graph: SceneGraph) -> list[Arrow]:
    """The relations gathered by pair and kind, those that repeat another the other way round left out.

    Relations that read the same both ways have no heads.
    """
    gathered: dict[tuple[str, str, str], list[str]] = defaultdict(list)
    for relation in distinct(graph.relations):
        kind = vocabulary().predicate(relation.predicate).kind
        gathered[relation.subject, relation.object, kind].append(relation.predicate)
    symmetric = {predicate.name for predicate in vocabulary().predicates if predicate.symmetric}
    return [
        Arrow(subject, object_, kind, tuple(word.replace("_", " ") for word in words), set(words) <= symmetric)
        for (subject, object_, kind), words in gathered.items()
    ]


def draw_graph(graph: SceneGraph, path: str | os.PathLike[str]) -> None:
    """Write a picture of `graph` to `path`; its extension (.png, .svg, .pdf) chooses the form. Raises OSError."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    place = places(graph)
    where = dict(zip(graph.names, place, strict=True))
    joined = arrows(graph)
    curves = _curves(joined, where)
    middles = np.array([curve.middle for curve in curves]).reshape(-1, 2)
    margin = np.array([0.7 * WIDTH, 0.65])
    low = np.minimum(place.min(0) - margin, middles.min(0, initial=np.inf) - 0.4)
    high = np.maximum(place.max(0) + margin, middles.max(0, initial=-np.inf) + 0.4)
    span = np.maximum(high - low, (5.5, 2.2))
    low, high = (low + high - span) / 2, (low + high + span) / 2
    shrink = min(1.0, 40 / span.max())  # a thousand objects still make a picture that opens
    figure = Figure(figsize=(span[0] * shrink, span[1] * shrink + 1.05), dpi=160)
    FigureCanvasAgg(figure)
    tall = figure.get_figheight()
    axes = figure.add_axes((0, 0.45 / tall, 1, 1 - 1.05 / tall))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.axis("off")
    for curve in curves:
        _draw_curve(axes, curve, shrink, labelled=len(curves) <= LABELLED)
    for node in graph.nodes:
        _draw_node(axes, node, where[node.name], shrink)
    room = graph.room
    size = f", {room.extents[0]:g} x {room.extents[1]:g} m" if room.extents else ""
    title = f"{room.type.replace('_', ' ')}{size}: {len(graph.nodes)} objects, {len(graph.relations)} relations"
    figure.text(0.5, 1 - 0.34 / tall, title, ha="center", va="center", fontsize=13, weight="bold", color="#2b2f36")
    _draw_legend(figure, {arrow.kind for arrow in joined}, tall)
    suffix = Path(path).suffix.lower().lstrip(".")
    metadata: dict[str, Any] = {"Date": None} if suffix == "svg" else {}
    metadata |= {"Creator" if suffix in ("svg", "pdf") else "Software": "echousd"}
    with rc_context({"svg.hashsalt": "echousd"}), whole_file(path) as beside:  # the same graph, the same bytes
        figure.savefig(beside, format=suffix, facecolor="white", metadata=metadata)


def _draw_node(axes: Axes, node: Node, place: np.ndarray, shrink: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    colour = vocabulary().category(node.category).colour
    across, up = (float(value) for value in place)
    corner = (across - WIDTH / 2, up - HEIGHT / 2)
    shape = FancyBboxPatch(
        corner, WIDTH, HEIGHT, boxstyle="round,pad=0,rounding_size=0.14", facecolor=colour, edgecolor="#4a4f57",
        linewidth=2.2 * shrink if node.locked else 1.1 * shrink, zorder=3,
    )  # fmt: skip
    axes.add_patch(shape)
    below = node.category.replace("_", " ") if node.category != node.name else ""
    if node.style:
        below = f"{below or node.category.replace('_', ' ')} · {node.style}"
    style: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 4, "clip_on": True, "parse_math": False}
    name = node.name if len(node.name) <= 22 else node.name[:20] + "…"
    axes.text(across, up + (0.12 if below else 0), name, fontsize=10 * shrink, weight="bold", color="#1d2026", **style)
    if below:
        below = below if len(below) <= 32 else below[:30] + "…"
        axes.text(across, up - 0.15, below, fontsize=7.5 * shrink, color="#4a4f57", **style)


@dataclass(frozen=True)
class Curve:
    """An arrow on the page, from edge to edge of two boxes, with the place of its words."""

    arrow: Arrow
    start: np.ndarray
    end: np.ndarray
    bend: float
    middle: np.ndarray


def _curves(joined: list[Arrow], where: dict[str, np.ndarray]) -> list[Curve]:
    """Arrows between the same two boxes bend apart."""
    pairs: dict[frozenset[str], list[Arrow]] = defaultdict(list)
    for arrow in joined:
        pairs[frozenset((arrow.subject, arrow.object))].append(arrow)
    curves = []
    for together in pairs.values():
        for i, arrow in enumerate(together):
            turn = 1 if arrow.subject < arrow.object else -1  # one bend means one side, whichever way the arrow goes
            bend = turn * 0.34 * (i - (len(together) - 1) / 2)
            ends = where[arrow.subject], where[arrow.object]
            start, end = _edge(*ends, bend), _edge(*ends[::-1], -bend)
            along = end - start
            middle = (start + end) / 2 + 0.5 * bend * np.array([along[1], -along[0]])  # of the quadratic curve
            curves.append(Curve(arrow, start, end, bend, middle))
    return curves


def _draw_curve(axes: Axes, curve: Curve, shrink: float, labelled: bool) -> None:
    from matplotlib.patches import FancyArrowPatch

    kind = vocabulary().predicate_kind(curve.arrow.kind)
    patch = FancyArrowPatch(
        tuple(curve.start), tuple(curve.end), connectionstyle=f"arc3,rad={curve.bend}",
        arrowstyle="-" if curve.arrow.both_ways else "-|>", mutation_scale=13 * shrink, shrinkA=0, shrinkB=0,
        color=kind.colour, linestyle=kind.line, linewidth=1.4 * shrink, zorder=2,
    )  # fmt: skip
    axes.add_patch(patch)
    if labelled:
        box = {"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.9}
        style: dict[str, Any] = {"ha": "center", "va": "center", "linespacing": 1.0, "zorder": 2.5, "bbox": box}
        words = "\n".join(curve.arrow.words)
        axes.text(curve.middle[0], curve.middle[1], words, fontsize=7.5 * shrink, color=kind.colour, **style)


def _edge(start: np.ndarray, end: np.ndarray, bend: float) -> np.ndarray:
    """Where an arrow from the middle of one box to another, bent aside, leaves the first box."""
    along = end - start
    along = along + 2 * bend * np.array([along[1], -along[0]]) * 0.5
    reach = np.array([WIDTH / 2 + 0.04, HEIGHT / 2 + 0.04]) / np.maximum(np.abs(along), 1e-9)
    return start + along * min(reach.min(), 1.0)


def _draw_legend(figure: Any, used: set[str], tall: float) -> None:
    from matplotlib.lines import Line2D

    keys = [kind for kind in vocabulary().predicate_kinds if kind.name in used]
    lines = [Line2D([], [], color=kind.colour, linestyle=kind.line, linewidth=1.6) for kind in keys]
    if lines:
        figure.legend(
            lines,
            [kind.name for kind in keys],
            loc="lower center",
            bbox_to_anchor=(0.5, 0.04 / tall),
            ncols=len(keys),
            frameon=False,
            fontsize=8.5,
        )


def to_dot(graph: SceneGraph) -> str:
    """The graph in Graphviz' language, one statement a line."""

    def quoted(text: str) -> str:
        return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'

    lines = [f"digraph {quoted(graph.room.type)} {{", '  node [shape=box, style="rounded,filled", fontname=Helvetica];']
    for node in graph.nodes:
        colour = vocabulary().category(node.category).colour
        label = node.name if node.name == node.category else f"{node.name}\n{node.category}"
        lines.append(f"  {quoted(node.name)} [label={quoted(label)}, fillcolor={quoted(colour)}];")
    for arrow in arrows(graph):
        kind = vocabulary().predicate_kind(arrow.kind)
        heads = ", dir=none" if arrow.both_ways else ""
        label = ", ".join(arrow.words)
        lines.append(
            f"  {quoted(arrow.subject)} -> {quoted(arrow.object)} "
            f"[label={quoted(label)}, color={quoted(kind.colour)}, style={kind.line}{heads}];"
        )
    return "\n".join([*lines, "}"]) + "\n"
