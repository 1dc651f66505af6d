"""EchoUSD: author indoor scenes in USD from semantic scene graphs."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from echousd import plugin

plugin.register()  # first act: a stage opened before the schema is registered never learns it

if TYPE_CHECKING:
    from echomodel.loading import load_model
    from echomodel.vocabulary import vocabulary
    from echousd.batches.batch import batch, generate_many
    from echousd.checks import check
    from echousd.draw.from_files import render
    from echousd.exporting.formats import export
    from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
    from echousd.home.assemble import generate_home
    from echousd.home.graph import HomeGraph
    from echousd.home.importing.formats import import_plan
    from echousd.home.plan import plan_home
    from echousd.make.edit import edit
    from echousd.make.finished import Room
    from echousd.make.pipeline import generate
    from echousd.options import RoomOptions
    from echousd.stage.boxes import read_dressing, relations_from_boxes
    from echousd.stage.graphs import read_graph, write_graph
    from echousd.stage.read import read_rooms
    from echousd.stage.update import update_graph
    from echousd.texturing import export_job as export_texture_job
    from echousd.texturing import import_job as import_texture_job

__version__ = "0.1.0"

# Modules (with a name there after a colon, if it is public under another one) and their public names, imported on first
# use: `import echousd` loads neither pxr nor torch. docs/API.md is made of them.
_PUBLIC = {
    "echomodel.loading": ("load_model",),
    "echomodel.vocabulary": ("vocabulary",),
    "echousd.batches.batch": ("batch", "generate_many"),
    "echousd.checks": ("check",),
    "echousd.draw.from_files": ("render",),
    "echousd.exporting.formats": ("export",),
    "echousd.graph": ("GraphError", "Node", "Relation", "RoomSpec", "SceneGraph"),
    "echousd.home.assemble": ("generate_home",),
    "echousd.home.graph": ("HomeGraph",),
    "echousd.home.importing.formats": ("import_plan",),
    "echousd.home.plan": ("plan_home",),
    "echousd.make.edit": ("edit",),
    "echousd.make.finished": ("Room",),
    "echousd.make.pipeline": ("generate",),
    "echousd.options": ("RoomOptions",),
    "echousd.stage.boxes": ("read_dressing", "relations_from_boxes"),
    "echousd.stage.graphs": ("read_graph", "write_graph"),
    "echousd.stage.read": ("read_rooms",),
    "echousd.stage.update": ("update_graph",),
    "echousd.texturing:export_job": ("export_texture_job",),
    "echousd.texturing:import_job": ("import_texture_job",),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}
__all__ = [
    "GraphError", "HomeGraph", "Node", "Relation", "Room", "RoomOptions", "RoomSpec", "SceneGraph", "batch", "check",
    "edit", "export", "export_texture_job", "generate", "generate_home", "generate_many", "import_plan",
    "import_texture_job", "load_model", "plan_home", "read_dressing", "read_graph", "read_rooms",
    "relations_from_boxes", "render", "update_graph", "vocabulary", "write_graph",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'echousd' has no attribute {name!r}")
    module, _, other = _HOME[name].partition(":")
    value = getattr(importlib.import_module(module), other or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
