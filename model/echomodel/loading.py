"""One loader for the weights of every preset.

A loaded model can be pickled, but another process had better call `load_model` with the same path: each process keeps
the last models that it loaded.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from safetensors import SafetensorError, safe_open

from echomodel.compact.weights import FORMAT as COMPACT
from echomodel.late import Late

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

RUN = "weights.safetensors"  # what a training calls its weights
# format of a weights file -> what gives the model of a path, on a `device`
LOADERS = {
    COMPACT: Late("echomodel.echo:EchoModel.load"), "echousd-released-1": Late("echoscene.echo:ReleasedEcho.load"),
}  # fmt: skip


def load_model(weights: str | Path | None = None, *, device: str = "cpu") -> RoomModel:
    """The model in a weights file (None: shipped), of the kind that the file says it is.

    A file that did not change since is not read again.

    `device`: where to load it, as torch calls it (`cpu`, `cuda`, `mps`); on `cpu` what ships is loaded without torch.

    Raises ValueError where there is none, and where torch finds no such device.
    """
    require_device(device)
    path = None if weights is None else Path(weights).absolute()
    if path and not path.exists():
        raise ValueError(f"{weights}: no such weights, allowed: a file or folder of `echousd train` or `convert`")
    return _loaded(path, _stamp(path), None if path is None and device == "cpu" else device)


def require_device(device: str) -> None:
    """Raise ValueError where torch finds no such device."""
    if device == "cpu":
        return
    import torch

    here = {"cpu": True, "cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available()}
    if not here.get(device.partition(":")[0]):
        found = ", ".join(name for name, there in here.items() if there)
        raise ValueError(f"device is {device!r}, which torch {torch.__version__} finds none of; here: {found}")


@lru_cache(maxsize=2)
def _loaded(path: Path | None, stamp: tuple[tuple[str, int, int], ...], device: str | None) -> RoomModel:
    if path is not None and _format(path / RUN) in LOADERS.keys() - {COMPACT}:
        path = path / RUN  # a training of published networks; a folder of compact weights is read as a whole
    return LOADERS.get(_format(path), LOADERS[COMPACT])(path, device=device)


def _format(path: Path | None) -> str:
    """What a weights file says it is, "" for folders, files that say nothing and those that cannot be read."""
    if path is None or not path.is_file():
        return ""
    try:
        with safe_open(path, framework="np") as file:
            return (file.metadata() or {}).get("format", "")
    except (OSError, SafetensorError):
        return ""


def _stamp(path: Path | None) -> tuple[tuple[str, int, int], ...]:
    """Names, sizes and times of the files, by which a change shows; the weights that ship do not change."""
    if path is None:
        return ()
    files = sorted(path.glob("*.safetensors")) if path.is_dir() else [path]
    return tuple((f.name, f.stat().st_size, f.stat().st_mtime_ns) for f in files if f.is_file())
