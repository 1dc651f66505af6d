"""From a recipe to a trainer: the model that its stage builds, and what earlier runs gave it."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel, load_weights, read_weights, restored
from echomodel.compact.modules import WordTable
from echomodel.compact.weights import WORDS, grown_tables, own_statistics, words_of
from echomodel.config import CompactConfig
from echomodel.files import check_ours
from echomodel.late import Late
from echomodel.training.recipe import Recipe
from echomodel.training.start import CompactStage, Start, known_words
from echomodel.training.trainer import Report, Trainer

_NO_BOXES = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)

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
    check_ours(folder, "run of echousd train", "log.csv", "checkpoint.safetensors")
    if recipe.threads:
        torch.set_num_threads(recipe.threads)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    torch.backends.cuda.matmul.allow_tf32 = True  # ten bits of a product of a GPU, eight times as fast
    torch.manual_seed(recipe.seed)
    if recipe.stage in ELSEWHERE:
        return ELSEWHERE[recipe.stage](recipe, folder, device, resume=resume, report=report)
    kind: type[CompactStage] = STAGES[recipe.stage].itself
    start = started(kind, recipe, device, resume=resume)
    if recipe.new_words:
        _keep_known(start)
    return Trainer(recipe, start.model, kind.open(start), folder, resume=resume, report=report)


def started(kind: type[CompactStage], recipe: Recipe, device: torch.device, *, resume: bool) -> Start:
    """The parts that a stage builds, on a device, with what the recipe's files hold of them.

    Raises ValueError where a part that the stage needs is in none of the files.
    """
    model = CompactModel(_in_words(recipe), _NO_BOXES, kind.parts).to(device)
    found: tuple[str, ...] = ()
    components = None
    for path in recipe.start:
        loaded, _ = load_weights([Path(path)])
        found += loaded.parts
        components = loaded.shape.to(device) if "shape" in loaded.parts else components
        for part in set(loaded.parts) & set(model.parts):
            model.get_submodule(part).load_state_dict(loaded.get_submodule(part).state_dict())
        if "layout" in loaded.parts:
            model.statistics = loaded.statistics
    for file in recipe.warm_files:
        found += warm_start(model, file)
    missing = [part for part in kind.needs if part not in found]
    if missing:
        raise ValueError(f"recipe field 'start': stage {recipe.stage!r} needs weights with {' and '.join(missing)}")
    return Start(recipe, model, found, resume, components)


def _keep_known(start: Start) -> None:
    """Of a model all but the words that its recipe's first file of `warm` does not know asks for no gradient."""
    recipe, known = start.recipe, known_words(start.recipe)
    if all(len(names) == len(getattr(start.model.config, kind)) for kind, names in known.items()):
        what = f"{recipe.warm[0]} knows all words" if known else "'warm' names no file whose words are known"
        raise ValueError(f"recipe field 'new_words': {what}")
    if recipe.optimizer.decay:
        raise ValueError("recipe field 'new_words': optimizer.decay would change known words, allowed: 0")
    start.model.requires_grad_(False)
    for table in (module for module in start.model.modules() if isinstance(module, WordTable)):
        new = torch.arange(len(table.names), device=table.weight.device)[:, None] >= len(known[table.kind])
        table.weight.requires_grad_(True).register_hook(partial(torch.mul, new))


def _in_words(recipe: Recipe) -> CompactConfig:
    """The recipe's model in the words of the file that it begins with; to a warm one's come those it does not know."""
    config = recipe.model
    if recipe.start:
        loaded = load_weights([Path(recipe.start[0])])[0].config
        return replace(config, **{kind: getattr(loaded, kind) for kind in WORDS})
    if not recipe.warm:
        return config
    named = known_words(recipe)
    new = {kind: tuple(name for name in getattr(config, kind) if name not in named[kind]) for kind in WORDS}
    if new["predicates"]:
        name, file = new["predicates"][0], recipe.warm_files[0]
        raise ValueError(f"{file}: knows no relation {name!r}, which networks learn today")
    grown: dict[str, Any] = {kind: named[kind] + new[kind] for kind in WORDS}
    return replace(config, **grown)


def warm_start(model: CompactModel, path: Path) -> tuple[str, ...]:
    """Take over the tensors of a weights file whose parts the model has, and its box statistics; returns the parts.

    A tensor that has grown keeps what it had in its first rows and columns and is zero elsewhere, so that the network
    starts out computing what the earlier one did; a tensor that the file does not hold stays as initialised.

    Raises ValueError where the file cannot be read, or a tensor of it is larger than the model's.
    """
    header, tensors = read_weights(path)
    own = model.state_dict()
    for key, value in grown_tables(restored(tensors), words_of(path, header), model.config).items():
        if key not in own:
            continue
        wanted = own[key]
        if value.ndim != wanted.ndim or any(a > b for a, b in zip(value.shape, wanted.shape, strict=True)):
            raise ValueError(f"{path}: {key} is {tuple(value.shape)}, the model's {tuple(wanted.shape)} cannot hold it")
        with torch.no_grad():
            if value.shape != wanted.shape:
                wanted.zero_()
            wanted[tuple(slice(0, size) for size in value.shape)] = value.to(wanted.dtype)
    parts = tuple(part for part in json.loads(header.get("parts", "[]")) if part in model.parts)
    if "layout" in parts:
        model.statistics = own_statistics({path: header}, model.config)
    return parts
