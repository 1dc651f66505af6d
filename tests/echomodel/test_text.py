"""Text encoder protocol: cache on disk, clear errors where package or weights are absent."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
import torch

from echomodel.text import CachedTextEncoder, ClipTextEncoder, TextEncoder, TextEncoderError, edge_text, node_text


class Letters:
    """Counts letters: a text encoder small enough for a test, which remembers what it was asked."""

    name, width = "letters", 4

    def __init__(self) -> None:
        self.asked: list[str] = []

    def __call__(self, texts: Sequence[str]) -> torch.Tensor:
        self.asked += texts
        return torch.tensor([[float(text.count(letter)) for letter in "aeio"] for text in texts])


def test_cache_survives_and_asks_once(tmp_path) -> None:
    first = Letters()
    features = CachedTextEncoder(first, tmp_path)(["chair", "table", "chair"])
    assert first.asked == ["chair", "table"]
    assert features.tolist() == [[1, 0, 1, 0], [1, 1, 0, 0], [1, 0, 1, 0]]
    again = Letters()
    encoder = CachedTextEncoder(again, tmp_path)
    assert torch.equal(encoder(["table", "chair"]), features[[1, 0]])
    assert again.asked == []
    encoder(["sofa"])
    assert again.asked == ["sofa"]
    assert [path.name for path in tmp_path.iterdir()] == ["text-letters.safetensors"]
    assert isinstance(encoder, TextEncoder)


def test_a_damaged_cache_is_computed_anew(tmp_path) -> None:
    (tmp_path / "text-letters.safetensors").write_bytes(b"\x08\x00")
    encoder = Letters()
    assert CachedTextEncoder(encoder, tmp_path)(["bed"]).shape == (1, 4)
    assert encoder.asked == ["bed"]
    assert CachedTextEncoder(encoder, tmp_path)([]).shape == (0, 4)


def test_absent_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr("echomodel.late.import_module", absent)
    with pytest.raises(TextEncoderError, match=r"need the package open_clip_torch: pip install 'echousd\[text\]'"):
        ClipTextEncoder()(["chair"])


def test_a_package_that_cannot_be_imported_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """What pip installs as torchvision may be made for another build of torch."""

    def broken(name: str) -> None:
        raise RuntimeError("operator torchvision::nms does not exist")

    monkeypatch.setattr("echomodel.late.import_module", broken)
    with pytest.raises(
        TextEncoderError, match=r"cannot be imported \(operator torchvision::nms does not exist\); torch 2"
    ):
        ClipTextEncoder()(["chair"])


def test_absent_weights_are_named(tmp_path) -> None:
    with pytest.raises(TextEncoderError, match=r"clip\.pt: no such weights file"):
        CachedTextEncoder(ClipTextEncoder(tmp_path / "clip.pt"), tmp_path)


def test_published_texts() -> None:
    assert node_text("tv_stand") == "tv_stand"
    assert node_text("_scene_") == "room"
    assert edge_text("desk", "close by", "chair") == "desk close by chair"
    assert edge_text("desk", "in", "_scene_") == "desk in room"
