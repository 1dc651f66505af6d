"""Where the objects of a scene graph go on a page.

The page is the room seen from above by an observer who looks along +X: up is front, right is right (+Z).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import Relation
from echousd.graph.scene import SceneGraph

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
