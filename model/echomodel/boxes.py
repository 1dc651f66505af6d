"""Oriented boxes as tensors, and the normalised 8-vector that the layout denoiser sees (EchoScene, section 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor

from echomodel.roomboxes import RoomBoxes

LARGEST = 10.0  # log metres, far beyond any furniture


@dataclass(frozen=True, eq=False)
class Boxes:
    """N oriented boxes in the room frame, whose origin is the centre of the floor's bounding box at floor height.

    Arguments:
        size: (N, 3) float32, extents along x, y, z at yaw 0, metres.
        position: (N, 3) float32, centre of the bottom face, metres.
        yaw: (N,) float32, radians about +Y.

    Raises:
        ValueError: the shapes do not belong together.
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

    def encode(self, statistics: BoxStatistics) -> Tensor:
        """(N, 8) float32 [sx, sy, sz, px, py, pz, sin, cos], size and position normalised by `statistics`."""
        size = self.size.clamp_min(1e-3).log() if statistics.log_size else self.size
        low, span = statistics.bounds(self.size)
        scaled = (torch.cat([size, self.position], dim=1) - low) / span * 2 - 1
        return torch.cat([scaled, torch.sin(self.yaw)[:, None], torch.cos(self.yaw)[:, None]], dim=1)

    @classmethod
    def decode(cls, vectors: Tensor, statistics: BoxStatistics) -> Boxes:
        """The inverse of `encode`, differentiable; the (sin, cos) pair may have any length, yaw = atan2(sin, cos)."""
        low, span = statistics.bounds(vectors)
        plain = (vectors[:, :6] + 1) / 2 * span + low
        # a guess of the clean box from pure noise lies anywhere: its exponential must stay finite, gradients too
        size = plain[:, :3].clamp(-LARGEST, LARGEST).exp() if statistics.log_size else plain[:, :3]
        return cls(size, plain[:, 3:], torch.atan2(vectors[:, 6], vectors[:, 7]))


@dataclass(frozen=True)
class BoxStatistics:
    """How size and position become numbers near [-1, 1]: v' = 2 (v - low) / (high - low) - 1 per axis (SPEC 2).

    Arguments:
        size_low, size_high: three numbers each, metres (or log metres with `log_size`).
        position_low, position_high: three numbers each, metres.
        log_size: normalise the logarithm of the size, so that a volume ratio is a difference.

    Raises:
        ValueError: not three numbers each, or a high that is not above its low.
    """

    size_low: tuple[float, ...]
    size_high: tuple[float, ...]
    position_low: tuple[float, ...]
    position_high: tuple[float, ...]
    log_size: bool = False

    def __post_init__(self) -> None:
        for kind in ("size", "position"):
            low, high = getattr(self, f"{kind}_low"), getattr(self, f"{kind}_high")
            if len(low) != 3 or len(high) != 3:
                raise ValueError(f"box statistics: {kind} bounds have {len(low)} and {len(high)} numbers, expected 3")
            if any(not a < b for a, b in zip(low, high, strict=True)):
                raise ValueError(f"box statistics: {kind}_high {high} is not above {kind}_low {low} on every axis")

    @classmethod
    def from_boxes(cls, boxes: Boxes) -> BoxStatistics:
        """Mean plus and minus one standard deviation of log size and position; x and z share theirs (rooms turn)."""
        size, position = boxes.size.double().clamp_min(1e-3).log(), boxes.position.double()
        mean, std = size.mean(0), size.std(0)
        centre = torch.stack([torch.zeros(()), position[:, 1].mean().float(), torch.zeros(())]).double()
        plane = position[:, [0, 2]].square().mean().sqrt()
        spread = torch.stack([plane, position[:, 1].std(), plane])
        numbers = [(mean - std), (mean + std), (centre - spread), (centre + spread)]
        low, high, start, stop = (tuple(round(float(v), 5) for v in values) for values in numbers)
        return cls(low, high, start, stop, log_size=True)

    def bounds(self, like: Tensor) -> tuple[Tensor, Tensor]:
        """low (6,) and high - low (6,) as tensors of the dtype and device of `like`."""
        low = like.new_tensor([*self.size_low, *self.position_low])
        return low, like.new_tensor([*self.size_high, *self.position_high]) - low

    def to_json(self) -> dict:
        """Plain lists and numbers."""
        return {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(self).items()}

    @classmethod
    def from_json(cls, raw: dict) -> BoxStatistics:
        """What `to_json` wrote."""
        fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in raw.items()}
        return cls(**fields)
