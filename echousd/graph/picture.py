"""A picture of a scene graph (matplotlib): objects as boxes, relations as arrows."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.files import whole_file
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import Node, Relation
from echousd.graph.scene import SceneGraph

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES = (".png", ".svg", ".pdf")
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
    save_figure(figure, path)


DATES = {"svg": "Date", "pdf": "CreationDate"}


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a drawing in the form of its extension (.png, .svg, .pdf); the same drawing is the same bytes."""
    from matplotlib import rc_context

    form = Path(path).suffix.lower().lstrip(".")
    metadata = {DATES[form]: None, "Creator": "echousd"} if form in DATES else {"Software": "echousd"}
    with rc_context({"svg.hashsalt": "echousd"}), whole_file(path) as beside:
        figure.savefig(beside, format=form, metadata=metadata)


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

    kind = next(row for row in vocabulary().predicate_kinds if row.name == curve.arrow.kind)
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
            lines, [kind.name for kind in keys], loc="lower center", bbox_to_anchor=(0.5, 0.04 / tall), ncols=len(keys),
            frameon=False, fontsize=8.5,
        )  # fmt: skip


WIDTH, HEIGHT = 1.9, 0.62  # of a box, inches
CELL = np.array([2.75, 1.6])  # what one box and the words beside it take up, inches
TRIES = 16  # starts of small graphs, of which the clearest picture is kept


def places(graph: SceneGraph) -> np.ndarray:
    """Where each node goes on the page.

    Nodes that all have a position keep it, but for the room that boxes need; otherwise related nodes attract, all boxes
    repel, and left, right, front and behind pull their ends to the right sides of each other.

    Returns:
        (n, 2) float, inches right and up.
    """
    fixed = [node.position for node in graph.nodes if node.position is not None]
    count = len(graph.nodes)
    relations = distinct(graph.relations)
    cell = CELL * np.clip(np.sqrt(len(relations) / (2.5 * count)), 1, 2.2)  # many words need room
    if len(fixed) == count:
        place = np.array([(z, x) for x, _, z in fixed], float)
        span = max(np.ptp(place, axis=0).max(), 1e-6)
        return _spread((place - place.mean(0)) * max(1.0, 0.6 * cell[0] * np.sqrt(count) / span), 0.9 * cell)
    import networkx

    index = {name: i for i, name in enumerate(graph.names)}
    pairs = {tuple(sorted((index[r.subject], index[r.object]))) for r in relations}
    simple = networkx.Graph(pairs)
    simple.add_nodes_from(index.values())
    ends = np.array(sorted(pairs), int).reshape(-1, 2)
    # Where the subject wants to be from its object, in steps across (right, +Z) and up (front, +X) the page.
    steps = [(index[r.subject], index[r.object], *vocabulary().predicate(r.predicate).step[::-1]) for r in relations]
    pulls = [pull for pull in steps if any(pull[2:])]
    directed = np.array([pull[:2] for pull in pulls], int).reshape(-1, 2)
    ways = np.array([pull[2:] for pull in pulls], float).reshape(-1, 2)
    best, least = np.zeros((count, 2)), np.inf
    for seed in range(TRIES if count <= 60 else 1):
        start = networkx.spring_layout(simple, seed=seed, iterations=20, scale=0.5 * np.sqrt(count))
        place = np.array([start[i] for i in range(count)])
        for step in np.linspace(0.5, 0.03, 250 if count <= 200 else 60):
            place = place + step * np.clip(_forces(place, ends, directed, ways), -1, 1)
        place = _spread((place - place.mean(0)) * cell, np.array([WIDTH + 0.35, HEIGHT + 0.5]))
        muddle = _muddle(place, ends, directed, ways) if count <= 60 else 0.0
        if muddle < least:
            best, least = place, muddle
    return best


def distinct(relations: Iterable[Relation]) -> list[Relation]:
    """The relations without those that say what an earlier one says already, the other way round."""
    inverse = {predicate.name: predicate.inverse for predicate in vocabulary().predicates}
    kept: dict[tuple[str, str | None, str], Relation] = {}
    for relation in relations:
        if (relation.object, inverse[relation.predicate], relation.subject) not in kept:
            kept[relation.triple] = relation
    return list(kept.values())


def _muddle(place: np.ndarray, ends: np.ndarray, directed: np.ndarray, ways: np.ndarray) -> float:
    """How hard a placing is to read: arrows that cross, run over boxes or point aside, length, paper."""
    start, end = place[ends[:, 0]], place[ends[:, 1]]

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return np.sign((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])

    a, b, c, d = start[:, None], end[:, None], start[None], end[None]
    crossing = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    t = np.linspace(0, 1, 15)[:, None, None]
    points = (1 - t) * start + t * end
    inside = (np.abs(points[:, :, None] - place) < (WIDTH / 2 + 0.1, HEIGHT / 2 + 0.1)).all(-1).any(0)
    inside[np.arange(len(ends))[:, None], ends] = False
    offset = (place[directed[:, 0]] - place[directed[:, 1]]) / CELL
    aside = 1 - (offset * ways).sum(1) / np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    length = np.linalg.norm((end - start) / CELL, axis=1).sum()
    paper = np.ptp(place / CELL, axis=0).prod() / len(place)
    return float(crossing.sum() / 2 + 2 * inside.sum() + 2 * aside.sum() + 0.1 * length + 0.3 * paper)


def _forces(place: np.ndarray, ends: np.ndarray, directed: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(n, 2) pull on each node, in cells: related nodes to one cell apart, unrelated ones away, words to their side."""
    move = np.zeros_like(place)
    between = place[ends[:, 1]] - place[ends[:, 0]]
    far = np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-9)
    draw = 0.3 * between * (1 - 1 / far)
    np.add.at(move, ends[:, 0], draw)
    np.add.at(move, ends[:, 1], -draw)
    offset = place[directed[:, 0]] - place[directed[:, 1]]
    short = 0.8 * np.clip(1 - (offset * ways).sum(1, keepdims=True), 0, None) * ways - 0.2 * offset * (ways == 0)
    np.add.at(move, directed[:, 0], short)
    np.add.at(move, directed[:, 1], -short)
    gap = place[:, None] - place[None]
    near = np.maximum((gap**2).sum(-1, keepdims=True), 1e-2)
    np.einsum("iij->ij", near)[:] = np.inf
    return move + (0.16 * gap / near**1.5).sum(1)


def _spread(place: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Push boxes aside, the shorter way, until all are `apart` (across, up)."""
    for _ in range(200 if len(place) <= 200 else 20):
        gap = place[:, None] - place[None]
        lack = apart - np.abs(gap)
        overlap = (lack > 0).all(-1)
        np.fill_diagonal(overlap, False)
        if not overlap.any():
            break
        way = np.where(
            gap == 0, np.sign(np.arange(len(place))[:, None] - np.arange(len(place)))[..., None], np.sign(gap)
        )
        across = (lack[..., :1] < lack[..., 1:]) == [True, False]
        place = place + (0.3 * lack * way * across * overlap[..., None]).sum(1)
    return place
