"""The rooms and furniture of the recipe `smoke`, made once for all workers of a run of the tests."""

import fcntl
import os
from pathlib import Path

import pytest

from echomodel.data.shapeset import build_data


def smoke_data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the data; whoever comes first makes it, the others wait. Nobody writes into it."""
    top = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        top = top.parent
    folder = top / "smoke"
    with (top / "smoke.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            build_data(top / "smoke.part", "smoke", seed=3)
            (top / "smoke.part").rename(folder)
    return folder
