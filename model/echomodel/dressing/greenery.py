"""What grows in pots and stands in vases, and the vessels: of pottery, turned on a wheel."""

import numpy as np

from echomodel.furniture.carpentry import Size
from echomodel.furniture.solids import Lathe, Solid, ball, rotation, tube
from echomodel.late import Late

grown, species = Late("echomodel.furniture.plants:grown"), Late("echomodel.furniture.plants:species")


def vessel(outer: np.ndarray, wall: float, material: str, inside: float = 0.1) -> Lathe:
    """A vessel whose outer side is `outer` (k, 2): radius and height from the foot to the rim."""
    top = outer[-1, 1]
    inner = outer[outer[:, 1] > inside * top][::-1] - (wall, 0.0)
    foot = np.array([[max(inner[-1, 0] * 0.6, 1e-3), inside * top]])
    return Lathe(profile=np.concatenate([outer, inner, foot]), material=material)


def _outline(radii: list[float], size: Size) -> np.ndarray:
    heights = np.linspace(0, 1, len(radii))
    fine = np.linspace(0, 1, 9)
    return np.stack([np.interp(fine, heights, radii) * min(size[0], size[2]) / 2, fine * size[1]], 1)


SHAPES = ([0.55, 0.95, 1.0, 0.85, 0.5, 0.42, 0.5], [0.5, 0.75, 0.95, 1.0, 0.9, 0.6, 0.38, 0.42])
POTS = ([0.78, 0.9, 1.0], [0.95, 1.0, 1.0], [0.7, 1.0, 0.92], [0.6, 0.95, 1.0, 0.86], [1.0, 0.86, 0.8])
POTTERY = ("ceramic", "ceramic", "enamel", "wicker", "soil", "metal")


def flowers(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A vase with branches."""
    w, h, d = size
    body = np.array([w * 0.5, h * 0.42, d * 0.5])
    parts: list[Solid] = [vessel(_outline(SHAPES[int(rng.integers(len(SHAPES)))], body), 0.006, "ceramic", 0.05)]
    count = int(rng.integers(5, 8))
    for number in range(count):
        yaw = 2 * np.pi * (number + rng.uniform(-0.2, 0.2)) / count
        reach = min(w, d) / 2 * rng.uniform(0.45, 0.9)
        tall = h * rng.uniform(0.78, 0.97)
        tip = np.array([np.sin(yaw) * reach, tall, np.cos(yaw) * reach])
        knee = np.array([tip[0] * 0.35, h * 0.62, tip[2] * 0.35])
        parts.append(tube([[0, h * 0.1, 0], knee, tip], 0.0022, "stem"))
        for at in (0.55, 0.75, 0.92):
            place = knee + (tip - knee) * at
            lean = rotation(y=yaw + rng.uniform(-1.2, 1.2)) @ rotation(x=-rng.uniform(0.2, 0.9))
            half = np.array([0.014, 0.003, 0.026]) * rng.uniform(0.8, 1.2)
            parts.append(ball(place + lean @ (0, 0, 0.022), half, "leaf", turn=lean))
        parts.append(ball(tip, 0.014 * rng.uniform(0.8, 1.3), "petal"))
    return parts


def small_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A plant of a table in a pot."""
    return _potted(size, str(rng.choice(species("table"))), rng.uniform(0.3, 0.42) * size[1], 0.27, rng)


def _potted(size: Size, kind: str, tall: float, share: float, rng: np.random.Generator) -> list[Solid]:
    """A species in a pot that is `tall` metres high and whose rim's radius is a share of the plant's width."""
    radius = share * min(size[0], size[2])
    shape = POTS[int(rng.integers(len(POTS)))]
    pot = vessel(_outline(shape, np.array([2 * radius, tall, 2 * radius])), 0.006, str(rng.choice(POTTERY)), 0.8)
    soil = Lathe(
        profile=np.array([[0.9 * radius * shape[-1], 0.7 * tall], [0.9 * radius * shape[-1], 0.9 * tall]]),
        material="soil",
    )
    return [pot, soil, *grown(kind, 0.88 * tall, size, radius, rng)]


def floor_plant(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A tall plant in a pot."""
    return _potted(size, str(rng.choice(species("floor"))), float(np.clip(0.24 * size[1], 0.2, 0.34)), 0.3, rng)
