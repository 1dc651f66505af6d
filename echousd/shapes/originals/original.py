"""A model of somebody else's as a part of a room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

CONVERTED = "model.usdc"


@dataclass(frozen=True, eq=False)
class Original:
    """The model that a piece of furniture is.

    Arguments:
        pose: (4, 4) float, its frame and unit to the object's frame, in metres.
        prim: path of its root prim.
        layer: the USD file that holds it, which stays where it is and as it is; None where `files` hold it.
        files: name -> content of a model that was converted to USD or is taken along, to be written beside it.
        main: which of the files is the model.
        bodies, colliders: it has rigid bodies or colliders of its own, so that it gets none of ours.
    """

    pose: np.ndarray
    prim: str
    layer: Path | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)
    main: str = CONVERTED
    bodies: bool = False
    colliders: bool = False
