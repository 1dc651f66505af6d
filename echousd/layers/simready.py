"""Furniture of a room as packages for SimReady hosts: Z up, a payload folder, a picture, provenance."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdUtils

import echousd
from echomodel.files import check_free
from echousd.draw.from_files import picture
from echousd.folder.found import manifest_of
from echousd.folder.stored import asset_from, shelf_of
from echousd.folder.within import inside
from echousd.pending import check_written
from echousd.stage.encoding import LABELS
from echousd.stage.files import layer_bytes, write_all
from echousd.stage.harmless import check_harmless
from echousd.stage.paths import asset_file, layer_name
from echousd.stage.turning import rescale, turn_up
from echousd.stage.vouched import just_written

FURNITURE = "Q14745"  # Wikidata's number of what all of these are
INSIDE = "usd"  # the folder between a package's name and its layer
DATE = "1980-01-01"  # the earliest there is, as in our archives: the same asset gives the same bytes


def pack(
    root: Path, out: Path, *, names: Sequence[str] = (), author: str = "EchoUSD", force: bool = False
) -> tuple[list[Path], list[str], list[str]]:
    """Write the furniture of a room as `<out>/<name>/usd/<name>.usda` with `payload/` and `.thumbs/256x256/` beside it.

    `root`: root layer of a room of ours. `out`: folder of the packages. `names`: of assets; empty = all furniture.
    `author`: who is told as the author. `force`: replace packages that are there. Raises ValueError where there is no
    room of ours, no such asset, a package in the way, or nothing draws pictures.

    Returns the layers that people open, and a sentence for each asset that was left out, and for each that hangs.
    """
    check_written([root])
    manifest = manifest_of(root)
    known = sorted(set(manifest["assets"].values()))
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"{root}: no asset {unknown[0]!r}, allowed: {', '.join(known)}")
    source = manifest.get("source") or "none"
    assets = {name: _files(root, manifest, name) for name in names or known}
    # Not those that hold a model as somebody else made it.
    ours = [n for n, own in assets.items() if asset_file(n, "geo") in own and not any("/original/" in at for at in own)]
    for name in ours:
        check_free(out / name / INSIDE, force=force)
    files: dict[Path, bytes] = {}
    layers, hangs = [], []
    for name in ours:
        place = out / name / INSIDE
        layers.append(place / f"{name}.usda")
        made = package(name, assets[name], author=author, source=source)
        files |= {place / path: content for path, content in made.items()}
        if b"PhysicsRigidBodyAPI" not in made[f"{name}.usda"]:
            hangs.append(f"{name}: hangs, so that it is no rigid body, which Robotics-Prop asks for")
    others = [name for name in assets if name not in ours]
    left = [f"{name}: a model of somebody else's, which is packed where it comes from" for name in others]
    write_all(files)
    return layers, left, hangs


def package(name: str, files: Mapping[str, bytes], *, author: str, source: str) -> dict[str, bytes]:
    """Path in the package -> content, of an asset given by its files in a room's folder; see `pack`."""
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        scratch = Path(folder)
        (scratch / "payload").mkdir()
        for part in ("geo", "low"):
            file, path = layer_name(name, part), asset_file(name, part)
            if path in files:
                _turned(scratch, file, files[path]).Export(str(scratch / "payload" / file))
                (scratch / file).unlink()
        layer = _turned(scratch, f"{name}.usda", files[asset_file(name)])
        UsdUtils.ModifyAssetPaths(layer, lambda path: f"./payload/{path[2:]}" if path.endswith(".usdc") else path)
        main = scratch / f"{name}.usda"
        main.write_bytes(layer_bytes(layer, ".usda"))
        layer.customLayerData = {**layer.customLayerData, "SimReady_Metadata": _facts(main, author, source)}
        main.write_bytes(layer_bytes(layer, ".usda"))
        written = [path for path in scratch.rglob("*") if path.is_file()]
        just_written(written)
        made = {path.relative_to(scratch).as_posix(): path.read_bytes() for path in written}
        return made | {f".thumbs/256x256/{name}.usda.png": picture(main)}


def _turned(scratch: Path, file: str, content: bytes) -> Sdf.Layer:
    """A layer from its bytes, in metres with Z up."""
    place = scratch / file
    place.write_bytes(content)
    return turn_up(rescale(Sdf.Layer.OpenAsAnonymous(str(place)), 1.0))


def _facts(main: Path, author: str, source: str) -> dict[str, Any]:
    """What SimReady wants to be told of an asset."""
    stage = Usd.Stage.Open(str(main))
    root = stage.GetDefaultPrim()
    bodies = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    masses = [UsdPhysics.MassAPI(prim).GetMassAttr().Get() or 0.0 for prim in bodies]
    bounds = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"], useExtentsHint=False).ComputeWorldBound(root)
    size = np.array(bounds.ComputeAlignedRange().GetSize())
    return {
        "asset_name": root.GetName(), "asset_type": "Prop", "author": author,
        "asset_license": stage.GetRootLayer().customLayerData.get("asset_license", "Apache-2.0"),
        "category": root.GetAttribute(LABELS).Get()[0], "source_file": source,
        "usd_date_generated": DATE, "generator": f"echousd {echousd.__version__}", "qcode": FURNITURE,
        "rigid_body_count": len(bodies), "asset_extents": Gf.Vec3f(*map(float, size)), "mass": float(sum(masses)),
    }  # fmt: skip


def _files(root: Path, manifest: Mapping[str, Any], name: str) -> Mapping[str, bytes]:
    """The files of an asset, from the room's folder or its store."""
    shelf = shelf_of(manifest, root.parent)
    if shelf is not None and f"assets/{name}" in shelf.keys:
        return asset_from(shelf, name)
    paths = [path for path in manifest["files"] if path.startswith(f"assets/{name}/")]
    places = {path: inside(root.parent, path, f"asset {name!r}") for path in paths}
    for place in (place for path, place in places.items() if path.endswith((".usda", ".usdc"))):
        check_harmless(place)
    return {path: place.read_bytes() for path, place in places.items()}
