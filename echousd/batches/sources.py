"""Graphs from files, folders, globs, JSONL, Parquet and the room generator; what cannot be read is told, not raised."""

import glob
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echomodel.files import telling, within_memory
from echomodel.late import extra
from echomodel.vocabulary import vocabulary
from echousd.assets.table import LARGEST, unpacked
from echousd.graph import GraphError, Node, RoomSpec, SceneGraph
from echousd.graph.files import MAX_BYTES, load_graph
from echousd.naming import STAGE_FORMS, TEXT_FORMS

MANY = (".jsonl", ".parquet")
AT_ONCE = 64  # graphs of a table that are held in memory
FORMS = (*TEXT_FORMS, *STAGE_FORMS)


@dataclass(frozen=True)
class FoundGraph:
    """A graph of the sources, or why there is none.

    Arguments:
        origin: file, and for many in one the line or row, or room.
        name: what its rooms are called after.
        text: canonical JSON of the graph, "" where it could not be read.
        error: why not.
    """

    origin: str
    name: str
    text: str = ""
    error: str = ""


def find_graphs(sources: Sequence[str], outside: Sequence[str] = ()) -> Iterator[FoundGraph]:
    """All graphs of the sources in their order; raises ValueError for a source that matches nothing.

    Arguments:
        outside: folders besides that of its graph in which the file of a model may lie.
    """
    for source in sources:
        paths = _files(source)
        if not paths:
            raise ValueError(f"{source}: no graphs there; allowed: {', '.join((*FORMS, *MANY))} files, folders, globs")
        for path in paths:
            read = {".jsonl": _lines, ".parquet": _rows}.get(path.suffix.lower(), _file)
            yield from (_anchored(found, path.parent, outside) for found in read(path))


def _anchored(found: FoundGraph, folder: Path, outside: Sequence[str]) -> FoundGraph:
    """What was found with the files of its models as absolute paths, or why they may not be read."""
    if '"asset"' not in found.text:
        return found
    from echousd.shapes.sources.named import anchored, check_files

    graph = anchored(SceneGraph.from_json(found.text), folder)
    try:
        check_files(graph, folder, outside, found.origin)
    except ValueError as error:
        return replace(found, text="", error=str(error))
    return replace(found, text=graph.to_json())


def sampled_graph(room_type: str, seed: int, number: int, relations: float) -> SceneGraph:
    """Graph number `number` of a type from the room generator: its furniture, floor and doors, and what is told of it.

    Arguments:
        relations: relations an object, the ones that a person would write first.
    """
    from echomodel.rooms.generator import generate_room
    from echomodel.rules import label_relations
    from echomodel.rules.telling import stated_of_room
    from echousd.stage.boxes import graph_of

    types = [row.name for row in sorted(vocabulary().room_types, key=lambda row: -row.share)]
    if room_type not in types:
        raise ValueError(f"sample: no rooms of type {room_type!r} are drawn, allowed: {', '.join(types)}")
    kind = types.index(room_type)
    room = generate_room(np.random.Generator(np.random.PCG64([seed, kind, number])), room_type)
    edges = stated_of_room(label_relations(room, headings=True), room, relations, number)
    made = graph_of(replace(room, relations=edges))
    floor = tuple(map(tuple, room.floor_polygon.round(4).tolist()))
    spec = RoomSpec(room_type, floor_polygon=floor, height=round(room.height, 4), openings=room.openings)
    return SceneGraph(spec, tuple(Node(n.name, n.category, style=n.style) for n in made.nodes), made.relations)


def _files(source: str) -> list[Path]:
    path = Path(source)
    if path.is_file():
        return [path]
    if path.is_dir():
        return sorted(p for p in path.iterdir() if p.suffix.lower() in (*FORMS, *MANY) and p.is_file())
    return sorted(Path(p) for p in glob.glob(source, recursive=True) if Path(p).is_file())  # noqa: PTH207


def _file(path: Path) -> Iterator[FoundGraph]:
    try:
        yield FoundGraph(path.as_posix(), path.stem, load_graph(path).to_json())
    except ValueError as error:
        rooms = _rooms_of(path)
        if len(rooms) < 2:
            yield FoundGraph(path.as_posix(), path.stem, error=str(error))
        for room in rooms if len(rooms) > 1 else ():
            try:
                yield FoundGraph(f"{path.as_posix()}<{room}>", path.stem, load_graph(path, room=room).to_json())
            except ValueError as wrong:
                yield FoundGraph(f"{path.as_posix()}<{room}>", path.stem, error=str(wrong))


def _rooms_of(path: Path) -> list[str]:
    """Prim paths of the rooms on a stage, none where it cannot be read."""
    if path.suffix.lower() not in STAGE_FORMS:
        return []
    from echousd.stage.files import opened
    from echousd.stage.read import find_rooms

    try:
        return [str(prims.room.GetPath()) for prims in find_rooms(opened(path))]
    except ValueError:
        return []


def _lines(path: Path) -> Iterator[FoundGraph]:
    with telling(path, "cannot be read"), path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(iter(lambda: file.readline(MAX_BYTES + 1), ""), 1):
            if len(line) > MAX_BYTES:
                raise ValueError(f"{path}:{number}: more than {MAX_BYTES} characters, allowed for a scene graph")
            if line.strip():
                yield _text(path, number, line)


def _rows(path: Path) -> Iterator[FoundGraph]:
    parquet = extra("pyarrow.parquet", f"{path}: reading Parquet needs pyarrow", "batch")
    from pyarrow import ArrowException

    try:
        with parquet.ParquetFile(path) as file:
            size = unpacked(file.metadata)
            if size > LARGEST:
                raise ValueError(f"{size} bytes when unpacked, allowed: {LARGEST}")
            if "graph" not in file.schema_arrow.names:
                raise ValueError("it has none")
            before, packs = 0, file.iter_batches(AT_ONCE, columns=["graph"])
            while True:
                with within_memory(path):
                    pack = next(packs, None)
                    texts = () if pack is None else pack.column(0).to_pylist()
                if pack is None:
                    return
                for number, text in enumerate(texts, before + 1):
                    yield _text(path, number, text if isinstance(text, str) else "")
                before += len(texts)
    except (ArrowException, OSError, ValueError, KeyError) as error:
        raise ValueError(f"{path}: no Parquet file with a column 'graph' ({str(error).splitlines()[0]:.160})") from None


def _text(path: Path, number: int, text: str) -> FoundGraph:
    origin = f"{path.as_posix()}:{number}"
    try:
        with within_memory(path, "it", size=len(text)):
            raw = json.loads(text)
            inner = raw.get("graph") if isinstance(raw, dict) else None
            if isinstance(inner, dict | str):  # a record around the graph, such as a room's manifest
                text = inner if isinstance(inner, str) else json.dumps(inner)
            return FoundGraph(origin, path.stem, SceneGraph.from_json(text).to_json())
    except (GraphError, ValueError, RecursionError) as error:
        return FoundGraph(origin, path.stem, error=f"{origin}: {error}")
