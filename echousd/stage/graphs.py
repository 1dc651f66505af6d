"""Graphs in and out of any stage: ours or somebody else's to read, empty or with a graph already to write."""

from __future__ import annotations

import os
from pathlib import Path

from pxr import Sdf, Usd

from echousd.graph import SceneGraph, load_graph
from echousd.naming import TEXT_FORMS
from echousd.stage import values
from echousd.stage.files import opened, save_layer
from echousd.stage.read import find_rooms, room_graph, the_room
from echousd.stage.write import author, graph_layer, prim_path


def read_graph(stage: Usd.Stage | str | os.PathLike[str], room: str | None = None) -> SceneGraph:
    """The scene graph on a stage or in a file; `room` is the prim path of the room, needed where there are several.

    A YAML or JSON file is read as `echousd new --from` reads it. A stage without a scene graph becomes one all the
    same if its prims carry semantics labels and bounds (`foreign_graph`). Raises StageError for a stage, GraphError for
    a text, that is not valid, with the file's name.
    """
    if not isinstance(stage, Usd.Stage) and Path(stage).suffix.lower() in TEXT_FORMS:
        return load_graph(stage)
    stage = opened(stage)
    with values.reading(stage):
        rooms = find_rooms(stage)
        if not rooms:
            from echousd.stage.foreign import foreign_graph, foreign_rooms

            if room is None:
                return foreign_graph(stage)
            found = foreign_rooms(stage)
            if room in found:
                return found[room]
        return room_graph(the_room(stage, room, rooms))


def write_graph(graph: SceneGraph, target: Sdf.Layer | Usd.Stage | str | os.PathLike[str], room: str = "/Room") -> None:
    """Author `graph` at the prim path `room` of a layer, of a stage's edit target (a variant's, too) or of a new file.

    Where `room` holds a graph already it is changed into `graph`, and only where the two differ (`update_graph`); a
    file at a path is replaced. Raises StageError for a room that is no absolute prim path and for a path that cannot be
    written, nothing authored.
    """
    path = prim_path(room)
    if isinstance(target, str | os.PathLike):
        save_layer(graph_layer(graph, root=room), target)
        return
    stage = target if isinstance(target, Usd.Stage) else Usd.Stage.Open(target)
    if target.GetPrimAtPath(path) and any(prims.room.GetPath() == path for prims in find_rooms(stage)):
        from echousd.stage.update import update_graph

        update_graph(target, graph, room=room)
    elif isinstance(target, Usd.Stage):
        edit_target = target.GetEditTarget()
        author(edit_target.GetLayer(), graph, edit_target.MapToSpecPath(path))
    else:
        author(target, graph, path)
