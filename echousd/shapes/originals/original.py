"""A model of somebody else's as a part of a room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

CONVERTED = "model.usdc"


@dataclass(frozen=True, eq=False)
class Original:
    """The model that a piece of furniture is."""

    pose: np.ndarray  # (4, 4) float, its frame and unit to the object's frame, in metres
    prim: str  # path of its root prim
    # the USD file that holds it, which stays where it is and as it is; None where `files` hold it
    layer: Path | None = None
    # name -> content of a model that was converted to USD or is taken along, to be written beside it
    files: Mapping[str, bytes] = field(default_factory=dict)
    main: str = CONVERTED  # which of the files is the model
    bodies: bool = False  # bodies, colliders: it has rigid bodies or colliders of its own, so that it gets none of ours
    colliders: bool = False
