"""Sets of labelled rooms on disk: sharded, memory-mapped, about half a kilobyte a room, read as rooms or as batches.

A packed set is one compressed file (`pack_rooms`), 0.14 kB a room, in millimetres; it is labelled when it is read.

A folder holds `rooms.json` (what the set is, written last) and shards `rooms-0000.bin`: a header, then five tables, one
entry per room, object, floor corner, opening and ordered pair of objects. A pair carries one bit per predicate and rule
set.
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from echomodel.files import read_json, whole_file, write_json
from echomodel.openings import HINGES, KINDS, SWINGS, Opening, numbered
from echomodel.progress import StepListener
from echomodel.roomboxes import RoomBoxes, read_rooms
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

MAGIC = b"ECHOROM3"
MAGIC_OF_16 = b"ECHOROM2"  # earlier sets: 16 bits per pair and rule set
RULES = ("strict", "sgfront")
ROOM = np.dtype(
    [("objects", "<u4"), ("corners", "<u4"), ("openings", "<u4"), ("pairs", "<u4"), ("type", "u1"), ("held_out", "u1"),
     ("shaken", "u1"), ("height", "<f4")]  # rooms of earlier sets were shaken on purpose
)  # fmt: skip
OBJECT = np.dtype(
    [("category", "u1"), ("style", "<i2"), ("size", "<f4", 3), ("position", "<f4", 3), ("yaw", "<f4")]
)  # fmt: skip
CORNER = np.dtype(("<f4", 2))
OPENING = np.dtype(
    [("kind", "u1"), ("hinge", "u1"), ("swing", "u1"), ("edge", "<u2"), ("offset", "<f4"), ("width", "<f4"),
     ("height", "<f4"), ("sill", "<f4")]
)  # fmt: skip
PAIR = np.dtype(("<u4", len(RULES)))  # one bit per predicate
BITS = 32
TABLES = (("rooms", ROOM), ("objects", OBJECT), ("corners", CORNER), ("openings", OPENING), ("pairs", PAIR))
ROOMS_PER_SHARD = 1000
HELD_OUT_EVERY = 20  # every twentieth room is kept out of training
DIGITS = 4  # a tenth of a millimetre
MILLIMETRES, STEPS = 1000.0, {"yaw": 1e4}  # steps to the unit of the numbers of a packed set


def build_rooms(
    directory: str | os.PathLike[str],
    count: int,
    seed: int,
    styles: int,
    progress: StepListener | None = None,
    *,
    halls: float = 0.0,
) -> RoomSet:
    """Generate and label a set of rooms, shard by shard; the same bytes for the same seed, whenever interrupted.

    Arguments:
        directory: folder of the set; shards that are complete there are kept.
        count: number of rooms, at least 1. seed: seed of the world. styles: number of style groups of the shape set.
        progress: called with (rooms done, rooms in all).
        halls: share of large rooms of several zones, 0 to 1.

    Raises:
        ValueError: the folder holds a set that was begun with other arguments.
    """
    if count < 1:
        raise ValueError(f"number of rooms is {count}, need at least 1")
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    words = [category.name for category in vocabulary().categories]
    plan = {"kind": "generated rooms", "seed": seed, "rooms": count, "styles": styles, "categories": words}
    plan["room_types"] = [room_type.name for room_type in vocabulary().room_types]
    if halls:
        plan["halls"] = halls
    claim(folder, plan)
    for number, first in enumerate(range(0, count, ROOMS_PER_SHARD)):
        path = folder / f"rooms-{number:04d}.bin"
        last = min(first + ROOMS_PER_SHARD, count)
        if not path.exists():
            rooms: list[RoomBoxes] = []
            for start in range(first, last, 100):
                drawn = generate_rooms(min(100, last - start), seed, styles=styles, start=start, halls=halls)
                rooms += drawn
                if progress:
                    progress(start + min(100, last - start), count)
            write_shard(path, rooms, first)
        elif progress:
            progress(last, count)
    write_json(folder / "rooms.json", plan)
    return RoomSet(folder)


def write_shard(path: str | os.PathLike[str], rooms: Sequence[RoomBoxes], first: int = 0) -> None:
    """Label rooms (by all rule sets) and write them as one shard, complete or not at all; `first` is the number of the
    first room in its set. Raises `UnknownWord` for a category or room type that the vocabulary does not hold."""
    path, rooms = Path(path), [_rounded(room) for room in rooms]
    joined = _tables_of(rooms, [_held_out(first + k) for k in range(len(rooms))]) | {"pairs": _pairs(rooms)}
    with whole_file(path) as beside, beside.open("wb") as file:
        file.write(MAGIC + np.array([len(joined[name]) for name, _ in TABLES], "<u8").tobytes())
        for name, _ in TABLES:
            file.write(joined[name].tobytes())


def pack_rooms(path: str | os.PathLike[str], rooms: Sequence[RoomBoxes], held_out: Sequence[bool], info: dict) -> None:
    """Write rooms as one packed set, complete or not at all, that `RoomSet` reads.

    Arguments:
        held_out: which of them no training may see. info: what the set says of itself.

    Raises `UnknownWord` as `write_shard`, and ValueError for a number that is no whole count of millimetres below 2^15.
    """
    names = {kind: [row.name for row in getattr(vocabulary(), kind)] for kind in ("categories", "room_types")}
    note = {"kind": "rooms", "seed": 0, **info, "rooms": len(rooms), **names}
    columns: dict[str, np.ndarray] = {"note": np.frombuffer(json.dumps(note).encode(), np.uint8)}
    for name, table in _tables_of(rooms, held_out).items():
        for field in _packed_fields(table.dtype):
            column = table[field] if field else table
            if column.dtype.kind == "f":
                column = np.round(column * STEPS.get(field, MILLIMETRES))
                if np.abs(column).max(initial=0) >= 2**15:
                    raise ValueError(f"{name}.{field} reaches {np.abs(column).max()} steps, a packed set holds 32767")
                column = column.astype("<i2")
            columns[f"{name}.{field}"] = column
    with whole_file(path) as beside, beside.open("wb") as file:
        np.savez_compressed(file, **columns)  # type: ignore[arg-type]


def _packed_fields(dtype: np.dtype) -> list[str]:
    """The columns of a packed table; "" for a table of plain numbers."""
    return [field for field in dtype.names or ("",) if field != "shaken"]


def _unpacked(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """What a packed set says of itself, and its tables without labels; raises ValueError for other files."""
    tables: dict[str, np.ndarray] = {}
    try:
        with np.load(path, allow_pickle=False) as held:
            note = json.loads(held["note"].tobytes())
            for name, dtype in TABLES[:-1]:
                parts = {field: held[f"{name}.{field}"] for field in _packed_fields(dtype)}
                tables[name] = table = np.zeros(len(next(iter(parts.values()))), dtype)
                for field, column in parts.items():
                    into = table[field] if field else table
                    into[...] = column / STEPS.get(field, MILLIMETRES) if into.dtype.kind == "f" else column
        pairs = int((tables["rooms"]["objects"].astype(np.int64) ** 2).sum())
        return note, tables | {"pairs": np.zeros((pairs, len(RULES)), PAIR.base)}
    except (OSError, KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{path}: not a packed set of rooms ({error})") from None


def _tables_of(rooms: Sequence[RoomBoxes], held_out: Sequence[bool]) -> dict[str, np.ndarray]:
    """The tables of some rooms but for their pairs."""
    words = vocabulary()
    tables: dict[str, list[np.ndarray]] = {name: [] for name, _ in TABLES[:-1]}
    for k, room in enumerate(rooms):
        n = len(room)
        entry = (n, len(room.floor_polygon), len(room.openings), n * n, words.room_type_id(room.room_type),
                 held_out[k], 0, room.height)  # fmt: skip
        objects = np.zeros(n, OBJECT)
        objects["category"] = [words.category_id(category) for category in room.categories]
        objects["style"] = room.styles or -1
        objects["size"], objects["position"], objects["yaw"] = room.size, room.position, room.yaw
        tables["rooms"].append(np.array([entry], ROOM))
        tables["objects"].append(objects)
        tables["corners"].append(np.asarray(room.floor_polygon, "<f4"))
        tables["openings"].append(np.array([_entry(opening) for opening in room.openings], OPENING))
    return {name: np.ascontiguousarray(np.concatenate(tables[name])).astype(dtype.base) for name, dtype in TABLES[:-1]}


def _pairs(rooms: Sequence[RoomBoxes]) -> np.ndarray:
    """(P, rule sets) uint32, the relations of all ordered pairs of the rooms, labelled anew."""
    counts = np.array([len(room) for room in rooms], np.int64)
    first = np.cumsum(counts**2) - counts**2
    pairs = np.zeros((int((counts**2).sum()), len(RULES)), PAIR.base)
    for column, rules in enumerate(RULES):
        for k, found in enumerate(label_rooms(rooms, rules=rules)):
            subject, predicate, object_ = found.T
            if predicate.max(initial=0) >= BITS:
                word = vocabulary().predicates[predicate.max()].name
                raise ValueError(f"predicate {word} has number {predicate.max()}: a room set holds those below {BITS}")
            at = first[k] + subject * counts[k] + object_
            np.bitwise_or.at(pairs[:, column], at, (1 << predicate).astype(PAIR.base))
    return pairs


class RoomSet:
    """A set of labelled rooms on disk, read through memory maps.

    Arguments:
        directory: folder with `rooms.json` and its shards, or a packed set, which is held in memory.

    Attributes: `held_out`, `shaken` (n,) bool, `counts` (n,) objects per room, `info`, what `rooms.json` says. Raises
    ValueError for a folder without a finished set or with a damaged shard.
    """

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        self.directory = Path(directory)
        packed: list[dict[str, np.ndarray]] = []
        if self.directory.is_file():
            self.info, held = _unpacked(self.directory)
            packed = [held]
        else:
            index = self.directory / "rooms.json"
            if not index.exists():
                unfinished = (self.directory / "plan.json").exists()
                hint = "unfinished set, run the build again" if unfinished else "no rooms.json"
                raise ValueError(f"{self.directory}: not a room set ({hint})")
            self.info = read_note(index, rooms=int)
        words = vocabulary()
        # sets of before named their categories alone
        here = {kind: [row.name for row in getattr(words, kind)] for kind in ("categories", "room_types")}
        self._names: dict[str, list[str]] = {kind: self.info.get(kind, here[kind]) for kind in here}
        most = {kind: len(names) for kind, names in self._names.items()}
        self._shards = [checked(self.directory, held, most) for held in packed]
        self._shards += [_tables(path, most) for path in sorted(self.directory.glob("rooms-*.bin"))]
        rooms = [shard["rooms"] for shard in self._shards]
        count = sum(map(len, rooms))
        if count != self.info["rooms"]:
            raise ValueError(f"{self.directory}: shards hold {count} rooms, rooms.json says {self.info['rooms']}")
        self._table = np.concatenate(rooms)
        self._shard_of = np.repeat(np.arange(len(rooms)), [len(table) for table in rooms])
        # Where each room's entries begin within its shard.
        self._begin = {
            name: np.concatenate([np.cumsum(table[name], dtype=np.int64) - table[name] for table in rooms])
            for name in ("objects", "corners", "openings", "pairs")
        }
        self.held_out = self._table["held_out"].astype(bool)
        self.shaken = self._table["shaken"].astype(bool)
        self.counts = self._table["objects"].astype(np.int64)
        for tables in packed:
            tables["pairs"][:] = _pairs([self.room(k) for k in range(len(self))])

    def __len__(self) -> int:
        return len(self._table)

    def _part(self, name: str, room: int) -> np.ndarray:
        start = self._begin[name][room]
        return self._shards[self._shard_of[room]][name][start : start + int(self._table[name][room])]

    def room(self, number: int, *, rules: str = "strict") -> RoomBoxes:
        """One room with all its relations by the given rules."""
        entry, objects = self._table[number], self._part("objects", number)
        names = tuple(self._names["categories"][k] for k in objects["category"])
        styles = tuple(int(style) for style in objects["style"])
        return RoomBoxes(
            id=f"room_{self.info['seed']}_{number:06d}",
            room_type=self._names["room_types"][entry["type"]],
            floor_polygon=np.round(self._part("corners", number).astype(float), DIGITS),
            height=round(float(entry["height"]), DIGITS),
            categories=names,
            size=np.round(objects["size"].astype(float), DIGITS),
            position=np.round(objects["position"].astype(float), DIGITS),
            yaw=objects["yaw"].astype(float),
            models=tuple(f"s{style}_{name}" if style >= 0 else "" for style, name in zip(styles, names, strict=True)),
            styles=styles,
            relations=self.relations(number, rules=rules),
            openings=_openings(self._part("openings", number)),
        )

    def relations(self, number: int, *, rules: str = "strict") -> np.ndarray:
        """(E, 3) int64 [subject, predicate, object] of one room; raises ValueError for unknown rules."""
        bits = self._part("pairs", number)[:, _column(rules)]
        pair, predicate = np.nonzero((bits[:, None] >> np.arange(8 * bits.itemsize, dtype=bits.dtype)) & 1)
        return np.stack([*np.divmod(pair, self.counts[number]), predicate], -1)[:, [0, 2, 1]].astype(np.int64)


def _held_out(number: int) -> bool:
    return number % HELD_OUT_EVERY == HELD_OUT_EVERY - 1


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


def _rounded(room: RoomBoxes) -> RoomBoxes:
    """The room as it comes back from disk, so that its labels fit it."""
    entry = room.to_json(DIGITS)
    for k, item in enumerate(entry["objects"]):
        item["yaw"] = float(np.float32(room.yaw[k]))
    return RoomBoxes.from_json(entry)


def _column(rules: str) -> int:
    if rules not in RULES:
        raise ValueError(f"unknown rules {rules!r}: a room set is labelled by {', '.join(RULES)}")
    return RULES.index(rules)


def _tables(path: Path, most: Mapping[str, int]) -> dict[str, np.ndarray]:
    raw = np.memmap(path, np.uint8, mode="r")
    if bytes(raw[:8]) not in (MAGIC, MAGIC_OF_16):
        raise ValueError(f"{path}: not a shard of rooms (begins with {bytes(raw[:8])!r}, expected {MAGIC!r})")
    tables = TABLES if bytes(raw[:8]) == MAGIC else (*TABLES[:-1], ("pairs", np.dtype(("<u2", len(RULES)))))
    counts = np.frombuffer(raw[8 : 8 + 8 * len(TABLES)].tobytes(), "<u8").astype(int)
    need = 8 + 8 * len(TABLES) + sum(int(n) * dtype.itemsize for n, (_, dtype) in zip(counts, tables, strict=True))
    if len(raw) != need:
        raise ValueError(f"{path}: damaged shard, {len(raw)} bytes of {need}; remove it and build again")
    out, start = {}, 8 + 8 * len(TABLES)
    for number, (name, dtype) in zip(counts, tables, strict=True):
        out[name] = np.frombuffer(raw, dtype.base, int(number) * int(np.prod(dtype.shape)), start)
        out[name] = out[name].reshape(int(number), *dtype.shape)
        start += int(number) * dtype.itemsize
    return checked(path, out, most)


def checked(path: Path, out: dict[str, np.ndarray], most: Mapping[str, int]) -> dict[str, np.ndarray]:
    """The tables of one shard; raises ValueError where they contradict one another."""
    rooms = out["rooms"]
    wrong = [name for name in list(out)[1:] if rooms[name].sum(dtype=np.uint64) != len(out[name])]
    wrong += [] if (rooms["pairs"] == rooms["objects"].astype(np.uint64) ** 2).all() else ["pairs"]
    wrong += [] if out["objects"]["category"].max(initial=0) < most["categories"] else ["categories"]
    wrong += [] if rooms["type"].max(initial=0) < most["room_types"] else ["room types"]
    if wrong:
        raise ValueError(f"{path}: damaged shard, its {wrong[0]} are not those of its rooms; remove it and build again")
    return out


LARGEST = 2**24  # bytes of a note


def read_note(path: Path, **kinds: type) -> dict:
    """What a folder of data says of itself, a JSON object.

    Arguments:
        kinds: fields that it must have, and their types.

    Raises ValueError, with the file's path, for anything else.
    """
    try:
        found = read_json(path, LARGEST)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror or error})") from None
    wrong = [key for key, kind in kinds.items() if not isinstance(found, dict) or type(found.get(key)) is not kind]
    if wrong or not isinstance(found, dict):
        told = ", ".join(f"{key} ({kinds[key].__name__})" for key in wrong) or "an object"
        raise ValueError(f"{path}: not what a set of data says of itself, missing: {told}")
    return found


def claim(folder: Path, plan: dict) -> None:
    """Remember what a folder is being filled with (`plan.json`).

    Raises ValueError for a folder that was begun with something else.
    """
    note = folder / "plan.json"
    if not note.exists():
        write_json(note, plan)
        return
    found = read_note(note)
    wrong = [key for key in plan if found.get(key) != plan[key]]
    if wrong:
        told = ", ".join(f"{key} {found.get(key)!r}" for key in wrong if key != "categories") or "other categories"
        raise ValueError(f"{folder}: was begun with {told}; choose another folder or remove it")


def load_rooms(path: Path, limit: int | None = None, *, held_out: bool = False) -> list[RoomBoxes]:
    """Rooms of a rooms file or a room set (its held-out ones only, if so asked).

    Raises ValueError for anything else.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.is_dir() or path.suffix == ".npz":
        rooms = RoomSet(path / "rooms" if (path / "rooms").is_dir() else path)
        numbers = rooms.held_out.nonzero()[0] if held_out else range(len(rooms))
        return [rooms.room(int(k)) for k in numbers[:limit]]
    if held_out:
        raise ValueError(f"{path}: a rooms file holds nothing out, allowed with --held-out: a folder of a room set")
    return read_rooms(path)[:limit]


def rooms_of_type(rooms: list[RoomBoxes], word: str, path: Path) -> list[RoomBoxes]:
    """Those of a room type, in any spelling; raises ValueError naming `path` where there are none."""
    wanted = vocabulary().room_type(word).name
    kept = [room for room in rooms if vocabulary().room_type(room.room_type).name == wanted]
    if not kept:
        raise ValueError(f"{path}: holds no room of type {wanted}")
    return kept
