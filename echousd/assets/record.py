"""One model of a library: where it lies, whose it is, what it is, and how it comes into the object frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echousd.assets.reference import Vector

UPRIGHT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
Z_UP = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0)  # (x, y, z) -> (x, z, -y)


@dataclass(frozen=True)
class AssetRecord:
    """A row of an index.

    Arguments:
        id: unique in its library, made from where the model lies.
        uri: the file, relative to the index where that is possible, with forward slashes; `archive.sh3f!member` for a
            model in an archive.
        root: the folder that was indexed, as `uri`; the model's own files are looked for below it and nowhere else.
        sha256: of the file. stamp: size and time of the file when it was read, to see whether it changed.
        name: what its source calls it. licence: SPDX identifier or what the source says, "unknown" where it says
            nothing. author: who must be named, "" where nobody is known.
        category: of the vocabulary, "" = unknown. confidence: 0 to 1, in the category. front_confidence: in the front.
        turn: (9) rows of the rotation from the model's axes to the object frame (+Y up, front +Z).
        low, high: (3) of the turned model, in its own unit. dims: (3) width, height, depth in metres.
        placement: what it rests on, `floor`, `wall`, `ceiling` or `surface`.
        joints: how many. rigid: it has colliders, bodies or joints of its own, and must not be stretched unevenly.
        prim: path of its root prim, "" for a model that is no USD. materials: names of its material slots.
        tags: words of its source: style, material, colour. variants: `set=selection` that are there.
        missing: files that the model names and that are not there.
        thumbnail: PNG. descriptor: of its shape, empty where none was made.
        colors: share, and OKLab, of up to three colours of its surface, the largest share first; empty = not known.
        corrected: what a person's table said of it when it was read, "" = nothing.
        fault: why it cannot be used, "" where it can.
    """

    id: str
    uri: str
    root: str = "."
    sha256: str = ""
    stamp: str = ""
    name: str = ""
    licence: str = "unknown"
    author: str = ""
    category: str = ""
    confidence: float = 0.0
    front_confidence: float = 0.0
    turn: tuple[float, ...] = UPRIGHT
    low: Vector = (0.0, 0.0, 0.0)
    high: Vector = (0.0, 0.0, 0.0)
    dims: Vector = (0.0, 0.0, 0.0)
    placement: str = "floor"
    joints: int = 0
    rigid: bool = False
    prim: str = ""
    materials: tuple[str, ...] = ()
    tags: tuple[str, ...] = ()
    variants: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    thumbnail: bytes = b""
    descriptor: tuple[float, ...] = ()
    colors: tuple[float, ...] = ()
    corrected: str = ""
    fault: str = ""

    @property
    def usable(self) -> bool:
        """Whether it may be chosen: read, measured, and of a known category."""
        return not self.fault and bool(self.category) and min(self.dims) > 0

    def pose(self, size: Vector | None = None) -> np.ndarray:
        """(4, 4) float: the model's frame and unit to the object frame, where it fills `size` metres (its own dims)."""
        low, high = np.array(self.low), np.array(self.high)
        scale = np.array(size or self.dims) / np.maximum(high - low, 1e-12)
        foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        out = np.eye(4)
        out[:3, :3] = scale[:, None] * np.array(self.turn).reshape(3, 3)
        out[:3, 3] = -scale * foot
        return out

    def turned(self, quarters: int) -> AssetRecord:
        """The record with the model turned by quarters of a circle about +Y, counter-clockwise seen from above."""
        turn = np.linalg.matrix_power(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), quarters % 4)
        ends = np.array([self.low, self.high]) @ turn.T
        own, dims = turn @ np.reshape(self.turn, (3, 3)), np.abs(turn @ self.dims)
        return replace(
            self, turn=tuple(own.ravel().tolist()), low=vector(ends.min(0)), high=vector(ends.max(0)), dims=vector(dims)
        )


def vector(values: np.ndarray) -> Vector:
    """Three numbers as a tuple, rounded to a micrometre."""
    x, y, z = (round(float(value), 6) + 0.0 for value in values)
    return x, y, z
