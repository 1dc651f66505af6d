"""A flat layer and its images as a usdz package, for the web or for Apple's viewers."""

from __future__ import annotations

import tempfile
import zipfile
from pathlib import Path

from pxr import Sdf, Tf, UsdUtils

from echousd.exporting.arkit import for_arkit
from echousd.exporting.packing import Package, without_clock
from echousd.stage.files import write_all


def usdz(layer: Sdf.Layer, package: Package, *, arkit: bool = False) -> bytes:
    """The package of a flat layer; for ARKit the layer is turned and stripped first, and is a usdc in the package."""
    root = package.reach.room
    if arkit:
        for_arkit(layer)
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        folder = Path(scratch)
        write_all(package.files(folder))
        flat = folder / f"{root.stem}{'.usdc' if arkit else '.usda'}"
        packed = folder / "package.usdz"
        make = UsdUtils.CreateNewARKitUsdzPackage if arkit else UsdUtils.CreateNewUsdzPackage
        try:
            layer.Export(str(flat))
            whole = make(Sdf.AssetPath(str(flat)), str(packed)) and zipfile.is_zipfile(packed)
        except Tf.ErrorException:
            whole = False
        if not whole:  # USD does not say why
            raise ValueError(
                f"{root}: cannot be packed as usdz in {folder.parent}, the folder of temporary files (its disk may be "
                "full; TMPDIR names another); nothing was changed"
            )
        return without_clock(packed.read_bytes())
