"""From a recipe to a trainer: opens the data, builds the model and the stage."""

from __future__ import annotations

import os
from pathlib import Path

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import PARTS, CompactModel, load_weights
from echomodel.training.autoencoder_stage import AutoencoderStage
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.shape_stage import ShapeStage
from echomodel.training.shapes import ShapeGrids, encoded_set
from echomodel.training.trainer import Report, Trainer, TrainingStage

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
    model = CompactModel(recipe.model, _NO_BOXES, _PARTS[recipe.stage])
    started: tuple[str, ...] = ()
    for path in recipe.start:
        given, _ = load_weights([Path(path)])
        started += given.parts
        for part in set(given.parts) & set(model.parts):
            getattr(model, part).load_state_dict(getattr(given, part).state_dict())
        if "layout" in given.parts:
            model.statistics = given.statistics
    stage = _stage(recipe, model, started)
    return Trainer(recipe, model, stage, folder, resume=resume, report=report)


def _stage(recipe: Recipe, model: CompactModel, started: tuple[str, ...]) -> TrainingStage:
    if recipe.stage == "layout":
        rooms, held_rooms = (PackedRooms.load(_file(recipe, name)) for name in ("rooms", "held_rooms"))
        if "layout" not in started:
            model.statistics = BoxStatistics.from_boxes(rooms.boxes)
        return LayoutStage(rooms, held_rooms, recipe.nodes, recipe.relation_weight, recipe.frozen)
    shapes, held = (ShapeGrids.open(_file(recipe, name), recipe.model.categories) for name in ("shapes", "held_shapes"))
    if recipe.stage == "vqvae":
        stage = AutoencoderStage(shapes, held, recipe.shapes_per_batch)
        if "autoencoder" not in started:
            stage.initialise(model, torch.Generator().manual_seed(recipe.seed))
        return stage
    missing = [part for part in ("latent", "autoencoder") if part not in started]
    if missing:
        raise ValueError(f"recipe field 'start': stage 'shape' needs weights with {' and '.join(missing)}")
    rooms = PackedRooms.load(_file(recipe, "rooms"))
    coded, held_coded = (encoded_set(model.autoencoder, grids) for grids in (shapes, held))
    return ShapeStage(rooms, coded, held_coded, recipe.shapes_per_batch)


_PARTS = {
    "layout": ("latent", "layout"),
    "vqvae": ("autoencoder",),
    "shape": ("latent", "autoencoder", "shape"),
    "joint": PARTS,
}


def _file(recipe: Recipe, field: str) -> Path:
    name = getattr(recipe, field)
    if not name:
        raise ValueError(f"recipe field {field!r} is empty, stage {recipe.stage!r} needs a file")
    path = Path(name)
    if not path.exists():
        raise ValueError(f"recipe field {field!r}: {path} does not exist")
    return path
