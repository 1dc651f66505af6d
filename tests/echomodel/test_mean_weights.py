"""`recipes/mean.py`: the mean of weights files of one form, and what it says of others."""

import runpy
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from echomodel.compact.weights import FORMAT
from echomodel.config import CompactConfig, to_json

WORDS = CompactConfig()
SCRIPT = Path(__file__).parents[2] / "model" / "recipes" / "mean.py"


def written(tensors, path, **words):
    """A layout branch of these numbers, in some words."""
    config = to_json(replace(WORDS, **words))
    save_file(tensors, path, {"format": FORMAT, "parts": '["layout"]', "config": config, "statistics": "{}"})


def mean(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["mean.py", *map(str, words)])
    runpy.run_path(str(SCRIPT), run_name="__main__")


def test_the_mean_is_of_each_tensor_and_as_precise_as_the_first(tmp_path, monkeypatch):
    for name, value in (("one", 1.0), ("two", 4.0)):
        written({"a": torch.full((2,), value, dtype=torch.float16)}, tmp_path / name)
    mean(monkeypatch, tmp_path / "one", tmp_path / "two", "-o", tmp_path / "mean")
    found = load_file(tmp_path / "mean")["a"]
    assert found.tolist() == [2.5, 2.5]
    assert found.dtype == torch.float16


def test_a_word_means_what_those_say_that_know_it(tmp_path, monkeypatch):
    names = WORDS.categories
    written(
        {"layout.category.weight": torch.ones(46, 1), "layout.b": torch.ones(1)},
        tmp_path / "old",
        categories=names[:46],
    )
    written({"layout.category.weight": torch.full((len(names), 1), 3.0), "layout.b": torch.zeros(1)}, tmp_path / "new")
    mean(monkeypatch, tmp_path / "old", tmp_path / "new", "-o", tmp_path / "mean")
    found = load_file(tmp_path / "mean")
    assert found["layout.category.weight"][:, 0].tolist() == [2.0] * 46 + [3.0] * (len(names) - 46)
    assert found["layout.b"].item() == 0.5
    with safe_open(tmp_path / "mean", "pt") as file:
        assert file.metadata()["config"] == to_json(WORDS)


@pytest.mark.parametrize("other", [{"b": torch.ones(2)}, {"a": torch.ones(3)}, {}])
def test_files_of_other_parts_are_named(tmp_path, monkeypatch, capsys, other):
    written({"a": torch.ones(2)}, tmp_path / "one")
    written(other, tmp_path / "two")
    with pytest.raises(SystemExit):
        mean(monkeypatch, tmp_path / "one", tmp_path / "two", "-o", tmp_path / "mean")
    assert f"{tmp_path}/two: holds other parts than {tmp_path}/one" in capsys.readouterr().err
    assert not (tmp_path / "mean").exists()
