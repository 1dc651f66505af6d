"""Forms that a room may be written in: layers as usdc, shared assets as instances, a picture of every asset."""

import io
import json

import numpy as np
import pytest
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from small_room import StandIn, small_graph

import echousd
from echousd.checks import check
from echousd.exporting.formats import export
from echousd.make.reading import read_room
from echousd.options import RoomOptions


def made(folder, without=(), **options):
    graph = small_graph()
    for name in without:
        graph = graph.remove_node(name)
    options = RoomOptions(walls=True, dress="some", **options)
    room = echousd.generate(graph, seed=3, model=StandIn(), place=False, shapes="boxes", options=options)
    return room.save(folder / "bedroom", preview=False)


def shown(root):
    """Path of every mesh that is seen or collides -> points in the world, material, physics material."""
    stage = Usd.Stage.Open(str(root))
    found = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Mesh):
            world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)
            parts = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets() or [UsdGeom.Mesh(prim)]
            looks = [
                str(UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial(purpose)[0].GetPath())
                for part in parts for purpose in ("", "physics")
            ]  # fmt: skip
            found[str(prim.GetPath())] = (points @ world[:3, :3] + world[3, :3], looks)
    return found, stage


def test_layers_of_usdc_say_the_same_and_can_be_edited(tmp_path):
    text, crate = made(tmp_path / "text"), made(tmp_path / "crate", crate=True)
    layers = sorted(path.name for path in (crate.parent / "layers").iterdir())
    assert {name.rpartition(".")[2] for name in layers} == {"usdc"}
    assert (crate.parent / "layers/layout.usdc").read_bytes()[:8] == b"PXR-USDC"
    (wanted, _), (found, _) = shown(text), shown(crate)
    assert wanted.keys() == found.keys()
    assert all(found[path][1] == looks for path, (_, looks) in wanted.items())
    assert echousd.read_graph(crate) == echousd.read_graph(text)
    assert not check(crate).errors
    assert json.loads(crate.with_suffix(".json").read_text())["crate"] is True
    edited = echousd.edit(crate, read_room(crate).graph.relate("wardrobe", "bigger_than", "lamp"), model=StandIn())
    edited.save(crate.parent, preview=False)
    assert sorted(path.name for path in (crate.parent / "layers").iterdir()) == layers
    assert len(echousd.read_graph(crate).relations) == len(echousd.read_graph(text).relations) + 1


def test_shared_assets_are_instances_that_look_and_collide_alike(tmp_path):
    (wanted, _), (found, stage) = shown(made(tmp_path / "plain")), shown(made(tmp_path / "shared", instances=True))
    alike = [prim.GetName() for prim in stage.Traverse() if prim.IsInstance()]
    assert {"nightstand_left", "nightstand_right"} <= set(alike)
    assert not {"bed", "wardrobe"} & set(alike)  # nobody else has their assets
    left, right = (stage.GetPrimAtPath(f"/Room/Objects/nightstand_{side}") for side in ("left", "right"))
    assert left.GetPrototype() == right.GetPrototype()
    assert left.HasAPI(UsdPhysics.RigidBodyAPI)
    assert wanted.keys() == found.keys()
    for path, (points, looks) in wanted.items():
        np.testing.assert_allclose(found[path][0], points, atol=1e-5)
        assert found[path][1] == looks, path
    root = tmp_path / "shared/bedroom/bedroom.usda"
    assert not check(root).errors
    flat, same = (shown(export(place, tmp_path / f"{n}.usdc"))[0] for n, place in enumerate(
        (root, tmp_path / "plain/bedroom/bedroom.usda")))  # fmt: skip
    assert flat.keys() == same.keys()
    assert all(flat[path][1] == looks for path, (_, looks) in same.items())
    stage = Usd.Stage.Open(str(tmp_path / "0.usdc"))
    assert not any(prim.IsInstance() for prim in stage.Traverse())
    again = echousd.edit(root, read_room(root).graph.relate("wardrobe", "bigger_than", "lamp"), model=StandIn())
    assert again.options.instances


def test_instances_of_a_room_at_another_path_are_bound_to_its_own_looks(tmp_path):
    root = made(tmp_path / "deep", instances=True, room_path="/World/Flat")
    stage = Usd.Stage.Open(str(root))
    classes = [prim for prim in stage.Traverse(Usd.PrimAllPrimsPredicate) if prim.IsAbstract()]
    bound = [prim.GetRelationship("material:binding") for prim in classes]
    paths = {str(target) for one in bound if one for target in one.GetTargets()}
    assert paths
    assert all(path.startswith("/World/Flat/Looks/") and stage.GetPrimAtPath(path) for path in paths)
    assert not check(root).errors


def test_every_asset_has_a_picture(tmp_path, monkeypatch):
    pytest.importorskip("embreex")
    monkeypatch.setattr("echousd.draw.from_files.QUICK", 1)
    root = made(tmp_path / "room", ("lamp", "wardrobe", "pendant", "nightstand_right"), thumbnails=True)
    assert len(list((root.parent / "assets").glob("small_*"))) > 5
    for asset in (root.parent / "assets").iterdir():
        content = (asset / f".thumbs/256x256/{asset.name}.usda.png").read_bytes()
        with Image.open(io.BytesIO(content)) as picture:
            assert picture.size == (256, 256)
            assert np.ptp(np.asarray(picture.convert("RGB")), axis=(0, 1)).max() > 30  # something is to be seen
    edited = echousd.edit(root, read_room(root).graph.add_node("stool", "nightstand"), model=StandIn(), shapes="boxes")
    edited.save(tmp_path / "copy", preview=False)
    pictures = sorted(path.name for path in (tmp_path / "copy/assets").glob("*/.thumbs/256x256/*.png"))
    assert len(pictures) == len(list((tmp_path / "copy/assets").iterdir()))
    assert Sdf.Layer.FindOrOpen(str(tmp_path / "copy/copy.usda"))
