"""The network on a device of its own: who draws what, and that the rooms are those of a run without."""

import json
import os
import pickle

import pytest
import torch
from inline_batches import QUICK, Inline, digests

from echousd.batches import work
from echousd.batches.batch import batch, generate_many
from echousd.batches.executor import LocalWorkers, Task
from echousd.batches.work import ElsewhereModel, SamplesWanted, sampled
from echousd.graph import SceneGraph


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
        return real(path, stamp, "cpu")

    monkeypatch.setattr(loading, "_loaded", loaded)
    return asked


@pytest.mark.parametrize("shapes", ["parts", "sdf"])
def test_rooms_ask_the_device_for_shapes_and_are_the_same(graphs, tmp_path, stand_in, shapes):
    asked = {**QUICK, "shapes": shapes, "faces": 500}
    batch(graphs, tmp_path / "cpu", executor=Inline(), **asked)
    executor = Inline({"samples 0 graphs_000000": ["died"]})
    assert batch(graphs, tmp_path / "device", executor=executor, device="cuda", **asked).complete
    assert digests(tmp_path / "device") == digests(tmp_path / "cpu")
    wanted = [key for key in executor.calls if key.startswith("samples")]
    assert sorted(wanted) == ["samples 0 graphs_000000"] * 2 + ["samples 0 graphs_000001"]
    assert set(stand_in) == {"cpu", "cuda"}
    several = [SceneGraph.from_json(line) for line in graphs.read_text().splitlines()]
    for room, place in zip(generate_many(several, device="cuda", **asked), (tmp_path / "cpu").glob("rooms/*/*")):  # noqa: B905
        assert room.graph.to_json()
        assert place.is_dir()


def test_a_room_that_the_device_refuses_is_told(graphs, tmp_path, stand_in, monkeypatch):
    def refuses(asks):
        raise ValueError("the device is out of memory")

    with monkeypatch.context() as patch:
        patch.setattr(work, "samples", refuses)
        result = batch(graphs, tmp_path / "run", executor=Inline(), device="cuda", **{**QUICK, "shapes": "parts"})
    assert (result.done, result.failed) == (0, 2)


def test_only_samples_are_called_for():
    model = ElsewhereModel(None, ())
    generator = torch.Generator()
    with pytest.raises(SamplesWanted) as wanted:
        model.sample_shapes(None, None, generator=generator, progress=print)
    assert wanted.value.call
    with pytest.raises(ValueError, match="'load' is no call for samples, allowed: sample_layout, sample_shapes"):
        sampled(None, pickle.dumps(("load", (), None, {})))


def where(_):
    return os.getpid(), os.environ.get(work.VISIBLE, "")


def test_network_tasks_go_to_the_processes_of_the_devices():
    pool = LocalWorkers(2, networks=[{work.VISIBLE: "7"}, {work.VISIBLE: "9"}])
    try:
        assert (pool.workers, pool.free(), pool.free(network=True)) == (2, 2, 2)
        for key in range(4):
            pool.submit(Task(str(key), where, None, network=key % 2 == 0))
        assert (pool.free(), pool.free(network=True)) == (0, 0)
        found = {}
        while len(found) < 4:
            found |= {outcome.task.key: outcome.value for outcome in pool.outcomes(5.0)}
    finally:
        pool.close()
    assert {found[key][1] for key in "02"} == {"7", "9"}
    assert len({process for process, _ in found.values()}) == 4


def test_devices_are_found_or_refused(monkeypatch, tmp_path):
    assert work.network_processes("cpu") == []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    monkeypatch.delenv(work.VISIBLE, raising=False)
    assert work.network_processes("cuda") == [{work.VISIBLE: "0"}, {work.VISIBLE: "1"}]
    monkeypatch.setenv(work.VISIBLE, "3, 5")
    assert work.network_processes("cuda") == [{work.VISIBLE: "3"}, {work.VISIBLE: "5"}]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ValueError, match=r"device is 'cuda', which torch .* finds none of; here: cpu"):
        batch(tmp_path / "none.yaml", tmp_path / "run", device="cuda")
    assert not (tmp_path / "run").exists()
    with pytest.raises(ValueError, match="one device for all"):
        batch(tmp_path / "none.yaml", tmp_path / "run", variations={"device": ["cpu"]})
