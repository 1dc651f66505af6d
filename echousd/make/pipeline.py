"""From a graph to a room: sample boxes, place them, get shapes from a source, decide what shares an asset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from echomodel.boxes import Boxes
from echomodel.boxes2d import footprints
from echomodel.late import Late, lates
from echomodel.progress import StageListener, StageTimer
from echomodel.protocols import RoomModel
from echousd.graph import SceneGraph, load_graph
from echousd.graph.arrays import graph_batch, one_thread
from echousd.graph.consistency import faults_of
from echousd.graph.floors import check_doors, check_space, with_lowered_windows, with_plan
from echousd.make.clearing import cleared_layouts
from echousd.make.finished import Room
from echousd.make.layouts import (
    LayoutSearch,
    check_objects,
    model_of,
    most_drafts,
    plan_boxes,
    room_floor,
    with_free_openings,
    with_sizes,
)
from echousd.make.verdicts import layout_outcome, warn_of_faults
from echousd.naming import STAGE_FORMS
from echousd.options import RoomOptions, takes_options
from echousd.place.living import unusual
from echousd.room import Provenance
from echousd.shapes.sources.mixing import check_sources, default_source, mixed_shapes, shape_nearness, sources_of
from echousd.shapes.sources.named import anchored, check_files, names_models, with_model_sizes
from echousd.shapes.sources.source import Retrieved, ShapeRequest
from echousd.shapes.styles import asset_names, style_groups
from echousd.stage.files import open_stage
from echousd.stage.read import read_graph
from echousd.stage.units import conventions

# of a room that is there already
with_earlier_locks, with_locked_places = lates("echousd.make.reading", "with_earlier_locks", "with_locked_places")
named_pieces, retrieved = (Late(f"echousd.shapes.sources.retrieval:{name}") for name in ("named_pieces", "retrieved"))
fitted, with_space, with_wider_floor = lates("echousd.make.fitting", "fitted", "with_space", "with_wider_floor")


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
        graph: the graph, or a file that holds one (stage, YAML, JSON).
        room: prim path of one room where the file holds several.
        options: how the room is made and written; `changes`, the same by name, comes first. Equal options give equal
            rooms.
        model: a loaded model, or a sampler of your own (any object that keeps `echomodel.protocols.RoomModel`); None =
            the model of the option `weights`.
        earlier: folder or root layer of the last generation, where locked objects without a place are looked for.
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
    seed, wishes = asked.seed, partial(asked.wishes, outside)
    if asked.assets:  # what is absent is told before any long work
        wishes()
    if asked.settle:
        from echousd.settle.settle import require_engine

        require_engine()
    if not isinstance(graph, SceneGraph):
        file, beside = Path(graph).name, Path(graph).parent
        read = None if room else Path(graph)
        with timer.stage("read"):
            graph, other = _read(Path(graph), room, asked)
    before = earlier if earlier is None or earlier.is_dir() else earlier.parent
    if any(node.locked for node in graph.nodes) or (before and any(before.glob("*.json"))):
        graph, held = with_earlier_locks(graph, earlier)
        graph, homeless = with_locked_places(graph, read, earlier)
        assert isinstance(graph, SceneGraph)
    if asked.resident:
        graph = graph.with_room(resident=asked.resident)
    graph = anchored(graph.with_room(openings=()) if asked.openings == "drawn" else graph, beside)
    if file:  # a graph that was read may come from anybody; one in memory is the caller's own
        check_files(graph, beside, outside, file)
    graph = with_own_boxes(with_own_pieces(graph, meshes or {}), boxes)
    check_objects(graph, file)
    with timer.stage("load"), one_thread():
        echo = model_of(asked, model)
        shapes = asked.shapes or default_source(echo)
        check_sources([shapes, *sources_of(graph, shapes).values()], echo)
    theirs = names_models(graph, shapes)
    pieces = named_pieces(graph, wishes, timer=timer) if theirs else Retrieved()
    with faults_of(file):
        check_doors(graph)
        graph, left_out = with_space(graph) if asked.fit == "drop" else (graph, ())
        crowded = check_space(graph)
    stated, graph = graph, with_plan(graph, seed)
    search = LayoutSearch(
        echo, seed, timer, asked.steps, drafts=asked.drafts or most_drafts(echo, len(graph.nodes)), place=asked.place,
        proposed=not stated.room.openings,
    )  # fmt: skip

    def arranged(graph: SceneGraph) -> tuple[Boxes, tuple[str, ...]]:
        return search.best(with_model_sizes(graph, sizes))

    models = pieces
    for drawn in (False, True):
        sizes = models.sizes
        graph, (first, notes), more = fitted(graph, arranged) if asked.fit == "drop" else (graph, arranged(graph), ())
        left_out = (*left_out, *more)
        request = ShapeRequest(graph, first, style_groups(graph), seed, echo, asked.steps, asked.faces, timer=timer)
        if theirs and not drawn:
            guided = "guided" in sources_of(graph, shapes).values()
            near = shape_nearness(request, shapes, wishes()) if guided else None
            models = retrieved(request, shapes, wishes, pieces, near, asked.palette)
        if models.sizes == sizes:  # else real ones shape the layout
            break
    notes = (*left_out, *models.notes, *echo.unlearned(graph_batch(graph)), *notes)
    sized = with_sizes(graph, first)
    layouts = [first, *(search.best(sized, number)[0] for number in range(1, asked.layouts))]
    plan = plan_boxes(layouts)
    if stated.room.extents is None:  # unplaced, or by weights that know of no floor, furniture may stand beyond
        graph = with_wider_floor(graph, footprints(*plan).reshape(-1, 2))
        assert isinstance(graph, SceneGraph)
    if not stated.room.openings:
        graph = with_free_openings(graph, layouts, seed)
    graph = with_lowered_windows(graph, stated, plan, seed)
    made = mixed_shapes(replace(request, graph=graph, retrieved=models), shapes)
    floor = room_floor(graph, layouts)
    geometry = {name: made.geometry[owner] for name, owner in made.owners.items()}
    outcomes = tuple(layout_outcome(graph, found) for found in layouts)
    if asked.place:
        with timer.stage("place"), one_thread():
            layouts, outcomes = cleared_layouts([graph] * asked.layouts, layouts, geometry, floor, walls=asked.walls)
    made_room = Room(
        name=graph.room.type, graph=graph, layouts=tuple(layouts), geometry=geometry,
        assets=asset_names(made.owners, {node.name: node.category for node in graph.nodes}), floor=floor,
        outcomes=outcomes,
        notes=(*filter(None, [other]), *crowded, *held, *homeless, *notes, *unusual(stated)),
        provenance=Provenance(seed, echo.preset, echo.hash, shapes, file), options=asked, timings=timer.seconds,
    )  # fmt: skip
    if asked.settle:
        from echousd.make.resting import settled

        with timer.stage("settle"):
            made_room = settled(made_room)
    warn_of_faults(made_room)
    return made_room


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
    rows = zip(graph.nodes, boxes.size.tolist(), boxes.position.tolist(), boxes.yaw.tolist(), strict=True)
    return graph.replaced(
        nodes=tuple(node.replaced(size=tuple(size), position=tuple(at), yaw=yaw) for node, size, at, yaw in rows)
    )


def with_own_pieces(graph: SceneGraph, meshes: Mapping[str, str | Path]) -> SceneGraph:
    """The graph in which some objects are files: object name -> file; raises ValueError naming object and file."""
    for name, file in meshes.items():
        if not Path(file).is_file():
            raise ValueError(f"meshes: object {name!r}: {file}: no such file")
        graph = graph.update_node(name, asset=Path(file).absolute().as_posix(), shapes=None)
    return graph
