"""A room furnished by a brief: what stays keeps box and shape, all else gets one, what is in its way makes way."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.boxes import Boxes
from echomodel.boxes2d import footprints
from echomodel.late import Late, lates
from echomodel.progress import StageTimer
from echousd.graph import Node, SceneGraph
from echousd.graph.arrays import graph_batch, one_thread
from echousd.graph.floors import with_lowered_windows
from echousd.make.clearing import cleared_layouts
from echousd.make.finished import Room
from echousd.make.layouts import LayoutSearch, finished_boxes, most_drafts, plan_boxes, room_floor, with_free_openings
from echousd.naming import free_name
from echousd.options import RoomOptions
from echousd.room import LayoutOutcome, Provenance
from echousd.shapes.looks import palette_of_room
from echousd.shapes.sources.mixing import check_sources, mixed_shapes
from echousd.shapes.sources.named import names_models, source_of
from echousd.shapes.sources.source import Retrieved, ShapeRequest
from echousd.shapes.styles import asset_names
from echousd.shapes.walls import walls_of_room

if TYPE_CHECKING:
    from echomodel.graph import GraphEdit
    from echomodel.protocols import RoomModel
    from echousd.assets.choose import AssetWishes
    from echousd.assets.reference import Vector
    from echousd.shapes.geometry import Geometry

named_pieces, retrieved = (Late(f"echousd.shapes.sources.retrieval:{name}") for name in ("named_pieces", "retrieved"))
fitted, with_wider_floor = lates("echousd.make.fitting", "fitted", "with_wider_floor")
ROUNDS = 4  # times that boxes are placed: what is in the way of what was moved makes way, and what is in its way
SAME = 1e-4  # metres within which a size is that of its box
BOX = ("size", "position", "yaw")
BoxFields = Mapping[str, Any]  # of one object: size and position, each (x, y, z) in metres, and yaw in radians


@dataclass(frozen=True, eq=False)
class Brief:
    """What a room shall become, and what of one that is there stays: all else is made."""

    graph: SceneGraph  # with floor and openings, the files of its assets as absolute paths
    stated: SceneGraph  # the same before anybody proposed floor and openings
    name: str
    options: RoomOptions  # how what is new is made
    shapes: str  # source of what says nothing itself
    made_by: Provenance  # its seed is the room's; that of the options is for what is new
    wishes: Callable[[], AssetWishes]  # what is asked of a library, made where it is needed
    model: RoomModel | None  # None = there is nothing to draw
    timer: StageTimer
    boxes: Sequence[Mapping[str, BoxFields]]  # that stay, of each layout: object name -> box
    geometry: Mapping[str, Geometry] = field(default_factory=dict)  # that stays: object name -> geometry
    assets: Mapping[str, str] = field(default_factory=dict)  # object name -> asset name, of the same objects
    carried: Mapping[str, Mapping[str, bytes]] = field(default_factory=dict)  # asset name -> its files, path -> bytes
    edited: Path | None = None  # root layer of the room that is there
    moving: Collection[str] = ()  # names of those whose boxes stay in size alone
    change: GraphEdit | None = None  # what was edited in the graph as models are told it, None = nothing
    # names of what makes way, given a layout, what became of it, and who was moved
    in_the_way: Callable[[Boxes, LayoutOutcome, Collection[str]], set[str]] = lambda boxes, outcome, moving: set()
    notes: tuple[str, ...] = ()  # sentences of what was found before


def furnished(brief: Brief) -> Room:
    """The room of a brief; raises ValueError for shapes that cannot be had, as their sources do."""
    graph, asked, there, timer, model = brief.graph, brief.options, brief.boxes, brief.timer, brief.model
    moving = {*brief.moving}
    wanted = tuple(name for name in graph.names if name not in brief.geometry)
    check_sources([source_of(graph.node(name), brief.shapes) for name in wanted], model)
    search = None if model is None else LayoutSearch(
        model, asked.seed, timer, asked.steps, brief.change, asked.drafts or most_drafts(model, len(graph.nodes)),
        asked.place, graph.room.openings != brief.stated.room.openings, brief.stated.room.openings,
    )  # fmt: skip

    def arranged(graph: SceneGraph, number: int, sizes: Mapping[str, Vector]) -> tuple[Boxes, tuple[str, ...]]:
        room = with_boxes(graph, there[number], moving, sizes)
        return (boxes_of(room), ()) if search is None else search.best(room, number)

    def laid_out(graph: SceneGraph) -> tuple[list[Boxes], tuple[str, ...]]:
        first, notes = arranged(graph, 0, models.sizes)
        sizes = dict(zip(graph.names, map(tuple, first.size.tolist()), strict=True))  # one furniture in all layouts
        return [first, *(arranged(graph, number, sizes)[0] for number in range(1, len(there)))], notes

    def requested(graph: SceneGraph, boxes: Boxes, models: Retrieved) -> ShapeRequest:
        sampled = asked.seed, model, asked.steps, asked.faces
        return ShapeRequest(graph, boxes, *sampled, wanted, brief.geometry, brief.change, timer, models)

    def as_made(layouts: Sequence[Boxes]) -> list[Boxes]:  # what is round is as wide as deep, whatever its box was
        extents = np.array([np.ptp(geometry[name].mesh.bounds, axis=0) for name in graph.names], np.float32)
        return [replace(one, size=np.where(abs(extents - one.size) > SAME, extents, one.size)) for one in layouts]

    models = Retrieved()
    if search is not None and names_models(graph, brief.shapes, wanted):  # their sizes shape the layout
        models = named_pieces(graph, brief.wishes, wanted, timer)
        room = with_boxes(graph, there[0], moving, models.sizes)
        (draft, _), _ = finished_boxes(room, search.sampled(room, 0)[0], False, timer)
        palette = asked.palette or palette_of_room(brief.made_by.seed, graph.room.style)
        models = retrieved(requested(graph, draft, models), brief.shapes, brief.wishes, palette)
    left_out: tuple[str, ...] = ()
    if asked.fit == "drop":
        graph, (layouts, notes), left_out = fitted(graph, laid_out)
    else:
        layouts, notes = laid_out(graph)
    graph = with_room_around(graph, brief.stated, layouts, asked.seed)
    made = mixed_shapes(requested(graph, layouts[0], models), brief.shapes)
    shaped = {**brief.geometry, **{name: made.geometry[owner] for name, owner in made.owners.items()}}
    geometry = {name: shaped[name] for name in graph.names}
    assets = own_names(brief.assets, asset_names(made.owners, {node.name: node.category for node in graph.nodes}))
    layouts = as_made(layouts)
    floor = room_floor(graph, layouts)
    edge = floor if graph.room.corners is None else graph.room.corners
    walls = walls_of_room(graph, edge, graph.room.tall, brief.made_by.seed) if asked.walls else []
    for rest in reversed(range(ROUNDS if asked.place else 1)):
        with timer.stage("place"), one_thread():
            pins = [with_boxes(graph, boxes, moving) for boxes in there]
            layouts, outcomes = cleared_layouts(pins, as_made(layouts), geometry, floor, walls, place=asked.place)
        way = brief.in_the_way(layouts[0], outcomes[0], moving) if search is not None and rest else set()
        if not way:
            break
        moving |= way
        layouts, notes = laid_out(graph)
    unlearned = () if model is None else model.unlearned(graph_batch(graph))
    return Room(
        name=brief.name, graph=graph, layouts=tuple(layouts), geometry=geometry,
        assets={name: assets[name] for name in graph.names}, floor=floor, outcomes=outcomes, timings=timer.seconds,
        notes=(*brief.notes, *left_out, *models.notes, *unlearned, *notes), provenance=brief.made_by,
        options=asked.replaced(seed=brief.made_by.seed), carried=brief.carried, edited=brief.edited,
    )  # fmt: skip


def with_room_around(graph: SceneGraph, stated: SceneGraph, layouts: Sequence[Boxes], seed: int) -> SceneGraph:
    """The graph with floor and openings as what stands in all layouts needs them, where nobody `stated` them."""
    plan = plan_boxes(layouts)
    if stated.room.extents is None:  # unplaced, or by weights that know of no floor, furniture may stand beyond
        graph = with_wider_floor(graph, footprints(*plan).reshape(-1, 2))
    if graph.room.openings != stated.room.openings or not (graph.room.openings or graph.room.walls):
        graph = with_free_openings(graph, layouts, seed, stated.room.openings)
    return with_lowered_windows(graph, stated, plan, seed)


def with_boxes(
    graph: SceneGraph, boxes: Mapping[str, BoxFields], moving: Collection[str] = (),
    sizes: Mapping[str, Vector] | None = None,
) -> SceneGraph:  # fmt: skip
    """The graph with boxes that stay in its nodes, which may state their own; of what is `moving`, or has no box that
    stays, the size alone (`sizes`: of the latter)."""

    def placed(node: Node) -> Node:
        box = boxes.get(node.name, {"size": (sizes or {}).get(node.name)})
        keeps = BOX if node.name in boxes and node.name not in moving else BOX[:1]
        return node.replaced(**{name: box[name] for name in keeps if getattr(node, name) is None})

    return graph.replaced(nodes=tuple(map(placed, graph.nodes)))


def boxes_of(graph: SceneGraph) -> Boxes:
    """The boxes of a graph all of whose nodes have one."""
    return Boxes(*(np.array([getattr(node, name) for node in graph.nodes], np.float32) for name in BOX))


def box_fields(names: Sequence[str], boxes: Boxes, but: Collection[str] = ()) -> dict[str, BoxFields]:
    """Name -> fields of its box (n boxes in the order of n names), but for some names."""
    rows = zip(names, boxes.size.tolist(), boxes.position.tolist(), boxes.yaw.tolist(), strict=True)
    fields = {name: {"size": tuple(size), "position": tuple(at), "yaw": yaw} for name, size, at, yaw in rows}
    return {name: box for name, box in fields.items() if name not in but}


def own_names(kept: Mapping[str, str], made: Mapping[str, str]) -> dict[str, str]:
    """Object name -> asset name of all; an asset of `made` that is called as one of `kept` gets another name."""
    renamed: dict[str, str] = {}
    for asset in dict.fromkeys(made[name] for name in sorted(made)):
        if asset in kept.values():
            renamed[asset] = free_name(asset, {*kept.values(), *made.values(), *renamed.values()})
    return {**kept, **{name: renamed.get(asset, asset) for name, asset in made.items()}}
