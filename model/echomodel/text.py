"""Text features of labels and relations behind one protocol, with a cache on disk (EchoScene, section 3.1)."""

import hashlib
import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor

from echomodel.files import cache_folder, whole_file
from echomodel.late import extra

PUBLISHED_MODEL, PUBLISHED_WEIGHTS = "ViT-B-32-quickgelu", "openai"  # OpenAI's ViT-B/32 was trained with the quick GELU


class TextEncoderError(ValueError):
    """Text features cannot be computed; the message says what is absent and how to get it."""


@runtime_checkable
class TextEncoder(Protocol):
    """Whatever turns texts into vectors.

    `name` identifies the encoder and its weights (the cache is kept per name), `width` is the vectors' length, and a
    call takes n texts to (n, width) float32.
    """

    @property
    def name(self) -> str: ...

    @property
    def width(self) -> int: ...

    def __call__(self, texts: Sequence[str]) -> Tensor: ...


class ClipTextEncoder:
    """The text tower of OpenAI's CLIP ViT-B/32 through open_clip (extra `text`), features not normalised.

    Weights are loaded at the first call.

    `weights`: a weights file, or None for open_clip's own download and cache of the `openai` weights.
    """

    width = 512

    def __init__(self, weights: str | os.PathLike[str] | None = None) -> None:
        self.weights = str(weights) if weights is not None else PUBLISHED_WEIGHTS

    @property
    def name(self) -> str:
        """Model and weights; a weights file is named by its content."""
        path = Path(self.weights)
        if self.weights == PUBLISHED_WEIGHTS:
            return f"{PUBLISHED_MODEL}-{PUBLISHED_WEIGHTS}"
        if not path.is_file():
            raise TextEncoderError(f"{path}: no such weights file for the text encoder")
        with path.open("rb") as file:
            return f"{PUBLISHED_MODEL}-{hashlib.file_digest(file, 'sha256').hexdigest()[:16]}"

    @torch.inference_mode()
    def __call__(self, texts: Sequence[str]) -> Tensor:
        """n texts -> (n, 512) float32; raises TextEncoderError if package or weights are absent."""
        model = self.model
        import open_clip

        tokens = open_clip.get_tokenizer(PUBLISHED_MODEL)(list(texts))
        return model.encode_text(tokens, normalize=False).float()  # type: ignore[operator]

    @cached_property
    def model(self) -> torch.nn.Module:
        """Both towers; raises TextEncoderError if package or weights are absent."""
        try:
            open_clip = extra("open_clip", "text features need the package open_clip_torch", "text", TextEncoderError)
        except (RuntimeError, AttributeError, OSError) as error:  # torchvision's operators are of another torch
            reason = (str(error).strip() or type(error).__name__).splitlines()[0][:200]
            raise TextEncoderError(
                f"open_clip_torch is there and cannot be imported ({reason}); torch {torch.__version__} and "
                "torchvision must be of one release and one source"
            ) from None
        try:
            return open_clip.create_model(PUBLISHED_MODEL, pretrained=self.weights).eval()
        except (OSError, RuntimeError, ValueError) as error:
            reason = str(error).strip().splitlines()[0][:200] if str(error).strip() else type(error).__name__
            raise TextEncoderError(
                f"CLIP weights {self.weights!r} could not be loaded ({reason}); "
                "download them once with a network connection, or give a weights file"
            ) from None


class RandomTextEncoder:
    """A seeded random vector per text: tells texts apart and knows nothing of their meaning; needs no weights.

    `width`: length of the vectors.
    """

    def __init__(self, width: int = 512) -> None:
        self.name, self.width = f"random-{width}", width

    def __call__(self, texts: Sequence[str]) -> Tensor:
        """n texts -> (n, width) float32, each of about unit length."""
        if not texts:
            return torch.zeros(0, self.width)
        seeds = [int.from_bytes(hashlib.sha256(text.encode()).digest()[:7], "big") for text in texts]
        drawn = [torch.randn(self.width, generator=torch.Generator().manual_seed(seed)) for seed in seeds]
        return torch.stack(drawn) * self.width**-0.5


class CachedTextEncoder:
    """Another encoder with its results kept in one safetensors file per encoder name.

    A text that is in the cache needs neither package nor weights. A damaged cache file is computed anew.

    Arguments:
        encoder: what computes texts that are not cached.
        folder: where the files lie; None = `echomodel.files.cache_folder`.
    """

    def __init__(self, encoder: TextEncoder, folder: str | os.PathLike[str] | None = None) -> None:
        self.encoder, self.name, self.width = encoder, encoder.name, encoder.width
        self.path = Path(folder or cache_folder()) / f"text-{self.name}.safetensors"
        self._known: dict[str, Tensor] | None = None

    def __call__(self, texts: Sequence[str]) -> Tensor:
        """n texts -> (n, width) float32; encodes and stores what is new."""
        if self._known is None:
            self._known = self._read()
        new = [text for text in dict.fromkeys(texts) if text not in self._known]
        if new:
            features = self.encoder(new).float()
            if tuple(features.shape) != (len(new), self.width):
                raise TextEncoderError(f"{self.name}: {tuple(features.shape)} for {len(new)} texts")
            # Another process may have written meanwhile: keep its texts too.
            self._known = {**self._read(), **self._known, **{t: f.clone() for t, f in zip(new, features, strict=True)}}
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(self.path) as beside:
                save_file(self._known, beside)
        return torch.stack([self._known[text] for text in texts]) if texts else torch.zeros(0, self.width)

    def _read(self) -> dict[str, Tensor]:
        try:
            known = load_file(self.path)
        except (OSError, SafetensorError):
            return {}
        return {text: vector for text, vector in known.items() if tuple(vector.shape) == (self.width,)}


def encoder_named(name: str | None) -> TextEncoder:
    """The encoder that a weights file names; None stands for CLIP, as in published checkpoints.

    Raises TextEncoderError for a name that belongs to no encoder of ours, or to CLIP weights of one's own.
    """
    clip = ClipTextEncoder()
    if name in (None, clip.name):
        return CachedTextEncoder(clip)
    kind, _, width = str(name).rpartition("-")
    if kind == "random" and width.isdecimal() and int(width) > 0:
        return RandomTextEncoder(int(width))
    raise TextEncoderError(
        f"was trained with the text encoder {name!r}, allowed: {clip.name}, random-WIDTH; "
        "load it in Python and give the encoder (text=...)"
    )


def node_text(label: str) -> str:
    """The published text of a class: its bare label, and `room` for the scene's node."""
    return "room" if label == "_scene_" else label


def edge_text(subject: str, predicate: str, target: str) -> str:
    """The published text of a triplet, `desk left chair`; relations to the scene read `desk in room`."""
    return f"{node_text(subject)} {predicate} {node_text(target)}"
