"""Sweet Home 3D's libraries: catalogues, classes by name, and sets of shapes to learn from, by way of an index."""

import zipfile

import numpy as np
import pytest
import trimesh

from echomodel.data.shapeset import ShapeSet
from echomodel.tsdf import tsdf_from_mesh
from echomodel.vocabulary import vocabulary
from echousd.assets.catalogues import entries_of, read_library, reviewed
from echousd.assets.describe import described
from echousd.assets.index import index
from echousd.assets.measure import measure
from echousd.assets.naming import class_by_name
from echousd.cli.main import run

CATALOGUE = """# comment
id=Test
provider=someone
license=Creative Commons \\
  Attribution 3.0
name#1=Corner sofa
category#1=Living room
model#1=/models/sofa/sofa.obj
width#1=250
depth#1=160
height#1=80.5
creator#1=Ren\\u00e9
name#2=Lamp
model#2=/models/lamp.obj
modelRotation#2=1 0 0 0 0 1 0 -1 0
width#2=30
depth#2=30
height#2=150
name#3=Front door
category#3=Doors and windows
model#3=/models/door.obj
width#3=90
depth#3=10
height#3=200
name#4=incomplete
"""


def l_shape():
    """An asymmetric solid: a slab with a block at its -x side in front and a high back at -z."""
    parts = [([4, 1, 3], [0, 0.5, 0]), ([4, 2, 0.5], [0, 1, -1.25]), ([1, 1, 2], [-1.5, 0.5, 2.4])]
    boxes = [trimesh.creation.box(size, trimesh.transformations.translation_matrix(at)) for size, at in parts]
    return trimesh.util.concatenate(boxes)


@pytest.fixture
def library(tmp_path):
    path = tmp_path / "Test.sh3f"
    lying = l_shape().apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", CATALOGUE)
        archive.writestr("models/sofa/sofa.obj", l_shape().export(file_type="obj"))
        archive.writestr("models/lamp.obj", lying.export(file_type="obj"))
        archive.writestr("models/door.obj", trimesh.creation.box().export(file_type="obj"))
    return path


def surface(entry, library):
    record = described(entry, library)
    return measure(entry.file).turned(np.eye(3)).apply_transform(record.pose())


def test_a_library_tells_size_licence_and_creator(library):
    sofa, lamp, door = entries_of(library, print)
    assert (sofa.key, sofa.name, sofa.author) == ("Test/sofa", "Corner sofa", "René")
    assert sofa.licence == "Creative Commons Attribution 3.0"
    assert lamp.author == "someone"
    assert door.group == "Doors and windows"
    assert [entry.category for entry in (sofa, lamp, door)] == ["l_shaped_sofa", "floor_lamp", ""]
    np.testing.assert_allclose(surface(sofa, library).extents, [2.5, 0.805, 1.6])


def test_a_model_is_turned_upright_before_it_is_scaled(library):
    sofa, lamp, _ = entries_of(library, print)
    upright, turned = (tsdf_from_mesh(surface(entry, library)) for entry in (sofa, lamp))
    assert (np.sign(upright) == np.sign(turned)).mean() > 0.999
    np.testing.assert_allclose(surface(lamp, library).extents, [0.3, 1.5, 0.3])


@pytest.mark.parametrize(
    ("name", "group", "size", "category"),
    [
        ("Sofa", "Living room", (2.0, 0.8, 0.9), "multi_seat_sofa"),
        ("Couch", "Living room", (1.5, 0.8, 0.9), "loveseat_sofa"),
        ("Bed", "Bedroom", (1.6, 1.0, 2.1), "double_bed"),
        ("Bed", "Bedroom", (0.9, 1.0, 2.1), "single_bed"),
        ("Bedside table", "Bedroom", (0.5, 0.5, 0.4), "nightstand"),
        ("Desk lamp", "Lights", (0.2, 0.4, 0.2), "table_lamp"),
        ("Lamp", "Lights", (0.4, 1.5, 0.4), "floor_lamp"),
        ("Glass table", "Living room", (1.6, 0.75, 0.9), "dining_table"),
        ("Chair", "Office", (0.6, 1.0, 0.6), "office_chair"),
        ("Chair", "Living room", (0.5, 0.9, 0.5), "chair"),
        ("Pool table", "Miscellaneous", (2.5, 0.8, 1.4), ""),
        ("TV remote control", "Living room", (0.1, 0.02, 0.2), ""),
        ("Tablet", "Miscellaneous", (0.17, 0.01, 0.24), ""),
        ("Ficus", "Exterior", (2.7, 5.0, 2.8), ""),
        ("Seat Leon", "Vehicles", (1.9, 1.5, 4.2), ""),
    ],
)
def test_names_and_sizes_make_classes(name, group, size, category):
    assert class_by_name(name, group, size) == category


def test_the_review_uses_words_of_the_vocabulary():
    for key, columns in reviewed().items():
        assert set(columns) <= {"class", "use"}, key
        if "class" in columns:
            assert vocabulary().category(columns["class"]).name == columns["class"]


def test_a_file_that_is_no_library_is_named(tmp_path):
    (tmp_path / "no.sh3f").write_text("no")
    with pytest.raises(ValueError, match=r"no.sh3f: cannot be read"):
        read_library(tmp_path / "no.sh3f")


def test_an_index_becomes_a_set(library, tmp_path, capsys):
    made = tmp_path / "models.parquet"
    index([library], made)
    assert run(["data", "meshes", str(made), "-o", str(tmp_path / "set")]) == 0
    assert "4 shapes, 0 held out" in " ".join(capsys.readouterr().err.split())
    built = ShapeSet(tmp_path / "set")
    assert built.info["names"] == ["Test/lamp", "Test/lamp", "Test/sofa", "Test/sofa"]
    np.testing.assert_array_equal(built.codes(3), built.codes(2)[::-1])
    np.testing.assert_allclose(built.size[2], [2.5, 0.805, 1.6], rtol=1e-5)
    assert not np.allclose(built.size[3], built.size[2])
    text = (tmp_path / "set/ATTRIBUTION.md").read_text("utf-8")
    assert "| Test/sofa | Corner sofa | René |" in text
    before = (tmp_path / "set/shapes-0000.bin").read_bytes()
    assert run(["data", "meshes", str(made), "-o", str(tmp_path / "set")]) == 0
    assert (tmp_path / "set/shapes-0000.bin").read_bytes() == before


def test_a_correction_of_the_index_reaches_the_set(library, tmp_path):
    made = tmp_path / "models.parquet"
    (tmp_path / "models.csv").write_text("id,use,category,turn,metres\nTest/sofa,,loveseat_sofa,180,\nTest/lamp,0,,,\n")
    straight = surface(entries_of(library, print)[0], library)
    index([library], made, table=tmp_path / "models.csv")
    assert run(["data", "meshes", str(made), "-o", str(tmp_path / "set"), "--copies", "1"]) == 0
    (found,) = [grid for grid in ShapeSet(tmp_path / "set")]
    assert (np.sign(found) == np.sign(tsdf_from_mesh(straight))[::-1, :, ::-1]).mean() > 0.99
