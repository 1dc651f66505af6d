"""Sources of shapes by name; a new one is a module with a `SOURCE` and one line here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from echousd.room.sources.source import ShapeSource

# Imported when asked for: the command line names the sources without loading the model.
MODULES = {
    "parts": "echousd.room.sources.parts",
    "sdf": "echousd.room.sources.sdf",
    "boxes": "echousd.room.sources.boxes",
}
DEFAULT = "sdf"


def shape_source(name: str) -> ShapeSource:
    """The source of that name; raises ValueError naming those that there are."""
    if name not in MODULES:
        raise ValueError(f"shapes is {name!r}, allowed: {', '.join(MODULES)}")
    return importlib.import_module(MODULES[name]).SOURCE
