"""SG-FRONT as published: scene graphs over 3D-FRONT rooms, their boxes, and the 3D-FUTURE-SDF grids (SPEC 1 and 2).

Whoever has the files puts them in one folder: `relationships_{room}_{split}.json`, `obj_boxes_{room}_{split}.json`,
`classes_{room}.txt`, `relationships.txt`.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echomodel.files import write_text
from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

ROOMS = ("bedroom", "livingroom", "diningroom", "library", "all")
SPLITS = ("trainval", "test")  # the paper's; test is what its tables are computed on
SCENE, FLOOR, IN = "_scene_", "floor", 0


class SGFrontError(ValueError):
    """A file of SG-FRONT that is missing or not as published; the message names the file and the scan."""


@dataclass(frozen=True, eq=False)
class Scan:
    """One room: n objects (the floor among them, last) and its graph, exactly as the files say.

    Arguments:
        name: name of the scan, `MasterBedroom-33296`.
        fine: n fine class names. model_ids: n 3D-FUTURE ids, "" where there is none.
        size: (n, 3) float, extents, metres. position: (n, 3) float, bottom centres relative to `centre`, metres.
        yaw: (n,) float, radians. centre: (3,) float, the scan's `scene_center`.
        triples: (e, 3) int64 [subject, predicate 1..15, object], local indices, in the file's order.
    """

    name: str
    fine: tuple[str, ...]
    model_ids: tuple[str, ...]
    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    centre: np.ndarray
    triples: np.ndarray

    @property
    def room_type(self) -> str:
        """Our room type, told by the scan's name (the name itself where it is of no known kind)."""
        kind = self.name.split("-")[0]
        return next((room.name for room in vocabulary().room_types if kind in room.scans), kind)

    def room(self) -> RoomBoxes:
        """The furniture as a labelled room; the floor becomes the polygon, its relations are left out."""
        keep = [k for k, name in enumerate(self.fine) if name != FLOOR]
        place = {k: number for number, k in enumerate(keep)}
        floor = [k for k, name in enumerate(self.fine) if name == FLOOR]
        if floor:
            half, middle = self.size[floor[0]][[0, 2]] / 2, self.position[floor[0]][[0, 2]]
            low, high = middle - half, middle + half
        elif keep:
            reach = np.linalg.norm(self.size[keep][:, [0, 2]], axis=1)[:, None] / 2
            plan = self.position[keep][:, [0, 2]]
            low, high = (plan - reach).min(0), (plan + reach).max(0)
        else:
            low = high = np.zeros(2)
        corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
        triples = [t for t in self.triples.tolist() if t[0] in place and t[2] in place]
        return RoomBoxes(
            id=self.name, room_type=self.room_type, floor_polygon=corners,
            height=float(max([2.6, *(self.position[keep, 1] + self.size[keep, 1])])),
            categories=tuple(self.fine[k] for k in keep), size=self.size[keep], position=self.position[keep],
            yaw=self.yaw[keep], models=tuple(self.model_ids[k] for k in keep),
            relations=np.array([[place[s], p, place[o]] for s, p, o in triples], np.int64).reshape(-1, 3),
        )  # fmt: skip


class SGFront:
    """One split of SG-FRONT.

    Arguments:
        folder: where the files are.
        room: `bedroom`, `livingroom`, `diningroom`, `library` or `all` (the published weights).
        split: `trainval` or `test`.

    Attributes: `classes`, the fine ones, sorted; `predicates`, names by id (0 is `in`).

    Raises SGFrontError where a file is missing or malformed.
    """

    def __init__(self, folder: str | os.PathLike[str], room: str = "all", split: str = "trainval") -> None:
        if room not in ROOMS or split not in SPLITS:
            raise SGFrontError(
                f"room {room!r}, split {split!r}: allowed are {', '.join(ROOMS)} and {', '.join(SPLITS)}"
            )
        self.folder, self.room, self.split = Path(folder), room, split
        self.classes = tuple(sorted(set(self._lines(f"classes_{room}.txt"))))
        self.predicates = ("in", *self._lines("relationships.txt"))
        expected = len(vocabulary().sgfront_predicates)
        if len(self.predicates) != expected:
            path = self.folder / "relationships.txt"
            raise SGFrontError(f"{path}: holds {len(self.predicates) - 1} relationships, expected {expected - 1}")
        self.scans = self._scans()

    def __len__(self) -> int:
        return len(self.scans)

    def rooms(self) -> list[RoomBoxes]:
        """All scans as labelled rooms."""
        return [scan.room() for scan in self.scans]

    # -- files ---------------------------------------------------------------------------------------------------

    def _path(self, name: str) -> Path:
        if not (self.folder / name).exists():
            raise SGFrontError(f"{self.folder / name}: no such file, SG-FRONT has it")
        return self.folder / name

    def _lines(self, name: str) -> list[str]:
        return [line.strip() for line in self._path(name).read_text("utf-8").splitlines() if line.strip()]

    def _json(self, name: str) -> dict:
        path = self._path(name)
        try:
            return json.loads(path.read_text("utf-8"))
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise SGFrontError(f"{path}: not JSON ({error})") from None

    def _scans(self) -> list[Scan]:
        graphs = f"relationships_{self.room}_{self.split}.json"
        boxes = f"obj_boxes_{self.room}_{self.split}.json"
        raw, boxed = self._json(graphs), self._json(boxes)
        if not isinstance(raw.get("scans"), list):
            raise SGFrontError(f"{self.folder / graphs}: no list `scans`")
        scans, seen = [], set()
        for number, entry in enumerate(raw["scans"]):
            name = entry.get("scan", f"number {number}")
            if name in seen:
                raise SGFrontError(f"{self.folder / graphs}: scan {name}: appears twice")
            seen.add(name)
            if name not in boxed:
                raise SGFrontError(f"{self.folder / boxes}: scan {name}: missing")
            scans.append(self._scan(name, entry, boxed[name], graphs, boxes))
        return scans

    def _scan(self, name: str, entry: dict, boxed: dict, graphs: str, boxes: str) -> Scan:
        def fault(file: str, text: str) -> SGFrontError:
            return SGFrontError(f"{self.folder / file}: scan {name}: {text}")

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
            path = box.get("model_path") or ""
            models.append(Path(path).parent.name)
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
                told = self.predicates[predicate]
                raise fault(graphs, f"relation {number} {relation}: id {predicate} is {told!r} in relationships.txt")
            triples.append((local[str(subject)], predicate, local[str(object_)]))
        values = np.array(params, float)
        return Scan(
            name=name, fine=tuple(objects.values()), model_ids=tuple(models), size=values[:, :3],
            position=values[:, 3:6] - np.array(centre, float), yaw=values[:, 6], centre=np.array(centre, float),
            triples=np.array(triples, np.int64).reshape(-1, 3),
        )  # fmt: skip


def small_mapping() -> dict[str, str]:
    """Fine class of SG-FRONT -> small class, for the classes that our vocabulary knows."""
    fine = {entry.sgfront: entry.coarse for entry in vocabulary().categories if entry.name == entry.sgfront}
    return {SCENE: SCENE, **dict(sorted(fine.items())), FLOOR: FLOOR}


ON_FLOOR = 0.04  # metres


def write_sgfront(
    folder: str | os.PathLike[str], rooms: Sequence[RoomBoxes], *, split: str = "trainval", room: str = "all",
    drop: float = 0.5, seed: int = 0,
) -> None:  # fmt: skip
    """Write rooms as one split of SG-FRONT, labelled by its rules, with the floor as the last object of each scan.

    Arguments:
        folder: receives the files; those of another split stay, the bounds are those of `trainval`.
        rooms: at least one, in the vocabulary's words; classes that SG-FRONT lacks are written as its nearest.
        split: `trainval` or `test`. room: the `{room}` of the file names.
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
    write_text(folder / f"relationships_{room}_{split}.json", json.dumps({"scans": scans}))
    write_text(folder / f"obj_boxes_{room}_{split}.json", json.dumps(boxes))
    mapping = small_mapping()
    write_text(folder / f"classes_{room}.txt", "".join(f"{name}\n" for name in sorted(mapping)))
    write_text(folder / "mapping.json", json.dumps(mapping, indent=1))
    spelled = vocabulary().sgfront_predicates
    write_text(folder / "relationships.txt", "".join(f"{word}\n" for number, word in spelled.items() if number != IN))
    if split == "trainval":
        write_text(folder / f"centered_bounds_{room}_trainval.txt", _bounds(np.concatenate(rows)))


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
    corners = footprints(room.size, room.position, room.yaw)
    out: dict = {}
    for k, row in enumerate(params):
        if k < len(room):
            plan = corners[k] + shift[[0, 2]]
        else:
            plan = np.array([low, [high[0], low[1]], high, [low[0], high[1]]]) + shift[[0, 2]]
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
