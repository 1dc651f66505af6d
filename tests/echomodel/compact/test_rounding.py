"""Tensors that files keep in 8 bits: what is lost, older files, damaged ones."""

import re
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

import echomodel
from echomodel.compact.model import SCALES, WeightsError, load_weights, restored, rounded

NAME = "shape.basis"


def test_rows_come_back_to_half_a_step_of_their_own():
    basis = torch.randn(6, 40) * torch.tensor([1.0, 1e-3, 30.0, 0.0, 1.0, 1.0])[:, None]
    kept = rounded({NAME: basis, "other": torch.ones(2)})
    assert kept[NAME].dtype == torch.int8
    again = restored(kept)
    assert again.keys() == {NAME, "other"}
    step = basis.abs().amax(1, keepdim=True) / 127
    assert ((again[NAME] - basis).abs() <= 0.51 * step + 1e-9).all()


def test_older_files_are_read_as_they_are():
    old = {NAME: torch.randn(3, 4).half()}
    assert restored(old)[NAME] is old[NAME]


@pytest.mark.parametrize(
    ("bent", "message"),
    [
        ({NAME: torch.zeros(3, 4)}, "shape.basis torch.float32, allowed: float32 scales of int8 rows"),
        ({NAME + SCALES: torch.ones(2)}, "have shapes (2,) and (3, 4), allowed: (r,) and (r, n)"),
        ({NAME + SCALES: torch.full((3,), torch.nan)}, f"tensor {NAME} holds numbers that are not finite"),
        ({NAME: None}, "shape.basis None, allowed: float32 scales of int8 rows"),
        ({NAME + SCALES: None}, f"tensor {NAME} holds torch.int8"),
    ],
)
def test_rows_and_scales_that_do_not_fit(bent, message, tmp_path):
    given = rounded({NAME: torch.randn(3, 4)}) | bent
    save_file(
        {k: v for k, v in given.items() if v is not None}, tmp_path / "w.safetensors", {"format": "echousd-compact-1"}
    )
    with pytest.raises(WeightsError, match=re.escape(message)):
        load_weights([tmp_path / "w.safetensors"])


def test_what_ships_is_small():
    files = list(Path(echomodel.__file__).with_name("weights").glob("*.safetensors"))
    assert sum(path.stat().st_size for path in files) <= 40e6
    with safe_open(next(path for path in files if path.stem == "shape"), "pt") as shape:
        assert shape.get_tensor(NAME).dtype == torch.int8
