"""The `paper` stages: the paper's own sizes and wiring trained on our rooms (EchoScene 3.5 and its supplement)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.data.roomset import RoomSet, kept_out, with_known_words
from echomodel.data.sgfront import SGFront
from echomodel.data.shapeset import ShapeSet
from echomodel.files import raising
from echomodel.late import extra
from echomodel.roomboxes import RoomBoxes
from echomodel.text import CachedTextEncoder, ClipTextEncoder, RandomTextEncoder, TextEncoder, edge_text
from echomodel.training.recipe import Recipe
from echomodel.training.start import data_folder
from echomodel.training.trainer import Report, Trainer
from echomodel.vocabulary import vocabulary
from echoscene.checkpoint import load_released, write_released
from echoscene.config import paper
from echoscene.echo import pack_changes, pack_scenes, pseudo_graph, published_grids, published_scene
from echoscene.encoder import SceneGraphTensors
from echoscene.model import GraphChange, ReleasedModel

SHAPES, GRID, FIELD = "3D-FUTURE-SDF", "ori_sample_grid.h5", "pc_sdf_sample"
CLAMP = 0.2  # of the published distances


class PublishedRooms:
    """The scans of `trainval`, with the relations that their graphs state; every twentieth is for validation.

    `folder`: of SG-FRONT. Raises ValueError as `SGFront`, and for a folder without scans.
    """

    def __init__(self, folder: Path) -> None:
        rooms = with_known_words(SGFront(folder).rooms())
        self.rooms = [room for room in rooms if len(room) and room.relations is not None]
        if not self.rooms:
            raise ValueError(f"{folder}: no scan of trainval with objects that the vocabulary holds")
        self.held_out = kept_out(np.arange(len(self.rooms)))

    def __len__(self) -> int:
        return len(self.rooms)

    def room(self, number: int, *, rules: str = "sgfront") -> RoomBoxes:
        """A scan; `rules` is not looked at, its graph says what holds."""
        return self.rooms[number]


class PublishedShapes:
    """Signed distances of 3D-FUTURE's models, `3D-FUTURE-SDF/<model>/ori_sample_grid.h5` in the folder of SG-FRONT.

    Raises ValueError for a folder without any, and where h5py is not installed.
    """

    def __init__(self, folder: Path) -> None:
        self.files = sorted((folder / SHAPES).glob(f"*/{GRID}"))
        if not self.files:
            raise ValueError(
                f"{folder / SHAPES}: no <model>/{GRID}; echoscene's page says where people get 3D-FUTURE-SDF"
            )
        self._numbers = {file.parent.name: number for number, file in enumerate(self.files)}
        self.held_out = kept_out(np.arange(len(self.files)))

    def __len__(self) -> int:
        return len(self.files)

    def index_of(self, name: str) -> int:
        """Number of a model, -1 for one that is not there."""
        return self._numbers.get(name, -1)

    def published(self, numbers: np.ndarray, side: int) -> Tensor:
        """Grids (K, 1, side, side, side) float32 as published; raises ValueError that names a file of another form."""
        h5py = extra("h5py", "3D-FUTURE-SDF is read with h5py", "sgfront")
        out = []
        for number in numbers:
            name = self.files[int(number)]
            unfit = raising(f"{name}: no grid {FIELD!r} of 64 x 64 x 64", OSError, KeyError, ValueError)
            with unfit, h5py.File(name) as file:
                out.append(np.asarray(file[FIELD], np.float32).reshape(1, 64, 64, 64))
        grids = torch.from_numpy(np.stack(out)).clamp(-CLAMP, CLAMP)
        if side == grids.shape[-1]:
            return grids
        return torch.nn.functional.interpolate(grids, (side,) * 3, mode="trilinear", align_corners=True)


SCENE_BOX = (-1.0,) * 6  # what the published loader gives the `_scene_` node, with an angle of -1
AUTOENCODER = "vqvae"


class PaperModel(ReleasedModel):
    """The `paper` preset as the trainer takes it: `network` is everything but the autoencoder."""

    parts = ("network", AUTOENCODER)
    text_encoder: str | None = "not noted yet"

    def part_parameters(self, part: str) -> list[torch.nn.Parameter]:
        """Parameters of a part."""
        inside = {id(p) for p in self.vqvae.parameters()}
        return [p for p in self.parameters() if (id(p) in inside) == (part == AUTOENCODER)]

    def write(self, path: Path, parts: Sequence[str]) -> None:
        """Write all parts, whatever `parts` says, in the form of `echousd convert`."""
        write_released(path, self, self.config, self.classes, self.statistics)


class PaperStage:
    """Both branches at once on one latent graph, or (`autoencoder`) the VQ-VAE that the shape branch works on.

    The inverse strategy: a pseudo graph goes in, the true scene comes out. A batch of scenes feeds the layout branch
    and as many of its first scenes as fit the node budget the shape branch.

    Arguments:
        rooms: the room set, labelled by the published rules. shapes: the parametric shape set that it names.
        text: encoder of labels and relations.
        scenes: scenes per batch.
        budget: nodes in the shape branch's part of a batch, and grids in a batch of the autoencoder.
        autoencoder: train the VQ-VAE instead of the branches.
    """

    def __init__(
        self, rooms: RoomSet | PublishedRooms, shapes: ShapeSet | PublishedShapes, text: TextEncoder, *, scenes: int,
        budget: int, autoencoder: bool,
    ) -> None:  # fmt: skip
        self.rooms, self.shapes, self.text = rooms, shapes, text
        self.scenes, self.budget = scenes, budget
        self.trained = self.saved = (AUTOENCODER,) if autoencoder else ("network",)
        held = rooms.held_out if rooms.held_out.any() else np.arange(len(rooms)) >= len(rooms) * 19 // 20
        self.numbers = {False: (~held).nonzero()[0], True: held.nonzero()[0]}
        used = ~shapes.held_out if not shapes.held_out.all() else shapes.held_out
        self.used = used.nonzero()[0]

    def loss(self, model: PaperModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        if self.trained == (AUTOENCODER,):
            picked = self.used[torch.randint(len(self.used), (self.budget,), generator=generator).numpy()]
            loss = self._autoencoding(model, picked)
            return loss, {"autoencoder": loss}
        rooms = self._draw(generator, held=False)
        losses = self._losses(model, rooms, generator)
        return losses["loss"], {name: losses[name] for name in ("layout", "shape")}

    @torch.no_grad()
    def validate(self, model: PaperModel) -> dict[str, float]:
        """The same losses on held-out rooms, the same draws every time."""
        generator = torch.Generator().manual_seed(0)
        if self.trained == (AUTOENCODER,):
            held = self.shapes.held_out.nonzero()[0]
            picked = (held if len(held) else self.used)[: self.budget]
            return {"held/autoencoder": float(self._autoencoding(model, picked))}
        losses = self._losses(model, self._draw(generator, held=True), generator)
        return {f"held/{name}": float(losses[name]) for name in ("layout", "shape")}

    def _autoencoding(self, model: PaperModel, numbers: np.ndarray) -> Tensor:
        grids = grids_of(self.shapes, numbers, model.vqvae.config.resolution)
        return model.vqvae.loss(grids.to(model.device))

    def _draw(self, generator: torch.Generator, *, held: bool) -> list[RoomBoxes]:
        pool = self.numbers[held]
        picked = pool[torch.randint(len(pool), (self.scenes,), generator=generator).numpy()]
        return [self.rooms.room(int(number), rules="sgfront") for number in picked]

    def _losses(self, model: PaperModel, rooms: list[RoomBoxes], generator: torch.Generator) -> dict[str, Tensor]:
        graphs = [self.scene(room) for room in rooms]
        changes = [self._pseudo(graph, room, generator) for graph, room in zip(graphs, rooms, strict=True)]
        whole, scene = pack_scenes(graphs)
        assert model.statistics is not None
        boxes = torch.cat([scene_boxes(room, model.statistics) for room in rooms])
        latents = self._latents(model, rooms)
        return model.training_losses(
            whole, scene, boxes, latents, generator=generator, change=pack_changes(graphs, changes), budget=self.budget
        )

    def scene(self, room: RoomBoxes) -> SceneGraphTensors:
        """A room as a published graph with text features on nodes and edges."""
        classes = vocabulary().coarse_categories
        triples = torch.as_tensor([] if room.relations is None else room.relations, dtype=torch.int64).reshape(-1, 3)
        return published_scene(_labels(room), triples, classes=classes, text=self.text, edges=True)

    def _pseudo(self, graph: SceneGraphTensors, room: RoomBoxes, generator: torch.Generator) -> GraphChange:
        labels, words = [*_labels(room), "floor", "_scene_"], vocabulary().sgfront_predicates

        def relation_text(subject: int, predicate: int, target: int) -> Tensor:
            return self.text([edge_text(labels[subject], words[predicate], labels[target])])[0]

        return pseudo_graph(graph, generator, relation_text)

    @torch.no_grad()
    def _latents(self, model: PaperModel, rooms: list[RoomBoxes]) -> Tensor:
        """Latents of the nodes that the budget can reach; floor and scene nodes have those of an empty grid."""
        grids: list[Tensor] = []
        side = model.vqvae.config.resolution
        for room in rooms:
            if sum(len(part) for part in grids) >= self.budget:
                break
            empty = torch.zeros(2, 1, side, side, side)
            own = [self.shapes.index_of(name) if name else -1 for name in room.models or ()]
            known = torch.zeros(len(room), 1, side, side, side)
            rows = [k for k, number in enumerate(own) if number >= 0]
            if rows:
                known[rows] = grids_of(self.shapes, np.array([own[k] for k in rows]), side)
            grids += [known, empty]
        encoder = model.vqvae.eval()
        found = torch.cat([encoder.encode(part.to(model.device)) for part in torch.cat(grids).split(8)])
        missing = sum(len(room) + 2 for room in rooms) - len(found)
        return torch.cat([found, found.new_zeros(max(missing, 0), *found.shape[1:])])


def scene_boxes(room: RoomBoxes, statistics: BoxStatistics) -> Tensor:
    """Normalised (n + 2, 8) boxes of a room's objects, its floor and its `_scene_` node (SPEC: section 1.3)."""
    angle = torch.tensor(-1.0)
    scene = torch.cat([torch.tensor(SCENE_BOX), torch.stack([angle.sin(), angle.cos()])])
    return torch.cat([_with_floor(room).encode(statistics.scale()), scene[None]])


def box_bounds(rooms: RoomSet | PublishedRooms) -> BoxStatistics:
    """Lowest and highest sizes and positions of a set's first rooms, floors included, as the published bounds file."""
    every = Boxes.cat([_with_floor(rooms.room(number)) for number in range(min(2000, len(rooms)))])
    ends = (end for part in (every.size, every.position) for end in (part.amin(0), part.amax(0)))
    low, high, start, stop = (tuple(end.tolist()) for end in ends)
    return BoxStatistics(low, high, start, stop)


def _with_floor(room: RoomBoxes) -> Boxes:
    """A room's objects and its floor, a box without a height."""
    x, z = torch.as_tensor(room.floor_polygon.max(0) - room.floor_polygon.min(0), dtype=torch.float32).tolist()
    floor = Boxes(torch.tensor([[x, 0.0, z]]), torch.zeros(1, 3), torch.zeros(1))
    return Boxes.cat([room.boxes(), floor])


def opened_data(recipe: Recipe) -> tuple[RoomSet | PublishedRooms, ShapeSet | PublishedShapes]:
    """The recipe's rooms and shapes; `data` may be a folder of SG-FRONT. Raises ValueError for what is not there."""
    folder = Path(recipe.data)
    if not (folder / "classes_all.txt").is_file():
        return RoomSet(data_folder(recipe, "rooms")), ShapeSet(data_folder(recipe, "shapes"))
    shapes = ShapeSet(folder / "shapes") if (folder / "shapes").is_dir() else PublishedShapes(folder)
    return PublishedRooms(folder), shapes


def grids_of(shapes: ShapeSet | PublishedShapes, numbers: np.ndarray, side: int) -> Tensor:
    """(K, 1, side, side, side) float32 distances of some shapes in the published frame."""
    if isinstance(shapes, PublishedShapes):
        return shapes.published(numbers, side)
    return published_grids(torch.from_numpy(shapes.tsdf(numbers)), side)


def paper_model(settings: Mapping[str, Any], start: tuple[str, ...] = ()) -> PaperModel:
    """The `paper` preset, with the autoencoder (or everything that fits) of earlier runs.

    Raises ValueError where a file of `start` was trained with other sizes.
    """
    classes = vocabulary().coarse_categories
    model = PaperModel(paper(len(classes), settings), classes=classes)
    for path in start:
        released = load_released(path)
        if getattr(released, "config", None) != model.config:
            raise ValueError(f"{path}: was not trained with the sizes in the recipe's [paper]")
        model.load_state_dict(released.state_dict())
        model.statistics = getattr(released, "statistics", None)
    return model


def text_encoder(source: str, width: int) -> TextEncoder:
    """The encoder that a recipe's `text` names: `clip`, a CLIP weights file, or `random`; cached on disk."""
    if source == "random":
        return CachedTextEncoder(RandomTextEncoder(width))
    encoder = CachedTextEncoder(ClipTextEncoder(None if source == "clip" else source))
    if encoder.width != width:
        raise ValueError(f"recipe field 'paper.text' is {width}, CLIP's features have {encoder.width} numbers")
    return encoder


def opened(
    recipe: Recipe, folder: Path, device: torch.device, *, resume: bool = False, report: Report | None = None
) -> Trainer:
    """The trainer of a recipe of the stages `paper` and `paper_vqvae`; raises ValueError as `open_run` does."""
    autoencoder = recipe.stage == "paper_vqvae"
    if not autoencoder and not recipe.start and not resume:
        raise ValueError("recipe field 'start': stage 'paper' needs the weights of a 'paper_vqvae' run")
    rooms, shapes = opened_data(recipe)
    model = paper_model(recipe.paper, recipe.start)
    if model.statistics is None:
        model.statistics = box_bounds(rooms)
    text = text_encoder(recipe.text, model.encoder_config.text)
    model.text_encoder = text.name  # every weights file says by whom its words were read
    stage = PaperStage(
        rooms, shapes, text, scenes=recipe.scenes, budget=recipe.shapes_per_batch, autoencoder=autoencoder
    )
    return Trainer(recipe, model.to(device), stage, folder, resume=resume, report=report)


def _labels(room: RoomBoxes) -> list[str]:
    words = vocabulary()
    return [words.categories[words.category_id(name)].coarse for name in room.categories]
