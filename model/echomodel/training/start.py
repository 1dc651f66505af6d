"""What a stage of the compact model is opened with: its recipe, its model and its data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol

import torch

from echomodel.compact.model import CompactModel
from echomodel.compact.shape import ShapeDenoiser
from echomodel.compact.weights import read_header, words_of
from echomodel.data.roomset import RoomSet
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.trainer import TrainingStage

if TYPE_CHECKING:
    from echomodel.data.shapeset import ShapeSet


@dataclass(frozen=True, eq=False)
class Start:
    """What a stage is opened with.

    Arguments:
        recipe: what to train; its paths must exist.
        model: the stage's parts, with the tensors of earlier runs.
        loaded: parts that the files of `start` and `warm` held.
        resume: whether a checkpoint will replace the tensors.
        components: shape branch that a file of `start` held, None = none did.
    """

    recipe: Recipe
    model: CompactModel
    loaded: tuple[str, ...] = ()
    resume: bool = False
    components: ShapeDenoiser | None = None

    @property
    def generator(self) -> torch.Generator:
        """The source of what is initialised from data, the same every time."""
        return torch.Generator().manual_seed(self.recipe.seed)

    @property
    def known_categories(self) -> int:
        """How many of the model's categories, the first, the file that the recipe begins with knows."""
        return len(known_words(self.recipe).get("categories", self.model.config.categories))

    def rooms(self, *, held: bool) -> PackedRooms:
        """The recipe's rooms to train on, or those that are held out."""
        return PackedRooms.from_set(RoomSet(data_folder(self.recipe, "rooms")), self.model.config.rules, held=held)

    def shapes(self) -> ShapeSet:
        """The recipe's shapes."""
        from echomodel.data.shapeset import ShapeSet

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


def known_words(recipe: Recipe) -> dict[str, tuple[str, ...]]:
    """Words of every kind that the first file of `warm` knows; none where there is no such file."""
    return next((words_of(file, read_header(file)) for file in recipe.warm_files), {})


def data_folder(recipe: Recipe, part: str) -> Path:
    """The folder of the recipe's data that holds `part`; raises ValueError where the recipe names none that exists."""
    if not recipe.data or not Path(recipe.data).exists():
        fault = f"names {recipe.data}, which does not exist" if recipe.data else "is empty"
        raise ValueError(f"recipe field 'data' {fault}; stage {recipe.stage!r} needs a folder of `echousd data build`")
    return Path(recipe.data) if part == "rooms" and Path(recipe.data).is_file() else Path(recipe.data) / part
