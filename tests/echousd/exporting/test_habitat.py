"""A data set for Habitat: every object and the shell stand where they stand in USD, in metres with +Y up."""

import json

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom

import echousd
from echousd.cli.main import run
from echousd.exporting.formats import export
from echousd.graph import SceneGraph

GRAPH = """
room: {type: bedroom, size: [4.0, 3.6]}
doors: [{wall: south, offset: 0.3}]
objects: {bed: double_bed, stand: nightstand, wardrobe: wardrobe}
relations: [stand left of bed]
"""


def bounds(file, pose=None):
    scene = trimesh.load(file, force="scene")
    if pose is not None:
        scene.apply_transform(pose)
    return np.array(scene.bounds)


def pose_of(entry):
    pose = trimesh.transformations.quaternion_matrix(entry["rotation"])
    pose[:3, 3] = entry["translation"]
    return pose


@pytest.mark.parametrize(("axis", "metres"), [("Y", 1.0), ("Z", 0.01)])
def test_a_room_stands_as_in_usd(tmp_path, axis, metres):
    graph = SceneGraph.from_yaml(GRAPH)
    room = echousd.generate(graph, seed=3, dress="some", up_axis=axis, meters_per_unit=metres)
    root = room.save(tmp_path / "bedroom", preview=False)
    out = tmp_path / "out"
    assert run(["export", str(root), "--for", "habitat", "-o", str(out)]) == 0
    config = json.loads((out / "bedroom.scene_dataset_config.json").read_text("utf-8"))
    for kind in ("stages", "objects", "scene_instances"):
        assert list(out.glob(f"{config[kind]['paths']['.json'][0]}/*.json"))
    scene = json.loads((out / "scenes/bedroom.scene_instance.json").read_text("utf-8"))
    assert [one["template_name"] for one in scene["object_instances"]] == [f"objects/{name}" for name in room.names]
    stage = Usd.Stage.Open(str(root))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    for entry in scene["object_instances"]:
        name = entry["template_name"].removeprefix("objects/")
        there = cache.ComputeWorldBound(stage.GetPrimAtPath(f"/Room/Objects/{name}")).ComputeAlignedRange()
        ends = np.array([there.GetMin(), there.GetMax()]) * metres
        if axis == "Z":
            ends = np.sort(np.stack([ends[:, 0], ends[:, 2], -ends[:, 1]], 1), axis=0)
        np.testing.assert_allclose(bounds(out / f"objects/{name}.glb", pose_of(entry)), ends, atol=2e-3)
        assert entry["motion_type"] == "DYNAMIC" or name == "wardrobe"
        told = json.loads((out / f"objects/{name}.object_config.json").read_text("utf-8"))
        assert told["render_asset"] == f"{name}.glb"
        assert 1 < told.get("mass", 2) < 400
    shell = bounds(out / "stages/bedroom.glb")
    assert shell[1][1] > 2.0  # walls, and no bed alone
    (region,) = json.loads((out / "bedroom.semantic_config.json").read_text("utf-8"))["region_annotations"]
    assert (region["label"], region["floor_height"]) == ("bedroom", 0.0)
    assert np.ptp(np.array(region["poly_loop"]), axis=0) == pytest.approx([4.0, 0.0, 3.6], abs=1e-3)
    with pytest.raises(
        ValueError, match=r"bedroom: holds assets, .* and no data set of Habitat; choose another folder"
    ):
        export(root, root.parent, reader="habitat")


def test_a_stage_without_a_graph_is_named(tmp_path):
    Usd.Stage.CreateNew(str(tmp_path / "bare.usda")).Save()
    with pytest.raises(ValueError, match=r"bare\.usda: no scene graph, Habitat needs one"):
        export(tmp_path / "bare.usda", tmp_path / "out", reader="habitat")
    assert not (tmp_path / "out").exists()
    assert run(["export", str(tmp_path / "bare.usda"), "--for", "unreal", "-o", str(tmp_path / "out")]) == 2
