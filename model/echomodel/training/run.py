"""From a recipe to a trainer: opens the data, builds the model and the stage."""

from __future__ import annotations

import os
from pathlib import Path

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel, load_weights
from echomodel.compact.shape import ShapeDenoiser
from echomodel.data.roomset import RoomSet
from echomodel.data.shapeset import ShapeSet
from echomodel.training.autoencoder_stage import AutoencoderStage
from echomodel.training.joint_stage import JointStage
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.paper_stage import PaperStage, box_bounds, paper_model, text_encoder
from echomodel.training.parts_stage import PartsStage
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.shape_stage import ShapeStage
from echomodel.training.shapes import encoded_set
from echomodel.training.trainer import Report, Trainer, TrainingStage
from echomodel.training.warm import warm_start

_NO_BOXES = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)


def open_run(recipe: Recipe, folder: Path, *, resume: bool = False, report: Report | None = None) -> Trainer:
    """The trainer of a recipe, ready to `run`.

    Arguments:
        recipe: what to train; its paths must exist.
        folder: where the run lives.
        resume: continue from the folder's checkpoint.
        report: called with (step, values).

    Raises:
        ValueError: a file that the stage needs is not named or does not exist, or the checkpoint does not fit.
    """
    if recipe.threads:
        torch.set_num_threads(recipe.threads)
    if int(os.environ.get("WORLD_SIZE", 1)) > 1 and not torch.distributed.is_initialized():
        torch.distributed.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    torch.manual_seed(recipe.seed)
    if recipe.stage in ("paper", "paper_vqvae"):
        return _open_paper(recipe, folder, resume, report)
    model = CompactModel(recipe.model, _NO_BOXES, _PARTS[recipe.stage])
    started: tuple[str, ...] = ()
    components = None
    for path in recipe.start:
        given, _ = load_weights([Path(path)])
        started += given.parts
        components = given.shape if "shape" in given.parts else components
        for part in set(given.parts) & set(model.parts):
            getattr(model, part).load_state_dict(getattr(given, part).state_dict())
        if "layout" in given.parts:
            model.statistics = given.statistics
    for path in recipe.warm:
        started += warm_start(model, Path(path))
    stage = _stage(recipe, model, started, resume, components)
    return Trainer(recipe, model, stage, folder, resume=resume, report=report)


def _open_paper(recipe: Recipe, folder: Path, resume: bool, report: Report | None) -> Trainer:
    autoencoder = recipe.stage == "paper_vqvae"
    if not autoencoder and not recipe.start and not resume:
        raise ValueError("recipe field 'start': stage 'paper' needs the weights of a 'paper_vqvae' run")
    rooms, shapes = RoomSet(_folder(recipe, "rooms")), ShapeSet(_folder(recipe, "shapes"))
    model = paper_model(recipe.paper, recipe.start)
    if model.statistics is None:
        model.statistics = box_bounds(rooms)
    text = text_encoder(recipe.text, recipe.paper.text)
    model.text_encoder = text.name  # every weights file says by whom its words were read
    stage = PaperStage(
        rooms, shapes, text, scenes=recipe.scenes, budget=recipe.shapes_per_batch, autoencoder=autoencoder
    )
    return Trainer(recipe, model, stage, folder, resume=resume, report=report)


def _stage(
    recipe: Recipe, model: CompactModel, started: tuple[str, ...], resume: bool, components: ShapeDenoiser | None
) -> TrainingStage:
    if recipe.stage == "layout":
        return _layout_stage(recipe, model, started)
    if recipe.stage == "parts":
        if "latent" not in started:
            raise ValueError("recipe field 'start': stage 'parts' needs weights with latent")
        return PartsStage(_rooms(recipe, model, held=False), recipe.nodes)
    shapes = ShapeSet(_folder(recipe, "shapes"))
    if recipe.stage == "vqvae":
        stage = AutoencoderStage(shapes, recipe.shapes_per_batch, components)
        if "autoencoder" not in started:
            stage.initialise(model, torch.Generator().manual_seed(recipe.seed))
        return stage
    needed = ("autoencoder",) if recipe.stage == "joint" else ("latent", "autoencoder")
    missing = [part for part in needed if part not in started]
    if missing:
        raise ValueError(f"recipe field 'start': stage {recipe.stage!r} needs weights with {' and '.join(missing)}")
    layout = _layout_stage(recipe, model, started) if recipe.stage == "joint" else None
    rooms = _rooms(recipe, model, held=False) if layout is None else layout.rooms
    shape = ShapeStage(rooms, encoded_set(model.autoencoder, shapes), recipe.shapes_per_batch)
    if "shape" not in started and not resume:
        shape.initialise(model, torch.Generator().manual_seed(recipe.seed))
    return shape if layout is None else JointStage(layout, shape)


def _layout_stage(recipe: Recipe, model: CompactModel, started: tuple[str, ...]) -> LayoutStage:
    rooms, held = (_rooms(recipe, model, held=held) for held in (False, True))
    if "layout" not in started:
        model.statistics = BoxStatistics.from_boxes(rooms.boxes, rooms.category, recipe.model.categories)
    return LayoutStage(rooms, held, recipe.nodes, recipe.relation_weight, recipe.frozen, recipe.measure_weight)


def _rooms(recipe: Recipe, model: CompactModel, *, held: bool) -> PackedRooms:
    return PackedRooms.from_set(RoomSet(_folder(recipe, "rooms")), model.config.rules, held=held)


_PARTS = {
    "layout": ("latent", "layout"),
    "vqvae": ("autoencoder",),
    "shape": ("latent", "autoencoder", "shape"),
    "joint": ("latent", "layout", "autoencoder", "shape"),
    "parts": ("latent", "furniture"),
}


def _folder(recipe: Recipe, part: str) -> Path:
    if not recipe.data:
        raise ValueError(f"recipe field 'data' is empty, stage {recipe.stage!r} needs a folder of `echousd data build`")
    return Path(recipe.data) / part
