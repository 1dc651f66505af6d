"""Batches on a real Ray on this machine: workers and a node are killed, and the rooms are the same bytes."""

import sys
from pathlib import Path

import pytest
from environments import python_of, run

pytestmark = [
    pytest.mark.clients,
    pytest.mark.skipif(sys.platform != "linux", reason="the script finds the processes it kills in /proc"),
]
SCRIPT = Path(__file__).with_name("ray_batch.py")


@pytest.mark.parametrize("what", ["worker", "node", "limits"])
def test_what_is_lost_on_ray_is_made_again(what: str) -> None:
    assert run(python_of("ray"), SCRIPT, what, "--rooms", "6", timeout=1800).splitlines()[-1].startswith("same ")
