"""Oriented boxes as arrays of numpy or torch, and the normalised 8-vector that the layout denoiser sees (3.3)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from echomodel.arrays import Array, at_least, beside, cast, clipped, kit, on_device

LARGEST = 10.0  # log metres, far beyond any furniture


@dataclass(frozen=True, eq=False)
class Boxes:
    """N oriented boxes in the room frame, whose origin is the centre of the floor's bounding box at floor height.

    Arguments:
        size: (N, 3) float32, extents along x, y, z at yaw 0, metres.
        position: (N, 3) float32, centre of the bottom face, metres.
        yaw: (N,) float32, radians about +Y.

    Raises ValueError where the shapes do not belong together.
    """

    size: Array
    position: Array
    yaw: Array

    def __post_init__(self) -> None:
        shapes = tuple(self.size.shape), tuple(self.position.shape), tuple(self.yaw.shape)
        count = self.yaw.shape[-1] if self.yaw.ndim else 0
        if shapes != ((count, 3), (count, 3), (count,)):
            raise ValueError(
                f"Boxes: size, position, yaw have shapes {shapes[0]}, {shapes[1]}, {shapes[2]}, "
                "expected (N, 3), (N, 3), (N,)"
            )

    def __len__(self) -> int:
        return len(self.yaw)

    def __getitem__(self, index: slice | Array) -> Boxes:
        return Boxes(self.size[index], self.position[index], self.yaw[index])

    @classmethod
    def cat(cls, boxes: Sequence[Boxes]) -> Boxes:
        """Boxes behind one another."""
        parts = ([getattr(each, name) for each in boxes] for name in ("size", "position", "yaw"))
        return cls(*(kit(part[0]).concat(part) for part in parts))

    def to(self, device: Any) -> Boxes:
        """The same boxes as tensors on a device, or with None as arrays of numpy."""
        return Boxes(*(on_device(values, device) for values in (self.size, self.position, self.yaw)))

    def replaced(self, mask: Array, by: Boxes) -> Boxes:
        """The same boxes, but those of `by` where `mask` (N,) bool is true."""
        wide, xp = mask[:, None], kit(self.yaw)
        size, position = xp.where(wide, by.size, self.size), xp.where(wide, by.position, self.position)
        return Boxes(size, position, xp.where(mask, by.yaw, self.yaw))

    def check(self) -> None:
        """Raises ValueError for a box that is not finite or has an extent that is not positive; names the first."""
        size, position, yaw = (on_device(values, None) for values in (self.size, self.position, self.yaw))
        for text, wrong in (
            ("is not finite", ~np.isfinite(np.concatenate([size, position, yaw[:, None]], 1)).all(1)),
            ("has an extent that is not positive", (size <= 0).any(1)),
        ):
            if wrong.any():
                at = int(wrong.argmax())
                where = f"position {position[at].tolist()}, yaw {float(yaw[at])}"
                raise ValueError(f"box {at} {text}: size {size[at].tolist()}, {where}")

    def encode(self, scale: BoxScale) -> Array:
        """(N, 8) float32 [sx, sy, sz, px, py, pz, sin, cos], size and position in the units of `scale`."""
        xp = kit(self.yaw)
        size = xp.log(at_least(self.size, 1e-3)) if scale.log_size else self.size
        off = xp.concat([size, self.position], 1) - cast(scale.middle, size)
        scaled = off / xp.where(off < 0, cast(scale.below, size), cast(scale.above, size))
        return xp.concat([scaled, xp.sin(self.yaw)[:, None], xp.cos(self.yaw)[:, None]], 1)

    @classmethod
    def decode(cls, vectors: Array, scale: BoxScale) -> Boxes:
        """The inverse of `encode`, differentiable: (N, 8) of any length of (sin, cos), yaw = atan2(sin, cos)."""
        xp, scaled = kit(vectors), vectors[:, :6]
        step = xp.where(scaled < 0, cast(scale.below, vectors), cast(scale.above, vectors))
        plain = cast(scale.middle, vectors) + scaled * step
        # a guess of the clean box from pure noise lies anywhere: its exponential must stay finite, gradients too
        size = xp.exp(clipped(plain[:, :3], -LARGEST, LARGEST)) if scale.log_size else plain[:, :3]
        return cls(size, plain[:, 3:], xp.atan2(vectors[:, 6], vectors[:, 7]))


@dataclass(frozen=True, eq=False)
class BoxScale:
    """What the normalised numbers of boxes stand for: 0 is the `middle`, -1 lies `below` under it, 1 `above` over it.

    Arguments:
        middle, below, above: (N, 6) or (1, 6) float32, size and position, metres.
        log_size: sizes are in log metres.
    """

    middle: Array
    below: Array
    above: Array
    log_size: bool


@dataclass(frozen=True)
class BoxStatistics:
    """How size and position become numbers near [-1, 1]: v' = 2 (v - low) / (high - low) - 1 per axis (SPEC 2).

    Arguments:
        size_low, size_high: three numbers each, metres (or log metres with `log_size`).
        position_low, position_high: three numbers each, metres.
        log_size: normalise the logarithm of the size, so that a volume ratio is a difference.
        classes: for every class nine numbers, the middle of log x, y, z, how far -1 lies below and 1 above each; with
            them sizes become standard scores within their class and the size range is not used. Empty = one range for
            all.

    Raises ValueError for not three or nine numbers each, a high that is not above its low, a step that is not positive,
    or classes without `log_size`.
    """

    size_low: tuple[float, ...]
    size_high: tuple[float, ...]
    position_low: tuple[float, ...]
    position_high: tuple[float, ...]
    log_size: bool = False
    classes: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        for kind in ("size", "position"):
            low, high = getattr(self, f"{kind}_low"), getattr(self, f"{kind}_high")
            if len(low) != 3 or len(high) != 3:
                raise ValueError(f"box statistics: {kind} bounds have {len(low)} and {len(high)} numbers, expected 3")
            if any(not a < b for a, b in zip(low, high, strict=True)):
                raise ValueError(f"box statistics: {kind}_high {high} is not above {kind}_low {low} on every axis")
        for number, row in enumerate(self.classes):
            if len(row) != 9 or min(row[3:]) <= 0 or not self.log_size:
                raise ValueError(f"box statistics: class {number} is {row}, expected nine numbers of log sizes")

    def scale(self, category: Array | None = None) -> BoxScale:
        """What the numbers of boxes stand for: of N boxes of `category` (N,) int64, or of all alike.

        Raises ValueError where sizes are normalised within classes and there is no `category`.
        """
        where = np.zeros(1) if category is None else category
        low, high = (np.array([[*size, *place]], np.float32) for size, place in (
            (self.size_low, self.position_low), (self.size_high, self.position_high)
        ))  # fmt: skip
        middle, half = (low + high) / 2, (high - low) / 2
        if not self.classes:
            return BoxScale(beside(middle, where), beside(half, where), beside(half, where), self.log_size)
        if category is None:
            raise ValueError("box statistics normalise sizes within classes: the classes of the boxes are needed")
        of_class = np.array(self.classes, np.float32).reshape(-1, 3, 3)
        rows = (np.concatenate([of_class[:, number], np.repeat(values[:, 3:], len(of_class), 0)], 1)
                for number, values in enumerate((middle, half, half)))  # fmt: skip
        centre, below, above = (beside(values, where)[where] for values in rows)
        return BoxScale(centre, below, above, self.log_size)

    def to_json(self) -> dict:
        """Plain lists and numbers."""
        return json.loads(json.dumps(asdict(self)))

    @classmethod
    def from_json(cls, raw: dict) -> BoxStatistics:
        """What `to_json` wrote."""
        fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in raw.items()}
        return cls(**{**fields, "classes": tuple(tuple(row) for row in fields.get("classes", ()))})
