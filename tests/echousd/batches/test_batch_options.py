"""Options that a batch takes from `generate`: what of a library is allowed, what has no place, what comes to rest."""

import json
import re
from dataclasses import replace

import pytest
import torch
from inline_batches import QUICK, Inline, batch
from small_models import small_library
from small_room import small_graph

from echomodel import text as texts
from echousd.assets.choose import wishes_of
from echousd.assets.index import index
from echousd.batches.options import BatchOptions, parse_options, read_toml, request_of
from echousd.batches.plan import read_journals
from echousd.batches.verify import finish, verify
from echousd.graph import Node


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    return index([small_library(folder / "models")], folder / "lib.parquet").file


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "graph.json"
    path.write_text(small_graph().to_json())
    return path


def manifests(folder):
    return [json.loads(path.read_text()) for path in sorted((folder / "rooms").glob("*/*/*.json"))]


def made(source, folder, **options):
    how = {"executor": Inline(), "workers": 1, **QUICK, **options}
    assert batch(source, folder, **how).complete, list(read_journals(folder).values())
    return manifests(folder)


def test_a_batch_asks_a_library_as_generate_does(library, source, tmp_path, monkeypatch):
    shelf = {"shapes": "library", "assets": str(library)}
    (room,) = made(source, tmp_path / "all", collect=True, **shelf)
    assert {one["shapes"] for one in room["meshes"].values()} == {"library"}
    layers = [path.read_text() for path in (tmp_path / "all").rglob("*.usda")]
    assert not [text for text in layers if str(library.parent / "models") in text]  # nothing refers to the library
    (room,) = made(source, tmp_path / "none", licenses="MIT", **shelf)
    assert "library" not in {one["shapes"] for one in room["meshes"].values()}
    options = {"assets": str(library), "stretch": 1.5}
    wishes = wishes_of(request_of({"sample": {"bedroom": 1}, "options": options}, "test").options)
    assert (wishes.stretch, wishes.licences, wishes.collect) == (1.5, (), False)

    asked = []

    class Encoder:
        def __call__(self, said):
            asked.append(said[0])
            return torch.eye(len(said))

    monkeypatch.setattr(texts, "ClipTextEncoder", Encoder)
    made(source, tmp_path / "words", text="mid-century oak", count=2, **shelf)
    assert asked == ["mid-century oak"]  # the words of all models are compared once, not for each room


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"text": "oak"}, "batch: text 'oak' needs models to choose from"),
        ({"assets": "none.parquet"}, "none.parquet: no such file, allowed: an index"),
        ({"stretch": 9.0}, "batch: stretch is 9.0, allowed: 1 to 4"),
        ({"licenses": ","}, "batch: licenses is ',', allowed: licences with commas between"),
        ({"fit": "squeeze"}, "batch: fit is 'squeeze', allowed: keep or drop"),
    ],
)
def test_what_a_library_lacks_is_told_before_the_first_room(source, tmp_path, options, said):
    with pytest.raises(ValueError, match=said):
        batch(source, tmp_path / "run", executor=Inline(), **{**QUICK, **options})
    assert not (tmp_path / "run").exists()


def test_another_library_is_another_plan(library, source, tmp_path):
    file = tmp_path / "lib.parquet"
    file.write_bytes(library.read_bytes())
    options = {"shapes": "library", "assets": str(file), "executor": Inline(), "workers": 1}
    folder = small_library(tmp_path / "models")
    batch(source, tmp_path / "run", **{**QUICK, **options})
    (folder / "storage/thing_17.usda").unlink()
    file.unlink()
    index([folder], file)
    with pytest.raises(ValueError, match=r"another plan \(libraries\..*lib\.parquet was .*, now "):
        batch(source, tmp_path / "run", resume=True, **{**QUICK, **options})


def test_what_has_no_place_is_left_out_if_wanted(source, tmp_path):
    source.write_text(small_graph(size=(1.7, 1.9)).to_json())
    (room,) = made(source, tmp_path / "run", fit="drop")
    assert len(room["graph"]["nodes"]) < len(small_graph().nodes)
    (row,) = read_journals(tmp_path / "run").values()
    assert any(note.startswith("left out: ") for note in row["notes"])


def test_rooms_come_to_rest_if_wanted(source, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    from echousd.make import resting

    calm = resting.settled
    monkeypatch.setattr(resting, "settled", lambda room: replace(calm(room), notes=("lamp came to rest",)))
    made(source, tmp_path / "run", settle=True)
    (row,) = read_journals(tmp_path / "run").values()
    assert "lamp came to rest" in row["notes"]


def test_what_does_not_rest_fails_the_verdict_of_a_batch_that_settles(source, tmp_path, monkeypatch, echousd_command):
    """A lamp whose place in the air is stated falls."""
    pytest.importorskip("mujoco")
    from echousd.batches import batch as batches

    lamp = Node("lamp", "table_lamp", size=(0.25, 0.45, 0.25), position=(1.2, 1.5, 1.2), yaw=0.0)
    nodes = tuple(lamp if node.name == "lamp" else node for node in small_graph().nodes)
    relations = tuple(told for told in small_graph().relations if told.subject != "lamp")
    source.write_text(small_graph().replaced(nodes=nodes, relations=relations).to_json())
    monkeypatch.setattr(batches, "_executor", lambda how, rooms, device: Inline())
    quick = ("--shapes", "boxes", "--drafts", 1, "--steps", 2, "--no-preview", "--no-place", "--workers", 1)
    quick += ("--no-walls", "--dress", "none")
    for settles in (False, True):
        words = (*quick, *(["--settle"] if settles else []))
        done = echousd_command("batch", source, "-o", tmp_path / str(settles), *words)
        assert done.code == 0, done.err
        (row,) = read_journals(tmp_path / str(settles)).values()
        assert bool(row["restless"]) == settles
        told = [text for text in row["check_errors"] if text.startswith("lamp does not rest: it ")]
        assert bool(told) == settles, row["check_errors"]
    summary = finish(tmp_path / "True")
    assert (summary["restless"], summary["passed_check"]) == (row["restless"], 0)
    ((_, problem),) = verify(tmp_path / "True", check=True)
    assert problem.endswith(f"{row['restless']} restless")


@pytest.mark.parametrize("words", [("batch",), ("batch", "run")])
def test_all_options_of_rooms_are_in_the_help(echousd_command, words):
    shown = echousd_command(*words, "--help-all").out
    rows = set(BatchOptions.model_fields) - {"seed"}  # whose is the batch's
    assert "settle" in rows
    flags = {name: f"--{name.replace('_', '-')}" for name in rows} | {"resident": "--for"}
    assert [name for name in sorted(rows) if flags[name] not in shown] == []


def test_any_option_is_set_by_its_name(echousd_command, tmp_path):
    assert parse_options(["ceiling=true", "palette=oak", "faces=900", 'text="x"']) == {
        "ceiling": True, "palette": "oak", "faces": 900, "text": "x",
    }  # fmt: skip
    told = echousd_command("batch", "--sample", "bedroom:1", "--set", "ceiling", "-o", tmp_path / "run")
    assert (told.code, "--set is 'ceiling', allowed: an option of a room and its value" in told.err) == (2, True)
    told = echousd_command("batch", "--sample", "bedroom:1", "--set", "ceilin=true", "-o", tmp_path / "run")
    assert (told.code, "batch: ceilin is no option, allowed: assets, atlas, ceiling" in told.err) == (2, True)
    path = tmp_path / "batch.toml"
    path.write_text('[sample]\nbedroom = 1\n[options]\nassets = "lib.parquet"\nlicenses = "CC0"\nstretch = 1.3\n')
    options = request_of(read_toml(path), str(path)).options
    assert (options.assets, options.licenses, options.stretch) == (str(tmp_path / "lib.parquet"), "CC0", 1.3)
    path.write_text('[sample]\nbedroom = 1\n[options]\nlike = "flat.usda"\n')
    with pytest.raises(ValueError, match=re.escape(f"{tmp_path / 'flat.usda'}: no such file")):
        request_of(read_toml(path), str(path))
