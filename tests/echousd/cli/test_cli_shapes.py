"""`echousd data meshes`, `data sheet` end to end on a few small shapes."""

import pytest
import trimesh
from PIL import Image
from pxr import Gf, Usd, UsdGeom

from echomodel.data.shapeset import ShapeSet
from echousd.cli.main import run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An OBJ chair, a Z-up USD table in centimetres under a transform, and a broken file."""
    path = tmp_path_factory.mktemp("folder")
    trimesh.creation.box([0.5, 0.9, 0.5]).export(path / "kitchen_chair.obj")
    (path / "lamp.obj").write_text("v 0 0 0\n")
    stage = Usd.Stage.CreateNew(str(path / "coffee_table.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.Xform.Define(stage, "/Table").AddScaleOp().Set(Gf.Vec3f(100, 50, 40))
    mesh = UsdGeom.Mesh.Define(stage, "/Table/Top")
    mesh.CreatePointsAttr([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.CreateFaceVertexIndicesAttr([i for quad in quads for i in quad])
    stage.Save()
    return path


def test_a_folder_becomes_a_set_by_way_of_a_table(folder, tmp_path, capsys):
    out = tmp_path / "set"
    assert run(["data", "meshes", str(folder), "-o", str(out), "--table-only"]) == 0
    assert not (out / "shapes.json").exists()
    table = out / "table.csv"
    table.write_text(table.read_text("utf-8").replace("kitchen_chair,chair,1", "kitchen_chair,dining_chair,1"), "utf-8")
    assert run(["data", "meshes", str(folder), "-o", str(out), "--copies", "1"]) == 0
    err = capsys.readouterr().err
    assert "lamp.obj" in err
    assert "skipped" in err
    shapes = ShapeSet(out)
    assert [shapes.categories[c] for c in shapes.category] == ["coffee_table", "dining_chair"]
    assert shapes.size[0].tolist() == pytest.approx([1.0, 0.4, 0.5])
    assert shapes.size[1].tolist() == pytest.approx([0.5, 0.9, 0.5])
    assert (shapes[0] < 0).mean() == pytest.approx((60 / 64) ** 3, abs=0.01)
    assert run(["data", "sheet", "chair", "coffee table", "--set", str(out), "-o", str(tmp_path / "sheet.png")]) == 0
    assert Image.open(tmp_path / "sheet.png").size == (130 + 120, 120)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "no source given"),
        (["nowhere"], "nowhere: no such file or folder"),
        (["."], "holds neither .sh3f libraries nor .obj"),
        (["empty.txt"], "empty.txt: not a .sh3f library, a .deb package or a folder"),
    ],
)
def test_wrong_sources_are_named(arguments, text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.txt").touch()
    assert run(["data", "meshes", *arguments, "-o", "out"]) == 2
    assert text in " ".join(capsys.readouterr().err.split())


def test_a_sheet_of_parametric_pieces_is_drawn(tmp_path):
    picture = tmp_path / "sheet.png"
    assert run(["data", "sheet", "plant", "vanity", "--count", "2", "--size", "60", "-o", str(picture)]) == 0
    image = Image.open(picture).convert("L")
    assert image.size == (130 + 120, 120)
    for row in range(2):
        for column in range(2):
            cell = image.crop((130 + 60 * column, 60 * row, 190 + 60 * column, 60 * row + 60))
            dark = sum(cell.histogram()[:230]) / 3600
            assert 0.05 < dark < 0.9
