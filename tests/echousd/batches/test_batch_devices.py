"""The network on devices: which worker has which, and that the rooms are those of a run without."""

import json
import os
from multiprocessing import active_children

import pytest
import torch
from inline_batches import QUICK, Inline, batch, digests

from echousd.batches import work
from echousd.batches.executor import LocalWorkers, Task


@pytest.fixture
def graphs(tmp_path):
    """Two graphs of two objects."""
    path, lines = tmp_path / "graphs.jsonl", []
    for things in (("double_bed", "wardrobe"), ("desk", "office_chair")):
        nodes = [{"name": thing, "category": thing} for thing in things]
        lines.append(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes}))
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


@pytest.fixture
def stand_in(monkeypatch):
    """A `cuda` that is this machine's CPU."""
    from echomodel import loading

    real, asked = loading._loaded, []

    def loaded(path, stamp, device):
        asked.append(device)
        return real(path, stamp, None)

    monkeypatch.setattr(loading, "_loaded", loaded)
    return asked


@pytest.mark.parametrize("shapes", ["parts", "sdf"])
def test_rooms_of_a_device_are_the_same(graphs, tmp_path, stand_in, monkeypatch, shapes):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    asked = {**QUICK, "shapes": shapes, "faces": 500}
    if shapes == "sdf":  # whose meshes take longest
        graphs.write_text(graphs.read_text().splitlines()[0])
    batch(graphs, tmp_path / "cpu", executor=Inline(), **asked)
    assert set(stand_in) == {None}  # what ships, without torch
    assert batch(graphs, tmp_path / "device", executor=Inline(), device="cuda", **asked).complete
    assert digests(tmp_path / "device") == digests(tmp_path / "cpu")
    assert set(stand_in) == {None, "cuda"}


def test_workers_take_the_devices_in_turn():
    pool = LocalWorkers(3, devices=[{work.VISIBLE: "7"}, {work.VISIBLE: "9"}])
    try:
        assert pool.free() == 3
        for key in range(3):
            pool.submit(Task(str(key), os.getenv, work.VISIBLE))  # of os alone: workers import no torch
        assert pool.free() == 0
        found = {}
        while len(found) < 3:
            found |= {outcome.task.key: outcome.value for outcome in pool.outcomes(5.0)}
        assert len(active_children()) >= 3
    finally:
        pool.close()
    assert [found[key] for key in "012"] == ["7", "9", "7"]


def test_devices_are_found_or_refused(monkeypatch, tmp_path):
    assert work.devices("cpu") == []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    monkeypatch.delenv(work.VISIBLE, raising=False)
    assert work.devices("cuda") == [{work.VISIBLE: "0"}, {work.VISIBLE: "1"}]
    monkeypatch.setenv(work.VISIBLE, "3, 5")
    assert work.devices("cuda") == [{work.VISIBLE: "3"}, {work.VISIBLE: "5"}]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ValueError, match=r"device is 'cuda', which torch .* finds none of; here: cpu"):
        batch(tmp_path / "none.yaml", tmp_path / "run", device="cuda")
    assert not (tmp_path / "run").exists()
    with pytest.raises(ValueError, match="one device for all"):
        batch(tmp_path / "none.yaml", tmp_path / "run", variations={"device": ["cpu"]})
