"""A stage of several rooms: a folder for each and a root that composes them, or one of them."""

import json

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.checks import check
from echousd.layers.house import places
from echousd.stage.graphs import write_graph

QUICK = ("--shapes", "boxes", "--no-walls", "--no-place", "--dress", "none", "--no-preview")


@pytest.fixture(autouse=True)
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))


@pytest.fixture
def file(tmp_path):
    """Two bedrooms, the second one 6 m to the right and turned by a quarter."""
    path = tmp_path / "house.usda"
    layer = Sdf.Layer.CreateNew(str(path))
    house = Sdf.CreatePrimInLayer(layer, "/House")
    house.specifier, house.typeName = Sdf.SpecifierDef, "Xform"
    for name in ("West", "East"):
        write_graph(small_graph(), layer, f"/House/{name}")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    east = UsdGeom.Xformable(stage.GetPrimAtPath("/House/East"))
    east.AddTranslateOp().Set(Gf.Vec3d(6, 0, 0))
    east.AddRotateYOp().Set(90)
    layer.Save()
    return path


def test_all_rooms_are_made_and_composed(file, tmp_path, echousd_command):
    words = ("-o", tmp_path / "out", *QUICK)
    done = echousd_command("generate", file, *words)
    assert done.code == 0, done.err
    assert f"house    {tmp_path / 'out' / 'out.usda'}" in done.out
    assert (tmp_path / "out" / "West" / "West.usda").is_file()
    stage = Usd.Stage.Open(str(tmp_path / "out" / "out.usda"))
    assert stage.GetCompositionErrors() == []
    assert list(echousd.read_rooms(stage)) == ["/House/West", "/House/East"]
    bed = UsdGeom.Xformable(stage.GetPrimAtPath("/House/East/Objects/bed")).ComputeLocalToWorldTransform(0)
    np.testing.assert_allclose(bed.ExtractTranslation(), (6 - 0.6, 0, 0), atol=1e-4)
    report = check(stage)
    assert not report.broken
    assert not report.placement
    # again: ours are replaced
    done = echousd_command("generate", file, *words, "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    layers = [tmp_path / "out" / name for name in ("West/West.usda", "East/East.usda")]
    assert [room["room"] for room in told["rooms"]] == [str(layer) for layer in layers]
    assert told["written"][0] == str(tmp_path / "out" / "out.usda")
    done = echousd_command("edit", tmp_path / "out/out.usda", "--lock", "bed")
    assert done.code == 2
    assert "out.usda: a house, which composes rooms; name one of them: East/East.usda, West/West.usda" in done.err


def test_one_of_them(file, tmp_path, echousd_command):
    done = echousd_command("generate", file, "-o", tmp_path / "east", *QUICK, "--room", "/House/East")
    assert done.code == 0, done.err
    assert (tmp_path / "east" / "east.usda").is_file()
    done = echousd_command("generate", file, "-o", tmp_path / "north", "--room", "/House/North")
    assert done.code == 2
    assert "no room '/House/North', allowed: /House/West, /House/East" in done.err
    assert len(echousd.generate(file, room="/House/West", model=StandIn(), shapes="boxes", **BARE).names) == 6
    with pytest.raises(ValueError, match=r"2 rooms, say which one of /House/West, /House/East"):
        echousd.generate(file, model=StandIn(), shapes="boxes", **BARE)


def test_a_file_that_is_no_house_of_ours_stays(file, tmp_path, echousd_command):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "out.usda").write_text("#usda 1.0\n")
    done = echousd_command("generate", file, "-o", tmp_path / "out", "--shapes", "boxes")
    assert done.code == 2
    assert "out.usda: exists and is no house of echousd; choose another folder or use --force" in done.err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["out.usda"]


def test_rooms_without_a_place_are_put_in_a_row(file, tmp_path, echousd_command):
    stage = Usd.Stage.Open(str(file))
    UsdGeom.Xformable(stage.GetPrimAtPath("/House/East")).ClearXformOpOrder()
    stage.Save()
    assert {tuple(place.pose[:3, 3]) for place in places(file)} == {(0.0, 0.0, 0.0)}
    done = echousd_command("generate", file, "-o", tmp_path / "out", *QUICK)
    assert done.code == 0, done.err
    stage = Usd.Stage.Open(str(tmp_path / "out" / "out.usda"))
    cache = UsdGeom.BBoxCache(0, ["default"])
    west, east = (
        cache.ComputeWorldBound(stage.GetPrimAtPath(f"/House/{name}/Objects")).ComputeAlignedRange()
        for name in ("West", "East")
    )
    assert east.GetMin()[0] > west.GetMax()[0] + 0.9
