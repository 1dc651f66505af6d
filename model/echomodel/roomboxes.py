"""A room as labelled boxes: the plain form in which rooms are generated, read, scored and converted (numpy only)."""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from echomodel.arrays import Array
from echomodel.boxes import Boxes
from echomodel.files import write_text
from echomodel.graph import GraphBatch
from echomodel.openings import Opening, opening_from_json
from echomodel.vocabulary import vocabulary

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

    @property
    def centre(self) -> np.ndarray:
        """(3,) float, the middle of the bounding box of its floor, the origin without one."""
        corners = self.floor_polygon if len(self.floor_polygon) else np.zeros((1, 2))
        return np.insert((corners.max(0) + corners.min(0)) / 2, 1, 0.0)

    def boxes(self) -> Boxes:
        """The boxes as tensors, moved so that the centre of the floor's bounding box is the origin."""
        position = np.asarray(self.position, np.float32).reshape(-1, 3) - self.centre.astype(np.float32)
        size, yaw = np.asarray(self.size, np.float32).reshape(-1, 3), np.asarray(self.yaw, np.float32).reshape(-1)
        return Boxes(size, position, yaw).to("cpu")

    def graph(self, *, triplets: Sequence[Sequence[int]] | Array | None = None) -> GraphBatch:
        """The graph of the labelled room (`triplets` overrides its relations); raises `UnknownWord`."""
        words = vocabulary()
        relations = self.relations if triplets is None else triplets
        return GraphBatch.single(
            [words.category_id(word) for word in self.categories],
            [] if relations is None else relations,
            room_type=words.room_type_id(self.room_type),
            floor=self.floor_polygon if len(self.floor_polygon) else None,
            openings=self.openings, height=self.height,
        )  # fmt: skip

    @classmethod
    def from_json(cls, raw: dict) -> "RoomBoxes":
        """Read one entry of a rooms file; raises ValueError that names the field which is not as allowed."""
        items = raw.get("objects") if isinstance(raw, dict) else None
        if not isinstance(items, list) or not all(isinstance(one, dict) for one in items):
            raise ValueError("objects is no list of objects")
        floor, height = _numbers(raw, "floor_polygon", -1, 2), float(_numbers(raw, "height", least=0))
        if len(floor) in (1, 2):
            raise ValueError(f"floor_polygon has {len(floor)} corners, allowed: none, or three and more")
        relations = None if raw.get("relations") is None else _numbers(raw, "relations", -1, 3).astype(int)
        known = {row.id for row in vocabulary().predicates}
        for s, p, o in () if relations is None else relations.tolist():
            if s == o or not {s, o} <= {*range(len(items))} or p not in known:
                raise ValueError(f"relation {[s, p, o]}, allowed: two of {len(items)} objects and a predicate's number")
        return cls(
            id=_word(raw, "id"), room_type=_word(raw, "room_type"), floor_polygon=floor, height=height,
            categories=tuple(_word(o, "category") for o in items),
            size=np.array([_numbers(o, "size", 3, least=0) for o in items]).reshape(-1, 3),
            position=np.array([_numbers(o, "position", 3) for o in items]).reshape(-1, 3),
            yaw=np.array([_numbers(o, "yaw") for o in items]).reshape(-1),
            models=tuple(_word({"model": "", **o}, "model") for o in items),
            styles=tuple(int(_numbers({"style": -1, **o}, "style")) for o in items),
            relations=relations, openings=tuple(map(opening_from_json, raw.get("openings", ()))),
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


def _word(raw: dict, key: str) -> str:
    if not isinstance(raw.get(key), str):
        raise ValueError(f"{key} is {raw.get(key)!r}, allowed: a string")
    return raw[key]


def _numbers(raw: dict, key: str, *shape: int, least: float = -np.inf) -> np.ndarray:
    """The finite numbers of a field, of one shape; -1 = as many as there are."""
    value = raw.get(key)
    try:
        found = np.array(value if value != [] else np.zeros((0, *shape[1:])), float)
        fits = all(want in (-1, has) for want, has in zip(shape, found.shape, strict=True))
    except (TypeError, ValueError):
        fits = False
    if not fits or not (np.isfinite(found) & (found >= least)).all():
        what = f"{' x '.join(map(str, shape)).replace('-1', 'n')} finite numbers" if shape else "a finite number"
        raise ValueError(f"{key} is {value!r}, allowed: {what}{' of 0 and more' * (least == 0)}")
    return found


def read_rooms(path: str | os.PathLike[str]) -> list[RoomBoxes]:
    """Read a rooms file (`{"convention", "rooms": [...]}`); raises ValueError naming the file and the room at fault."""
    path = Path(path)
    try:
        raw = json.loads(path.read_text("utf-8"))
        entries = list(raw["rooms"])
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError, KeyError, TypeError) as error:
        form = '{"convention": ..., "rooms": [...]}'
        raise ValueError(f"{path}: not a rooms file, expected {form} ({error})") from None
    rooms = []
    for number, entry in enumerate(entries):
        try:
            rooms.append(RoomBoxes.from_json(entry))
        except (TypeError, ValueError) as error:
            name = entry.get("id", f"number {number}") if isinstance(entry, dict) else f"number {number}"
            raise ValueError(f"{path}: room {name}: {error}") from None
    return rooms


def write_rooms(path: str | os.PathLike[str], rooms: Iterable[RoomBoxes]) -> None:
    """Write a rooms file, one room a line."""
    lines = ",\n".join(json.dumps(room.to_json(), separators=(",", ":")) for room in rooms)
    text = f'{{"convention": {json.dumps(CONVENTION)}, "rooms": [\n{lines}\n]}}\n'
    write_text(Path(path), text)
