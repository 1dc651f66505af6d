"""From a recipe to a trainer: opens the data, builds the model and the stage."""

from __future__ import annotations

from pathlib import Path

import torch

from echomodel.late import Late
from echomodel.training.recipe import Recipe
from echomodel.training.start import CompactStage, started
from echomodel.training.trainer import Report, Trainer

# the stages of the compact model, as recipes name them: a layout needs none of the libraries of shapes
STAGES = {
    "layout": Late("echomodel.training.layout_stage:LayoutStage"),
    "vqvae": Late("echomodel.training.shape_stage:AutoencoderStage"),
    "shape": Late("echomodel.training.shape_stage:ShapeStage"),
    "parts": Late("echomodel.training.parts_stage:PartsStage"),
}
# those of other models -> the module whose `opened` makes their trainer
ELSEWHERE = dict.fromkeys(("paper", "paper_vqvae"), Late("echoscene.training:opened"))


def open_run(recipe: Recipe, folder: Path, *, resume: bool = False, report: Report | None = None) -> Trainer:
    """The trainer of a recipe, ready to `run`.

    Arguments:
        recipe: what to train; its paths must exist.
        folder: where the run lives.
        resume: continue from the folder's checkpoint.
        report: called with (step, values).

    Raises ValueError for a file that the stage needs is not named or does not exist, or the checkpoint does not fit.
    """
    if recipe.threads:
        torch.set_num_threads(recipe.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    torch.manual_seed(recipe.seed)
    if recipe.stage in ELSEWHERE:
        return ELSEWHERE[recipe.stage](recipe, folder, device, resume=resume, report=report)
    kind: type[CompactStage] = STAGES[recipe.stage].itself
    start = started(kind, recipe, device, resume=resume)
    return Trainer(recipe, start.model, kind.open(start), folder, resume=resume, report=report)
