"""Write our own rooms in the files of SG-FRONT, so that whatever reads the published data set reads them too."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echomodel.data.sgfront import FLOOR, IN, SPLITS, small_mapping
from echomodel.files import write_text
from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

ON_FLOOR = 0.04  # metres


def write_sgfront(
    folder: str | os.PathLike[str],
    rooms: Sequence[RoomBoxes],
    *,
    split: str = "trainval",
    room: str = "all",
    drop: float = 0.5,
    seed: int = 0,
) -> None:
    """Write rooms as one split of SG-FRONT, labelled by its rules, with the floor as the last object of each scan.

    Arguments:
        folder: receives the files; those of another split stay, the bounds are those of `trainval`.
        rooms: at least one, in the vocabulary's words; classes that SG-FRONT lacks are written as its nearest.
        split: `trainval` or `test`. room: the `{room}` of the file names.
        drop: share of the relations that is left out. seed: of the dropping and of the rooms' places in the world.

    Raises:
        ValueError: no room or an unknown split; `UnknownWord`: a category that the vocabulary does not hold.
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
