"""Plants above their pots: leaves as the rows of `plants.toml` have them."""

from typing import Any

import numpy as np

from echomodel.files import tables
from echomodel.furniture.bent import Blade
from echomodel.furniture.solids import Solid, ball, rotation, tube

SPECIES: dict[str, dict[str, Any]] = tables("plants.toml", __file__)
GOLDEN = 2 * np.pi * 0.382  # radians from leaf to leaf


def species(where: str) -> list[str]:
    """Those that stand on the `floor` or on a `table`."""
    return [name for name, row in SPECIES.items() if where in row["where"]]


def grown(name: str, soil: float, size: np.ndarray, pot: float, rng: np.random.Generator) -> list[Solid]:
    """A plant from the level of its soil up, within a box `size` (3,); `pot`: radius of its rim; all metres."""
    row, forms = SPECIES[name], (_rosette, _stems, _crowns, _tree)
    form = next(form for form in forms if form.__name__ == f"_{row['form']}")
    count, seed = int(rng.integers(*row["count"])), int(rng.integers(1 << 30))
    base, wanted = np.array([0.0, soil, 0.0]), np.array([size[0] / 2, size[1] - soil, size[2] / 2])
    reach, parts = wanted, []
    for _ in range(3):  # what grew too small or too large for its box grows once more
        parts = form(row, base, reach, count, pot, np.random.default_rng(seed))
        points = np.concatenate([part.mesh(0)[0] for part in parts])
        spread = np.ptp(points, axis=0) / 2
        reach = reach * (wanted / np.array([spread[0], max(points[:, 1].max() - soil, 0.01), spread[2]])).clip(0.6, 1.8)
    return parts


def _leaf(row: dict[str, Any], base: np.ndarray, yaw: float, lift: float, length: float) -> Blade:
    """A leaf that starts at `base`, points to `yaw` and rises by the angle `lift`, radians."""
    turn, thick = rotation(y=yaw) @ rotation(x=-lift), max(0.003, 0.012 * length)
    form = {"width": row["wide"] * length, "bend": row["bend"], "full": row["full"]}
    slot = row["leaf" if np.degrees(lift) < np.mean(row["lift"]) else "young"]
    return Blade(base, turn, slot, "leaf", length=length, thick=thick, **form)


def _lift(row: dict[str, Any], share: float, rng: np.random.Generator) -> float:
    """Radians above level of the leaf at a share of the way from the lowest to the highest."""
    low, high = np.radians(row["lift"])
    return float(low + (high - low) * np.clip(share + rng.uniform(-0.12, 0.12), 0, 1))


def _rosette(
    row: dict[str, Any], base: np.ndarray, reach: np.ndarray, count: int, pot: float, rng: np.random.Generator
) -> list[Solid]:
    """Leaves round one point, the inner ones upright."""
    parts: list[Solid] = []
    for i in range(count):
        yaw, share = GOLDEN * i + rng.uniform(-0.2, 0.2), i / count
        lift = _lift(row, share, rng)
        side = float(np.hypot(np.sin(yaw) * reach[0], np.cos(yaw) * reach[2]))
        most = min(side / max(np.cos(lift), 0.05), reach[1] / max(np.sin(lift), 0.05), float(reach.max()))
        length = row["length"] * most * rng.uniform(0.85, 1.0)
        out = np.array([np.sin(yaw), -0.1, np.cos(yaw)]) * min(0.4 * pot, 0.03) * (1 - share)
        parts.append(_leaf(row, base + out, yaw, lift, length))
        if "bloom" in row and i % 6 == 5:
            tip = base + np.array([0.3 * reach[0] * np.sin(yaw), 0.96 * reach[1], 0.3 * reach[2] * np.cos(yaw)])
            parts.append(tube([base, tip], 0.003, "leaf", "stem"))
            half = np.array([0.35, 1.0, 0.2]) * 0.09 * reach[1]
            parts.append(ball(tip - (0, half[1], 0), half, row["bloom"], "leaf", turn=rotation(y=yaw)))
    return parts


def _stems(
    row: dict[str, Any], base: np.ndarray, reach: np.ndarray, count: int, pot: float, rng: np.random.Generator
) -> list[Solid]:
    """Stems that lean outward, with a leaf at each end or leaves along them."""
    parts: list[Solid] = []
    for i in range(count):
        yaw, share = GOLDEN * i + rng.uniform(-0.2, 0.2), (i + 0.5) / count
        ahead = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
        length = row["length"] * min(reach[0], reach[2]) * rng.uniform(0.85, 1.05)
        alone = row["along"] == 1
        tall = reach[1] * (0.3 + 0.62 * share if alone else rng.uniform(0.72, 0.95))
        away = (0.5 - 0.2 * share if alone else row.get("away", 0.45) * rng.uniform(0.6, 1)) * (count > 1)
        if row["lift"][0] > 45:  # leaves go on where their stems end, as paddles do
            tall, length = reach[1] * rng.uniform(0.35, 0.55), min(length * 1.3, 0.5 * reach[1])
        foot = base + 0.35 * pot * ahead - (0, 0.02, 0)
        end = base + ahead * away * reach + (0, tall, 0)
        knee = 0.35 * foot + 0.65 * (end * (0.6, 1, 0.6)) - (0, 0.12 * tall, 0)
        line = np.array([foot, knee, end])
        thick = min(0.006 + 0.004 * (count < 4), 0.03 * float(reach.min()))
        parts.append(tube(line, thick, "stem" if count < 6 else "leaf", "stem"))
        for k in range(row["along"]):
            at = 1.0 if alone else 0.28 + 0.72 * k / (row["along"] - 1)
            place = foot + (knee - foot) * at / 0.55 if at < 0.55 else knee + (end - knee) * (at - 0.55) / 0.45
            side = 0.0 if alone else (GOLDEN * k if count < 4 else (-1) ** k * 1.15 * (at < 1))
            parts.append(_leaf(row, place, yaw + side, _lift(row, share if alone else at, rng), length))
    return parts


def _crowns(
    row: dict[str, Any], base: np.ndarray, reach: np.ndarray, count: int, pot: float, rng: np.random.Generator
) -> list[Solid]:
    """Trunks of different heights, each with a rosette at its top."""
    parts: list[Solid] = []
    for i in range(count):
        yaw, tall = 2 * np.pi * i / count + rng.uniform(-0.3, 0.3), reach[1] * (0.62 - 0.36 * i / count)
        top = base + np.array([0.22 * pot * np.sin(yaw), tall, 0.22 * pot * np.cos(yaw)])
        parts.append(tube([base - (0, 0.02, 0), base + (top - base) * (1.0, 0.5, 1.0), top], 0.016, "stem", "stem"))
        parts += _rosette(
            row, top, np.array([reach[0] * 0.92, reach[1] - tall, reach[2] * 0.92]), row["along"], pot, rng
        )
    return parts


def _tree(
    row: dict[str, Any], base: np.ndarray, reach: np.ndarray, count: int, pot: float, rng: np.random.Generator
) -> list[Solid]:
    """A trunk that forks into bent branches with leaves along them, a round crown altogether."""
    crown = reach[1] * rng.uniform(0.5, 0.7)
    middle, fork = base + np.outer([reach[1] - crown / 2, max(0.05, reach[1] - 1.02 * crown)], (0.0, 1.0, 0.0))
    parts: list[Solid] = [
        tube([base - (0, 0.02, 0), (base + fork) / 2 + (0.015, 0, 0.01), fork], 0.011, "stem", "stem")
    ]
    half = np.array([reach[0], crown / 2, reach[2]])
    length = float(np.clip(row["length"] * half.min(), 0.05, 0.16))
    for i in range(count):
        around, level = GOLDEN * i + rng.uniform(-0.3, 0.3), 2 * (i + 0.5) / count - 0.9
        flat = np.sqrt(max(1 - level**2, 0.05))
        out = np.array([np.sin(around) * flat, min(level, 1.0), np.cos(around) * flat])
        tip = middle + out * half * rng.uniform(0.6, 0.75)
        bend = (fork + tip) / 2 + np.array([out[0], -0.3, out[2]]) * 0.12 * crown
        parts.append(tube([fork, bend, tip], 0.0035, "stem", "stem"))
        for k in range(row["along"] + 1):
            at = 0.35 + 0.65 * k / row["along"]
            place = bend + (tip - bend) * (2 * at - 1) if at > 0.5 else fork + (bend - fork) * 2 * at
            yaw = around + (-1) ** k * rng.uniform(0.5, 1.5) * (at < 1)
            parts.append(_leaf(row, place, yaw, _lift(row, rng.random(), rng), length))
        if "bloom" in row and i % 2:
            parts.append(ball(tip - (0, 0.05, 0), (0.026, 0.032, 0.026), row["bloom"], "leaf"))
    return parts
