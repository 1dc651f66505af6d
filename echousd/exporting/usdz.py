"""A flat layer and its images as a usdz package, for the web or for Apple's viewers."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdPhysics, UsdUtils

from echousd.exporting.packing import Package, without_clock
from echousd.exporting.strip_physics import strip
from echousd.stage.files import write_all

OURS = "Echo"  # what the names of our types and schemas begin with
PROPERTIES = "echo:"


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


def for_arkit(layer: Sdf.Layer) -> None:
    """Turn a flat layer to +Y up, and take lights and the scene graph out of it: Apple's checker knows no such types.

    Labels, cameras and materials stay.
    """
    stage = Usd.Stage.Open(layer)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        _turn(stage)
    for prim in list(stage.TraverseAll()):
        if prim.IsValid() and (prim.GetTypeName().startswith(OURS) or _is_light(prim)):
            stage.RemovePrim(prim.GetPath())
    for prim in reversed(list(stage.TraverseAll())):  # what a scope holds before the scope
        if _is_empty_scope(prim):
            stage.RemovePrim(prim.GetPath())
    strip(layer, PROPERTIES, OURS)


def _is_light(prim: Usd.Prim) -> bool:
    return prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdLux.LightFilter)


def _is_empty_scope(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() == "Scope" and not prim.GetAllChildren())


def _turn(stage: Usd.Stage) -> None:
    """Z up to Y up by a matrix on every prim that has a place and none above it that counts; gravity turns along."""
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), -90.0))
    for placed in list(_outermost(stage.GetPseudoRoot())):
        matrix, alone = placed.GetLocalTransformation() * turn, placed.GetResetXformStack()
        placed.ClearXformOpOrder()
        for attribute in placed.GetPrim().GetAttributes():
            if attribute.GetName().startswith("xformOp:"):
                placed.GetPrim().RemoveProperty(attribute.GetName())
        if not Gf.IsClose(matrix, Gf.Matrix4d(1.0), 1e-9):
            placed.AddTransformOp().Set(matrix)
        if alone:
            placed.SetResetXformStack(True)
    for prim in stage.Traverse():
        scene = UsdPhysics.Scene(prim)
        if scene and scene.GetGravityDirectionAttr().HasAuthoredValue():
            scene.GetGravityDirectionAttr().Set(Gf.Vec3f(turn.TransformDir(scene.GetGravityDirectionAttr().Get())))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)


def _outermost(top: Usd.Prim, turned: bool = False) -> Iterator[UsdGeom.Xformable]:
    """The first prims with a place on every branch below `top`, and all that ignore what is above them."""
    for prim in top.GetChildren():
        placed = UsdGeom.Xformable(prim)
        if placed and (not turned or placed.GetResetXformStack()):
            yield placed
        yield from _outermost(prim, turned or bool(placed))
