"""What grows in pots, and those: of pottery, turned on a wheel."""

import numpy as np

from echomodel.furniture.carpentry import Size
from echomodel.furniture.solids import Lathe, Solid
from echomodel.late import Late

grown, species = Late("echomodel.furniture.plants:grown"), Late("echomodel.furniture.plants:species")
POTS = ([0.78, 0.9, 1.0], [0.95, 1.0, 1.0], [0.7, 1.0, 0.92], [0.6, 0.95, 1.0, 0.86], [1.0, 0.86, 0.8])
POTTERY = ("ceramic", "ceramic", "enamel", "wicker", "soil", "metal")


def small_plant(size: Size, rng: np.random.Generator, share: float = 0.27, where: str = "table") -> list[Solid]:
    """A plant in a pot whose rim's radius is a share of its width, of a species that stands on a table or the floor."""
    kind, radius, floor = str(rng.choice(species(where))), share * min(size[0], size[2]), where == "floor"
    tall = float(np.clip(0.24 * size[1], 0.2, 0.34)) if floor else rng.uniform(0.3, 0.42) * size[1]
    shape, heights = POTS[int(rng.integers(len(POTS)))], np.linspace(0, 1, 9)
    outer = np.stack([radius * np.interp(heights, np.linspace(0, 1, len(shape)), shape), tall * heights], 1)
    inner = outer[heights > 0.8][::-1] - (0.006, 0.0)
    foot = np.array([[0.6 * inner[-1, 0], 0.8 * tall]])
    pot = Lathe(profile=np.concatenate([outer, inner, foot]), material=str(rng.choice(POTTERY)), role="pot")
    soil = Lathe(profile=np.array([[0.9 * radius * shape[-1], at * tall] for at in (0.7, 0.9)]), material="soil")
    return [pot, soil, *grown(kind, 0.88 * tall, size, radius, rng)]
