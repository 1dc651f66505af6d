"""Change the graph of a finished room and make anew only what the change touches."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from echomodel.boxes import Boxes
from echousd.graph import SceneGraph
from echousd.room import pipeline
from echousd.room.reading import SavedRoom, read_room
from echousd.room.room import Provenance, Room, RoomOptions
from echousd.room.styles import free_name

if TYPE_CHECKING:
    from echomodel.echo import GraphEdit
    from echousd.room.pipeline import Echo


def edit(
    root: str | Path,
    graph: SceneGraph,
    *,
    seed: int = 0,
    shapes: str = "generate",
    model: Echo | str | Path | None = None,
    repair: bool = True,
    steps: int | None = None,
    progress: pipeline.Progress | None = None,
) -> Room:
    """A room whose graph was changed; objects that the change does not touch keep box, mesh and files.

    New objects and objects of another category get boxes and shapes, subjects of new relations (and what stands on
    them) get new places.

    Arguments:
        root: root layer of a room that `generate` made.
        graph: what its graph (`read_room(root).graph`) shall become.
        seed: of the new randomness.
        shapes, model, repair, steps, progress: as for `generate`.

    Raises ValueError as `generate` and `read_room` do, and for a room that other weights than those that ship made if
    `model` is None. Warns where the weights are not those that made the room.
    """
    if shapes not in pipeline.SHAPES:
        raise ValueError(f"shapes is {shapes!r}, allowed: {', '.join(pipeline.SHAPES)}")
    watch = pipeline.Watch(progress)
    with watch.stage("read"):
        saved = read_room(root)
    fresh, moving = touched(saved.graph, graph)
    echo, grids = None, None
    layouts: list[Boxes] = []
    notes: tuple[str, ...] = ()
    if fresh or moving:
        with watch.stage("load"):
            echo = pipeline.load_model(model)
            _compare(saved.manifest, echo, given=model is not None, root=Path(root))
        change = graph_edit(saved.graph, graph)
    for number, before in enumerate(saved.layouts):
        pinned = _pinned(graph, saved.graph, before, fresh, moving)
        if layouts:  # one furniture in all layouts
            pinned = pipeline.with_sizes(pinned, layouts[0])
        if echo is None:
            layouts.append(_boxes_of(pinned))
            continue
        found = pipeline.sample_boxes(echo, pinned, seed=seed, number=number, steps=steps, change=change, watch=watch)
        found, told = pipeline.settled(pinned, found, repair, watch)
        layouts.append(found)
        notes = told if number == 0 else notes
    boxes = layouts[0]
    if fresh and shapes == "generate" and echo is not None:
        grids = pipeline.sample_shapes(echo, graph, boxes, seed=seed, steps=steps, change=change, watch=watch)
    made = _without(graph, set(graph.names) - fresh)
    rows = torch.tensor([i for i, name in enumerate(graph.names) if name in fresh], dtype=torch.long)
    meshes, assets = dict(saved.meshes), dict(saved.assets)
    if made is not None:
        part = None if grids is None else grids[rows.numpy()]
        new_meshes, new_assets = pipeline.make_meshes(made, boxes[rows], part, watch=watch)
        meshes.update(new_meshes)
        assets.update(new_assets)
    assets = _own_names({name: assets[name] for name in graph.names}, fresh, saved)
    manifest = saved.manifest
    return Room(
        name=manifest["name"],
        graph=graph,
        boxes=boxes,
        meshes={name: meshes[name] for name in graph.names},
        assets=assets,
        floor=pipeline.room_floor(graph, layouts),
        verdicts=pipeline.judge(graph, boxes),
        layouts=tuple(layouts),
        notes=notes,
        provenance=_provenance(manifest, echo),
        options=RoomOptions(manifest["up_axis"], manifest.get("walls", False), manifest.get("atlas", False)),
        timings=watch.seconds,
        carried={asset: saved.carried[asset] for name, asset in assets.items() if name not in fresh},
    )


def touched(before: SceneGraph, after: SceneGraph) -> tuple[set[str], set[str]]:
    """Names of objects that need a box and a shape, and of objects that only need another place."""
    diff = before.diff(after)
    fresh = {node.name for node in diff.added}
    fresh |= {new.name for old, new in diff.changed if (old.category, old.size) != (new.category, new.size)}
    moving = {relation.subject for relation in diff.related}
    moving |= {new.name for old, new in diff.changed if (old.position, old.yaw) != (new.position, new.yaw)}
    on = [(r.subject, r.object) for r in after.relations if r.predicate in ("standing_on", "above")]
    for _ in on:  # what stands on something goes with it, and what stands on that
        moving |= {subject for subject, carrier in on if carrier in moving | fresh}
    return fresh, {name for name in moving - fresh if not after.node(name).locked}


def graph_edit(before: SceneGraph, after: SceneGraph) -> GraphEdit:
    """The change as the model takes it: what was related among the objects that stay, and which are new.

    An object of another category counts as new.
    """
    from echomodel.echo import GraphEdit

    old = {node.name: node.category for node in before.nodes}
    added = torch.tensor([old.get(node.name) != node.category for node in after.nodes], dtype=torch.bool)
    stay = {node.name for node, new in zip(after.nodes, added.tolist(), strict=True) if not new}
    relations = tuple(r for r in before.relations if r.subject in stay and r.object in stay)
    return GraphEdit(pipeline.graph_batch(after.replaced(relations=relations)).triplets, added)


def _pinned(
    graph: SceneGraph, old: SceneGraph, boxes: Boxes, fresh: Iterable[str], moving: Iterable[str]
) -> SceneGraph:
    """The graph with the boxes of everything that stays written into its nodes."""
    row = {name: i for i, name in enumerate(old.names)}
    nodes = []
    for node in graph.nodes:
        if node.name not in fresh:
            size, position, yaw = (v[row[node.name]].tolist() for v in _arrays(boxes))
            fields: dict[str, Any] = {"size": node.size or tuple(size)}
            if node.name not in moving:
                fields |= {"position": node.position or tuple(position), "yaw": yaw if node.yaw is None else node.yaw}
            node = node.replaced(**fields)
        nodes.append(node)
    return graph.replaced(nodes=tuple(nodes))


def _arrays(boxes: Boxes) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    return boxes.size, boxes.position, boxes.yaw


def _boxes_of(graph: SceneGraph) -> Boxes:
    return Boxes(
        torch.tensor([node.size for node in graph.nodes]),
        torch.tensor([node.position for node in graph.nodes]),
        torch.tensor([node.yaw for node in graph.nodes]),
    )


def _without(graph: SceneGraph, names: set[str]) -> SceneGraph | None:
    """The graph without some objects and their relations; None if nothing is left."""
    nodes = tuple(node for node in graph.nodes if node.name not in names)
    if not nodes:
        return None
    relations = tuple(r for r in graph.relations if r.subject not in names and r.object not in names)
    return graph.replaced(nodes=nodes, relations=relations)


def _own_names(assets: Mapping[str, str], fresh: set[str], saved: SavedRoom) -> dict[str, str]:
    """A new asset whose name an asset that stays has already gets another name."""
    kept = {asset for name, asset in assets.items() if name not in fresh}
    renamed: dict[str, str] = {}
    for name in sorted(fresh):
        asset = assets[name]
        if asset in kept and asset not in renamed:
            renamed[asset] = free_name(asset, kept | set(assets.values()) | set(renamed.values()))
    return {name: renamed.get(asset, asset) if name in fresh else asset for name, asset in assets.items()}


def _compare(manifest: Mapping[str, Any], echo: Echo, *, given: bool, root: Path) -> None:
    """Refuse the weights that ship where the room needs others; warn where the room was made with other weights."""
    preset, made_with = manifest["preset"], manifest["model"]
    if not given and preset != pipeline.preset_of(echo):
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


def _provenance(manifest: Mapping[str, Any], echo: Echo | None) -> Provenance:
    preset, model = manifest["preset"], manifest["model"]
    if echo is not None:
        preset, model = pipeline.preset_of(echo), echo.hash or model
    return Provenance(manifest["seed"], preset, model, manifest["shapes"], manifest["source"])
