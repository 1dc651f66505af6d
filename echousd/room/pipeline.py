"""From a graph to a room: sample boxes, repair them, get shapes from a source, decide what shares an asset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from echomodel.boxes import Boxes
from echomodel.loading import check_preset, load_model
from echomodel.progress import StageListener
from echomodel.roomboxes import footprints
from echousd.assets.choose import AssetWishes, wishes_of
from echousd.graph import SceneGraph
from echousd.graph.consistency import faults_of
from echousd.graph.doors import check_doors
from echousd.graph.floors import check_space, with_plan, with_wider_floor
from echousd.repair.living import unusual_sizes
from echousd.room.clearing import cleared_layouts
from echousd.room.finished import Room
from echousd.room.fitting import FITS, fitted, with_space
from echousd.room.layouts import (
    Drawn,
    Draws,
    best_boxes,
    check_drafts,
    check_objects,
    most_drafts,
    plan_boxes,
    room_floor,
    with_free_openings,
    with_sizes,
)
from echousd.room.locking import with_locked_places
from echousd.room.manifest import FACES, check_seed
from echousd.room.merging import merged
from echousd.room.owned import with_own_boxes, with_own_pieces
from echousd.room.progress import StageTimer
from echousd.room.reproducible import one_thread
from echousd.room.room import Provenance, RoomOptions
from echousd.room.sources import default_source, shape_source
from echousd.room.sources.guided import shape_nearness
from echousd.room.sources.mixing import check_sources, mixed_shapes, sources_of
from echousd.room.sources.retrieval import anchored, check_files, given_pieces, retrieved, with_given_sizes
from echousd.room.sources.source import ShapeRequest
from echousd.room.styles import asset_names, style_groups
from echousd.room.tensors import graph_batch
from echousd.room.verdicts import layout_outcome, warn_of_faults

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echomodel.protocols import RoomModel


def generate(
    graph: SceneGraph | str | Path,
    *,
    room: str | None = None,
    seed: int = 0,
    shapes: str | None = None,
    model: RoomModel | str | Path | None = None,
    preset: str | None = None,
    repair: bool = True,
    samples: int = 1,
    drafts: int | None = None,
    earlier: Path | None = None,
    fit: str = "keep",
    steps: int | None = None,
    faces: int = FACES,
    options: RoomOptions | None = None,
    progress: StageListener | None = None,
    drawn: Drawn | None = None,
    assets: AssetWishes | str | Path | None = None,
    boxes: Boxes | None = None,
    meshes: Mapping[str, str | Path] | None = None,
) -> Room:
    """Make a room from a scene graph.

    A floor that nobody stated is proposed before the layout is drawn, and doors and windows that nobody stated are
    placed where no furniture stands; both are in the room's graph and stay when it is generated again.

    Arguments:
        graph: the graph, or a file that holds one (stage, YAML, JSON).
        room: prim path of one room where the file holds several.
        seed: of all randomness, 0 to 2^63 - 1; equal arguments give equal rooms.
        shapes: where geometry comes from, a name of `echousd.room.sources`: `parts`, furniture built from the model's
            descriptions, `sdf`, the model's shape branch, plain `boxes`, or `library` or `guided`, models of `assets`;
            None = `parts` where the model can. An object of the graph may say otherwise (`source`, `asset`).
        model: a loaded model, a sampler of your own (any object that keeps `echomodel.protocols.RoomModel`), a weights
            file (one of `echousd convert`, too), or None for the weights that ship with the package.
        preset: which kind of model it must be (`echomodel.loading.PRESETS`); None = any.
        repair: move and size the sampled boxes as little as possible until the graph is kept.
        samples: number of layouts of the same furniture.
        drafts: layouts that are drawn at most for each of them, the best by relations and living rules is kept; None =
            8, fewer in rooms of more than 30 objects, or 1 for the published models, which take a thousand steps;
            without repair it is always 1.
        earlier: folder or root layer of the last generation, where locked objects without a place are looked for.
        fit: `keep` everything and say what collides, or `drop` what finds no place, and say it (`Room.notes`).
        steps: sampling steps, None for the model's own.
        faces: face budget of each mesh.
        options: how the room is written.
        progress: called with (stage, done, total).
        drawn: drafts of the first layout that were sampled already (`echousd.room.packed`).
        assets: index of a library (`echousd assets index`), or what is asked of one.
        boxes: layout of your own, n boxes in the order of the graph's nodes, metres and radians in the room's frame;
            every object stands where its box is.
        meshes: object name -> file of a piece of your own (USD, glTF, OBJ), which keeps its materials; relative to the
            working folder.

    Raises:
        ValueError: an argument that is not allowed, a graph that cannot be read or contradicts itself, weights that are
            missing, damaged or have no shape branch.

    Warns (`RoomWarning`) of relations that are broken and of furniture that collides; `Room.faults` lists them.
    """
    if shapes is not None:
        shape_source(shapes)
    if samples < 1 or samples > 1000:
        raise ValueError(f"samples is {samples}, allowed: 1 to 1000")
    check_drafts(drafts)
    if fit not in FITS:
        raise ValueError(f"fit is {fit!r}, allowed: {', '.join(FITS)}")
    check_seed(seed)
    check_preset(model, preset)
    timer = StageTimer(progress)
    file, beside = "", Path.cwd()
    wishes = wishes_of(assets)
    if not isinstance(graph, SceneGraph):
        from echousd.graph import load_graph

        file, beside = Path(graph).name, Path(graph).parent
        with timer.stage("read"):
            read = Path(graph)
            graph, homeless = with_locked_places(load_graph(read, room), None if room else read, earlier)
    else:
        graph, homeless = with_locked_places(graph, earlier)
    graph = anchored(graph, beside)
    if file:  # a graph that was read may come from anybody; one in memory is the caller's own
        check_files(graph, beside, wishes, file)
    graph = with_own_boxes(with_own_pieces(graph, meshes or {}), boxes)
    check_objects(graph, file)
    with timer.stage("load"), one_thread():
        echo = load_model(model, preset)
        shapes = shapes or default_source(echo)
        check_sources([shapes, *sources_of(graph, shapes).values()], echo)
    given = given_pieces(graph, shapes, wishes, timer=timer)
    sizes = dict(given.sizes)
    with faults_of(file):
        check_doors(graph)
        graph, left_out = with_space(graph) if fit == "drop" else (graph, ())
        crowded = check_space(graph)
    stated, graph = graph, with_plan(graph, seed)
    drafts = drafts or most_drafts(echo, len(graph.nodes))

    def arranged(graph: SceneGraph) -> tuple[Boxes, tuple[str, ...]]:
        styles = style_groups(graph)
        whole = drawn is not None and len(drawn.rounds[0][0]) == len(graph.nodes)  # none of them left out
        return best_boxes(
            echo, with_given_sizes(graph, sizes), styles, Draws(seed, steps=steps), drafts=drafts, repair=repair,
            drawn=drawn if whole else None, proposed=not stated.room.openings, timer=timer,
        )  # fmt: skip

    def laid_out(graph: SceneGraph) -> tuple[SceneGraph, Boxes, tuple[str, ...], tuple[str, ...]]:
        if fit == "drop":
            graph, (boxes, notes), more = fitted(graph, arranged)
            return graph, boxes, notes, more
        return graph, *arranged(graph), ()

    graph, boxes, notes, more = laid_out(graph)
    left_out = (*left_out, *more)
    near = shape_nearness(graph, boxes, shapes, wishes, seed, echo, steps, timer)
    options = options or RoomOptions()
    models = retrieved(
        graph, boxes, style_groups(graph), shapes, wishes, seed, given, near, palette=options.palette, timer=timer
    )
    if models.sizes != sizes:  # real sizes shape the layout
        sizes |= models.sizes
        graph, boxes, notes, more = laid_out(graph)
        left_out = (*left_out, *more)
    styles = style_groups(graph)
    notes = (*left_out, *models.notes, *echo.unlearned(graph_batch(graph)), *notes)
    layouts, sized = [boxes], with_sizes(graph, boxes)
    for number in range(1, samples):
        found, _ = best_boxes(
            echo, sized, styles, Draws(seed, number, steps), drafts=drafts, repair=repair, sized=boxes,
            proposed=not stated.room.openings, timer=timer,
        )  # fmt: skip
        layouts.append(found)
    plan = plan_boxes(layouts)
    if stated.room.extents is None:  # without repair, or with weights that know of no floor, furniture may stand beyond
        graph = with_wider_floor(graph, footprints(*plan).reshape(-1, 2))
    if not stated.room.openings:
        graph = with_free_openings(graph, layouts, seed)
    request = ShapeRequest(graph, boxes, styles, seed, echo, steps, faces, timer=timer, retrieved=models)
    made = mixed_shapes(request, shapes)
    floor = room_floor(graph, layouts)
    own = {name: made.geometry[owner] for name, owner in made.owners.items()}
    geometry = merged(own, options.merge, faces)
    outcomes = tuple(layout_outcome(graph, found) for found in layouts)
    if repair:
        with timer.stage("repair"), one_thread():
            layouts, outcomes = cleared_layouts([graph] * samples, layouts, geometry, floor, walls=options.walls)
    made_room = Room(
        name=graph.room.type,
        graph=graph,
        boxes=layouts[0],
        geometry=geometry,
        assets=asset_names(made.owners, {node.name: node.category for node in graph.nodes}),
        floor=floor,
        layouts=tuple(layouts),
        outcomes=outcomes,
        notes=(*crowded, *homeless, *notes, *unusual_sizes(stated)),
        provenance=Provenance(seed, echo.preset, echo.hash, shapes, file, faces),
        options=options,
        timings=timer.seconds,
    )
    warn_of_faults(made_room)
    return made_room
