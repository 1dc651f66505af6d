"""Scene graphs in files, told apart by extension (USD: `echousd.stage`)."""

import math
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

from echomodel.files import whole_file, within_memory
from echomodel.late import Late
from echousd.graph.consistency import GraphError
from echousd.graph.scene import SceneGraph, graph_from_text
from echousd.naming import LAYER_FORMS, STAGE_FORMS, TEXT_FORMS

MAX_BYTES = 8 * 2**20
# what builds on this package
read_graph, write_graph = Late("echousd.stage.read:read_graph"), Late("echousd.stage.graphs:write_graph")


def load_graph(path: str | os.PathLike[str], room: str | None = None) -> SceneGraph:
    """Read the graph in the file at `path`.

    Arguments:
        path: a YAML or JSON file of either form, or a stage.
        room: prim path of one room of several on a stage.

    Raises `GraphError` (text) or `echousd.stage.StageError` (stage), both ValueError, naming the file and the fault.
    """
    path = Path(path)
    if path.is_dir():
        raise GraphError(f"{path}: is a directory, allowed: a {', '.join((*TEXT_FORMS, *STAGE_FORMS))} file")
    if path.suffix.lower() in STAGE_FORMS:
        return read_graph(path, room=room)
    return read_file(path, lambda *text: graph_from_text(SceneGraph, *text))


def read_file(path: Path, build: Callable[[str, Any, str], Any]) -> Any:
    """What `build` makes of (text, its form, what errors call it) of a YAML or JSON file; raises `GraphError`."""
    form = TEXT_FORMS.get(path.suffix.lower())
    if form is None:
        raise GraphError(f"{path}: extension {path.suffix!r}, allowed: {', '.join((*TEXT_FORMS, *STAGE_FORMS))}")
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise GraphError(f"{path}: not a regular file, allowed: a file")
        if found.st_size > MAX_BYTES:
            size = math.ceil(found.st_size / 2**20 * 10) / 10  # up, so that it never says what is allowed
            raise GraphError(f"{path}: {size:g} MiB, allowed: {MAX_BYTES // 2**20} MiB for a scene graph")
        with within_memory(path):
            return build(path.read_text("utf-8-sig"), form, str(path))
    except UnicodeDecodeError as error:
        raise GraphError(f"{path}: no text in UTF-8 (byte {error.start})") from None
    except OSError as error:
        raise GraphError(f"{path}: {(error.strerror or str(error)).lower()}") from None
    except GraphError:
        raise
    except ValueError as error:  # of a word alone, or of memory
        message = str(error)
        raise GraphError(message if message.startswith(f"{path}: ") else f"{path}: {message}") from None


def save_graph(graph: SceneGraph, path: str | os.PathLike[str]) -> None:
    """Write `graph` to `path` in the form of its extension, whole or not at all; raises as `load_graph` does."""
    path = Path(path)
    form = TEXT_FORMS.get(path.suffix.lower())
    if form is None:
        if path.suffix.lower() not in LAYER_FORMS:
            allowed = ", ".join((*TEXT_FORMS, *LAYER_FORMS))
            raise GraphError(f"{path}: extension {path.suffix!r}, allowed: {allowed}")
        write_graph(graph, path)
        return
    write_text(path, graph.to_json() if form == "json" else graph.to_yaml())


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a UTF-8 file beside `path`, then rename it; raises `GraphError`."""
    path = Path(path)
    try:
        with whole_file(path) as beside:
            beside.write_text(text, "utf-8")
    except OSError as error:
        raise GraphError(f"{path}: cannot be written ({(error.strerror or str(error)).lower()})") from None
