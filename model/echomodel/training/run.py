"""From a recipe to a trainer: opens the data, builds the model and the stage."""

from __future__ import annotations

import os
from pathlib import Path

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import PARTS, CompactModel, load_weights
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.trainer import Report, Trainer, TrainingStage


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
    stage, statistics = _stage(recipe)
    torch.manual_seed(recipe.seed)
    parts = [part for part in PARTS if part in stage.trained or part in _needed(recipe)]
    model = CompactModel(recipe.model, statistics, parts)
    if recipe.start:
        given, _ = load_weights([Path(path) for path in recipe.start])
        for part in given.parts:
            if part in model.parts:
                getattr(model, part).load_state_dict(getattr(given, part).state_dict())
        model.statistics = given.statistics
    return Trainer(recipe, model, stage, folder, resume=resume, report=report)


def _stage(recipe: Recipe) -> tuple[TrainingStage, BoxStatistics]:
    if recipe.stage == "layout":
        rooms, held = PackedRooms.load(_file(recipe, "rooms")), PackedRooms.load(_file(recipe, "held_rooms"))
        return LayoutStage(rooms, held, recipe.nodes, recipe.relation_weight), BoxStatistics.from_boxes(rooms.boxes)
    raise ValueError(f"stage {recipe.stage!r} is not available")


def _needed(recipe: Recipe) -> tuple[str, ...]:
    return {"layout": (), "vqvae": (), "shape": ("latent", "autoencoder"), "joint": ("autoencoder",)}[recipe.stage]


def _file(recipe: Recipe, field: str) -> Path:
    name = getattr(recipe, field)
    if not name:
        raise ValueError(f"recipe field {field!r} is empty, stage {recipe.stage!r} needs a file")
    path = Path(name)
    if not path.exists():
        raise ValueError(f"recipe field {field!r}: {path} does not exist")
    return path
