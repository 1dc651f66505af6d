"""Published data as the `paper` preset trains on it: SG-FRONT's scans and graphs, 3D-FUTURE-SDF's grids beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from echomodel.data.roomset import with_known_words
from echomodel.data.sgfront import SGFront
from echomodel.roomboxes import RoomBoxes

SHAPES, GRID, FIELD = "3D-FUTURE-SDF", "ori_sample_grid.h5", "pc_sdf_sample"
CLAMP = 0.2  # of the published distances
HELD_OUT_EVERY = 20


class PublishedRooms:
    """The scans of `trainval`, with the relations that their graphs state; every twentieth is for validation.

    Arguments:
        folder: of SG-FRONT. Raises `SGFrontError` as `SGFront`, and ValueError for a folder without scans.
    """

    def __init__(self, folder: Path) -> None:
        told = SGFront(folder).rooms()
        pairs = zip(with_known_words(told), told, strict=True)
        self.rooms = [replace(new, relations=old.relations) for new, old in pairs if len(new) == len(old) > 0]
        if not self.rooms:
            raise ValueError(f"{folder}: no scan of trainval with objects that the vocabulary holds")
        self.held_out = np.arange(len(self.rooms)) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1

    def __len__(self) -> int:
        return len(self.rooms)

    def room(self, number: int, *, rules: str = "sgfront") -> RoomBoxes:
        """A scan; `rules` is not looked at, its graph says what holds."""
        return self.rooms[number]


class PublishedShapes:
    """Signed distances of 3D-FUTURE's models, `3D-FUTURE-SDF/<model>/ori_sample_grid.h5` in the folder of SG-FRONT.

    Raises ValueError for a folder without any, and where h5py is not installed.
    """

    def __init__(self, folder: Path) -> None:
        self.files = sorted((folder / SHAPES).glob(f"*/{GRID}"))
        if not self.files:
            raise ValueError(
                f"{folder / SHAPES}: no <model>/{GRID}; echoscene's page says where people get 3D-FUTURE-SDF"
            )
        self._numbers = {file.parent.name: number for number, file in enumerate(self.files)}
        self.held_out = np.arange(len(self.files)) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1

    def __len__(self) -> int:
        return len(self.files)

    def index_of(self, name: str) -> int:
        """Number of a model, -1 for one that is not there."""
        return self._numbers.get(name, -1)

    def published(self, numbers: np.ndarray, side: int) -> Tensor:
        """Grids (K, 1, side, side, side) float32 as published; raises ValueError that names a file of another form."""
        try:
            import h5py
        except ImportError:
            raise ValueError("3D-FUTURE-SDF is read with h5py: pip install 'echousd[sgfront]'") from None
        out = []
        for number in numbers:
            try:
                with h5py.File(self.files[int(number)]) as file:
                    out.append(np.asarray(file[FIELD], np.float32).reshape(1, 64, 64, 64))
            except (OSError, KeyError, ValueError) as error:
                raise ValueError(f"{self.files[int(number)]}: no grid {FIELD!r} of 64 x 64 x 64 ({error})") from None
        grids = torch.from_numpy(np.stack(out)).clamp(-CLAMP, CLAMP)
        if side == grids.shape[-1]:
            return grids
        return torch.nn.functional.interpolate(grids, (side,) * 3, mode="trilinear", align_corners=True)
