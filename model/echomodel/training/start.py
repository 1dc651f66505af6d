"""Where a training starts: the model that its stage builds, what earlier runs gave it, and its data."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Protocol

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import WORDS, CompactModel, load_weights, read_header, words_of
from echomodel.compact.shape import ShapeDenoiser
from echomodel.config import CompactConfig
from echomodel.data.roomset import RoomSet
from echomodel.data.shapeset import ShapeSet
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.trainer import TrainingStage
from echomodel.training.warm import warm_start

_NO_BOXES = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)


@dataclass(frozen=True, eq=False)
class Start:
    """What a stage is opened with.

    Arguments:
        recipe: what to train; its paths must exist.
        model: the stage's parts, with the tensors of earlier runs.
        given: parts that the files of `start` and `warm` held.
        resume: whether a checkpoint will replace the tensors.
        components: shape branch that a file of `start` held, None = none did.
    """

    recipe: Recipe
    model: CompactModel
    given: tuple[str, ...] = ()
    resume: bool = False
    components: ShapeDenoiser | None = None

    @property
    def generator(self) -> torch.Generator:
        """The source of what is initialised from data, the same every time."""
        return torch.Generator().manual_seed(self.recipe.seed)

    def rooms(self, *, held: bool) -> PackedRooms:
        """The recipe's rooms to train on, or those that are held out."""
        return PackedRooms.from_set(RoomSet(data_folder(self.recipe, "rooms")), self.model.config.rules, held=held)

    def shapes(self) -> ShapeSet:
        """The recipe's shapes."""
        return ShapeSet(data_folder(self.recipe, "shapes"))


class CompactStage(TrainingStage, Protocol):
    """A training stage of the compact model, as a recipe names it: the parts it builds, and those it must be given."""

    parts: ClassVar[tuple[str, ...]]
    needs: ClassVar[tuple[str, ...]]

    @classmethod
    def open(cls, start: Start) -> CompactStage:
        """The stage of a recipe, with its data; may initialise what the model was not given.

        Raises ValueError for a field of the recipe that is missing or wrong.
        """
        ...


def started(kind: type[CompactStage], recipe: Recipe, device: torch.device, *, resume: bool) -> Start:
    """The parts that a stage builds, on a device, with what the recipe's files hold of them.

    Raises ValueError where a part that the stage needs is in none of the files.
    """
    model = CompactModel(_in_words(recipe), _NO_BOXES, kind.parts).to(device)
    found: tuple[str, ...] = ()
    components = None
    for path in recipe.start:
        given, _ = load_weights([Path(path)])
        found += given.parts
        components = given.shape.to(device) if "shape" in given.parts else components
        for part in set(given.parts) & set(model.parts):
            model.get_submodule(part).load_state_dict(given.get_submodule(part).state_dict())
        if "layout" in given.parts:
            model.statistics = given.statistics
    for path in recipe.warm:
        found += warm_start(model, Path(path))
    missing = [part for part in kind.needs if part not in found]
    if missing:
        raise ValueError(f"recipe field 'start': stage {recipe.stage!r} needs weights with {' and '.join(missing)}")
    return Start(recipe, model, found, resume, components)


def _in_words(recipe: Recipe) -> CompactConfig:
    """The recipe's model in the words of the file that it begins with; to a warm one's come those it does not know."""
    config = recipe.model
    if recipe.start:
        given = load_weights([Path(recipe.start[0])])[0].config
        return replace(config, **{kind: getattr(given, kind) for kind in WORDS})
    if not recipe.warm:
        return config
    named = words_of(Path(recipe.warm[0]), read_header(Path(recipe.warm[0])))
    new = {kind: tuple(name for name in getattr(config, kind) if name not in named[kind]) for kind in WORDS}
    if new["predicates"]:
        raise ValueError(f"{recipe.warm[0]}: knows no relation {new['predicates'][0]!r}, which networks learn today")
    grown: dict[str, Any] = {kind: named[kind] + new[kind] for kind in WORDS}
    return replace(config, **grown)


def data_folder(recipe: Recipe, part: str) -> Path:
    """The folder of the recipe's data that holds `part`; raises ValueError where the recipe names none."""
    if not recipe.data:
        raise ValueError(f"recipe field 'data' is empty, stage {recipe.stage!r} needs a folder of `echousd data build`")
    return Path(recipe.data) / part
