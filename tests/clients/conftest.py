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
    from echousd import generate

    folder = tmp_path_factory.mktemp("rooms")
    return [generate(SAMPLES / f"{name}.usda", seed=7).save(folder / name) for name in NAMES]
