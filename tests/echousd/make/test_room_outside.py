"""Graphs, rooms and indices that somebody sent name files of their own folders; others take an explicit word."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import pytest
from inline_batches import QUICK, Inline, batch
from small_models import chest, picture, write_obj
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.assets.index import index
from echousd.assets.table import read_library, write_library
from echousd.batches.plan import read_journals
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.shapes.originals.loading import library_file

NODE = {"name": "wardrobe", "category": "wardrobe"}


@pytest.fixture
def sent(tmp_path):
    """A folder that came from somebody, beside one that did not."""
    (tmp_path / "sent").mkdir()
    write_obj(tmp_path / "outside", "secret", chest(1.0, 2.0, 0.5))
    return tmp_path / "sent"


def test_an_index_reaches_no_further_than_its_folder(sent, echousd_command):
    secret = sent.parent / "outside/picture.png"
    secret.write_bytes(picture((1, 2, 3)))
    write_obj(sent / "models", "wardrobe", chest(1.6, 2.2, 0.6), texture="../../outside/picture.png")
    file = index([sent / "models"], sent / "furniture.parquet").file
    write_library(file, [replace(record, root="..") for record in read_library(file).records.values()])
    graph = small_graph()
    told = rf"furniture.parquet: a row names {sent.parent}, allowed: files below {sent} \(--allow-outside DIR"
    with pytest.raises(ValueError, match=told):
        echousd.generate(graph, model=StandIn(), shapes="library", assets=file)
    done = echousd_command(
        "generate", write(sent / "g.json", [NODE]), "-o", sent / "out", "--shapes", "library", "--assets", file
    )
    assert (done.code, "a row names" in done.err) == (2, True)
    assert not (sent / "out").exists()
    room = echousd.generate(graph, model=StandIn(), shapes="library", assets=file, outside=[sent.parent], **BARE)
    brought = [content for g in room.geometry.values() if g.original for content in g.original.files.values()]
    assert any(content.startswith(b"\x89PNG") for content in brought)


def test_a_row_reaches_no_further_than_its_root(sent):
    write_obj(sent / "models", "wardrobe", chest(1.6, 2.2, 0.6))
    library = read_library(index([sent / "models"], sent / "furniture.parquet").file)
    (record,) = library.records.values()
    for uri in ("../outside/secret.obj", str(sent.parent / "outside/secret.obj"), "other/x.obj", "models/link.obj"):
        (sent / "models/link.obj").unlink(missing_ok=True)
        (sent / "models/link.obj").symlink_to(sent.parent / "outside/secret.obj")
        with pytest.raises(ValueError, match=r"asset 'wardrobe.obj' names .*, allowed: files below .*models"):
            library_file(library, replace(record, uri=uri))


def write(path, nodes):
    path.write_text(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes}))
    return path


@pytest.mark.parametrize("way", ["up", "absolute", "link"])
def test_a_graph_reaches_no_further_than_its_folder(sent, way, echousd_command):
    outside = sent.parent / "outside"
    (sent / "link").symlink_to(outside)
    asset = {"up": "../outside/secret.obj", "absolute": str(outside / "secret.obj"), "link": "link/secret.obj"}[way]
    file = write(sent / "graph.json", [{**NODE, "asset": asset}])
    words = ("generate", file, "-o", sent / "out", "--shapes", "boxes")
    done = echousd_command(*words)
    assert done.code == 2
    assert f"graph.json: object 'wardrobe': asset names {outside}/secret.obj, allowed: files below {sent} (" in done.err
    assert not (sent / "out").exists()
    if way == "link":
        assert echousd_command(*words, "--allow-outside", outside).code == 0
        assert list((sent / "out/assets").rglob("model.usdc"))


def test_a_room_reaches_no_further_than_its_folder(sent, echousd_command):
    shutil.copy(sent.parent / "outside/secret.obj", sent / "own.obj")
    graph = small_graph().update_node("wardrobe", asset=str(sent / "own.obj"), size=None)
    room = echousd.generate(graph, model=StandIn(), shapes="boxes")
    root = room.save(sent / "bedroom", preview=False)
    layer = sent / "bedroom/layers/graph.usda"
    assert layer.read_text().count('"../own.obj"') == 1
    layer.write_text(layer.read_text().replace('"../own.obj"', '"../../outside/secret.obj"'))
    before = {path: path.read_bytes() for path in (sent / "bedroom").rglob("*") if path.is_file()}
    wished = read_room(root).graph.update_node("wardrobe", size=(1.0, 1.9, 0.5))
    with pytest.raises(ValueError, match=r"'wardrobe': asset names .*/secret.obj, allowed: files below .*bedroom"):
        edit(root, wished, model=StandIn(), shapes="boxes")
    done = echousd_command("edit", root, "--resize", "wardrobe:1,1.9,0.5")
    assert (done.code, "secret.obj, allowed: files below" in done.err) == (2, True)
    assert {path: path.read_bytes() for path in (sent / "bedroom").rglob("*") if path.is_file()} == before
    allowed = [sent.parent / "outside"]
    assert edit(root, wished, model=StandIn(), shapes="boxes", outside=allowed).geometry["wardrobe"].original
    assert edit(root, read_room(root).graph.remove_node("lamp"), model=StandIn()).names  # nothing of it is read anew


def test_graphs_of_a_run_reach_no_further_than_their_folder(sent):
    write_obj(sent, "own", chest(1.0, 2.0, 0.5))
    for name, asset in (("a_mine", "own.obj"), ("b_theirs", "../outside/secret.obj")):
        write(sent / f"{name}.json", [{**NODE, "asset": asset}])
    for number, (outside, done) in enumerate((((), 1), ((str(sent.parent / "outside"),), 2))):
        out = sent.parent / f"run_{number}"
        found = batch(sent, out, executor=Inline(), outside=outside, **QUICK)
        assert found.done == done
        errors = [row["error"] for row in read_journals(out).values() if row["state"] == "failed"]
        assert len(errors) == 2 - done
        assert all("b_theirs.json: object 'wardrobe': asset names" in error for error in errors)
