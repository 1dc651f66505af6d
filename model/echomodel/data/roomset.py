"""Sets of rooms on disk, 0.14 kB a room, in millimetres; they are labelled when they are read.

A set is one compressed file (`pack_rooms`), or a folder of such files `rooms-0000.npz` with `rooms.json`, what the set
is, written last. A file holds four tables, one entry per room, object, floor corner and opening, column by column.
"""

import json
import os
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from echomodel.bounded import read_json
from echomodel.files import check_ours, telling, whole_file, write_json
from echomodel.openings import HINGES, KINDS, SWINGS, Opening, numbered
from echomodel.progress import StepListener
from echomodel.roomboxes import RoomBoxes, read_rooms
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

RULES = ("strict", "sgfront")
ROOM = np.dtype(
    [("objects", "<u4"), ("corners", "<u4"), ("openings", "<u4"), ("type", "u1"), ("held_out", "u1"), ("height", "<f4")]
)
OBJECT = np.dtype(
    [("category", "u1"), ("style", "<i2"), ("size", "<f4", 3), ("position", "<f4", 3), ("yaw", "<f4")]
)  # fmt: skip
CORNER = np.dtype(("<f4", 2))
OPENING = np.dtype(
    [("kind", "u1"), ("hinge", "u1"), ("swing", "u1"), ("edge", "<u2"), ("offset", "<f4"), ("width", "<f4"),
     ("height", "<f4"), ("sill", "<f4")]
)  # fmt: skip
TABLES = {"rooms": ROOM, "objects": OBJECT, "corners": CORNER, "openings": OPENING}
ROOMS_PER_SHARD = 1000
LABELLED = 200  # rooms at a time
DIGITS = 4  # a tenth of a millimetre
MILLIMETRES, STEPS = 1000.0, {"yaw": 1e4}  # steps to the unit of the numbers of a packed set
MOST = 2**15  # such steps


def build_rooms(
    directory: str | os.PathLike[str], count: int, seed: int, styles: int, progress: StepListener | None = None, *,
    halls: float = 0.0,
) -> "RoomSet":  # fmt: skip
    """Generate a set of rooms, shard by shard; the same bytes for the same seed, whenever interrupted.

    Arguments:
        directory: folder of the set; shards that are complete there are kept.
        count: number of rooms, at least 1. seed: seed of the world. styles: number of style groups of the shape set.
        progress: called with (rooms done, rooms in all).
        halls: share of large rooms of several zones, 0 to 1.

    Raises ValueError where the folder holds a set that was begun with other arguments.
    """
    if count < 1:
        raise ValueError(f"number of rooms is {count}, need at least 1")
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    plan: dict = {"kind": "generated rooms", "seed": seed, "rooms": count, "styles": styles, **_words()}
    if halls:
        plan["halls"] = halls
    claim(folder, plan)
    for number, first in enumerate(range(0, count, ROOMS_PER_SHARD)):
        path = folder / f"rooms-{number:04d}.npz"
        last = min(first + ROOMS_PER_SHARD, count)
        if not path.exists():
            rooms: list[RoomBoxes] = []
            for start in range(first, last, 100):
                drawn = generate_rooms(min(100, last - start), seed, styles=styles, start=start, halls=halls)
                rooms += drawn
                if progress:
                    progress(start + min(100, last - start), count)
            pack_rooms(path, rooms, [kept_out(first + k) for k in range(len(rooms))], {"seed": seed})
        elif progress:
            progress(last, count)
    write_json(folder / "rooms.json", plan)
    return RoomSet(folder)


def pack_rooms(path: str | os.PathLike[str], rooms: Sequence[RoomBoxes], held_out: Sequence[bool], info: dict) -> None:
    """Write rooms as one file, complete or not at all, that `RoomSet` reads.

    Arguments:
        held_out: which of them no training may see. info: what the set says of itself.

    Raises `UnknownWord` for a category or room type that the vocabulary does not hold, and ValueError for a room that
    reaches MOST steps.
    """
    note = {"kind": "rooms", "seed": 0, **info, "rooms": len(rooms), **_words()}
    columns: dict[str, np.ndarray] = {"note": np.frombuffer(json.dumps(note).encode(), np.uint8)}
    for name, table in _tables_of(rooms, held_out).items():
        for field in table.dtype.names or ("",):
            column = table[field] if field else table
            if column.dtype.kind == "f":
                column = np.round(column * STEPS.get(field, MILLIMETRES)).astype("<i2")
            columns[f"{name}.{field}"] = column
    with whole_file(path) as beside, beside.open("wb") as file:
        np.savez_compressed(file, **columns)  # type: ignore[arg-type]


def _words() -> dict[str, list[str]]:
    """What the numbers of categories and room types mean."""
    return {kind: [row.name for row in getattr(vocabulary(), kind)] for kind in ("categories", "room_types")}


def _unpacked(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """What a file says of itself, and its tables; raises ValueError for other files and damaged ones."""
    tables: dict[str, np.ndarray] = {}
    try:
        with np.load(path, allow_pickle=False) as held:
            note = json.loads(held["note"].tobytes())
            for name, dtype in TABLES.items():
                parts = {field: held[f"{name}.{field}"] for field in dtype.names or ("",)}
                tables[name] = table = np.zeros(len(next(iter(parts.values()))), dtype)
                for field, column in parts.items():
                    into = table[field] if field else table
                    into[...] = column / STEPS.get(field, MILLIMETRES) if into.dtype.kind == "f" else column
        most = {kind: len(note[kind]) for kind in _words()}
    except (OSError, KeyError, TypeError, ValueError, EOFError, TokenError, zipfile.BadZipFile, zlib.error):
        raise ValueError(f"{path}: not a packed set of rooms, allowed: a .npz of `echousd data import`") from None
    rooms = tables["rooms"]
    wrong = [name for name in list(TABLES)[1:] if rooms[name].sum(dtype=np.uint64) != len(tables[name])]
    wrong += [] if tables["objects"]["category"].max(initial=0) < most["categories"] else ["categories"]
    wrong += [] if rooms["type"].max(initial=0) < most["room_types"] else ["room types"]
    if wrong:
        raise ValueError(f"{path}: damaged, its {wrong[0]} are not those of its rooms; remove it and build again")
    return note, tables


def _tables_of(rooms: Sequence[RoomBoxes], held_out: Sequence[bool]) -> dict[str, np.ndarray]:
    """The tables of some rooms."""
    words = vocabulary()
    tables: dict[str, list[np.ndarray]] = {name: [np.zeros(0, dtype)] for name, dtype in TABLES.items()}
    for k, room in enumerate(rooms):
        n = len(room)
        kind, openings = words.room_type_id(room.room_type), [_entry(opening) for opening in room.openings]
        lengths = (room.height, *(x for entry in openings for x in entry[4:]))
        parts = (room.size, room.position, room.floor_polygon, lengths, np.divide(room.styles, MILLIMETRES))
        if max(np.abs(part).max(initial=0) for part in parts) * MILLIMETRES > MOST - 1:
            raise ValueError(f"room {room.id}: a set of rooms holds less than {MOST / MILLIMETRES} m and {MOST} styles")
        entry = (n, len(room.floor_polygon), len(room.openings), kind, held_out[k], room.height)
        objects = np.zeros(n, OBJECT)
        objects["category"] = [words.category_id(category) for category in room.categories]
        objects["style"] = room.styles or -1
        objects["size"], objects["position"] = np.maximum(room.size, 1 / MILLIMETRES), room.position
        turned_on = np.arctan2(np.sin(room.yaw), np.cos(room.yaw))
        objects["yaw"] = np.where(np.abs(room.yaw) * STEPS["yaw"] < MOST - 1, room.yaw, turned_on)
        tables["rooms"].append(np.array([entry], ROOM))
        tables["objects"].append(objects)
        tables["corners"].append(np.asarray(room.floor_polygon, "<f4"))
        tables["openings"].append(np.array(openings, OPENING))
    joined = {name: np.ascontiguousarray(np.concatenate(parts)) for name, parts in tables.items()}
    return {name: joined[name].astype(dtype.base) for name, dtype in TABLES.items()}


class RoomSet:
    """A set of rooms on disk, held in memory and labelled where it is asked.

    `directory`: one file, or a folder with `rooms.json` and its files.

    Attributes: `held_out` (n,) bool, `counts` (n,) objects per room, `info`, what the set says of itself. Raises
    ValueError for a folder without a finished set or with a damaged file.
    """

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        self.directory, info = Path(directory), None
        files = [self.directory]
        if not self.directory.is_file():
            info, files = set_note(self.directory, "room", rooms=int), sorted(self.directory.glob("rooms-*.npz"))
        held = [_unpacked(path) for path in files]
        count = sum(len(tables["rooms"]) for _, tables in held)
        self.info: dict = info or held[0][0]
        if count != self.info["rooms"]:
            raise ValueError(f"{self.directory}: its files hold {count} rooms, said are {self.info['rooms']}")
        self._tables = {name: np.concatenate([tables[name] for _, tables in held]) for name in TABLES}
        rooms = self._tables["rooms"]
        many: dict[str, np.ndarray] = {name: rooms[name].astype(np.int64) for name in list(TABLES)[1:]}
        self._begin = {name: np.cumsum(counts) - counts for name, counts in many.items()}
        self.held_out = rooms["held_out"].astype(bool)
        self.counts = rooms["objects"].astype(np.int64)
        self._labels: dict[tuple[str, int], list[np.ndarray]] = {}

    def __len__(self) -> int:
        return len(self.counts)

    def _part(self, name: str, room: int) -> np.ndarray:
        start = self._begin[name][room]
        return self._tables[name][start : start + int(self._tables["rooms"][name][room])]

    def room(self, number: int, *, rules: str = "strict") -> RoomBoxes:
        """One room with all its relations by the given rules."""
        return replace(self._bare(number), relations=self.relations(number, rules=rules))

    def _bare(self, number: int) -> RoomBoxes:
        entry, objects = self._tables["rooms"][number], self._part("objects", number)
        names = tuple(self.info["categories"][k] for k in objects["category"])
        styles = tuple(int(style) for style in objects["style"])
        return RoomBoxes(
            id=f"room_{self.info['seed']}_{number:06d}", room_type=self.info["room_types"][entry["type"]],
            floor_polygon=np.round(self._part("corners", number).astype(float), DIGITS),
            height=round(float(entry["height"]), DIGITS), categories=names,
            size=np.round(objects["size"].astype(float), DIGITS),
            position=np.round(objects["position"].astype(float), DIGITS), yaw=objects["yaw"].astype(float),
            models=tuple(f"s{style}_{name}" if style >= 0 else "" for style, name in zip(styles, names, strict=True)),
            styles=styles, openings=_openings(self._part("openings", number)),
        )  # fmt: skip

    def relations(self, number: int, *, rules: str = "strict") -> np.ndarray:
        """(E, 3) int64 [subject, predicate, object] of one room; raises ValueError for unknown rules."""
        if rules not in RULES:
            raise ValueError(f"unknown rules {rules!r}: a room set is labelled by {', '.join(RULES)}")
        first = number // LABELLED * LABELLED
        if (rules, first) not in self._labels:
            rooms = [self._bare(k) for k in range(first, min(first + LABELLED, len(self)))]
            self._labels[rules, first] = label_rooms(rooms, rules=rules)
        return self._labels[rules, first][number - first]


def kept_out(number: Any) -> Any:
    """Whether no training may see the room or style of this number, int or array, in its set: every twentieth."""
    return number % 20 == 19


def _entry(opening: Opening) -> tuple:
    words = KINDS.index(opening.kind), HINGES.index(opening.hinge), SWINGS.index(opening.swing)
    return (*words, opening.edge, opening.offset, opening.width, opening.height, opening.sill)


def _openings(entries: np.ndarray) -> tuple[Opening, ...]:
    found: list[Opening] = []
    for entry in entries:
        kind = KINDS[entry["kind"]]
        offset, width, height, sill = (round(float(entry[f]), DIGITS) for f in ("offset", "width", "height", "sill"))
        name, words = numbered(kind, [o.name for o in found]), (HINGES[entry["hinge"]], SWINGS[entry["swing"]])
        found.append(Opening(name, kind, int(entry["edge"]), offset, width, height, sill, *words))
    return tuple(found)


def load_rooms(path: Path, limit: int | None = None, *, held_out: bool = False) -> list[RoomBoxes]:
    """Rooms of a rooms file, or of a room set (its held-out ones only, if so asked).

    Raises ValueError for anything else.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.is_dir() or path.suffix == ".npz":
        rooms = RoomSet(path / "rooms" if (path / "rooms").is_dir() else path)
        return [rooms.room(int(k)) for k in (rooms.held_out.nonzero()[0] if held_out else range(len(rooms)))[:limit]]
    return read_rooms(path)[:limit]


def rooms_of_type(rooms: list[RoomBoxes], word: str, path: Path) -> list[RoomBoxes]:
    """Those of a room type, in any spelling; raises ValueError naming `path` where there are none."""
    wanted = vocabulary().room_type(word).name
    kept = [room for room in rooms if vocabulary().room_type(room.room_type).name == wanted]
    if not kept:
        raise ValueError(f"{path}: holds no room of type {wanted}")
    return kept


def with_known_words(rooms: Iterable[RoomBoxes]) -> list[RoomBoxes]:
    """The rooms in the vocabulary's words, without the objects that it does not hold; relations stay where all do."""
    out = []
    for room in rooms:
        rows = [vocabulary().known_category(word) for word in room.categories]
        keep = [k for k, row in enumerate(rows) if row is not None]
        styles = room.styles or (-1,) * len(room)
        models = room.models or ("",) * len(room)
        known = replace(
            room, room_type=vocabulary().room_type(room.room_type).name,
            relations=room.relations if len(keep) == len(room) else None,
            categories=tuple(row.name for row in rows if row is not None), size=room.size[keep],
            position=room.position[keep], yaw=room.yaw[keep], models=tuple(models[k] for k in keep),
            styles=tuple(styles[k] for k in keep),
        )  # fmt: skip
        out.append(known)
    return out


def read_note(path: Path, **kinds: type) -> dict:
    """What a folder of data says of itself, a JSON object.

    `kinds`: fields that it must have, and their types.

    Raises ValueError, with the file's path, for anything else.
    """
    with telling(path, "cannot be read"):
        found = read_json(path, 2**24)
    wrong = [key for key, kind in kinds.items() if not isinstance(found, dict) or type(found.get(key)) is not kind]
    if wrong or not isinstance(found, dict):
        wanted = ", ".join(f"{key} ({kinds[key].__name__})" for key in wrong) or "an object"
        raise ValueError(f"{path}: not what a set of data says of itself, missing: {wanted}")
    return found


def set_note(folder: Path, what: str, **kinds: type) -> dict:
    """What a set of rooms or shapes says of itself, as `read_note`; raises ValueError where it is not finished, too."""
    index = folder / f"{what}s.json"
    if not index.exists():
        hint = "unfinished set, run the build again" if (folder / "plan.json").exists() else f"no {index.name}"
        raise ValueError(f"{folder}: not a {what} set ({hint})")
    return read_note(index, **kinds)


def claim(folder: Path, plan: dict) -> None:
    """Remember what a folder is being filled with (`plan.json`).

    Raises ValueError for a folder that was begun with something else.
    """
    note = folder / "plan.json"
    if not note.exists():
        check_ours(folder, "data set")
        write_json(note, plan)
        return
    found = read_note(note)
    wrong = [key for key in plan if found.get(key) != plan[key]]
    if wrong:
        listed = ", ".join(f"{key} {found.get(key)!r}" for key in wrong if key != "categories") or "other categories"
        raise ValueError(f"{folder}: was begun with {listed}; choose another folder or remove it")
