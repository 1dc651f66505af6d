"""Oriented boxes as tensors, and the normalised 8-vector that the layout denoiser sees (EchoScene, section 3.3)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor

from echomodel.roomboxes import RoomBoxes

FEWEST = 50  # boxes that the statistics of a class need
NARROWEST = 0.02  # log metres: sizes that hardly vary would turn noise into huge numbers
Z95 = 1.6449  # standard score of the 95th percentile
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

    size: Tensor
    position: Tensor
    yaw: Tensor

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

    def __getitem__(self, index: slice | Tensor) -> Boxes:
        return Boxes(self.size[index], self.position[index], self.yaw[index])

    @classmethod
    def cat(cls, boxes: Sequence[Boxes]) -> Boxes:
        """Boxes behind one another."""
        size, position = torch.cat([b.size for b in boxes]), torch.cat([b.position for b in boxes])
        return cls(size, position, torch.cat([b.yaw for b in boxes]))

    @classmethod
    def from_room(cls, room: RoomBoxes) -> Boxes:
        """The boxes of a room, moved so that the centre of its floor's bounding box is the origin."""
        position = torch.as_tensor(room.position, dtype=torch.float32).reshape(-1, 3).clone()
        if len(room.floor_polygon):
            centre = (room.floor_polygon.max(0) + room.floor_polygon.min(0)) / 2
            position[:, 0] -= float(centre[0])
            position[:, 2] -= float(centre[1])
        size = torch.as_tensor(room.size, dtype=torch.float32).reshape(-1, 3)
        return cls(size, position, torch.as_tensor(room.yaw, dtype=torch.float32).reshape(-1))

    def to(self, device: torch.device | str) -> Boxes:
        """The same boxes on another device."""
        return Boxes(self.size.to(device), self.position.to(device), self.yaw.to(device))

    def replaced(self, mask: Tensor, by: Boxes) -> Boxes:
        """The same boxes, but those of `by` where `mask` (N,) bool is true."""
        wide = mask[:, None]
        size, position = torch.where(wide, by.size, self.size), torch.where(wide, by.position, self.position)
        return Boxes(size, position, torch.where(mask, by.yaw, self.yaw))

    def check(self) -> None:
        """Raises ValueError for a box that is not finite or has an extent that is not positive; names the first."""
        flat = torch.cat([self.size, self.position, self.yaw[:, None]], dim=1)
        for text, wrong in (
            ("is not finite", ~torch.isfinite(flat).all(1)),
            ("has an extent that is not positive", (self.size <= 0).any(1)),
        ):
            if bool(wrong.any()):
                at = int(wrong.nonzero()[0])
                size, position = self.size[at].tolist(), self.position[at].tolist()
                raise ValueError(f"box {at} {text}: size {size}, position {position}, yaw {float(self.yaw[at])}")

    def encode(self, scale: BoxScale) -> Tensor:
        """(N, 8) float32 [sx, sy, sz, px, py, pz, sin, cos], size and position in the units of `scale`."""
        size = self.size.clamp_min(1e-3).log() if scale.log_size else self.size
        off = torch.cat([size, self.position], dim=1) - scale.middle.to(size)
        scaled = off / torch.where(off < 0, scale.below.to(size), scale.above.to(size))
        return torch.cat([scaled, torch.sin(self.yaw)[:, None], torch.cos(self.yaw)[:, None]], dim=1)

    @classmethod
    def decode(cls, vectors: Tensor, scale: BoxScale) -> Boxes:
        """The inverse of `encode`, differentiable: (N, 8) of any length of (sin, cos), yaw = atan2(sin, cos)."""
        scaled = vectors[:, :6]
        step = torch.where(scaled < 0, scale.below.to(vectors), scale.above.to(vectors))
        plain = scale.middle.to(vectors) + scaled * step
        # a guess of the clean box from pure noise lies anywhere: its exponential must stay finite, gradients too
        size = plain[:, :3].clamp(-LARGEST, LARGEST).exp() if scale.log_size else plain[:, :3]
        return cls(size, plain[:, 3:], torch.atan2(vectors[:, 6], vectors[:, 7]))


@dataclass(frozen=True, eq=False)
class BoxScale:
    """What the normalised numbers of boxes stand for: 0 is the `middle`, -1 lies `below` under it, 1 `above` over it.

    Arguments:
        middle, below, above: (N, 6) or (1, 6) float32, size and position, metres.
        log_size: sizes are in log metres.
    """

    middle: Tensor
    below: Tensor
    above: Tensor
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

    @classmethod
    def from_boxes(cls, boxes: Boxes, category: Tensor, categories: int) -> BoxStatistics:
        """Spreads of log size per class and of position; x and z share theirs (rooms turn).

        Arguments:
            boxes: N boxes. category: (N,) int64, their classes. categories: number of classes; one with fewer than
                `FEWEST` boxes gets the spread of all.
        """
        size, position = boxes.size.double().clamp_min(1e-3).log(), boxes.position.double()
        mean, std = size.mean(0), size.std(0)
        centre = torch.stack([torch.zeros(()), position[:, 1].mean().float(), torch.zeros(())]).double()
        plane = position[:, [0, 2]].square().mean().sqrt()
        spread = torch.stack([plane, position[:, 1].std(), plane])
        numbers = [(mean - std), (mean + std), (centre - spread), (centre + spread)]
        low, high, start, stop = (tuple(round(float(v), 5) for v in values) for values in numbers)
        rows, shares = [], size.new_tensor([0.05, 0.5, 0.95])
        for number in range(categories):
            own = size[category == number]
            few, middle, many = (own if len(own) >= FEWEST else size).quantile(shares, dim=0)
            steps = (torch.cat([middle - few, many - middle]) / Z95).clamp_min(NARROWEST)
            rows.append(tuple(round(float(v), 4) for v in torch.cat([middle, steps])))
        return cls(low, high, start, stop, log_size=True, classes=tuple(rows))

    def scale(self, category: Tensor | None = None) -> BoxScale:
        """What the numbers of boxes stand for: of N boxes of `category` (N,) int64, or of all alike.

        Raises ValueError where sizes are normalised within classes and there is no `category`.
        """
        device = "cpu" if category is None else category.device
        low = torch.tensor([*self.size_low, *self.position_low])[None].to(device)
        high = torch.tensor([*self.size_high, *self.position_high])[None].to(device)
        middle, half = (low + high) / 2, (high - low) / 2
        if not self.classes:
            return BoxScale(middle, half, half, self.log_size)
        if category is None:
            raise ValueError("box statistics normalise sizes within classes: the classes of the boxes are needed")
        sizes = torch.tensor(self.classes).to(category.device)[category].split(3, dim=1)
        places = (values[:, 3:].expand(len(category), 3) for values in (middle, half, half))
        centre, below, above = (torch.cat(pair, 1) for pair in zip(sizes, places, strict=True))
        return BoxScale(centre, below, above, self.log_size)

    def to_json(self) -> dict:
        """Plain lists and numbers."""
        return json.loads(json.dumps(asdict(self)))

    @classmethod
    def from_json(cls, raw: dict) -> BoxStatistics:
        """What `to_json` wrote."""
        fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in raw.items()}
        return cls(**{**fields, "classes": tuple(tuple(row) for row in fields.get("classes", ()))})
