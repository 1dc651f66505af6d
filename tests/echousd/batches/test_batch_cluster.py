"""The Ray executor without Ray: a watched task ends with its limit, and a missing Ray is told."""

import sys
import time

import pytest

from echousd.batches import executor
from echousd.batches.batch import batch
from echousd.batches.executor import RayCluster, watched


def test_without_ray_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ValueError, match=r"--ray needs Ray: pip install 'echousd\[ray\]'"):
        batch(sample={"bedroom": 1}, out=tmp_path / "run", ray="auto")
    with pytest.raises(ValueError, match="needs Ray"):
        RayCluster()


def test_a_watched_task_gives_its_value_or_its_limit(monkeypatch):
    assert watched(abs, -3, None) == ("done", 3)
    assert watched(int, "x", 10**6)[0] == "error"
    ended = []
    monkeypatch.setattr(executor, "DYING", 0.01)
    monkeypatch.setattr(executor, "resident", lambda process: 500.0)
    monkeypatch.setattr(executor.os, "_exit", ended.append)
    assert watched(time.sleep, 1, 400) == ("limit", "held 500 MiB of memory, allowed: 400 MiB")
    time.sleep(1.2)
    assert ended == [1]
