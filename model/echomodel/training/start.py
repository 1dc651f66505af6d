"""Where a training starts: the model that its stage builds, what earlier runs gave it, and its data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

import torch

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel, load_weights
from echomodel.compact.shape import ShapeDenoiser
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
    model = CompactModel(recipe.model, _NO_BOXES, kind.parts).to(device)
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


def data_folder(recipe: Recipe, part: str) -> Path:
    """The folder of the recipe's data that holds `part`; raises ValueError where the recipe names none."""
    if not recipe.data:
        raise ValueError(f"recipe field 'data' is empty, stage {recipe.stage!r} needs a folder of `echousd data build`")
    return Path(recipe.data) / part
