import base64
import csv
import io
import re

import numpy as np
import pytest
from PIL import Image
from small_models import chest, seat, small_library, write_obj

from echousd.assets.describe import front_by_shape
from echousd.assets.index import by_reason, index, read_corrections, write_page, write_table
from echousd.assets.table import read_library


def edited(path, **rows):
    """The table with some cells changed: id -> {column: text}."""
    with path.open(newline="") as file:
        reader = csv.DictReader(file)
        columns, found = reader.fieldnames, list(reader)
    for row in found:
        row.update(rows.get(row["id"].split("/")[-1].partition(".")[0], {}))
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(found)


def test_a_person_corrects_what_was_found(tmp_path):
    folder, file, table = small_library(tmp_path / "models"), tmp_path / "lib.parquet", tmp_path / "lib.csv"
    write_obj(folder, "gizmo", chest(1.2, 0.8, 0.45))
    index([folder], file)
    write_table(table, read_library(file).records.values())
    edited(table, gizmo={"category": "sideboard", "metres": "1"}, dining_chair={"turn": "180"}, table_lamp={"use": "0"})
    for _ in range(2):  # what was corrected once is not corrected again
        done = index([folder], file, table=table)
        found = read_library(file).records
        assert found["gizmo.obj"].category == "sideboard"
        assert found["gizmo.obj"].usable
        assert found["chairs/dining_chair.obj"].turn[6:] == pytest.approx((0, 0, -1))
        assert found["lamps/table_lamp.obj"].fault == "left out in the table"
    assert done.read == 0
    write_table(table, found.values(), read_corrections(table))
    assert read_corrections(table)["gizmo.obj"]["category"] == "sideboard"
    edited(table, dining_chair={"turn": ""}, table_lamp={"use": ""})
    assert index([folder], file, table=table).read == 2
    assert read_library(file).records["chairs/dining_chair.obj"].turn[6:] == pytest.approx((0, 0, 1))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"use": "maybe"}, "use is 'maybe', allowed: 1 or 0"),
        ({"turn": "45"}, "turn is '45', allowed: 0, 90, 180, 270 degrees"),
        ({"metres": "-1"}, "metres is '-1', allowed: a positive number"),
        ({"category": "spaceship"}, "spaceship"),
    ],
)
def test_faults_of_a_table_name_the_line(tmp_path, change, told):
    file, table = index([small_library(tmp_path / "models")], tmp_path / "lib.parquet").file, tmp_path / "lib.csv"
    write_table(table, read_library(file).records.values())
    edited(table, dining_chair=change)
    with pytest.raises(ValueError, match=rf"lib.csv:3: .*{told}"):
        read_corrections(table)


def test_a_page_shows_every_model(tmp_path):
    folder = small_library(tmp_path / "models")
    write_obj(folder, "gizmo<b>", chest())
    records = list(read_library(index([folder], tmp_path / "lib.parquet").file).records.values())
    write_page(tmp_path / "review.html", records)
    page = (tmp_path / "review.html").read_text()
    assert page.count("<img src='data:image/png;base64,") == 6
    assert "6 of 7 models usable" in page
    assert "gizmo<b>" not in page
    pictures = re.findall("png;base64,([^']*)'", page)
    with Image.open(io.BytesIO(base64.b64decode(pictures[0]))) as picture:
        assert np.asarray(picture.convert("L")).min() < 100


def test_models_that_are_left_out_are_told_by_reason(tmp_path, echousd_command):
    folder = small_library(tmp_path / "models")
    for name in ("gizmo", "widget", "doodad"):
        write_obj(folder, name, chest())
    (folder / "desk.glb").write_bytes(b"no glb")
    file = index([folder], tmp_path / "lib.parquet").file
    found = by_reason(list(read_library(file).records.values()))
    reasons = {reason: [record.id for record in members] for reason, members in found.items()}
    unknown = "... is of no known category; set `category` in the table"
    assert next(iter(reasons)) == unknown  # the commonest first
    assert sorted(reasons.pop(unknown)) == ["doodad.obj", "gizmo.obj", "widget.obj"]
    ((reason, ids),) = reasons.items()
    assert reason.startswith("cannot be read")
    assert ids == ["desk.glb"]
    notes = file.with_name("notes.html")
    notes.write_text("somebody's")
    assert "notes.html: exists and is no page of models" in echousd_command("assets", "review", file, "-o", notes).err
    assert notes.read_text() == "somebody's"
    said = echousd_command("assets", "review", file).out
    assert f"left out 3: {unknown}\n" in said
    page = (tmp_path / "lib.html").read_text()
    assert "<summary>3: ... is of no known category" in page


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize(
    ("mesh", "category"), [(seat(), "chair"), (seat(1.8, 0.9, 2.1), "double_bed"), (chest(), "dresser")]
)
def test_a_front_is_found_by_shape(mesh, category, quarters):
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    turned = mesh.copy()
    turned.vertices = mesh.vertices @ np.linalg.matrix_power(turn, quarters).T
    found, evidence = front_by_shape(turned, category)
    assert (found + quarters) % 4 == 0
    assert evidence > 0.1
