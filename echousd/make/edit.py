"""Change the graph of a finished room and make anew only what the change touches; take that back, make it again.

What attends, stands on or hangs over what is put elsewhere goes along, and what is free makes way.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.boxes import Boxes
from echomodel.boxes2d import turned
from echomodel.graph import GraphEdit
from echomodel.late import Late
from echomodel.objective import Plan, faults_of
from echomodel.objective.support import ON_CEILING
from echomodel.progress import StageListener, StageTimer
from echomodel.vocabulary import vocabulary
from echousd.folder import history
from echousd.folder.folder import held
from echousd.folder.found import check_ours, layer_over, own_root, room_at
from echousd.graph import SceneGraph, consistency
from echousd.graph.arrays import graph_batch, one_thread
from echousd.graph.changes import EditRequest
from echousd.graph.floors import check_space
from echousd.make.finished import Room
from echousd.make.furnishing import Brief, box_fields, boxes_of, furnished, with_boxes
from echousd.make.layouts import check_objects, model_of
from echousd.make.reading import SavedRoom, read_room
from echousd.make.save import write_pictures
from echousd.make.verdicts import layout_outcome, warn_of_faults
from echousd.make.wishes import artists_wishes, wished
from echousd.options import OF_NEW, Look, RoomOptions, takes_options
from echousd.place.living import plan_to_live_in, unusual
from echousd.place.search import LIT
from echousd.room import LayoutOutcome, Provenance
from echousd.shapes.sources.mixing import default_source
from echousd.shapes.sources.named import anchored, check_files
from echousd.shapes.styles import stated_styles

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

wishes_of = Late("echousd.assets.choose:wishes_of")
WISHES = tuple(EditRequest.__dataclass_fields__)


@takes_options(OF_NEW)
def edit(
    room: str | Path, graph: SceneGraph | None = None, *, model: RoomModel | None = None,
    outside: Sequence[str | Path] = (), copies: Mapping[str, str] | None = None,
    progress: StageListener | None = None, **changes: Any,
) -> Room:  # fmt: skip
    """A room whose graph was changed; objects that the change does not touch keep box, mesh and files.

    New objects and objects of another category get boxes and shapes, subjects of new relations (and who attends or
    stands on them) get new places. Who attends what is put elsewhere goes with it, and what is free makes way where a
    relation or physics would not hold otherwise.

    Arguments:
        room: root layer or folder of a room that `generate` made.
        graph: what its graph (`read_graph(room)`) shall become; a floor or openings that it leaves open stay those of
            the room. None = as the wishes among `changes` say.
        model, outside, progress: as for `generate`.
        copies: new objects that share an asset of the room, of which they have the size: name -> name of the asset.
        changes: wishes in the words of `echousd edit`, lists such as `add=["stool:stool"]`, and options of what is new
            (`RoomOptions`); without these `shapes` and `faces` are those of the room.

    Raises ValueError as `generate` and `read_room` do, and for a room that other weights than those that ship made if
    neither `model` nor `weights` is given. Warns where the weights are not those that made the room, and of
    faults as `generate` does.
    """
    if wrong := sorted(changes.keys() - {*OF_NEW, *WISHES}):
        raise ValueError(f"{wrong[0]} is no option of an edit, allowed: {', '.join((*WISHES, *OF_NEW))}")
    words = {name: changes.pop(name) for name in WISHES if name in changes}
    wish = EditRequest(**{name: [text] if isinstance(text, str) else text for name, text in words.items() if text})
    if (graph is None) == (wish == EditRequest()):
        raise ValueError(f"an edit takes either a graph or wishes ({', '.join(WISHES)})")
    changes = {name: value for name, value in changes.items() if value is not None}
    RoomOptions(**changes)  # what is not allowed is told before the room is read
    timer = StageTimer(progress)
    with timer.stage("read"):
        saved = read_room(room := room_at(Path(room)))
    graph, outside = graph or wished(saved, wish), (*outside, *wish.folders)
    manifest, beside = saved.manifest, room.parent
    asked = RoomOptions(**{name: manifest[name] for name in Look.model_fields} | changes)
    wishes = partial(wishes_of, asked, outside)
    check_objects(graph, str(room))
    graph = with_plan_of(anchored(graph, beside), saved.graph)
    fresh, moving = touched(anchored(saved.graph, beside), graph, saved.boxes)
    with consistency.faults_of(str(room)):
        crowded = check_space(graph) if fresh else ()
    odd = [sentence for sentence in unusual(graph) if sentence not in unusual(saved.graph)]
    begun = [carried(saved.graph, graph, boxes) for boxes in saved.layouts]
    there = tuple(box_fields(saved.graph.names, boxes, fresh) for boxes, _ in begun)
    rebuilt = graph.room.replaced(style=saved.graph.room.style) != saved.graph.room
    along = (movable(graph) if rebuilt else begun[0][1]) - moving
    stated = with_boxes(graph, there[0], moving)
    put = fresh | _put_elsewhere(stated, saved) - along  # who went along may be in the way where it came
    whole = all(None not in (node.size, node.position, node.yaw) for node in stated.nodes)

    def way(boxes: Boxes, outcome: LayoutOutcome, moved: Collection[str]) -> set[str]:
        return in_the_way(saved, graph, boxes, outcome, along, {*moved, *put})

    if asked.place and whole and (rebuilt or moving | put):
        boxes = boxes_of(stated)  # before anything is searched in vain
        moving |= way(boxes, layout_outcome(graph, boxes), moving)
    assets, formed = {**saved.assets, **(copies or {})}, {saved.assets[name]: g for name, g in saved.geometry.items()}
    shaped = fresh - (copies or {}).keys() | restyled(saved, graph, fresh)
    check_files(graph, beside, outside, str(room), fresh)
    used, shapes = None, asked.shapes or manifest["shapes"]
    made_by = Provenance(*(manifest[key] for key in ("seed", "preset", "model", "shapes", "source")))
    if fresh | shaped | moving:
        with timer.stage("load"), one_thread():
            used = model_of(asked, model)
        _compare(manifest, used, chosen=bool(model or asked.weights), root=room)
        made_by = replace(made_by, preset=used.preset, model=used.hash or made_by.model)
        again = shapes in ("parts", "sdf", "boxes") or (shapes in ("library", "guided") and asked.assets is not None)
        shapes = asked.shapes or (shapes if again else default_source(used))
    names = {name: assets[name] for name in graph.names if name not in shaped}
    geometry = {name: formed[asset] for name, asset in names.items()}
    files = {asset: saved.carried[asset] for asset in names.values()}
    after = furnished(Brief(
        graph, graph, manifest["name"], asked, shapes, made_by, wishes, used, timer, there, geometry, names, files,
        edited=room, moving=moving, change=graph_edit(saved.graph, graph), in_the_way=way, notes=(*crowded, *odd),
    ))  # fmt: skip
    warn_of_faults(after)
    return after


def update(layer: str | Path, **given: Any) -> Room:
    """A room brought up to date with what a stronger layer of somebody's changes: relations, objects, transforms.

    What the layer (or the one over a room in its folder) moves stays where it was put, locked; others make way.
    `given`: model, outside, progress and options of what is new, as for `edit`. Raises ValueError as that does, for a
    folder with no such layer or several, and for one that changes nothing.
    """
    own, graph, _, copies = artists_wishes(layer_over(Path(layer)))
    return edit(own, graph, copies=copies, **given)


def undo(room: str | Path, *, wait: bool = False) -> tuple[str, ...]:
    """Take the last edit of a room (root layer or folder) back, byte for byte; returns its steps, a line each.

    `wait`: for another process that writes the room, instead of raising. Raises ValueError where there is no edit, or
    somebody changed a file of the room since; nothing is changed then.
    """
    return _stepped(Path(room), "undo", wait)


def redo(room: str | Path, *, wait: bool = False) -> tuple[str, ...]:
    """Make again what `undo` took back last, byte for byte; arguments, result and errors are as there."""
    return _stepped(Path(room), "redo", wait)


def _stepped(place: Path, run: str, wait: bool) -> tuple[str, ...]:
    """Make a step of a room's history, and its pictures anew where it has some; a run that was killed is finished."""
    check_ours(root := own_root(room_at(place)))
    with held(root.parent, wait=wait, run=run) as finished:
        shown = finished or root.with_suffix(".png").is_file()  # who wanted no picture gets none
        steps = history.steps_of(root, run) if finished == run else getattr(history, run)(root)
        if shown:
            write_pictures(root)
    return steps


made_of = attrgetter("category", "size", "shapes", "asset")
placed_at = attrgetter("position", "yaw", "place", "between")
STILL = 1e-3  # metres or radians: less is no other place


def attending(room: Plan) -> list[tuple[int, int]]:
    """Numbers of boxes of one room, and of what they attend, stand on or hang over; a screen is nobody's company."""
    out = [(k, i) for k, i in enumerate(room.anchor.tolist()) if i >= 0 and room.slot_role[k] != "opposite"]
    out += [(k, i) for k, i in enumerate(room.carrier.tolist()) if i >= 0]
    away = np.linalg.norm((room.position[:, None] - room.position)[..., ::2], axis=2)
    over = (room.carrier == ON_CEILING)[:, None] & room.standing & (away < LIT)
    return [*dict.fromkeys([*out, *((k, i) for k, i in np.argwhere(over).tolist())])]


def carried(before: SceneGraph, after: SceneGraph, boxes: Boxes) -> tuple[Boxes, set[str]]:
    """The boxes of `before` in which who attends what `after` puts elsewhere stands to it as it did, and their names.

    What is locked, or has a place of its own, stays.
    """
    room = plan_to_live_in(before, boxes)
    pairs, free, names = attending(room), movable(after), set[str]()
    position, yaw = room.position.copy(), room.yaw.copy()
    for i, name in enumerate(before.names):
        node = after.node(name) if name in after.names else None
        if node is None or node.position is None:
            continue
        shift, turn = np.asarray(node.position) - room.position[i], 0.0 if node.yaw is None else node.yaw - room.yaw[i]
        if max(abs(shift).max(), abs(turn)) < STILL:
            continue
        group = [i]
        for one in group:
            group += [k for k, at in pairs if at == one and before.names[k] in free - names and k not in group]
        for k in group[1:]:
            away = (room.position[k] - room.position[i])[::2]
            position[k] += shift * (1, room.carrier[k] in group, 1)
            position[k, ::2] += turned(away, turn) - away
            yaw[k] += turn
            names.add(before.names[k])
    return Boxes(boxes.size, position.astype(np.float32), yaw.astype(np.float32)), names


def in_the_way(
    saved: SavedRoom, graph: SceneGraph, boxes: Boxes, outcome: LayoutOutcome, along: Collection[str],
    moving: Collection[str],
) -> set[str]:  # fmt: skip
    """Names of what is free and, with what was moved, breaks a relation or physics that held before, and its company.

    Arguments:
        saved: the room before. graph, boxes, outcome: as they are now.
        along: those who were `carried`, or all where the room has other openings, make way for what a person would
            point at, too.
        moving: who was placed anew; where nobody else is in the way, those who are told of them make way.
    """

    def broken(graph: SceneGraph, room: Plan, outcome: LayoutOutcome) -> set[tuple[str, str, str]]:
        names = [*graph.names, ""]
        found = [fault for fault in faults_of(room) if names[fault.object] in along] + faults_of(room, ("physics",))
        ends = [(one.predicate, one.subject, one.object) for one in outcome.broken]
        ends += [("apart", one.first, one.second) for one in outcome.collisions]
        return {*ends, *((fault.rule, names[fault.object], names[fault.other]) for fault in found)}

    free, room = movable(graph), plan_to_live_in(graph, boxes, all_blamed=True)
    was = plan_to_live_in(saved.graph, saved.boxes, all_blamed=True)
    new = broken(graph, room, outcome) - broken(saved.graph, was, layout_outcome(saved.graph, saved.boxes))
    out = set().union(*({*ends} for _, *ends in new if {*ends} & {*moving, *along})) & free
    if out <= {*moving}:
        related = [{relation.subject, relation.object} for relation in graph.relations]
        out = out.union(*(ends for ends in related if ends & out)) & free
    pairs = [(graph.names[k], graph.names[i]) for k, i in attending(room)]
    for _ in pairs:
        out |= {name for name, at in pairs if at in out} & free
    return out - {*moving}


def movable(graph: SceneGraph) -> set[str]:
    """Names of what is neither locked nor has a place that somebody stated."""
    return {node.name for node in graph.nodes if node.position is None and not node.locked}


def restyled(saved: SavedRoom, graph: SceneGraph, fresh: Collection[str]) -> set[str]:
    """Names of furniture of ours that keeps its place and gets another shape: a style of another name is told."""
    before, after = stated_styles(saved.graph), stated_styles(graph)
    ours = {name for name, form in saved.geometry.items() if form.description}
    kept = [node for node in graph.nodes if node.name in ours and node.name not in fresh and not node.locked]
    return {node.name for node in kept if before[node.name] != after[node.name]}


def touched(before: SceneGraph, after: SceneGraph, boxes: Boxes | None = None) -> tuple[set[str], set[str]]:
    """Names of objects that need a box and a shape, and of objects that only need another place.

    `boxes`: of `before`, which tell who attends what is placed anew, and stood on what is gone; who attends what is put
    somewhere is `carried`.
    """
    diff = before.diff(after)
    fresh = {node.name for node in diff.added}
    fresh |= {new.name for old, new in diff.changed if made_of(old) != made_of(new)}
    moving = {relation.subject for relation in diff.related}
    moving |= {new.name for old, new in diff.changed if placed_at(old) != placed_at(new)}
    on = [(r.subject, r.object) for r in after.relations if vocabulary().predicate(r.predicate).follows]
    free, by = movable(after), list[tuple[str, str]]()
    if boxes is not None:
        room, names = plan_to_live_in(before, boxes), before.names
        by = [(names[k], names[i]) for k, i in attending(room)]
        fallen = {names[k] for k, i in enumerate(room.carrier.tolist()) if i >= 0 and names[i] not in after.names}
        moving |= fallen & free
    for _ in (*on, *by):  # what stands on something goes with it, and what stands on that
        moving |= {subject for subject, carrier in on if carrier in fresh | moving & free} & free
        moving |= {guest for guest, host in by if host in moving & free} & free
    return fresh, {name for name in moving - fresh if not after.node(name).locked}


def graph_edit(before: SceneGraph, after: SceneGraph) -> GraphEdit:
    """The change as the model takes it: what was related among the objects that stay, and which are new.

    An object of another category counts as new.
    """
    old = {node.name: node.category for node in before.nodes}
    added = np.array([old.get(node.name) != node.category for node in after.nodes], bool)
    stay = {node.name for node, new in zip(after.nodes, added.tolist(), strict=True) if not new}
    relations = tuple(r for r in before.relations if r.subject in stay and r.object in stay)
    return GraphEdit(graph_batch(after.replaced(relations=relations)).triplets, added)


def _put_elsewhere(stated: SceneGraph, saved: SavedRoom) -> set[str]:
    """Names of what stands elsewhere than in the saved room, locked or not."""
    was = {name: [*box["position"], box["yaw"]] for name, box in box_fields(saved.graph.names, saved.boxes).items()}
    there = {node.name: [*node.position, node.yaw] for node in stated.nodes if node.position and node.yaw is not None}
    return {name for name in was.keys() & there if np.abs(np.subtract(was[name], there[name])).max() > STILL}


def _compare(manifest: Mapping[str, Any], echo: RoomModel, *, chosen: bool, root: Path) -> None:
    """Refuse the weights that ship where the room needs others; warn where the room was made with other weights."""
    preset, made_with = manifest["preset"], manifest["model"]
    if not chosen and preset != echo.preset:
        raise ValueError(
            f"{root}: made with weights of the preset {preset!r} (hash {made_with or 'unknown'}), which do not ship; "
            "name their file (--weights FILE)"
        )
    if made_with and echo.hash and made_with != echo.hash:
        warnings.warn(
            f"{root}: made with weights {made_with}, edited with weights {echo.hash}; "
            "what the edit does not touch stays as it is",
            stacklevel=3,
        )


def with_plan_of(graph: SceneGraph, before: SceneGraph) -> SceneGraph:
    """The graph with floor and openings of an earlier one where it states none of its own."""
    room, old = graph.room, before.room
    if room.extents is None and old.extents is not None:
        room = room.replaced(floor_polygon=old.floor_polygon, size=old.size)
    same = room.corners is not None and old.corners is not None and np.array_equal(room.corners, old.corners)
    if not room.openings and same:
        room = room.replaced(openings=old.openings)
    return graph if room is graph.room else graph.replaced(room=room)
