"""`echousd data sheet` end to end on a few small shapes."""

import trimesh
from PIL import Image

from echomodel.data.meshes import MeshModel, build_meshes
from echousd.cli.main import run


def test_a_sheet_of_a_set_is_drawn(tmp_path):
    box = MeshModel("a", "chair", "", "", "", "", lambda: trimesh.creation.box([0.5, 0.9, 0.5]))
    build_meshes(tmp_path / "set", [box], copies=1)
    out = tmp_path / "sheet.png"
    assert run(["data", "sheet", "chair", "coffee table", "--set", str(tmp_path / "set"), "-o", str(out)]) == 0
    assert Image.open(out).size == (130 + 120, 120)


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
