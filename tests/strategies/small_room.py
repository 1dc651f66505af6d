"""A small bedroom for tests: a graph, and a stand-in for the model that knows where everything goes."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.randomness import Noise, normal
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph

if TYPE_CHECKING:
    from echousd.room import Room

BARE = {"walls": False, "dress": "none"}  # options of a room that is its furniture alone

# category -> size, and places in the order of use (metres, radians)
PLACES: dict[str, tuple[tuple[float, float, float], list[tuple[float, float, float, float]]]] = {
    "double_bed": ((1.8, 1.0, 2.1), [(0.0, 0.0, -0.6, 0.0)]),
    "nightstand": ((0.5, 0.5, 0.4), [(-1.25, 0.0, -1.4, 0.0), (1.25, 0.0, -1.4, 0.0)]),
    "table_lamp": ((0.25, 0.45, 0.25), [(-1.25, 0.5, -1.4, 0.0)]),
    "wardrobe": ((1.6, 2.2, 0.6), [(-1.6, 0.0, 0.9, np.pi / 2)]),
    "pendant_lamp": ((0.5, 0.7, 0.5), [(0.0, 2.1, 0.9, 0.0)]),
}
OBJECTS = {
    "bed": "double_bed",
    "nightstand_left": "nightstand",
    "nightstand_right": "nightstand",
    "lamp": "table_lamp",
    "wardrobe": "wardrobe",
    "pendant": "pendant_lamp",
}


def small_graph(**room: object) -> SceneGraph:
    """Six objects; the two nightstands are one style group."""
    return SceneGraph(
        room=RoomSpec("bedroom", **{"size": (4.0, 3.4), **room}),
        nodes=tuple(Node(name, category) for name, category in OBJECTS.items()),
        relations=(
            Relation("nightstand_left", "close_by", "bed"),
            Relation("nightstand_right", "close_by", "bed"),
            Relation("nightstand_left", "same_style_as", "nightstand_right"),
            Relation("lamp", "standing_on", "nightstand_left"),
            Relation("wardrobe", "taller_than", "bed"),
        ),
    )


def drawn(generator: Noise | torch.Generator) -> float:
    """A number of a source that tells seeds apart."""
    return float(normal((16,), generator, None)[0])


class StandIn:
    """Knows the two calls of the echo model; `shift` metres along x come from the generator it is given.

    `edits` are the graph edits that it was told of.
    """

    hash, preset, branches = "standin", "compact", frozenset({"layout", "shape"})

    def __init__(self, shift: float = 0.0) -> None:
        self.shift = shift
        self.edits: list = []

    def unlearned(self, graph):
        return ()

    def sample_layout(self, graph, *, generator, steps=None, known=None, known_mask=None, edit=None, progress=None):
        self.edits.append(edit)
        used: dict[str, int] = {}
        size, position, yaw = [], [], []
        for number in graph.category.tolist():
            word = vocabulary().categories[number].name
            extent, places = PLACES[word]
            x, y, z, turn = places[used.setdefault(word, 0) % len(places)]
            used[word] += 1
            size.append(extent)
            position.append((x, y, z))
            yaw.append(turn)
        moved = torch.tensor(position) + drawn(generator) * torch.tensor([self.shift, 0.0, 0.0])
        if progress is not None:
            progress(1, 1)
        return Boxes(torch.tensor(size), moved, torch.tensor(yaw, dtype=torch.float32))

    def sample_shapes(self, graph, boxes, *, generator, steps=None, edit=None, progress=None):
        self.edits.append(edit)
        return torch.from_numpy(np.stack([ball_tsdf() if c % 2 else table_tsdf() for c in graph.category.tolist()]))


@cache
def ball_tsdf() -> np.ndarray:
    """A sphere that fills its box."""
    x, y, z = np.meshgrid(*[(np.arange(64) + 0.5) / 64 - 0.5] * 3, indexing="ij")
    return np.clip((np.sqrt(x**2 + y**2 + z**2) - 30 / 64) * 16, -1, 1).astype(np.float32)


@cache
def table_tsdf(leg: float = 2.0) -> np.ndarray:
    """A plate on four legs; `leg` is half the thickness of a leg in voxels."""

    def block(centre: tuple[float, float, float], half: tuple[float, float, float]) -> np.ndarray:
        axes = np.meshgrid(*[np.arange(64) + 0.5] * 3, indexing="ij")
        away = [np.abs(a - c) - h for a, c, h in zip(axes, centre, half, strict=True)]
        outside = np.sqrt(sum(np.maximum(a, 0) ** 2 for a in away))
        return outside + np.minimum(np.maximum(np.maximum(away[0], away[1]), away[2]), 0)

    solids = [block((32, 58, 32), (30, 4, 30))]
    solids += [block((x, 30, z), (leg, 28, leg)) for x in (2 + leg, 62 - leg) for z in (2 + leg, 62 - leg)]
    return np.clip(np.minimum.reduce(solids) / 4, -1, 1).astype(np.float32)


@cache
def small_room(shift: float = 0.0, **options: object) -> Room:
    """The small graph as a room of the stand-in, bare where `options` do not say more; made once a process."""
    import echousd

    return echousd.generate(small_graph(), model=StandIn(shift), **{**BARE, **options})


def saved_room(folder: Path, **options: object) -> Path:
    """Root layer of `small_room(**options)`, saved in `folder`: a copy of what is written once a process."""
    for path, content in _saved(folder.name, **options).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder / f"{folder.name}.usda"


@cache
def _saved(name: str, **options: object) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as top:
        folder = small_room(**options).save(Path(top) / name, preview=False).parent
        return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
