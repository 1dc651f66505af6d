"""The plan of a run, written down before the first room, and its journals: a line for every room made or failed."""

import hashlib
import json
import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, cached_property
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, create_model

import echousd
from echomodel.bounded import bounded_lines
from echomodel.files import whole_file
from echousd.batches.options import BatchOptions, BatchRequest
from echousd.batches.sources import find_graphs
from echousd.folder.lock import LOCK
from echousd.folder.manifest import MAX_SEED, Name, find_manifest
from echousd.folder.within import check_links, inside
from echousd.graph import SceneGraph
from echousd.graph.values import IDENTIFIER
from echousd.invalid import validation_message
from echousd.naming import LAYER_FORMS, as_identifier
from echousd.pending import STAGING
from echousd.store import Store

STATE = ".batch"  # folder of plan and journals
STORE = "store"  # folder of the assets that the rooms share
PLAN, GRAPHS = "plan.jsonl", "graphs.jsonl"
MOST = 1_000_000  # rooms of a run: a plan is held in memory
SHELF = 1000  # rooms in one folder
Seed = Annotated[int, Field(strict=True, ge=0, le=MAX_SEED)]
Text = Annotated[str, Field(min_length=0)]  # which UTF-8 can hold: a length is asked of no other


@dataclass(frozen=True, slots=True)
class Entry:
    """One room of the plan.

    Arguments:
        number: from 0; id: name of its folder and root layer.
        origin: where its graph comes from; graph: digest of the graph's text, "" for one that is drawn.
        draw: (room type, seed, number) of a graph from the room generator, or None.
        seed: of the room. options: which of the plan's sets of options it takes.
        error: why its graph cannot be read.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    number: Seed
    id: Name
    origin: Text
    graph: Text
    seed: Seed
    options: Seed = 0
    draw: tuple[Text, Seed, Seed] | None = None
    error: Text = ""

    @property
    def path(self) -> str:
        """Folder of the room below that of the run."""
        return f"rooms/{self.number // SHELF:04d}/{self.id}"

    def folder(self, run: Path) -> Path:
        """Folder of the room; raises ValueError where a link on the way leads out of the run's folder."""
        return inside(run, self.path, f"{run}: room {self.id}")


@dataclass(frozen=True, eq=False)
class RunPlan:
    """All rooms of a run.

    Arguments:
        head: version, hash of the weights, the request: what must be equal for a run to be gone on with.
        options: the sets of options. entries: the rooms. graphs: digest -> canonical JSON of a graph.
    """

    head: dict[str, Any]
    options: tuple[BatchOptions, ...]
    entries: tuple[Entry, ...]
    graphs: dict[str, str]

    @property
    def request(self) -> BatchRequest:
        """What the run was asked."""
        asked = self.head["request"]
        return BatchRequest(**{**asked, "options": BatchOptions(**asked["options"])})

    @cached_property
    def digest(self) -> str:
        """Hash of all of it."""
        found = hashlib.sha256()
        for line in self.lines():
            found.update(line.encode())
        return found.hexdigest()[:16]

    def lines(self) -> Iterator[str]:
        """The plan as JSON lines, the head first."""
        head = {**self.head, "sets": [options.model_dump() for options in self.options]}
        yield json.dumps(head, sort_keys=True) + "\n"
        for entry in self.entries:
            yield json.dumps(asdict(entry)) + "\n"

    def part(self, shard: tuple[int, int]) -> tuple[Entry, ...]:
        """The rooms of shard i of n: every n-th from number i on."""
        return self.entries[shard[0] :: shard[1]]


def make_plan(request: BatchRequest, weights: str, outside: Sequence[str] = ()) -> RunPlan:
    """The plan of a request; the same for the same request, files and weights.

    Arguments:
        weights: hash of the weights.
        outside: folders besides those of the graphs' files in which files of models may lie.
    """
    sets: dict[BatchOptions, int] = {}
    entries: list[Entry] = []
    graphs: dict[str, str] = {}

    def add(name: str, origin: str, digest: str, copy: int, draw: Any = None, error: str = "") -> None:
        number = len(entries)
        if number == MOST:
            raise ValueError(f"{origin}: more than {MOST} rooms, allowed in one run: that many")
        chosen = sets.setdefault(request.chosen(copy), len(sets))
        seed = request.seed + copy
        origin, error = (text.encode("utf-8", "replace").decode() for text in (origin, error))  # of odd file names
        entries.append(
            Entry(number, f"{as_identifier(name)[:60]}_{number:06d}", origin, digest, seed, chosen, draw, error)
        )

    for found in find_graphs(request.sources, outside):
        digest = hashlib.sha256(found.text.encode()).hexdigest()[:16] if found.text else ""
        if digest:
            graphs[digest] = found.text
        for copy in range(request.count):
            add(found.name, found.origin, digest, copy, error=found.error)
    for kind, count in request.sample.items():
        for copy in range(count):
            add(kind, f"sample:{kind}:{copy}", "", copy, (kind, request.seed, copy))
    head = {
        "echousd_batch": 1,
        "version": echousd.__version__,
        "weights": weights,
        "rooms": len(entries),
        "request": request.model_dump(),
    }
    return RunPlan(head, tuple(sets), tuple(entries), graphs)


def save_plan(plan: RunPlan, folder: Path) -> None:
    """Write the plan and its graphs, each whole or not at all; the plan last."""
    state = folder / STATE
    state.mkdir(parents=True, exist_ok=True)
    with whole_file(state / GRAPHS) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps({"graph": key, "text": text}) + "\n" for key, text in plan.graphs.items())
    with whole_file(state / PLAN) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(plan.lines())


def load_plan(folder: Path) -> RunPlan:
    """The plan of the run in `folder`; raises ValueError where there is none or it cannot be read."""
    path = inside(folder, f"{STATE}/{PLAN}", f"{folder}: the run")
    if not path.is_file():
        raise ValueError(f"{folder}: no run of echousd batch (no {STATE}/{PLAN})")
    try:
        with path.open("rb") as file:
            lines = bounded_lines(file, LONGEST, path)
            head = _head(json.loads(next(lines)))
            sets = tuple(BatchOptions(**raw) for raw in head.pop("sets"))
            entries = tuple(_entry(json.loads(line), number, len(sets)) for number, line in enumerate(lines))
        texts = inside(folder, f"{STATE}/{GRAPHS}", f"{folder}: the run")
        if not texts.is_file():
            raise ValueError(f"no regular file {STATE}/{GRAPHS}")
        with texts.open("rb") as file:
            rows = map(json.loads, bounded_lines(file, LONGEST, texts))
            graphs = {str(row["graph"]): str(row["text"]) for row in rows}
        if head["echousd_batch"] != 1 or head["rooms"] != len(entries):
            raise ValueError("it is not whole")
    except (OSError, StopIteration, KeyError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not a plan of this version ({error})") from None
    return RunPlan(head, sets, entries, graphs)


def difference(old: RunPlan, new: RunPlan) -> str:
    """What the new plan says otherwise, in one line; "" where both are equal."""
    if old.digest == new.digest:
        return ""
    lines = [f"{key} was {a}, now {b}" for key, a, b in _unequal(old.head, new.head)]
    if not lines:
        pairs = list(zip(old.entries, new.entries, strict=False))
        changed = [a for a, b in pairs if a.graph != b.graph and not _alike(old.graphs, a.graph, new.graphs, b.graph)]
        other = old.options != new.options or any(replace(a, graph=b.graph) != b for a, b in pairs)
        lines = ["other rooms"] if other else []
        lines = [f"{len(changed)} graphs changed, the first of {changed[0].origin}"] if changed else lines
    return "; ".join(lines[:4])


def _alike(old: dict[str, str], a: str, new: dict[str, str], b: str) -> bool:
    """Whether two texts are of one graph, which another version writes otherwise."""
    return a in old and b in new and SceneGraph.from_json(old[a]) == SceneGraph.from_json(new[b])


def _unequal(old: Any, new: Any, where: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys(), key=str):
            yield from _unequal(old.get(key), new.get(key), f"{where}.{key}" if where else str(key))
    elif old != new:
        yield where.removeprefix("request."), json.dumps(old), json.dumps(new)


def _head(raw: Any) -> dict[str, Any]:
    """The first line of the plan; raises ValueError for one that is not as we write it."""
    kinds = {"version": str, "weights": str, "rooms": int, "request": dict, "sets": list}
    if not isinstance(raw, dict) or any(type(raw.get(key)) is not kind for key, kind in kinds.items()):
        raise ValueError("line 1 is no head of a plan")
    return raw


def _entry(raw: Any, number: int, sets: int) -> Entry:
    """A line of the plan, which anybody may have sent; raises ValueError for one that is not as we write it."""
    try:
        entry = TypeAdapter(Entry).validate_python(raw)
    except ValidationError as error:
        raise ValueError(f"line {number + 2}: {validation_message(error)}") from None
    if entry.number != number:
        raise ValueError(f"line {number + 2}: number is {entry.number}, allowed: {number}")
    if entry.options >= sets:
        raise ValueError(f"line {number + 2}: options is {entry.options}, allowed: 0 to {sets - 1}")
    return entry


LATEST = 1e11  # seconds since 1970
LONGEST = 16 * 2**20  # bytes of one line of a run's files
FARTHEST = 1e6  # metres

# column -> what it is where a room has none; the order is that of the manifest
COLUMNS: dict[str, Any] = {
    "id": "", "state": "missing", "source": "", "seed": 0, "type": "", "graph": "", "weights": "", "version": "",
    "shapes": "", "root": "", "bounds": [], "objects": 0, "categories": {}, "relations_asked": 0,
    "relations_kept": 0, "living_faults": [], "collisions": 0, "restless": 0, "check": False, "check_errors": [],
    "faces": 0, "bytes": 0, "licences": [], "sha256": "", "seconds": 0.0, "error": "",
}  # fmt: skip


@cache
def _row() -> Any:
    """The model of a journal's line: columns hold what is of their default's type and in its range."""
    farthest: Any = list[Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]]
    kinds: dict[type, Any] = {
        bool: bool, int: Seed, str: Text, float: Annotated[float, Field(ge=0)], list: list[Text],
        dict: dict[Text, Seed],
    }  # fmt: skip
    columns: dict[str, Any] = {name: (kinds[type(default)], default) for name, default in COLUMNS.items()}
    columns |= {"bounds": (farthest, []), "room": (Text, ...), "when": (Annotated[float, Field(ge=0, lt=LATEST)], ...)}
    return create_model("Row", __config__=ConfigDict(strict=True, allow_inf_nan=False), **columns)


def is_row(row: Any) -> bool:
    """Whether a line of a journal is one that we write; a run's folder may come from anybody."""
    try:
        found = _row().model_validate(row)
    except ValidationError:
        return False
    if found.state == "failed":
        return "error" in row and not found.root
    return found.state == "done" and len(found.bounds) == 6 and bool(found.sha256) and _is_root(found.root)


def _is_root(name: str) -> bool:
    path = PurePosixPath(name)
    return path.name == name and path.suffix in LAYER_FORMS and IDENTIFIER.fullmatch(path.stem) is not None


JOURNAL = "journal.jsonl"


class Journal:
    """Appends lines and has them on the disk before it goes on.

    Arguments:
        folder: of the shard (`shard_folder`).
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = inside(folder, JOURNAL, f"{folder}: the run")
        links = getattr(os, "O_NOFOLLOW", 0)
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | links, 0o644)
        if os.fstat(self._file).st_size:  # a run that was killed while it wrote left half a line, which is no room
            os.write(self._file, b"\n")

    def append(self, row: dict[str, Any]) -> None:
        """Add one line; raises OSError where the disk is full, after which no half line counts."""
        content = (json.dumps(row, sort_keys=True, ensure_ascii=False) + "\n").encode("utf-8", "replace")
        written = os.write(self._file, content)
        if written != len(content):
            raise OSError(28, "No space left on device", str(self.path))
        os.fsync(self._file)

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._file)


def shard_folder(folder: Path, shard: tuple[int, int]) -> Path:
    """Where a shard keeps its journal and its lock; raises ValueError where a link leads out of the run's folder."""
    return inside(folder, f"{STATE}/shard_{shard[0]}_of_{shard[1]}", f"{folder}: the run")


def read_journals(folder: Path) -> dict[str, dict[str, Any]]:
    """Room id -> its last line in the journals of all shards; a room that is done stays done."""
    found: dict[str, dict[str, Any]] = {}
    for path in sorted((folder / STATE).glob(f"shard_*/{JOURNAL}")):
        check_links(folder, path, f"{folder}: the run has {path.relative_to(folder)}")
        if not path.is_file():
            raise ValueError(f"{path}: not a regular file, allowed: a journal")
        for row in _rows(path):
            before = found.get(row["room"])
            if before is None or before["when"] <= row["when"]:
                found[row["room"]] = row
    return found


def room_digest(folder: Path) -> str:
    """SHA-256 of a room's files, their paths and bytes; "" where there is none. Nothing is read through a link."""
    if not folder.is_dir():
        return ""
    total = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_symlink() or p.is_file()):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink():
            total.update(f"{name}\0link\n".encode())
        elif name != LOCK and not name.startswith(f"{STAGING}/"):
            with path.open("rb") as file:
                total.update(f"{name}\0{hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return total.hexdigest()


def fault_of(folder: Path, row: dict[str, Any], stored: Collection[str]) -> str:
    """What is wrong with a room that the journal calls done, "" where nothing is.

    Arguments:
        folder: of the room. row: its line in the journal. stored: keys of what is whole in the run's store.
    """
    if not folder.is_dir():
        return "missing"
    if room_digest(folder) != row["sha256"]:
        return "changed since it was made"
    manifest = find_manifest(folder, Path(row["root"]).stem) or {}
    missing = set((manifest.get("stored") or {}).values()) - set(stored)
    return f"{len(missing)} of its assets are missing in the store or changed" if missing else ""


def whole_keys(folder: Path, *, mend: bool = False) -> set[str]:
    """Keys of what is whole in the store of a run; `mend` takes away what is not, for its rooms to put it again."""
    place = inside(folder, STORE, f"{folder}: the run")
    if not place.is_dir():
        return set()
    store = Store.open(place)
    wrong = set(store.wrong())
    for key in wrong if mend else ():
        store.remove(key)
    return set(store.keys()) - wrong


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    with path.open("rb") as file:
        while line := file.readline(LONGEST):
            try:
                row = json.loads(line)
            except (ValueError, RecursionError):
                continue  # empty, torn by a kill or a power cut, or longer than any of ours
            if is_row(row):
                yield row
