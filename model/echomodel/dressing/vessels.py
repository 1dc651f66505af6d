"""What is turned or thrown: vases with branches, bowls with fruit, candles, cups, plates, glasses, trays, baskets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from echomodel.furniture.carpentry import Size, box
from echomodel.furniture.solids import FINEST, Array, Solid, ball, loft, rotation, superellipse, tube


@dataclass(frozen=True, eq=False)
class Lathe(Solid):
    """A solid of revolution about +Y: `profile` (k, 2) float holds radius and height from rim to rim, metres.

    A profile that comes back down inside makes a vessel.
    """

    profile: Array = field(default_factory=lambda: np.array([[1.0, 0.0], [1.0, 1.0]]))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        circle = superellipse(2.0, (8, 10, 14, 20)[detail])
        return loft([np.insert(circle * max(radius, 1e-4), 1, height, axis=1) for radius, height in self.profile])


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


SHAPES = (
    [0.55, 0.95, 1.0, 0.85, 0.5, 0.42, 0.5],
    [0.5, 0.75, 0.95, 1.0, 0.9, 0.6, 0.38, 0.42],
    [0.8, 0.85, 0.9, 0.95, 1.0],
    [0.6, 1.0, 0.8, 0.45, 0.35, 0.35, 0.4],
)


def vase(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A vase alone."""
    return [vessel(_outline(SHAPES[int(rng.integers(len(SHAPES)))], size), 0.006, "ceramic", 0.05)]


def flowers(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A vase with branches."""
    w, h, d = size
    body = np.array([w * 0.5, h * 0.42, d * 0.5])
    parts: list[Solid] = [vessel(_outline(SHAPES[int(rng.integers(2))], body), 0.006, "ceramic", 0.05)]
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
    """Leaves on arching stems in a pot."""
    w, h, d = size
    pot_h, pot_r = h * 0.36, min(w, d) * 0.27
    pot = vessel(_outline([0.78, 0.9, 1.0], np.array([2 * pot_r, pot_h, 2 * pot_r])), 0.006, "ceramic", 0.8)
    parts: list[Solid] = [pot, Lathe(profile=np.array([[pot_r * 0.9, pot_h * 0.7], [pot_r * 0.9, pot_h * 0.9]]),
                                     material="soil")]  # fmt: skip
    count = int(rng.integers(10, 15))
    for number in range(count):
        yaw = 2 * np.pi * 0.382 * number
        share = (number + 1) / count
        length = (h - pot_h) * (0.35 + 0.35 * share)
        lift = 0.35 + 0.9 * share
        out = np.array([np.sin(yaw) * np.cos(lift), np.sin(lift), np.cos(yaw) * np.cos(lift)])
        root = np.array([0, pot_h * 0.85, 0])
        turn = rotation(y=yaw) @ rotation(x=-lift)
        half = np.array([0.2 * length, 0.035 * length, 0.55 * length])
        parts.append(ball(root + out * length * 0.75, half, "leaf", turn=turn))
    return parts


def bowl(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A wide bowl, often with fruit in it."""
    w, h, d = size
    rim = h if rng.random() < 0.35 else h * 0.78
    parts: list[Solid] = [vessel(_outline([0.42, 0.62, 0.84, 0.95, 1.0], np.array([w, rim, d])), 0.006, "ceramic")]
    if rim < h:
        radius = min(w, d) * 0.15
        for number in range(5):
            away = 0.0 if number == 4 else 0.19 * min(w, d)
            yaw = 2 * np.pi * number / 4 + rng.uniform(0, 0.4)
            level = h - radius if number == 4 else rim - radius * 0.6
            centre = np.array([np.sin(yaw) * away, level, np.cos(yaw) * away])
            parts.append(ball(centre, np.full(3, radius) * (1, 0.93, 1), "fruit"))
    return parts


def candles(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Two or three candles of different heights, side by side."""
    w, h, d = size
    count = 3 if w > 0.16 else 2
    radius = min(w / count, d) / 2 * 0.92
    parts: list[Solid] = []
    for number, share in enumerate(rng.permutation([1.0, 0.72, 0.5])[:count]):
        x = (number - (count - 1) / 2) * w / count
        tall = h * share - 0.012
        disc = np.array([[radius, 0.0], [radius, tall - 0.004], [radius - 0.003, tall]])
        parts.append(Lathe(centre=np.array([x, 0.0, 0.0]), profile=disc, material="wax"))
        parts.append(tube([[x, tall - 0.003, 0], [x + 0.002, tall + 0.012, 0]], 0.0012, "soil"))
    return parts


def cup(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A mug with a handle, coffee in it."""
    w, h, d = size
    radius = d / 2
    centre = -(w - d) / 2
    body = vessel(_outline([0.86, 0.95, 1.0, 1.0], np.array([d, h, d])), 0.004, "ceramic")
    turn = np.linspace(-np.pi / 2, np.pi / 2, 7)
    loop = np.stack([radius * 0.95 + (w - d) * np.cos(turn), h * (0.52 + 0.3 * np.sin(turn)), 0 * turn], 1)
    coffee = Lathe(profile=np.array([[radius * 0.92, h * 0.5], [radius * 0.92, h * 0.78]]), material="soil")
    parts = [body, tube(loop, 0.0045, "ceramic"), coffee]
    return [_moved(part, (centre, 0, 0)) for part in parts]


def plate(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A dinner plate with a smaller one on it."""
    w, h, _ = size
    r = w / 2
    large = np.array([[r * 0.6, 0], [r, h * 0.55], [r, h * 0.62], [r * 0.66, h * 0.2], [r * 0.1, h * 0.2]])
    small = large * (0.72, 1.0) + (0, h * 0.38)
    return [Lathe(profile=large, material="ceramic"), Lathe(profile=small, material="ceramic")]


def glass(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A drinking glass."""
    return [vessel(_outline([0.82, 0.9, 1.0], size), 0.003, "glass", 0.08)]


def tray(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A flat tray with a rim."""
    w, h, d = size
    t = 0.008
    return [
        box((-w / 2, 0, -d / 2), (w / 2, t, d / 2), "frame", 0.002),
        box((-w / 2, 0, -d / 2), (-w / 2 + t, h, d / 2), "frame", 0.002),
        box((w / 2 - t, 0, -d / 2), (w / 2, h, d / 2), "frame", 0.002),
        box((-w / 2, 0, -d / 2), (w / 2, h, -d / 2 + t), "frame", 0.002),
        box((-w / 2, 0, d / 2 - t), (w / 2, h, d / 2), "frame", 0.002),
    ]


def basket(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A woven basket with a blanket in it."""
    w, h, d = size
    parts: list[Solid] = [vessel(_outline([0.8, 0.95, 1.0, 0.97], np.array([w, h * 0.9, d])), 0.012, "wicker")]
    for x, z, tall in ((-0.1, 0.06, 1.0), (0.12, -0.05, 0.94)):
        half = np.array([w * 0.24, h * 0.22, d * 0.26])
        centre = np.array([x * w, h * tall - half[1], z * d])
        parts.append(ball(centre, half, "accent_cloth", power=2.6))
    return parts


def _moved(part: Solid, by: tuple[float, float, float]) -> Solid:
    from dataclasses import replace

    return replace(part, centre=part.centre + np.array(by))


def plates(size: Size, rng: np.random.Generator) -> list[Solid]:
    """A pile of plates, a bowl or two on top."""
    w, h, d = size
    count = max(2, int(h * 0.6 / 0.012))
    one, top = vessel(_outline([0.55, 0.7, 0.95, 1.0], np.array([w, 0.016, d])), 0.004, "enamel", 0.25), 0.012 * count
    cups = vessel(_outline([0.42, 0.7, 0.9, 1.0], np.array([0.6 * w, h - top, 0.6 * d])), 0.005, "ceramic")
    return [*(_moved(one, (0.0, 0.012 * number, 0.0)) for number in range(count)), _moved(cups, (0.0, top, 0.0))]


def bottles(size: Size, rng: np.random.Generator) -> list[Solid]:
    """Oil, vinegar and salt, or soap and cream: three vessels of different heights."""
    w, h, d = size
    parts: list[Solid] = []
    for number, (tall, material) in enumerate(zip((1.0, 0.78, 0.45), rng.permutation(["glass", "leather", "enamel"]),
                                                  strict=True)):  # fmt: skip
        radius = min(w / 3, d) / 2 * 0.92
        outline = np.array([[radius, 0.0], [radius, 0.62 * tall * h], [0.4 * radius, 0.78 * tall * h],
                            [0.4 * radius, tall * h]])  # fmt: skip
        centre = np.array([(number - 1) * w / 3, 0.0, 0.0])
        parts.append(Lathe(centre=centre, profile=outline, material=str(material)))
    return parts
