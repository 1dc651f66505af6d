"""SG-FRONT as published: scene graphs over 3D-FRONT rooms, their boxes, and the 3D-FUTURE-SDF grids (SPEC 1 and 2).

Whoever has the files puts them in one folder: `relationships_{room}_{split}.json`, `obj_boxes_{room}_{split}.json`,
`classes_{room}.txt`, `relationships.txt`.
"""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echomodel.bounded import read_json
from echomodel.boxes2d import footprints
from echomodel.files import write_text
from echomodel.roomboxes import RoomBoxes
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

ROOMS = ("bedroom", "livingroom", "diningroom", "library", "all")
SPLITS = ("trainval", "test")  # the paper's; test is what its tables are computed on
SCENE, FLOOR, IN = "_scene_", "floor", 0
LARGEST = 2**30  # bytes of a file


class SGFront:
    """One split of SG-FRONT.

    Arguments:
        folder: where the files are.
        room: `bedroom`, `livingroom`, `diningroom`, `library` or `all` (the published weights).
        split: `trainval` or `test`.

    Attributes: `classes`, the fine ones, sorted; `predicates`, names by id (0 is `in`).

    Raises ValueError where a file is missing or malformed; names the file and the scan.
    """

    def __init__(self, folder: str | os.PathLike[str], room: str = "all", split: str = "trainval") -> None:
        if room not in ROOMS or split not in SPLITS:
            raise ValueError(f"room {room!r}, split {split!r}: allowed are {', '.join(ROOMS)} and {', '.join(SPLITS)}")
        self.folder, self.room, self.split = Path(folder), room, split
        self.classes = tuple(sorted(set(self._lines(f"classes_{room}.txt"))))
        self.predicates = ("in", *self._lines("relationships.txt"))
        expected = len(vocabulary().sgfront_predicates)
        if len(self.predicates) != expected:
            path = self.folder / "relationships.txt"
            raise ValueError(f"{path}: holds {len(self.predicates) - 1} relationships, expected {expected - 1}")

    def rooms(self) -> list[RoomBoxes]:
        """All scans as labelled rooms; their floors become polygons, whose relations are left out."""
        graphs, boxes = (f"{what}_{self.room}_{self.split}.json" for what in ("relationships", "obj_boxes"))
        raw, boxed = (read_json(self._path(name), LARGEST) for name in (graphs, boxes))
        if not isinstance(raw, dict) or not isinstance(raw.get("scans"), list):
            raise ValueError(f"{self.folder / graphs}: no list `scans`")
        rooms: dict[str, RoomBoxes] = {}
        try:
            for number, entry in enumerate(raw["scans"]):
                name = entry.get("scan", f"number {number}")
                if name in rooms:
                    raise ValueError(f"{self.folder / graphs}: scan {name}: appears twice")
                if name not in boxed:
                    raise ValueError(f"{self.folder / boxes}: scan {name}: missing")
                rooms[name] = self._room(name, entry, boxed[name], graphs, boxes)
        except (AttributeError, KeyError, TypeError) as error:
            raise ValueError(f"{self.folder / graphs}, {boxes}: a scan not as SG-FRONT has it ({error})") from None
        return list(rooms.values())

    # -- files ---------------------------------------------------------------------------------------------------

    def _path(self, name: str) -> Path:
        if not (self.folder / name).exists():
            raise ValueError(f"{self.folder / name}: no such file, SG-FRONT has it")
        return self.folder / name

    def _lines(self, name: str) -> list[str]:
        return [line.strip() for line in self._path(name).read_text("utf-8").splitlines() if line.strip()]

    def _room(self, name: str, entry: dict, boxed: dict, graphs: str, boxes: str) -> RoomBoxes:
        def fault(file: str, text: str) -> ValueError:
            return ValueError(f"{self.folder / file}: scan {name}: {text}")

        objects = entry.get("objects")
        if not isinstance(objects, dict) or not objects:
            raise fault(graphs, "no objects")
        params, models = [], []
        for key, category in objects.items():
            if category not in self.classes:
                raise fault(graphs, f"object {key} is a {category!r}, which classes_{self.room}.txt does not hold")
            box = boxed.get(key)
            if box is None:
                raise fault(boxes, f"no box for object {key} ({category})")
            param7 = box.get("param7", ())
            if len(param7) != 7 or not all(isinstance(v, int | float) and math.isfinite(v) for v in param7):
                raise fault(boxes, f"object {key}: param7 is {param7}, expected 7 finite numbers")
            if min(param7[:3]) < 0:
                raise fault(boxes, f"object {key}: size {param7[:3]} is negative")
            params.append(param7)
            models.append(Path(box.get("model_path") or "").parent.name)
        centre = boxed.get("scene_center")
        if centre is None or len(centre) != 3:
            raise fault(boxes, f"scene_center is {centre}, expected 3 numbers")
        local = {key: k for k, key in enumerate(objects)}
        triples = []
        for number, relation in enumerate(entry.get("relationships", ())):
            if len(relation) != 4:
                raise fault(graphs, f"relation {number} is {relation}, expected [subject, object, id, name]")
            subject, object_, predicate, word = relation
            for end in (subject, object_):
                if str(end) not in local:
                    raise fault(graphs, f"relation {number} {relation}: no object {end}, there are {', '.join(local)}")
            if not isinstance(predicate, int) or not 1 <= predicate < len(self.predicates):
                raise fault(graphs, f"relation {number} {relation}: id {predicate}, allowed are 1 to 15")
            if self.predicates[predicate] != word:
                words = self.predicates[predicate]
                raise fault(graphs, f"relation {number} {relation}: id {predicate} is {words!r} in relationships.txt")
            triples.append((local[str(subject)], predicate, local[str(object_)]))
        values = np.array(params, float) - [0, 0, 0, *centre, 0]
        there = np.array([category != FLOOR for category in objects.values()])
        place = np.cumsum(there) - 1
        size, position, yaw = np.split(values[there], [3, 6], 1)
        kind = name.split("-")[0]  # a room whose name is of no known kind is of that type
        return RoomBoxes(
            id=name, room_type=next((row.name for row in vocabulary().room_types if kind in row.scans), kind),
            floor_polygon=_outline(values[~there], values[there]),
            height=float(max([2.6, *(position[:, 1] + size[:, 1])])),
            categories=tuple(category for category in objects.values() if category != FLOOR), size=size,
            position=position, yaw=yaw[:, 0], models=tuple(m for m, kept in zip(models, there, strict=True) if kept),
            relations=np.array(
                [(place[s], p, place[o]) for s, p, o in triples if there[s] and there[o]], np.int64
            ).reshape(-1, 3),
        )  # fmt: skip


def _outline(floors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(4, 2) corners of the first of some floors (k, 7), else of what others (n, 7) reach."""
    if len(floors):
        half, middle = floors[0, [0, 2]] / 2, floors[0, [3, 5]]
        low, high = middle - half, middle + half
    elif len(others):
        reach = np.linalg.norm(others[:, [0, 2]], axis=1)[:, None] / 2
        low, high = (others[:, [3, 5]] - reach).min(0), (others[:, [3, 5]] + reach).max(0)
    else:
        low = high = np.zeros(2)
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


ON_FLOOR = 0.04  # metres


def write_sgfront(
    folder: str | os.PathLike[str], rooms: Sequence[RoomBoxes], *, split: str = "trainval", drop: float = 0.5,
    seed: int = 0,
) -> None:  # fmt: skip
    """Write rooms as one split of SG-FRONT, labelled by its rules, with the floor as the last object of each scan.

    Arguments:
        folder: receives the files; those of another split stay, the bounds are those of `trainval`.
        rooms: at least one, in the vocabulary's words; classes that SG-FRONT lacks are written as its nearest.
        split: `trainval` or `test`; the files are those of all rooms.
        drop: share of the relations that is left out. seed: of the dropping and of the rooms' places in the world.

    Raises ValueError for no room or an unknown split; `UnknownWord`: a category that the vocabulary does not hold.
    """
    if not rooms or split not in SPLITS:
        raise ValueError(f"{len(rooms)} rooms, split {split!r}: need at least one room and {' or '.join(SPLITS)}")
    folder, rng = Path(folder), np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    labels = label_rooms(rooms, rules="sgfront", drop=drop, rng=rng)
    scans, boxes, rows = [], {}, []
    for number, (entry, edges) in enumerate(zip(rooms, labels, strict=True)):
        kind = vocabulary().room_type(entry.room_type)
        name = f"{(kind.scans or (kind.name,))[0]}-{number}"
        shift = np.append(rng.uniform(-5, 5, 2), 0.0)[[0, 2, 1]].round(3)
        scans.append(_graph(name, entry, edges))
        boxes[name], params = _boxes(entry, shift)
        rows.append(params - np.concatenate([np.zeros(3), shift, [0.0]]))
    write_text(folder / f"relationships_all_{split}.json", json.dumps({"scans": scans}))
    write_text(folder / f"obj_boxes_all_{split}.json", json.dumps(boxes))
    fine = {entry.sgfront: entry.coarse for entry in vocabulary().categories if entry.name == entry.sgfront}
    mapping = {SCENE: SCENE, **dict(sorted(fine.items())), FLOOR: FLOOR}  # of the classes that we know
    write_text(folder / "classes_all.txt", "".join(f"{name}\n" for name in sorted(mapping)))
    write_text(folder / "mapping.json", json.dumps(mapping, indent=1))
    spelled = vocabulary().sgfront_predicates
    write_text(folder / "relationships.txt", "".join(f"{word}\n" for number, word in spelled.items() if number != IN))
    if split == "trainval":
        write_text(folder / "centered_bounds_all_trainval.txt", _bounds(np.concatenate(rows)))


def _graph(name: str, room: RoomBoxes, edges: np.ndarray) -> dict:
    words = vocabulary()
    floor = len(room) + 1
    objects = {str(k + 1): words.category(word).sgfront for k, word in enumerate(room.categories)}
    spelled = words.sgfront_predicates
    relations = [[int(s) + 1, int(o) + 1, int(p), spelled[int(p)]] for s, p, o in edges if int(p) in spelled]
    for k in range(len(room)):
        predicate = words.predicate_id("standing_on" if room.position[k, 1] < ON_FLOOR else "above")
        relations.append([k + 1, floor, predicate, spelled[predicate]])
    return {"scan": name, "objects": {**objects, str(floor): FLOOR}, "relationships": relations}


def _boxes(room: RoomBoxes, shift: np.ndarray) -> tuple[dict, np.ndarray]:
    params = np.concatenate([room.size, room.position + shift, room.yaw[:, None]], -1)
    low, high = room.floor_polygon.min(0), room.floor_polygon.max(0)
    middle = (low + high) / 2
    # The scan's centre is the middle of its floor, as in the published boxes.
    extent = [high[0] - low[0], 0.0, high[1] - low[1], middle[0] + shift[0], shift[1], middle[1] + shift[2], 0.0]
    params = np.concatenate([params, [extent]])
    floor = [low, [high[0], low[1]], high, [low[0], high[1]]]
    corners = np.concatenate([footprints(room.size, room.position, room.yaw), [floor]]) + shift[[0, 2]]
    out: dict = {}
    for k, (row, plan) in enumerate(zip(params, corners, strict=True)):
        heights = (row[4], row[4] + row[1])
        model = room.models[k] if k < len(room.models) else ""
        out[str(k + 1)] = {
            "param7": row.tolist(),
            "8points": [[float(x), float(y), float(z)] for x, z in plan for y in heights],
            "scale": [1, 1, 1],
            "model_path": f"3D-FUTURE-model/{model}/raw_model.obj" if model else None,
        }
    out["scene_center"] = shift.tolist()
    return out, params


def _bounds(rows: np.ndarray) -> str:
    """14 numbers: smallest and largest size, position, angle."""
    low, high = rows.min(0), rows.max(0)
    high = np.where(high - low < 1e-3, low + 1e-3, high)
    parts = (low[:3], high[:3], low[3:6], high[3:6], [low[6]], [high[6]])
    return " ".join(f"{value:.6f}" for part in parts for value in part) + "\n"
