"""Runs of an evaluation: which rooms are asked, what every system made of them, and rooms from elsewhere."""

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from echomodel.boxes2d import seen
from echomodel.data.roomset import load_rooms, with_known_words
from echomodel.data.sgfront import SGFront
from echomodel.files import raising, tables
from echomodel.metrics.layouts import Task
from echomodel.metrics.statistics import Counts, Figure, Pair, figure
from echomodel.progress import StageListener
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.vocabulary import UnknownWord, vocabulary
from echousd.assets.naming import category_of
from echousd.evaluation.systems import System, drawn, finished
from echousd.folder.found import stages_at
from echousd.graph.nodes import HEIGHT
from echousd.naming import STAGE_FORMS
from echousd.stage.boxes import read_stage

HELD_OUT = 770_000  # seed of generated rooms that no training used
UNTRAINED = ("random", "generator", "shuffled")
HONEST = (*UNTRAINED, *(f"{name}+search" for name in UNTRAINED), "retrieval", "real")
SYSTEMS = ("default", "network", "guided")
SECTIONS = (
    "relations", "faults", "selection", "field", "realism", "pictures", "steps", "shapes", "physics", "repetition",
)  # fmt: skip


@dataclass(frozen=True)
class SuiteSettings:
    """What is asked.

    Arguments:
        systems: as `System.parse` reads them; the first is what others are compared with.
        against: rooms of any source, of a set those held out, of SG-FRONT the test split, or `generated`: rooms of the
            room generator that no training saw.
        count: rooms that are laid out. seed: of every draw. only: sections, () = all.
        relations: an object where people would tell them. drafts: of `+half`, of which the best is kept.
        shapes: set of shapes to compare pieces with, None = the programs' own, drawn anew.
        inception, clip: files of weights of FID, KID and FID-CLIP, None = not measured.
        workers: processes that place rooms; they change nothing.
    """

    systems: tuple[str, ...] = SYSTEMS
    against: str = "generated"
    count: int = 24
    seed: int = 0
    only: tuple[str, ...] = ()
    relations: float = 1.0
    drafts: int = 3
    shapes: str | None = None
    inception: str | None = None
    clip: str | None = None
    workers: int = 1

    def __post_init__(self) -> None:
        wrong = [name for name in self.only if name not in SECTIONS]
        if wrong:
            raise ValueError(f"--only: no section {wrong[0]!r}, allowed: {', '.join(SECTIONS)}")
        if self.count < 2:
            raise ValueError(f"--count is {self.count}, allowed: 2 or more; one room alone has no interval")


@dataclass(frozen=True)
class Table:
    """Rows of systems, columns of figures.

    Arguments:
        name: of the section; note: what is measured, in a sentence or two. rows: system -> column -> figure.
        curves: panel -> line -> (x, y); what is plotted, instead of the rows. plain: without a plot.
    """

    name: str
    title: str
    note: str
    rows: Mapping[str, Mapping[str, Figure]]
    curves: Mapping[str, Mapping[str, tuple[Sequence[float], Sequence[float]]]] = field(default_factory=dict)
    plain: bool = False

    @property
    def columns(self) -> list[str]:
        """Of all rows, in their order."""
        return list(dict.fromkeys(column for row in self.rows.values() for column in row))


@dataclass(frozen=True, eq=False)
class Run:
    """What was laid out.

    Arguments:
        systems: in the order of the rows. tasks: that all who can be asked were asked. reference: other rooms of that
            source. made, of: system -> its rooms and what they were asked, room by room.
        seconds: of the processor a room. missing: what is not measured and why; shown: system -> (n, 256, 256, 3)
        pictures from above; sections add to both.
    """

    settings: SuiteSettings
    systems: Sequence[System]
    tasks: Sequence[Task]
    reference: Sequence[RoomBoxes]
    made: Mapping[str, Sequence[RoomBoxes]]
    of: Mapping[str, Sequence[Task]]
    seconds: Mapping[str, float]
    missing: list[str] = field(default_factory=list)
    shown: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def asked(self) -> list[System]:
        """Systems that lay out other tasks as well, one draft each."""
        return [system for system in self.systems if not system.foreign and system.finish != "half"]


def rooms_against(settings: SuiteSettings) -> tuple[list[RoomBoxes], list[RoomBoxes]]:
    """Rooms to lay out and, of the same source, as many others to compare with; raises ValueError for too few."""
    wanted = 2 * settings.count
    path = Path(settings.against)
    published = (path / "classes_all.txt").exists()
    if settings.against == "generated":
        rooms = generate_rooms(wanted, HELD_OUT + settings.seed)
    elif published:
        rooms = SGFront(path, split="test").rooms()
    else:
        rooms = rooms_from(path, held_out=True)
    known = [room if published else replace(room, relations=None) for room in known_rooms(settings.against, rooms)]
    rooms = [room for room in known if len(room) > 1 and len(room.floor_polygon) > 2]
    if len(rooms) < 4:
        needed = "4 are needed (of a set among those held out, every twentieth)"
        raise ValueError(f"{settings.against}: {len(rooms)} rooms with a floor and two known objects, {needed}")
    chosen = _spread(rooms, min(wanted, len(rooms) // 2 * 2))
    return chosen[::2], chosen[1::2]


def _spread(found: Sequence[Any], count: int) -> list[Any]:
    """At most so many, from all parts of a sequence."""
    count = min(count, len(found))
    return [found[number * len(found) // count] for number in range(count)]


def known_rooms(name: str, rooms: Sequence[RoomBoxes]) -> list[RoomBoxes]:
    """The rooms in the vocabulary's words; raises ValueError that names the source for a room type of another one."""
    with raising(f"{name}:", UnknownWord):
        return with_known_words(rooms)


def run_systems(
    systems: Sequence[System], tasks: Sequence[Task], settings: SuiteSettings, progress: StageListener | None = None
) -> tuple[dict[str, list[RoomBoxes]], dict[str, float]]:
    """The rooms of every system, and its CPU seconds a room (drawing here, placing wherever it ran)."""
    made: dict[str, list[RoomBoxes]] = {}
    seconds: dict[str, float] = {}
    bases: dict[tuple[str, int], tuple[list[RoomBoxes], float]] = {}
    several = settings.workers > 1
    with ProcessPoolExecutor(settings.workers, get_context("spawn")) if several else nullcontext() as pool:
        for number, system in enumerate(systems):
            keys = [(system.base, draft) for draft in range(settings.drafts if system.finish == "half" else 1)]
            for base, draft in keys:
                if (base, draft) not in bases:
                    bases[base, draft] = _timed(drawn, system, tasks, settings.seed + 1000 * draft)
            drafts = [bases[key] for key in keys]
            work, over = partial(_timed, finished, system), (tasks, zip(*(rooms for rooms, _ in drafts), strict=True))
            done = list(pool.map(work, *over, chunksize=2) if pool else map(work, *over))
            made[system.name] = [room for room, _ in done]
            seconds[system.name] = sum(took for _, took in [*drafts, *done]) / len(tasks)
            if progress:
                progress("rooms", number + 1, len(systems))
    return made, seconds


def _timed(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    began = time.process_time()
    return work(*arguments), time.process_time() - began


def rooms_of(system: System, settings: SuiteSettings) -> tuple[list[Task], list[str]]:
    """Rooms from elsewhere as tasks that they answered themselves, and what was left out of them, a sentence each."""
    assert system.foreign is not None
    found = rooms_from(system.foreign)
    known = known_rooms(system.name, found)
    odd = sorted({word for old, new in zip(found, known, strict=True) for word in {*old.categories}
                  if vocabulary().known_category(word) is None})  # fmt: skip
    notes = [f"{system.name}: objects that the vocabulary does not hold are left out: {', '.join(odd)}"] if odd else []
    bare = sum(len(room.floor_polygon) < 3 for room in known)
    if bare:
        notes.append(f"{system.name}: {bare} of {len(known)} rooms have no floor, figures of floors leave them out")
    stated = [np.array(() if room.relations is None else room.relations, np.int64).reshape(-1, 3) for room in known]
    tasks = [Task(room, kept) for room, kept in zip(known, stated, strict=True) if len(room)]
    if len(tasks) < 2:
        raise ValueError(f"{system.name}: {len(tasks)} rooms with known objects, 2 or more are needed for an interval")
    return _spread(tasks, settings.count), notes


def note(section: str, **values: Any) -> str:
    """What a table measures, as notes.toml has it."""
    return " ".join(tables("notes.toml", __file__)[section].split()).format(**values)


def figures(
    scores: Mapping[str, Sequence[Mapping[str, Pair]]], columns: Sequence[str], seed: int, reference: str
) -> dict[str, dict[str, Figure]]:
    """The table of some columns of what rooms score, every system compared with one of them on the same rooms."""
    counts = {
        name: {column: Counts.of([row.get(column, (0.0, 0.0)) for row in rows]) for column in columns}
        for name, rows in scores.items()
    }
    return {
        name: {c: figure(row[c], seed, counts[reference][c] if name != reference else None) for c in columns}
        for name, row in counts.items()
    }


ASSETS = ("_data", "assets")  # folders beside SceneEval's states, or above, in which its models lie
BUFFER = 0.1  # metres that Holodeck adds to what an object covers
Object = tuple[str, np.ndarray, np.ndarray, float]  # word, size, position, yaw


def rooms_from(path: Path, *, held_out: bool = False) -> list[RoomBoxes]:
    """The rooms at a path, whatever wrote them; the words are theirs. `held_out`: of a set those that it holds out.

    Raises ValueError that names the file, for none and for what cannot be read.
    """
    if path.is_dir() and not any(path.rglob("rooms-*.npz")):
        files = sorted(file for file in path.rglob("*.json") if not {*ASSETS} & {*file.relative_to(path).parts})
        found = [room for file in files for room in _from_json(file)]
        found += [room for file in stages_at(path) for room in read_stage(file)]
        if not found:
            raise ValueError(f"{path}: no room in this folder, allowed: rooms of ours, USD, rooms or scene JSON")
        return found
    if path.suffix in STAGE_FORMS:
        return read_stage(path)
    rooms = _from_json(path) if path.is_file() and path.suffix != ".npz" else load_rooms(path, held_out=held_out)
    if not rooms and not held_out:
        raise ValueError(f"{path}: no rooms, a state of SceneEval, Holodeck's or SceneSmith's JSON")
    return rooms


def _from_json(file: Path) -> list[RoomBoxes]:
    with raising(f"{file}: neither a stage ({', '.join(STAGE_FORMS)}), a set (.npz) nor JSON", ValueError, OSError):
        raw = json.loads(file.read_bytes())
    try:
        match raw:
            case {"format": "sceneState"}:
                return [_sceneeval(raw["scene"], file)]
            case {"rooms": list(), "objects": list(), "walls": _}:
                return [_holodeck(raw, room, file) for room in raw["rooms"]]
            case {"room_type": _, "objects": list(), "floor_polygon": _}:
                return [RoomBoxes.from_json(raw)]
            case {"objects": dict()}:
                return [_scenesmith(raw, file)]
    except (AttributeError, KeyError, TypeError, IndexError, ValueError, RecursionError) as error:
        raise ValueError(f"{file}: not a room as it says ({type(error).__name__} {error})") from None
    return load_rooms(file) if isinstance(raw, dict) and isinstance(raw.get("rooms"), list) else []


def _room(name: str, kind: str, floor: Iterable[Iterable[float]], height: float, found: list[Object]) -> RoomBoxes:
    """A room of objects; a type that we do not know is told by its name, else a living room."""
    known = vocabulary().room_types
    words = [row.name for row in known if row.name in kind.lower().replace(" ", "_")]
    return RoomBoxes(
        id=name,
        room_type=words[0] if words else "living_room",
        floor_polygon=np.array([tuple(corner) for corner in floor], float).reshape(-1, 2),
        height=height,
        categories=tuple(category_of([], word, dims=size)[0] or word for word, size, *_ in found),
        size=np.array([size for _, size, _, _ in found], float).reshape(-1, 3),
        position=np.array([place for _, _, place, _ in found], float).reshape(-1, 3),
        yaw=np.array([yaw for *_, yaw in found], float),
    )


def _sceneeval(scene: dict[str, Any], file: Path) -> RoomBoxes:
    """Z up; what an object is and how large says its model."""
    elements = scene["arch"]["elements"]
    floor: list = next((e["points"] for e in elements if e["type"] == "Floor"), [])
    heights = [float(e["height"]) for e in elements if e["type"] == "Wall"]
    found: list[Object] = []
    for entry in scene["object"]:
        matrix = np.array(entry["transform"]["data"], float).reshape(4, 4).T
        word, bounds = _model(entry["modelId"], file)
        corners = trimesh.bounds.corners(bounds) @ matrix[:3, :3].T + matrix[:3, 3]
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        front = matrix[:3, 2]  # a model's front is its +Z, as in glTF
        middle = matrix[:3, :3] @ bounds.mean(0) + matrix[:3, 3]
        place = np.array([middle[0], corners[:, 2].min(), -middle[1]])
        size = (bounds[1] - bounds[0]) * scale
        found.append((word, size, place, math.atan2(front[0], -front[1])))
    kind = " ".join(sorted({str(e.get("roomId", "")) for e in elements}))
    return _room(file.stem, kind, ((x, -y) for x, y, _ in floor), max(heights, default=HEIGHT), found)


@cache
def _model(name: str, file: Path) -> tuple[str, np.ndarray]:
    """What a model is called and its bounds (2, 3), metres; raises ValueError that names the file that is missing."""
    number = name.rpartition(".")[2]
    for top in (file.parent, *list(file.parents)[1:3]):
        for folder in (place for kind in ASSETS for place in sorted((top / kind).glob(f"*/{number}"))):
            annotations = json.loads((folder / "data.json").read_text("utf-8"))["annotations"]
            return str(annotations["category"]), np.asarray(trimesh.load_scene(folder / f"{number}.glb").bounds, float)
    wanted = f"_data/<data set>/{number}/{number}.glb"
    raise ValueError(f"{file}: model {name} is not there, wanted: {wanted} beside it or above")


def _holodeck(house: dict[str, Any], room: dict[str, Any], file: Path) -> RoomBoxes:
    """Left-handed with Y up: x is mirrored. Footprints in centimetres with a rim, heights from the middles."""
    found: list[Object] = []
    for entry in house["objects"]:
        if entry.get("roomId") != room["id"] or "vertices" not in entry:
            continue
        plan = np.ptp(np.array(entry["vertices"], float), axis=0) / 100 - BUFFER
        turned = round(entry["rotation"]["y"] / 90) % 2 == 1
        place = entry["position"]
        size = np.array([plan[1] if turned else plan[0], 2 * place["y"], plan[0] if turned else plan[1]]).clip(0.02)
        name = entry.get("object_name", entry["id"])
        where = np.array([-place["x"], 0.0, place["z"]])
        found.append((name.rpartition("-")[0] or name, size, where, -math.radians(entry["rotation"]["y"])))
    floor = [(-point["x"], point["z"]) for point in room["floorPolygon"]]
    height = float(house.get("wall_height", HEIGHT))
    return _room(f"{file.stem} {room['id']}", str(room.get("roomType", "")), floor, height, found)


def _scenesmith(raw: dict[str, Any], file: Path) -> RoomBoxes:
    """Z up, fronts along +Y; bounds in the object's frame, a pose with a quaternion."""
    found: list[Object] = []
    for entry in raw["objects"].values():
        if entry.get("object_type") in ("wall", "floor") or not entry.get("bbox_min"):
            continue
        low, high = np.array(entry["bbox_min"], float), np.array(entry["bbox_max"], float)
        w, x, y, z = entry["transform"]["rotation_wxyz"]
        turn = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        at = np.array(entry["transform"]["translation"], float)
        plan = at[:2] + seen((low + high)[:2] / 2, turn)
        size = (high - low)[[0, 2, 1]]
        place = np.array([plan[0], at[2] + low[2], -plan[1]])
        found.append((entry["name"], size, place, turn + math.pi))
    outline = raw.get("room_geometry") or {}
    x, z = (float(outline.get(side, 0)) / 2 for side in ("length", "width"))
    floor = [(-x, -z), (x, -z), (x, z), (-x, z)] if x and z else []
    return _room(file.stem, str(raw.get("room_type", "")), floor, float(outline.get("wall_height", HEIGHT)), found)
