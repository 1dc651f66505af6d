"""Rooms and furniture to train on for a few steps, made once for all who read them."""

from __future__ import annotations

from pathlib import Path

import pytest
from smoke_data import smoke_data

from echomodel.data.roomset import RoomSet
from echomodel.training.rooms import PackedRooms


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return smoke_data(tmp_path_factory)


@pytest.fixture(scope="session")
def packed(data: Path) -> PackedRooms:
    return PackedRooms.from_set(RoomSet(data / "rooms"), ("sgfront", "strict"), held=False)
