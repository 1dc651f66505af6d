import csv
import gzip
import json

import numpy as np
import pytest
from small_models import chest, seat, write_glb, write_obj

from echousd.assets.catalogues import CATALOGUES, entries_of, stands_in
from echousd.assets.describe import described


def rows(folder, told=None):
    kind = next(find.__name__ for find, _ in CATALOGUES if find(folder))
    said = [] if told is None else told
    return kind, {e.key: described(e, folder / "lib.parquet") for e in entries_of(folder, said.append)}


def test_abo(tmp_path):
    write_glb(tmp_path / "3dmodels/original/7", "B07", seat())
    table = tmp_path / "3dmodels/metadata/3dmodels.csv.gz"
    table.parent.mkdir(parents=True)
    with gzip.open(table, "wt") as file:
        file.write("3dmodel_id,path,meshes\nB07,7/B07.glb,1\nB08,8/B08.glb,1\nB09,../../../secret.glb,1\n")
    listing = {
        "3dmodel_id": "B07",
        "item_name": [{"language_tag": "de_DE", "value": "Stuhl"}, {"language_tag": "en_US", "value": "Rivet Chair"}],
        "product_type": [{"value": "CHAIR"}],
        "material": [{"language_tag": "en_US", "value": "Oak"}],
    }
    (tmp_path / "listings/metadata").mkdir(parents=True)
    (tmp_path / "listings/metadata/listings_0.json").write_text(json.dumps(listing) + "\nno json\n")
    kind, found = rows(tmp_path)
    assert (kind, list(found)) == ("abo", ["B07"])
    chair = found["B07"]
    assert (chair.category, chair.name, chair.licence, chair.tags) == ("chair", "Rivet Chair", "CC-BY-4.0", ("Oak",))
    assert chair.front_confidence == 1.0


def test_objaverse_with_objathor(tmp_path):
    turned = seat()
    turned.vertices = turned.vertices @ np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]) * 7  # its front at -X, any unit
    write_glb(tmp_path / "glbs/000-001", "abc", turned)
    told = {
        "abc": {
            "category": "dining chair",
            "description": "an oak chair",
            "onFloor": True,
            "size": [50, 90, 50],
            "frontView": 3,
            "license_info": {"license": "by-nc", "creator_username": "joiner"},
        },
        "gone": {"category": "desk"},
    }
    (tmp_path / "annotations.json").write_text(json.dumps(told))
    (tmp_path / "gone.pkl.gz").write_bytes(b"cposix\nsystem\n")
    said: list[str] = []
    kind, found = rows(tmp_path, said)
    assert (kind, list(found)) == ("objaverse", ["abc"])
    chair = found["abc"]
    assert (chair.category, chair.licence, chair.author, chair.placement) == (
        "dining_chair",
        "CC-BY-NC-4.0",
        "joiner",
        "floor",
    )
    assert chair.dims == pytest.approx((0.5, 0.9, 0.5), abs=1e-3)
    assert "1 of 2 models are not below" in said[0]


def test_hssd(tmp_path):
    lying = chest(1.6, 2.2, 0.6)
    lying.vertices = np.stack([lying.vertices[:, 0], -lying.vertices[:, 2], lying.vertices[:, 1]], 1)
    write_glb(tmp_path / "objects/a", "a1", lying)
    with (tmp_path / "objects.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerows(
            [("id", "name", "wnsynsetkey", "up", "front"), ("a1", "Pax", "wardrobe.n.01", "0,0,1", "0,-1,0")]
        )
    kind, found = rows(tmp_path)
    assert kind == "hssd"
    assert (found["a1"].category, found["a1"].licence) == ("wardrobe", "CC-BY-NC-4.0")
    assert found["a1"].dims == pytest.approx((1.6, 2.2, 0.6), abs=1e-3)
    assert (found["a1"].turn[3:6], found["a1"].turn[6:]) == ((0, 0, 1), (0, -1, 0))


def test_3d_future(tmp_path):
    write_obj(tmp_path / "m1", "raw_model", seat(2.0, 0.8, 0.9))
    told = [
        {"model_id": "m1", "category": "Three-Seat / Multi-seat Sofa", "super-category": "Sofa", "style": "Modern"},
        {"model_id": "../m2", "category": "Bed"},
    ]
    (tmp_path / "model_info.json").write_text(json.dumps(told))
    kind, found = rows(tmp_path)
    assert kind == "future3d"
    assert (found["m1"].category, found["m1"].tags) == ("multi_seat_sofa", ("Modern",))
    assert found["m1"].dims == pytest.approx((2.0, 0.8, 0.9), abs=1e-3)


def test_broken_tables_are_told(tmp_path):
    (tmp_path / "annotations.json").write_text("{")
    said: list[str] = []
    assert entries_of(tmp_path, said.append) == []
    assert "annotations.json: cannot be read as JSON" in said[0]


@pytest.mark.parametrize(
    ("stem", "others", "expected"),
    [
        ("table_collision", ("table",), True),
        ("table_lod1", ("table_lod0", "table_lod2"), True),
        ("table.LOD_2", ("table",), True),
        ("table_lod1", ("table_lamp",), False),
        ("table_lod1", ("tables",), False),
        ("table_lod1", ("table_lod2",), False),
        ("chair_collision", ("chair_visual",), True),
        ("sofa_collision", ("sofa_high",), True),
    ],
)
def test_a_file_stands_in_for_one_of_the_same_name_alone(stem, others, expected):
    assert stands_in(stem, {stem, *others}) == expected
