"""What the furniture of many rooms weighs, against what real pieces weigh (`kg` in the vocabulary).

    python masses.py [COUNT]

Rooms are graphs of the generator (500), their boxes and descriptions those of the shipped networks; pieces are built by
their programs as `--shapes parts` builds them, in sizes that are made usual as placing does it first.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np
import torch

from echomodel.furniture import solids
from echomodel.furniture.solids import pieces_of
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.loading import load_model
from echomodel.objective.sizes import usual_sizes
from echomodel.rooms.generator import generate_rooms
from echomodel.vocabulary import vocabulary
from echousd.graph.arrays import graph_batch
from echousd.shapes.matter import weighed
from echousd.stage.boxes import graph_of

AT_ONCE = 50  # rooms in one batch


def main(count: int) -> None:
    """Print a line for each category: pieces, range, quantiles, and how many lie outside of the range."""
    found: dict[str, list[float]] = defaultdict(list)
    graphs = [graph_of(room) for room in generate_rooms(count, 11)]
    model = load_model(None)
    for start in range(0, count, AT_ONCE):
        some = graphs[start : start + AT_ONCE]
        batch = GraphBatch.pack(graph_batch(graph) for graph in some)
        boxes = model.sample_layout(batch, generator=torch.Generator().manual_seed(start))
        told = model.sample_furniture(batch, boxes, generator=torch.Generator().manual_seed(start))
        words = [node.category for graph in some for node in graph.nodes]
        sizes = np.asarray(boxes.size, float)
        sizes = usual_sizes(words, sizes, lenient=np.zeros_like(sizes, bool))
        for word, size, description in zip(words, sizes, np.asarray(told), strict=True):
            pieces = pieces_of(solids(word, *piece_of(np.asarray(description, float)), size), size, 1)
            found[word].append(weighed(pieces).mass)
    outside = 0
    for row in vocabulary().categories:
        kilograms = np.array(found.get(row.name, ()))
        if len(kilograms):
            out = int(((kilograms < row.kg[0]) | (kilograms > row.kg[1])).sum())
            outside += out
            spread = " ".join(f"{value:7.1f}" for value in np.percentile(kilograms, [0, 5, 50, 95, 100]))
            print(f"{row.name:20s} {len(kilograms):5d}  {row.kg[0]:g} to {row.kg[1]:g} kg: {spread}  outside {out}")
    print(f"{count} rooms, {sum(map(len, found.values()))} pieces, {outside} outside")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
