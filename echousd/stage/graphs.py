"""Graphs written to any stage, empty or with a graph already, and layers to files."""

from __future__ import annotations

import os
from pathlib import Path

from pxr import Sdf, Tf, Usd

from echomodel.files import whole_file
from echousd.graph import SceneGraph
from echousd.naming import LAYER_FORMS
from echousd.stage.encoding import StageError
from echousd.stage.files import usd_error
from echousd.stage.read import find_rooms
from echousd.stage.write import author, graph_layer, prim_path


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


def save_layer(layer: Sdf.Layer, path: str | os.PathLike[str]) -> None:
    """Write a layer to `path` (.usd, .usda or .usdc) by a temporary file beside it and a rename.

    A layer of this process that was loaded from `path` is reloaded. Raises StageError, `path` left as it was.
    """
    path = Path(path)
    if path.suffix not in LAYER_FORMS:
        raise StageError(f"{path}: extension {path.suffix!r}, allowed: {', '.join(LAYER_FORMS)}")
    if not path.parent.is_dir():
        raise StageError(f"{path}: the folder {path.parent} does not exist")
    try:
        with whole_file(path, path.suffix) as beside:
            if not layer.Export(str(beside)):
                raise StageError(f"{path}: cannot be written")
    except (OSError, Tf.ErrorException) as error:
        why = usd_error(error) if isinstance(error, Tf.ErrorException) else error.strerror
        raise StageError(f"{path}: cannot be written ({why})") from None
    loaded = Sdf.Layer.Find(str(path.absolute()))
    if loaded:  # a stage of this process has the file open: let it follow
        loaded.Reload(force=True)
