"""Rooms that a person would live in, as boxes by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echomodel.objective import faults, plan_of

FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])
HALF = np.pi / 2


@dataclass
class Room:
    """Boxes by name: category, size, (x, z), yaw; all on the floor but for lamps."""

    things: dict

    def moved(self, name, **fields):
        """The same room with one thing changed."""
        return Room({**self.things, name: {**self.things[name], **fields}})

    def found(self, **kwargs):
        """(name, rule) of every fault."""
        names = list(self.things)
        rows = list(self.things.values())

        class Boxes:
            size = np.array([row["size"] for row in rows], float)
            position = np.array([(row["at"][0], row.get("up", 0.0), row["at"][1]) for row in rows], float)
            yaw = np.array([row.get("yaw", 0.0) for row in rows], float)

        options = {"floor": FLOOR, **kwargs}
        out = faults(plan_of(Boxes, [row["kind"] for row in rows], **options))
        return {(names[f.object], f.rule): f.sentence(names) for f in out}


STUDY = Room({
    "desk": {"kind": "desk", "size": (1.4, 0.75, 0.7), "at": (0.0, -1.63)},
    "chair": {"kind": "office_chair", "size": (0.6, 1.0, 0.6), "at": (0.3, -0.98), "yaw": np.pi},
})  # fmt: skip
BEDROOM = Room({
    "bed": {"kind": "double_bed", "size": (1.8, 1.0, 2.1), "at": (0.0, -0.93)},
    "left": {"kind": "nightstand", "size": (0.5, 0.5, 0.4), "at": (-1.2, -1.78)},
    "right": {"kind": "nightstand", "size": (0.5, 0.5, 0.4), "at": (1.2, -1.78)},
    "wardrobe": {"kind": "wardrobe", "size": (1.8, 2.2, 0.6), "at": (-2.18, 1.0), "yaw": HALF},
    "pendant": {"kind": "pendant_lamp", "size": (0.5, 0.6, 0.5), "at": (0.0, 0.0), "up": 2.0},
    "lamp": {"kind": "table_lamp", "size": (0.3, 0.5, 0.3), "at": (1.2, -1.78), "up": 0.5},
})  # fmt: skip
LIVING = Room({
    "sofa": {"kind": "multi_seat_sofa", "size": (2.2, 0.85, 0.9), "at": (0.0, -1.53)},
    "coffee": {"kind": "coffee_table", "size": (1.1, 0.4, 0.6), "at": (0.0, -0.4)},
    "stand": {"kind": "tv_stand", "size": (1.8, 0.5, 0.4), "at": (0.0, 1.78), "yaw": np.pi},
    "armchair": {"kind": "armchair", "size": (0.8, 0.8, 0.8), "at": (1.5, -0.3), "yaw": -HALF},
})  # fmt: skip
DINING = Room({
    "table": {"kind": "dining_table", "size": (1.4, 0.75, 0.9), "at": (0.0, 0.0)},
    "chair": {"kind": "dining_chair", "size": (0.5, 0.9, 0.5), "at": (0.3, 0.6), "yaw": np.pi},
    "sideboard": {"kind": "sideboard", "size": (1.4, 0.9, 0.4), "at": (0.0, -1.78)},
    "pendant": {"kind": "pendant_lamp", "size": (0.5, 0.6, 0.5), "at": (0.0, 0.0), "up": 2.0},
})  # fmt: skip


SET = Room({
    "table": {"kind": "dining_table", "size": (1.6, 0.75, 0.9), "at": (0.0, 0.0)},
    **{f"chair_{x}_{z}": {"kind": "dining_chair", "size": (0.5, 0.9, 0.5), "at": (0.4 * x, 0.6 * z),
                          "yaw": np.pi * (z > 0)} for x in (-1, 1) for z in (-1, 1)},
    "lamp": {"kind": "floor_lamp", "size": (0.4, 1.6, 0.4), "at": (1.9, 1.7)},
})  # fmt: skip
BENCH = Room({**BEDROOM.things, "bench": {
    "kind": "bench", "size": (1.2, 0.45, 0.4), "at": (0.2, 0.4),
}})  # fmt: skip
SMALL = Room(
    {
        **LIVING.things,
        "plant": {"kind": "plant", "size": (0.4, 1.2, 0.4), "at": (-2.2, 1.7)},
        "side": {"kind": "side_table", "size": (0.45, 0.5, 0.45), "at": (-1.4, -1.6)},
    }
)
SOFAS = Room({**LIVING.things, "other": {
    "kind": "loveseat_sofa", "size": (1.5, 0.85, 0.9), "at": (-1.7, -0.1), "yaw": HALF,
}})  # fmt: skip
PENDANTS = Room({**SET.things, **{f"pendant_{x}": {
    "kind": "pendant_lamp", "size": (0.3, 0.6, 0.3), "at": (0.35 * x, 0.0), "up": 2.0,
} for x in (-1, 1)}})  # fmt: skip


BAR = Room({
    "bar": {"kind": "console_table", "size": (1.8, 1.0, 0.5), "at": (0.0, -1.73)},
    **{f"stool_{x}": {"kind": "bar_stool", "size": (0.4, 0.8, 0.4), "at": (0.6 * x, -1.4), "yaw": np.pi}
       for x in (-1, 0, 1)},
    "table": {"kind": "dining_table", "size": (1.4, 0.75, 0.9), "at": (0.0, 0.6)},
})  # fmt: skip
