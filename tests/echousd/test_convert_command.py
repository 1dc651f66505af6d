"""`echousd convert` on the command line: one line and exit code 2 for what cannot be converted."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from echoscene.checkpoint import load_released
from echoscene.config import VQConfig
from echoscene.vqvae import VQVAE
from echousd.cli.main import run


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "vqvae_threedfront_best.pth"
    torch.save(VQVAE(VQConfig(channels=8, codes=16)).state_dict(), path)
    return path


def test_converts(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "vqvae.safetensors"
    assert run(["convert", str(source), "-o", str(target)]) == 0
    assert "vqvae.safetensors: vqvae," in " ".join(capsys.readouterr().out.split())
    assert load_released(target).vqvae.config.codes == 16
    assert run(["convert", str(source), "-o", str(target)]) == 2
    assert "exists; choose another place or use --force" in " ".join(capsys.readouterr().err.split())
    assert run(["convert", str(source), "-o", str(target), "--force"]) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.pth", "-o", "out.safetensors"], "missing.pth: No such file"),
        (["broken.pth", "-o", "out.safetensors"], "broken.pth: refused"),
        (["vqvae_threedfront_best.pth", "-o", "out.pth"], "must end by .safetensors"),
        (
            ["vqvae_threedfront_best.pth", "-o", "out.safetensors", "--bounds", "broken.pth"],
            "broken.pth: could not convert",
        ),
    ],
)
def test_bad_input(
    source: Path,
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(source.parent)
    (source.parent / "broken.pth").write_text("nothing of the kind")
    assert run(["convert", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in " ".join(said.split())
    assert said.count("\n") == 1
    assert not (source.parent / "out.safetensors").exists()
