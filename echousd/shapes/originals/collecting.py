"""A model with everything that it depends on, taken along: its layers, images and shader files, and nothing else."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from pxr import Sdf, Tf, UsdUtils

from echousd.assets.model_file import STAGES, ModelFile
from echousd.exporting.packing import PACKED, LeftOut, asset_paths
from echousd.stage.files import said
from echousd.textures import READABLE

TAKEN = (*STAGES, *PACKED, *READABLE, ".mdl", ".mtlx", ".hdr")
MAX_TOTAL = 4 * 2**30  # bytes of one model with all that it needs


def collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    """(name of its layer, name -> content) of a USD model and the files that it depends on.

    Files that are not there stay missing, as they are. Raises ValueError that names the file for one that lies out of
    the library's folder, is of a kind that no model needs, or where all together are too large.
    """
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the exception says as well
    try:
        return _collected(model)
    except Tf.ErrorException as error:
        raise ValueError(f"{model}: cannot be collected with the files that it depends on ({said(error)})") from None
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence


def _collected(model: ModelFile) -> tuple[str, Mapping[str, bytes]]:
    layers, others, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(model.path)))
    named = [str(layer.realPath) for layer in layers] + [str(path) for path in others]
    top, total = os.path.realpath(model.top), 0
    for name in named:
        path = name.partition("[")[0]
        if os.path.commonpath([top, os.path.realpath(path)]) != top:
            raise ValueError(f"{model}: {_named_by(layers, path)}depends on {path}, allowed: files below {model.top}")
        if Path(path).suffix.lower() not in TAKEN:
            warnings.warn(f"{model}: depends on {path}, which is left out", LeftOut, stacklevel=2)
        total += Path(path).stat().st_size
    if total > MAX_TOTAL:
        raise ValueError(f"{model}: {total} bytes with all that it needs, allowed: {MAX_TOTAL}")
    if model.suffix == ".usdz":
        return model.path.name, {model.path.name: model.path.read_bytes()}
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        if not UsdUtils.LocalizeAsset(Sdf.AssetPath(str(model.path)), folder):
            raise ValueError(f"{model}: cannot be collected with the files that it depends on")
        found = [p for p in sorted(Path(folder).rglob("*")) if p.is_file() and p.suffix.lower() in TAKEN]
        return model.path.name, {p.relative_to(folder).as_posix(): p.read_bytes() for p in found}


def _named_by(layers: Sequence[Sdf.Layer], path: str) -> str:
    """`<prim or property path> ` of who names a file, "" where no value does (a layer that is referred to)."""
    real = os.path.realpath(path)
    for layer in layers:
        for where, name in asset_paths(layer):
            if os.path.realpath(layer.ComputeAbsolutePath(name)) == real:
                return f"{where} "
    return ""
