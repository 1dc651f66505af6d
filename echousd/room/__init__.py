"""From a scene graph to a room on disk: meshes, layers, materials, physics, cameras."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echousd.room.pipeline import generate
    from echousd.room.room import Provenance, Room, RoomOptions, Verdict

__all__ = ["Provenance", "Room", "RoomOptions", "Verdict", "generate"]


def __getattr__(name: str) -> Any:  # `generate` needs torch, the plain data does not
    if name not in __all__:
        raise AttributeError(f"module 'echousd.room' has no attribute {name!r}")
    home = "echousd.room.pipeline" if name == "generate" else "echousd.room.room"
    return getattr(importlib.import_module(home), name)
