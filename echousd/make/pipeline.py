"""From a graph to a room: the graph read, its locks, floor and openings found; then furnished as a new room."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echomodel.boxes import Boxes
from echomodel.late import Late, lates
from echomodel.openings import KINDS
from echomodel.progress import StageListener, StageTimer
from echousd.graph import SceneGraph, load_graph
from echousd.graph.arrays import one_thread
from echousd.graph.consistency import faults_of
from echousd.graph.floors import check_doors, check_space, with_plan
from echousd.make.finished import Room
from echousd.make.furnishing import Brief, box_fields, furnished
from echousd.make.layouts import check_objects, model_of
from echousd.make.verdicts import warn_of_faults
from echousd.naming import STAGE_FORMS
from echousd.options import RoomOptions, takes_options
from echousd.place.living import unusual
from echousd.room import Provenance
from echousd.shapes.sources.mixing import check_sources, default_source
from echousd.shapes.sources.named import anchored, check_files
from echousd.stage.files import open_stage
from echousd.stage.read import read_graph
from echousd.stage.units import conventions

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

# of a room that is there already
with_earlier_locks, with_locked_places, with_locked_shapes = lates(
    "echousd.make.reading", "with_earlier_locks", "with_locked_places", "with_locked_shapes"
)
with_space, wishes_of = Late("echousd.make.fitting:with_space"), Late("echousd.assets.choose:wishes_of")
room_at = Late("echousd.folder.found:room_at")


@takes_options()
def generate(
    graph: SceneGraph | str | Path, *, room: str | None = None, options: RoomOptions | None = None,
    model: RoomModel | None = None, earlier: Path | None = None, outside: Sequence[str | Path] = (),
    boxes: Boxes | None = None, meshes: Mapping[str, str | Path] | None = None, progress: StageListener | None = None,
    **changes: Any,
) -> Room:  # fmt: skip
    """Make a room from a scene graph.

    A floor that nobody stated is proposed before the layout is drawn, and doors and windows that nobody stated are
    placed where no furniture stands; both are in the room's graph and stay when it is generated again.

    Arguments:
        graph: the graph, a file that holds one (stage, YAML, JSON), or a room's folder.
        room: prim path of one room where the file holds several.
        options: how the room is made and written; `changes`, the same by name, comes first. Equal options give equal
            rooms.
        model: a loaded model, or a sampler of your own (any object that keeps `echomodel.protocols.RoomModel`); None =
            the model of the option `weights`.
        earlier: folder or root layer of the last generation; what is locked keeps its place, shape and room.
        outside: folders besides those of the graph's file and of the library's index in which models may lie.
        boxes: layout of your own, n boxes in the order of the graph's nodes, such as `echomodel.boxes.Boxes`: size and
            position (n, 3) float, of the bottoms' centres, metres, yaw (n) float, radians, in the room's frame;
            every object stands where its box is.
        meshes: object name -> file of a piece of your own (USD, glTF, OBJ), which keeps its materials; relative to the
            working folder.
        progress: called with (stage, done, total).

    Raises:
        ValueError: an argument that is not allowed, a graph that cannot be read or contradicts itself, weights that are
            missing, damaged or have no shape branch, `settle` without the extra `sim`.

    Warns (`RoomWarning`) of relations that are broken, of furniture that collides and of what `settle` finds restless;
    `Room.faults` lists them.
    """
    asked = (options or RoomOptions()).replaced(**changes)
    timer = StageTimer(progress)
    file, beside, other, read = "", Path.cwd(), "", None
    held, homeless = (), ()
    wishes = partial(wishes_of, asked, outside)
    if asked.assets:  # what is absent is told before any long work
        wishes()
    if asked.settle:
        from echousd.settle.settle import require_engine

        require_engine()
    if not isinstance(graph, SceneGraph):
        path = room_at(Path(graph)) if Path(graph).is_dir() else Path(graph)
        file, beside = path.name, path.parent
        read = None if room else path
        with timer.stage("read"):
            graph, other = _read(path, room, asked)
    before = earlier if earlier is None or earlier.is_dir() else earlier.parent
    if any(node.locked for node in graph.nodes) or (before and any(before.glob("*.json"))):
        graph, held = with_earlier_locks(graph, earlier)
        graph, homeless = with_locked_places(graph, read, earlier)
        assert isinstance(graph, SceneGraph)
    if asked.resident:
        graph = graph.with_room(resident=asked.resident)
    anew = {"kept": (), "doors": ("window",), "drawn": KINDS}[asked.openings]
    graph = anchored(graph.with_room(openings=tuple(o for o in graph.room.openings if o.kind not in anew)), beside)
    if file:  # a graph that was read may come from anybody; one in memory is the caller's own
        check_files(graph, beside, outside, file)
    graph = with_own_boxes(with_own_pieces(graph, meshes or {}), boxes)
    check_objects(graph, file)
    with timer.stage("load"), one_thread():
        echo = model_of(asked, model)
    shapes = asked.shapes or default_source(echo)
    check_sources([shapes], echo)
    with faults_of(file):
        check_doors(graph)
        graph, left_out = with_space(graph) if asked.fit == "drop" else (graph, ())
        crowded = check_space(graph)
    whole = graph.room.walls and asked.openings == "kept"  # a home's plan has all openings of its rooms
    brief = Brief(
        graph if whole else with_plan(graph, asked.seed), graph, graph.room.type, asked, shapes,
        Provenance(asked.seed, echo.preset, echo.hash, shapes, file), wishes, echo, timer, [{}] * asked.layouts,
        notes=(*filter(None, [other]), *crowded, *held, *homeless, *left_out, *unusual(graph)),
    )  # fmt: skip
    made = furnished(with_locked_shapes(brief, earlier) if earlier and any(n.locked for n in graph.nodes) else brief)
    if asked.settle:
        from echousd.make.resting import settled

        with timer.stage("settle"):
            made = settled(made)
    warn_of_faults(made)
    return made


def _read(file: Path, room: str | None, asked: RoomOptions) -> tuple[SceneGraph, str]:
    """The graph in a file, and what of its stage's conventions is not kept, "" where all are."""
    if not file.is_file() or file.suffix.lower() not in STAGE_FORMS:
        return load_graph(file, room), ""
    stage = open_stage(file)
    graph, theirs = read_graph(stage, room), conventions(stage, room)
    if room is not None:  # one of several, which a house has where it wants them
        theirs.pop("room_path")
    differs = [
        f"{name} {value!r}, the room {getattr(asked, name)!r}"
        for name, value in theirs.items()
        if value != getattr(asked, name)
    ]
    return graph, f"{file.name} has {'; '.join(differs)} (like={file.name} keeps them)" if differs else ""


# -- what a caller brings along ----------------------------------------------------------------------------------------


def with_own_boxes(graph: SceneGraph, boxes: Boxes | None) -> SceneGraph:
    """The graph whose objects state size, place and heading of `boxes` (n, in its order); raises ValueError."""
    if boxes is None:
        return graph
    if not all(hasattr(boxes, field) for field in ("size", "position", "yaw")):
        raise ValueError(f"boxes: found {boxes!r:.60}, allowed: size, position and yaw of n boxes")
    if len(boxes) != len(graph.nodes):
        raise ValueError(f"boxes: {len(boxes)} for a graph of {len(graph.nodes)} objects: need one box per object")
    fields = box_fields(graph.names, boxes)
    return graph.replaced(nodes=tuple(node.replaced(**fields[node.name]) for node in graph.nodes))


def with_own_pieces(graph: SceneGraph, meshes: Mapping[str, str | Path]) -> SceneGraph:
    """The graph in which some objects are files: object name -> file; raises ValueError naming object and file."""
    for name, file in meshes.items():
        if not Path(file).is_file():
            raise ValueError(f"meshes: object {name!r}: {file}: no such file")
        graph = graph.update_node(name, asset=Path(file).absolute().as_posix(), shapes=None)
    return graph
