"""Open stages and save layers: errors that say which file, and files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from pxr import Sdf, Tf, Usd

from echousd.stage.encoding import StageError

EXTENSIONS = (".usd", ".usda", ".usdc")


def open_stage(path: str | os.PathLike[str]) -> Usd.Stage:
    """The stage in the file at `path`; raises StageError for a file that is missing, not USD or does not compose."""
    path = Path(path)
    if not path.exists():
        raise StageError(f"{path}: no such file")
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise StageError(f"{path}: not a USD file that can be read ({first_line(error)})") from None
    errors = stage.GetCompositionErrors() if hasattr(stage, "GetCompositionErrors") else []
    if errors:
        raise StageError(f"{path}: does not compose: {errors[0]}")
    return stage


def first_line(error: Tf.ErrorException) -> str:
    """What USD says about an error, without file and line of its own source."""
    said = [entry.commentary.strip().splitlines()[0] for entry in error.args if getattr(entry, "commentary", "")]
    return said[0] if said else str(error).strip().splitlines()[0]


def save_layer(layer: Sdf.Layer, path: str | os.PathLike[str]) -> None:
    """Write a layer to `path` (.usd, .usda or .usdc) by a temporary file beside it and a rename; raises StageError."""
    path = Path(path)
    if path.suffix not in EXTENSIONS:
        raise StageError(f"{path}: extension {path.suffix!r}, allowed: {', '.join(EXTENSIONS)}")
    if not path.parent.is_dir():
        raise StageError(f"{path}: the folder {path.parent} does not exist")
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise StageError(f"{path}: cannot be written ({error.strerror})") from None
    os.close(handle)
    try:
        if not layer.Export(temporary):
            raise StageError(f"{path}: cannot be written")
        os.replace(temporary, path)
    except (OSError, Tf.ErrorException) as error:
        raise StageError(f"{path}: cannot be written ({error})") from None
    finally:
        Path(temporary).unlink(missing_ok=True)
