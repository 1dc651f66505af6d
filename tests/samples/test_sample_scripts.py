import runpy
import sys
from pathlib import Path

import pytest
from few_cameras import FEW
from pxr import Usd, UsdGeom
from small_room import StandIn

SAMPLES = Path(__file__).parents[2] / "samples"


class Anything(StandIn):
    """Places whatever it is asked for on a grid."""

    def sample_layout(self, graph, *, generator, **rest):
        import torch

        from echomodel.boxes import Boxes

        count = graph.num_nodes
        size = torch.tensor([0.5, 0.6, 0.4]).repeat(count, 1)
        place = torch.tensor([[i % 3 - 1.0, 0.0, i // 3 - 1.0] for i in range(count)])
        return Boxes(size, place, torch.zeros(count))


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    monkeypatch.setattr("echousd.make.save.PREVIEW", 96)
    for name, value in FEW.items():
        monkeypatch.setattr(f"echousd.draw.views.{name}", value)


@pytest.fixture
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: Anything()))
    monkeypatch.setattr("echousd.make.layouts.DRAFTS", 1)  # all of them are equal


def run(monkeypatch, name, *words):
    monkeypatch.setattr(sys, "argv", [name, *map(str, words)])
    runpy.run_path(str(SAMPLES / name), run_name="__main__")


def test_make_room(model, monkeypatch, tmp_path, capsys):
    run(monkeypatch, "make_room.py", SAMPLES / "bedroom.usda", tmp_path / "room")
    assert "kept  nightstand_left close_by bed" in capsys.readouterr().out
    assert (tmp_path / "room/room.usda").is_file()


def test_author_graph(monkeypatch, capsys):
    run(monkeypatch, "author_graph.py")
    out = capsys.readouterr().out
    assert "lamp" in out.splitlines()[0]
    desk, lamp = (next(line for line in out.splitlines()[-6:] if name in line) for name in ("desk", "lamp"))
    assert "height 0.00" in desk
    assert "height 0.00" not in lamp


def test_use_meshes(monkeypatch, tmp_path, capsys):
    """With the model that ships: where things lie on a grid, finding places for them takes most of the time."""
    run(monkeypatch, "use_meshes.py", tmp_path / "room")
    assert "closed: True" in capsys.readouterr().out
    stage = Usd.Stage.Open(str(tmp_path / "room/mine.usda"))
    assert stage.GetPrimAtPath("/Room/Ball")
    assert stage.GetPrimAtPath("/Room/Objects/sofa/geo").GetChildren()[0].IsA(UsdGeom.Mesh)
