import numpy as np
import pytest
import trimesh
from pxr import Sdf, Usd, UsdGeom
from small_models import chest, picture, seat, write_obj, write_usd
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.assets.index import index
from echousd.assets.model_file import ModelFile
from echousd.assets.table import read_library
from echousd.shapes.geometry import CONVERTED
from echousd.shapes.originals.loading import converted, outward
from echousd.stage.files import open_stage


def test_pieces_that_are_inside_out_are_turned_and_others_left():
    good, bad = trimesh.creation.box((1, 1, 1)), trimesh.creation.icosphere(1)
    bad.apply_translation((3, 0, 0))
    points = np.concatenate([good.vertices, bad.vertices])
    faces = np.concatenate([good.faces, bad.faces[:, ::-1] + len(good.vertices)])
    turned = outward(points, faces)
    assert trimesh.Trimesh(points, turned, process=False).volume == pytest.approx(good.volume + bad.volume)
    np.testing.assert_array_equal(outward(points, turned), turned)
    cut = trimesh.Trimesh(points[turned].reshape(-1, 3), np.arange(3 * len(turned)).reshape(-1, 3), process=False)
    np.testing.assert_array_equal(outward(cut.vertices, cut.faces[:, ::-1]), cut.faces[:, ::-1][:, ::-1])
    sheet, uneven = good.faces[:2], np.array(good.faces)
    uneven[3] = uneven[3][::-1]
    for left in (sheet, uneven):  # what has no inside, and what is wound unevenly
        np.testing.assert_array_equal(outward(good.vertices, left[:, ::-1]), left[:, ::-1])


def test_a_converted_model_is_no_longer_inside_out(tmp_path):
    mesh = chest(1.6, 2.2, 0.6)
    mesh.faces = mesh.faces[:, ::-1]
    write_obj(tmp_path / "models", "wardrobe", mesh)
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=done.file, **BARE)
    stage = open_stage(room.save(tmp_path / "room", preview=False))
    form = UsdGeom.Mesh(stage.GetPrimAtPath("/Room/Objects/wardrobe/wardrobe_placed/wardrobe_model/mesh_0"))
    index_of = np.array(form.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    assert trimesh.Trimesh(np.array(form.GetPointsAttr().Get()), index_of, process=False).volume > 0
    normals = np.array(UsdGeom.PrimvarsAPI(form).GetPrimvar("normals").ComputeFlattened()).reshape(-1, 3, 3)
    corners = np.array(form.GetPointsAttr().Get())[index_of]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", flat, normals.mean(1)) > 0).all()


def test_folders_of_a_simulators_models_have_one_row_each(tmp_path):
    """`meshes/` and `materials/textures/` below each model, collision meshes and levels of detail beside the mesh."""
    for name, mesh in {"aws_robomaker_Wardrobe_01": chest(1.6, 2.2, 0.6), "aws_robomaker_ChairA_01": seat()}.items():
        folder = tmp_path / "models" / name
        (folder / "materials/textures").mkdir(parents=True)
        (folder / "materials/textures" / f"{name}.png").write_bytes(picture((90, 60, 40)))
        for word in ("_visual", "_collision", "_visual_lod1"):
            path = write_obj(folder / "meshes", f"{name}{word}", mesh, texture="../materials/textures/missing")
            path.with_suffix(".mtl").write_text(f"newmtl wood\nKd 1 1 1\nmap_Kd ../materials/textures/{name}.png\n")
    write_obj(tmp_path / "models", "table_collision", chest())  # nothing that it stands in for
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    found = read_library(done.file).records
    assert {key.rpartition("/")[2]: record.category for key, record in found.items()} == {
        "aws_robomaker_Wardrobe_01_visual.obj": "wardrobe",
        "aws_robomaker_ChairA_01_visual.obj": "chair",
        "table_collision.obj": found["table_collision.obj"].category,
    }
    assert all(record.missing == () for key, record in found.items() if "aws" in key)
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=done.file, **BARE)
    root = room.save(tmp_path / "room", preview=False)
    assert [path.suffix for path in (root.parent / "assets/wardrobe/original/textures").iterdir()] == [".png"]


def test_payloads_within_payloads_and_inherited_classes_arrive(tmp_path):
    inner = write_usd(tmp_path / "models/parts/deep/body.usda", chest(1.6, 2.2, 0.6), centimetres=True)
    for name, path, metres in (("parts/shell", "./deep/body.usda", 0.01), ("wardrobe", "./parts/shell.usda", 0.01)):
        stage = Usd.Stage.CreateNew(str(tmp_path / f"models/{name}.usda"))
        UsdGeom.SetStageMetersPerUnit(stage, metres)
        UsdGeom.SetStageUpAxis(stage, "Y")
        root = UsdGeom.Xform.Define(stage, "/piece").GetPrim()
        stage.SetDefaultPrim(root)
        UsdGeom.Xform.Define(stage, "/piece/inside").GetPrim().GetPayloads().AddPayload(Sdf.Payload(path))
        stage.Save()
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    assert (done.models, inner.exists()) == (1, True)
    assert read_library(done.file).records["wardrobe.usda"].dims == pytest.approx((1.6, 2.2, 0.6), abs=1e-3)
    room = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=done.file, **BARE)
    stage = open_stage(room.save(tmp_path / "room", preview=False))
    form = stage.GetPrimAtPath("/Room/Objects/wardrobe/wardrobe_placed/wardrobe_model/inside/inside/form")
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(form).ComputeAlignedRange()
    size = room.boxes.size[room.names.index("wardrobe")].tolist()
    assert sorted(box.GetSize()) == pytest.approx(sorted(size), abs=2e-3)


def test_texture_coordinates_that_are_an_exporters_slip_are_left_out(tmp_path):
    (tmp_path / "slip.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.5\nvt 3.44e9 1\nvt 1 0\nf 1/1 2/2 3/3\n", encoding="utf-8"
    )
    (tmp_path / CONVERTED).write_bytes(converted(ModelFile(tmp_path / "slip.obj", tmp_path))[CONVERTED])
    stage = open_stage(tmp_path / CONVERTED)
    form = next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    held = np.array(UsdGeom.PrimvarsAPI(form).GetPrimvar("st").Get())
    assert sorted(map(tuple, held.tolist())) == [(0.0, 1.0), (0.25, 0.5), (1.0, 0.0)]
