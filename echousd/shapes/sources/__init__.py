"""Sources of shapes by name; a new one is a module with a `SOURCE` and one line here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel
    from echousd.shapes.sources.source import ShapeSource

# Imported when asked for: the command line names the sources without loading the model.
MODULES = {
    "parts": "echousd.shapes.sources.parts",
    "sdf": "echousd.shapes.sources.sdf",
    "boxes": "echousd.shapes.sources.boxes",
    "library": "echousd.shapes.sources.library",
    "guided": "echousd.shapes.sources.guided",
    "independent": "echousd.shapes.sources.independent",
    "own": "echousd.shapes.sources.own",
}


def default_source(model: RoomModel | None) -> str:
    """`parts` where the model can describe furniture, else `sdf`."""
    return "parts" if model is None or "furniture" in model.branches else "sdf"


def shape_source(name: str) -> ShapeSource:
    """The source of that name; raises ValueError naming those that there are."""
    if name not in MODULES:
        raise ValueError(f"shapes is {name!r}, allowed: {', '.join(MODULES)}")
    return importlib.import_module(MODULES[name]).SOURCE
