"""Rooms for other people's software: generated from samples, or any folder of rooms in $ECHOUSD_CLIENT_ROOMS."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for `environments`, which runs in this process alone
SAMPLES = Path(__file__).parents[2] / "samples"
NAMES = ("bedroom", "living_room", "dining_room")


@pytest.fixture(scope="session")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Root layers of rooms."""
    given = os.environ.get("ECHOUSD_CLIENT_ROOMS")
    if given:
        found = sorted(path for path in Path(given).glob("*/*.usda") if (path.parent / "layers").is_dir())
        assert found, f"{given}: no rooms"
        return found
    from echousd import RoomOptions, generate

    folder, options = tmp_path_factory.mktemp("rooms"), RoomOptions(walls=True, dress="some")  # as the command's
    return [generate(SAMPLES / f"{name}.usda", seed=7, options=options).save(folder / name) for name in NAMES]


@pytest.fixture(scope="session")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The root layer of a home of three rooms."""
    from echousd import HomeGraph, generate_home

    graph = HomeGraph.from_words("hall open_to living, hall door bathroom", area=40)
    return generate_home(graph, tmp_path_factory.mktemp("home") / "flat", seed=7, walls=True, dress="some").root


@pytest.fixture(scope="session")
def z_room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room with Z up, its layers as usdc."""
    from echousd import RoomOptions, generate

    options = RoomOptions(up_axis="Z", walls=True, dress="some", crate=True)
    return generate(SAMPLES / "study.usda", seed=301, options=options).save(tmp_path_factory.mktemp("z") / "study")


@pytest.fixture(scope="session")
def shared_room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room whose chairs are instances of one asset."""
    from echousd import RoomOptions, generate

    options = RoomOptions(walls=True, dress="some", instances=True)
    return generate(SAMPLES / "dining_room.usda", seed=7, options=options).save(tmp_path_factory.mktemp("i") / "dining")
