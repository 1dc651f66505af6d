"""`recipes/mean.py`: the mean of weights files of one form, and what it says of others."""

import runpy
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

SCRIPT = Path(__file__).parents[2] / "model" / "recipes" / "mean.py"


def mean(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["mean.py", *map(str, words)])
    runpy.run_path(str(SCRIPT), run_name="__main__")


def test_the_mean_is_of_each_tensor_and_as_precise_as_the_first(tmp_path, monkeypatch):
    for name, value in (("one", 1.0), ("two", 4.0)):
        save_file({"a": torch.full((2,), value, dtype=torch.float16)}, tmp_path / name)
    mean(monkeypatch, tmp_path / "one", tmp_path / "two", "-o", tmp_path / "mean")
    found = load_file(tmp_path / "mean")["a"]
    assert found.tolist() == [2.5, 2.5]
    assert found.dtype == torch.float16


@pytest.mark.parametrize("other", [{"b": torch.ones(2)}, {"a": torch.ones(3)}, {}])
def test_files_of_other_parts_are_named(tmp_path, monkeypatch, capsys, other):
    save_file({"a": torch.ones(2)}, tmp_path / "one")
    save_file(other, tmp_path / "two")
    with pytest.raises(SystemExit):
        mean(monkeypatch, tmp_path / "one", tmp_path / "two", "-o", tmp_path / "mean")
    assert f"{tmp_path}/two: holds other parts than {tmp_path}/one" in capsys.readouterr().err
    assert not (tmp_path / "mean").exists()
