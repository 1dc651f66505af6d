"""What grows in pots, and those: of pottery, turned on a wheel."""

from functools import partial

import numpy as np

from echomodel.furniture.carpentry import Size
from echomodel.furniture.solids import Lathe, Solid
from echomodel.late import Late

grown, species = Late("echomodel.furniture.plants:grown"), Late("echomodel.furniture.plants:species")


POTS = ([0.78, 0.9, 1.0], [0.95, 1.0, 1.0], [0.7, 1.0, 0.92], [0.6, 0.95, 1.0, 0.86], [1.0, 0.86, 0.8])
POTTERY = ("ceramic", "ceramic", "enamel", "wicker", "soil", "metal")


def small_plant(size: Size, rng: np.random.Generator, share: float = 0.27) -> list[Solid]:
    """A plant of a table in a pot."""
    return _potted(size, str(rng.choice(species("table"))), rng.uniform(0.3, 0.42) * size[1], share, rng)


pot_plant = partial(small_plant, share=0.4)  # where there is no room for more than the pot


def _potted(size: Size, kind: str, tall: float, share: float, rng: np.random.Generator) -> list[Solid]:
    """A species in a pot that is `tall` metres high and whose rim's radius is a share of the plant's width."""
    radius = share * min(size[0], size[2])
    shape = POTS[int(rng.integers(len(POTS)))]
    heights = np.linspace(0, 1, 9)
    outer = np.stack([radius * np.interp(heights, np.linspace(0, 1, len(shape)), shape), tall * heights], 1)
    inner = outer[heights > 0.8][::-1] - (0.006, 0.0)
    foot = np.array([[0.6 * inner[-1, 0], 0.8 * tall]])
    pot = Lathe(profile=np.concatenate([outer, inner, foot]), material=str(rng.choice(POTTERY)))
    soil = Lathe(
        profile=np.array([[0.9 * radius * shape[-1], 0.7 * tall], [0.9 * radius * shape[-1], 0.9 * tall]]),
        material="soil",
    )
    return [pot, soil, *grown(kind, 0.88 * tall, size, radius, rng)]


def floor_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A tall plant in a pot."""
    return _potted(size, str(rng.choice(species("floor"))), float(np.clip(0.24 * size[1], 0.2, 0.34)), 0.3, rng)
