"""Real meshes: catalogues, classes by name, the reviewable table, sets with splits and attribution."""

import zipfile

import numpy as np
import pytest
import trimesh

from echomodel.data.catalogues import load_mesh, read_folder, read_library
from echomodel.data.meshes import (
    attribution,
    build_meshes,
    class_by_name,
    draft_table,
    prepared,
    read_table,
    reviewed,
    write_table,
)
from echomodel.data.shapeset import ShapeSet
from echomodel.tsdf import tsdf_from_mesh
from echomodel.vocabulary import vocabulary

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


def test_a_library_tells_size_licence_and_creator(library):
    sofa, lamp, door = read_library(library)
    assert (sofa.key, sofa.name, sofa.creator) == ("Test/sofa", "Corner sofa", "René")
    assert sofa.licence == "Creative Commons Attribution 3.0"
    assert lamp.creator == "someone"
    assert door.group == "Doors and windows"
    np.testing.assert_allclose(load_mesh(sofa).extents, [2.5, 0.805, 1.6])


def test_a_model_is_turned_upright_before_it_is_scaled(library):
    sofa, lamp, _ = read_library(library)
    upright, turned = (tsdf_from_mesh(load_mesh(entry)) for entry in (sofa, lamp))
    assert (np.sign(upright) == np.sign(turned)).mean() > 0.999
    np.testing.assert_allclose(load_mesh(lamp).extents, [0.3, 1.5, 0.3])


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
        assert set(columns) <= {"class", "use", "yaw"}, key
        if "class" in columns:
            assert vocabulary().category(columns["class"]).name == columns["class"]


def test_a_table_goes_to_disk_and_back(library, tmp_path):
    rows = draft_table(read_library(library))
    assert [row.category for row in rows] == ["l_shaped_sofa", "floor_lamp", ""]
    assert [row.use for row in rows] == [True, True, False]
    write_table(tmp_path / "table.csv", rows)
    assert read_table(tmp_path / "table.csv") == rows


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("floor_lamp,1", "flor_lamp,1", r"table.csv, line 3: unknown category 'flor_lamp'"),
        ("floor_lamp,1", "floor_lamp,yes", r"table.csv, line 3: use 'yes', split 'train'; use is 0 or 1"),
        ("0.3,1.5", "wide,1.5", r"table.csv, line 3: could not convert"),
        ("licence", "license", r"table.csv: misses the columns licence"),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(library, tmp_path, old, new, text):
    path = tmp_path / "table.csv"
    write_table(path, draft_table(read_library(library)))
    path.write_text(path.read_text("utf-8").replace(old, new), "utf-8")
    with pytest.raises(ValueError, match=text):
        read_table(path)


def test_a_fifth_of_each_class_is_held_out(library):
    sofa = read_library(library)[0]
    entries = [type(sofa)(**{**vars(sofa), "key": f"Test/sofa{i}"}) for i in range(20)]
    rows = draft_table(entries)
    assert sum(row.split == "held_out" for row in rows) == 4
    assert draft_table(entries[::-1])[::-1] == rows


def test_a_set_is_built_mirrored_and_attributed(library, tmp_path):
    entries = read_library(library)
    rows = draft_table(entries)
    calls = []
    built = build_meshes(tmp_path, entries, rows, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 2), (2, 2)]
    assert isinstance(built, ShapeSet)
    assert built.info["names"] == ["Test/sofa", "Test/sofa", "Test/lamp", "Test/lamp"]
    np.testing.assert_array_equal(built.codes(1), built.codes(0)[::-1])
    np.testing.assert_allclose(built.size[0], [2.5, 0.805, 1.6], rtol=1e-5)
    assert not np.allclose(built.size[1], built.size[0])
    assert len(list((tmp_path / "thumbnails").glob("*.png"))) == 2
    text = (tmp_path / "ATTRIBUTION.md").read_text("utf-8")
    assert "## Creative Commons Attribution 3.0" in text
    assert "| Test/sofa | Corner sofa | René |" in text
    assert attribution(rows[:1]).count("Test/") == 1
    before = (tmp_path / "shapes-0000.bin").read_bytes()
    build_meshes(tmp_path, entries, rows)
    assert (tmp_path / "shapes-0000.bin").read_bytes() == before


def test_yaw_turns_the_front_to_z(library, tmp_path):
    entry = read_library(library)[0]
    row = draft_table([entry])[0]
    straight, turned = prepared(entry, row), prepared(entry, type(row)(**{**vars(row), "yaw": 180.0}))
    # The high back stands at -z; with the front declared 180 degrees off it comes to +z.
    assert straight.vertices[straight.vertices[:, 1] > 0.7][:, 2].mean() < 0
    assert turned.vertices[turned.vertices[:, 1] > 0.7][:, 2].mean() > 0


def test_folders_and_damage(tmp_path):
    l_shape().export(tmp_path / "dining_chair.obj")
    (tmp_path / "broken.obj").write_text("v 0 0 0\n")
    (tmp_path / "LICENSE.txt").write_text("Creative Commons Zero license, do as you like")
    broken, chair = read_folder(tmp_path)
    assert (chair.name, chair.licence) == ("dining chair", "Creative Commons Zero license")
    np.testing.assert_allclose(load_mesh(chair).extents, l_shape().extents)
    with pytest.raises(ValueError, match=r"broken.obj: (holds no triangles|cannot be read)"):
        load_mesh(broken)
    told = []
    rows = draft_table([broken, chair], {"broken": {"class": "chair"}})
    built = build_meshes(tmp_path / "set", [broken, chair], rows, skipped=told.append)
    assert len(built) == 2
    assert "broken.obj" in told[0]
    (tmp_path / "no.sh3f").write_text("no")
    with pytest.raises(ValueError, match=r"no.sh3f: cannot be read"):
        read_library(tmp_path / "no.sh3f")
