"""From a scene graph to a room on disk: meshes, layers, materials, physics, cameras."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echousd.room.finished import Room
    from echousd.room.options import RoomOptions
    from echousd.room.pipeline import generate
    from echousd.room.room import Provenance, Verdict

# `generate` needs torch, the plain data does not: each is imported on first use.
_HOME = {
    "Provenance": "echousd.room.room",
    "Room": "echousd.room.finished",
    "RoomOptions": "echousd.room.options",
    "Verdict": "echousd.room.room",
    "generate": "echousd.room.pipeline",
}
__all__ = ["Provenance", "Room", "RoomOptions", "Verdict", "generate"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'echousd.room' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
