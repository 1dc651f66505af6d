"""A room as labelled boxes: the plain form in which rooms are generated, read, scored and converted (numpy only)."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from echomodel.files import write_text
from echomodel.openings import Opening, opening_from_json

CONVENTION = (
    "metres; +Y up; size = (x, y, z) extents in the object frame; position = bottom centre; "
    "yaw about +Y, object front = +Z at yaw 0; floor_polygon = (x, z); equal model = same furniture model"
)


@dataclass(frozen=True, eq=False)
class RoomBoxes:
    """One room: a floor polygon and n labelled, oriented boxes.

    Arguments:
        id: unique name of the room within its file.
        room_type: room type as the source spells it (`bedroom`, `living`, `living_dining` ...).
        floor_polygon: (k, 2) float, x and z of the corners in metres.
        height: room height in metres.
        categories: n category words.
        size: (n, 3) float, extents along x, y, z at yaw 0, metres.
        position: (n, 3) float, centre of the bottom face, metres.
        yaw: (n,) float, radians about +Y.
        models: n names; objects with the same name are the same piece of furniture ("" = unknown).
        styles: n style groups; objects with the same non-negative number belong together (-1 = unknown).
        relations: (e, 3) int [subject, predicate id, object], or None where the room is not labelled.
        openings: doors, windows and passages in the edges of the floor polygon.
    """

    id: str
    room_type: str
    floor_polygon: np.ndarray
    height: float
    categories: tuple[str, ...]
    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    models: tuple[str, ...] = ()
    styles: tuple[int, ...] = ()
    relations: np.ndarray | None = field(default=None)
    openings: tuple[Opening, ...] = ()

    def __len__(self) -> int:
        return len(self.categories)

    @classmethod
    def from_json(cls, raw: dict) -> RoomBoxes:
        """Read one entry of a rooms file; raises KeyError on a missing field."""
        objects = raw["objects"]
        relations = raw.get("relations")
        return cls(
            id=raw["id"], room_type=raw["room_type"],
            floor_polygon=np.asarray(raw["floor_polygon"], float).reshape(-1, 2), height=float(raw["height"]),
            categories=tuple(o["category"] for o in objects),
            size=np.asarray([o["size"] for o in objects], float).reshape(-1, 3),
            position=np.asarray([o["position"] for o in objects], float).reshape(-1, 3),
            yaw=np.asarray([o["yaw"] for o in objects], float).reshape(-1),
            models=tuple(o.get("model", "") for o in objects), styles=tuple(o.get("style", -1) for o in objects),
            relations=None if relations is None else np.asarray(relations, int).reshape(-1, 3),
            openings=tuple(map(opening_from_json, raw.get("openings", ()))),
        )  # fmt: skip

    def to_json(self, digits: int = 4) -> dict:
        """The entry that `from_json` reads, numbers rounded to `digits` decimals."""
        models, styles = self.models or ("",) * len(self), self.styles or (-1,) * len(self)
        out = {
            "id": self.id,
            "room_type": self.room_type,
            "floor_polygon": np.round(self.floor_polygon, digits).tolist(),
            "height": round(self.height, digits),
            "objects": [
                {
                    "category": self.categories[i],
                    "size": np.round(self.size[i], digits).tolist(),
                    "position": np.round(self.position[i], digits).tolist(),
                    "yaw": round(float(self.yaw[i]), digits),
                    "model": models[i],
                    "style": int(styles[i]),
                }
                for i in range(len(self))
            ],
        }
        if self.relations is not None:
            out["relations"] = self.relations.tolist()
        if self.openings:
            out["openings"] = [
                {key: round(v, digits) if isinstance(v, float) else v for key, v in opening.to_json().items()}
                for opening in self.openings
            ]
        return out


def read_rooms(path: str | os.PathLike[str]) -> list[RoomBoxes]:
    """Read a rooms file (`{"convention", "rooms": [...]}`); raises ValueError naming the file and the room at fault."""
    path = Path(path)
    try:
        raw = json.loads(path.read_text("utf-8"))
        entries = list(raw["rooms"])
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError) as error:
        form = '{"convention": ..., "rooms": [...]}'
        raise ValueError(f"{path}: not a rooms file, expected {form} ({error})") from None
    rooms = []
    for number, entry in enumerate(entries):
        try:
            rooms.append(RoomBoxes.from_json(entry))
        except (KeyError, TypeError, ValueError) as error:
            name = entry.get("id", f"number {number}") if isinstance(entry, dict) else f"number {number}"
            raise ValueError(f"{path}: room {name}: {type(error).__name__} {error}") from None
    return rooms


def write_rooms(path: str | os.PathLike[str], rooms: Iterable[RoomBoxes]) -> None:
    """Write a rooms file, one room a line."""
    lines = ",\n".join(json.dumps(room.to_json(), separators=(",", ":")) for room in rooms)
    text = f'{{"convention": {json.dumps(CONVENTION)}, "rooms": [\n{lines}\n]}}\n'
    write_text(Path(path), text)
