"""`make paper` on files in the form of SG-FRONT and 3D-FUTURE-SDF: one command trains and fills the tables."""

import json
import shlex
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

from echomodel.data.sgfront import SGFront, write_sgfront
from echomodel.metrics.layouts import tasks_of
from echomodel.rooms.generator import generate_rooms
from echomodel.training import trainer
from echomodel.training.recipe import read_recipe
from echoscene.model import ReleasedModel, Schedule
from echoscene.training import PublishedRooms, PublishedShapes, opened_data
from echousd.cli.main import run
from echousd.evaluation.runs import SuiteSettings, rooms_against

ROOT = Path(__file__).parents[3]
SIZES = {
    "text": 12, "learned": 4, "flag": 4, "hidden": 16, "layers": 2, "context": 32, "code": 8, "heads": 2,
    "layout_width": 128, "layout_mult": [1, 1], "shape_width": 32, "shape_mult": [1, 1], "blocks": 1,
    "vq_channels": 4, "vq_codes": 16, "grid": 8,
}  # fmt: skip
RUN = ["text=random", "steps=2", "scenes=2", "shapes_per_batch=10", "validate_every=2", "log_every=1"]


@pytest.fixture
def folder(tmp_path):
    rooms = [room for room in generate_rooms(80, 3) if 2 < len(room) < 8][:28]
    write_sgfront(tmp_path / "front", rooms[:22], seed=1)
    write_sgfront(tmp_path / "front", rooms[22:], split="test", seed=2)
    models = {name for room in PublishedRooms(tmp_path / "front").rooms for name in room.models if name}
    axis = np.linspace(-1, 1, 64)
    ball = np.sqrt(sum(grid**2 for grid in np.meshgrid(axis, axis, axis))) - 0.6
    for name in sorted(models)[:8]:
        (tmp_path / "front" / "3D-FUTURE-SDF" / name).mkdir(parents=True)
        with h5py.File(tmp_path / "front" / "3D-FUTURE-SDF" / name / "ori_sample_grid.h5", "w") as file:
            file["pc_sdf_sample"] = ball.reshape(-1, 1).astype(np.float32)
    return tmp_path / "front"


def test_graphs_are_those_of_the_files(folder):
    rooms, others = rooms_against(SuiteSettings(against=str(folder), count=3))
    told = {room.id: room.relations for room in SGFront(folder, split="test").rooms()}
    for task in tasks_of([*rooms, *others], 0, rules="sgfront"):
        assert np.array_equal(task.stated, told[task.room.id])
    trained, shapes = opened_data(read_recipe(ROOT / "model/recipes/paper.toml", [f"data={folder}"]))
    assert len(trained) == 22
    assert trained.held_out.sum() == 1
    assert len(trained.room(0).relations)
    assert isinstance(shapes, PublishedShapes)
    grid = shapes.published(np.array([0]), 32)
    assert grid.shape == (1, 1, 32, 32, 32)
    assert float(grid.max()) == pytest.approx(0.2)
    assert float(grid[0, 0, 16, 16, 16]) < -0.15
    assert shapes.index_of("nobody") == -1
    (shapes.files[0]).write_bytes(b"no h5")
    with pytest.raises(ValueError, match=r"ori_sample_grid.h5: no grid 'pc_sdf_sample' of 64 x 64 x 64"):
        shapes.published(np.array([0]), 64)


def test_one_command_trains_and_fills_our_column(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("echousd.evaluation.suite.HONEST", ("random", "real"))
    for name in ("PUBLISHED", "CONSISTENT"):  # ten classes take minutes
        monkeypatch.setattr(f"echousd.evaluation.sections.{name}", ("wardrobe",))
    for name, few in {"POINTS": 128, "SUITES": 4, "PAIRS": 2, "DISTANCES": {"Chamfer": 0, "EMD": 16}}.items():
        monkeypatch.setattr(f"echousd.evaluation.sections.{name}", few)
    monkeypatch.setattr("echousd.evaluation.suite.PANELS", 1)  # a plot
    monkeypatch.setattr("echousd.evaluation.systems.searched", lambda task, draft, config: draft)  # of `default`
    monkeypatch.setattr(trainer, "plot_log", lambda log, out: None)
    whole = Schedule.ddim  # a thousand steps and a hundred are for tests/parity
    monkeypatch.setattr(Schedule, "ddim", lambda tables, count: whole(tables, 4))
    monkeypatch.setattr(ReleasedModel, "layout_tables", Schedule.linear(1e-3, 0.2, 10))
    small = [f"paper.{name}={json.dumps(value).replace(' ', '')}" for name, value in SIZES.items()]
    settings = " ".join(f"--set {shlex.quote(word)}" for word in [*RUN, *small])
    given = [f"SGFRONT={folder}", f"PAPER={tmp_path / 'paper'}", f"SETTINGS={settings}", "BIN=bin"]
    given.append("ASKED=--only relations,shapes --count 3 --workers 1")
    asked = ["make", "--no-print-directory", "-n", "-o", ".venv/.installed", "paper"]  # make may run this test itself
    lines = subprocess.run([*asked, *given], capture_output=True, text=True, check=True).stdout
    commands = [shlex.split(line) for line in lines.splitlines()]
    assert [words[1] for words in commands] == ["train", "train", "eval"]
    for words in commands:
        assert run(words[1:]) == 0
    told = json.loads((tmp_path / "paper" / "report.json").read_text())
    ours = str(tmp_path / "paper" / "run")
    assert told["about"]["weights"][ours]
    by = {table["title"]: table["rows"] for table in told["tables"]}
    for mode in ("as told", "after a change", "after an addition"):
        assert (
            0
            <= by[f"Relations kept, {mode}"][ours]["all"]["value"]
            < by[f"Relations kept, {mode}"]["real"]["all"]["value"]
        )
    assert by["Relations kept, as told"]["real"]["all"]["value"] == 1.0
    assert by["1-NNA by class, EMD"][ours]["wardrobe"]["value"] is not None
    assert by["Consistency"][ours]["wardrobe x 1000"]["value"] >= 0
    page = (tmp_path / "paper" / "report.md").read_text()
    assert "| *EchoScene* | 0.98 | 0.99 |" in page  # the published column beside ours
