"""Small things that are rows of solids instead of programs: boxes, balls, turned profiles and rods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.furniture.carpentry import Size, both
from echomodel.furniture.solids import Block, Lathe, Solid, ball, rotation, tube

Row = Mapping[str, Any]  # as `things.toml` says


def form(forms: Sequence[Sequence[Row]]) -> Callable[[Size, np.random.Generator], list[Solid]]:
    """The program that builds a thing of the rows of one of its forms."""

    def built(size: Size, rng: np.random.Generator) -> list[Solid]:
        parts: list[Solid] = []
        luck = rng.random()
        for row in forms[int(rng.integers(len(forms)))]:
            among = [row["of"]] if isinstance(row["of"], str) else row["of"]
            count = max(1, round(size[0] / row["every"])) if "every" in row else 1
            solid = _solid(row, np.asarray(size, float) / (count, 1, 1), among[int(luck * len(among))])
            for step in size[0] * ((np.arange(count) + 0.5) / count - 0.5):
                copy = replace(solid, centre=solid.centre + np.array([step, 0, 0]))
                parts += both(copy) if row.get("both") else [copy]
        return parts

    return built


def _solid(row: Row, size: Size, material: str) -> Solid:
    turn = rotation(*np.radians(row.get("turn", (0, 0, 0))))
    if "box" in row:
        low, high = (np.array(corner) * size for corner in (row["box"][:3], row["box"][3:]))
        return Block((low + high) / 2, turn, material, half=(high - low) / 2, radius=row.get("round", 0.0))
    if "ball" in row:
        middle, half = (np.array(numbers) * size for numbers in (row["ball"][:3], row["ball"][3:]))
        return ball(middle, half, material, power=row.get("power", 2.0), turn=turn)
    if "rod" in row:
        return tube(np.array(row["rod"]) * size, row["thick"] / 2, material)
    profile = np.array(row["turned"]) * (row.get("wide", 1.0) * min(size[0], size[2]) / 2, size[1])
    return Lathe(np.array(row.get("at", (0, 0, 0))) * size, turn, material, profile=profile)
