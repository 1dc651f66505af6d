"""The process dies at every operation on the disk: readers meet the old, the new or a line; the rerun makes the new."""

import itertools
import json
import os
import shutil
import warnings

import numpy as np
import pytest
import trimesh
from dying_process import dying
from inline_batches import QUICK, Inline, batch
from painter import paint
from plain_rooms import plain_files, plain_room
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.files import sweep
from echousd.assets.index import index
from echousd.assets.table import read_library
from echousd.batches.verify import finish
from echousd.folder import history
from echousd.folder.journal import DONE
from echousd.folder.manifest import find_manifest
from echousd.pending import STAGING
from echousd.stage.files import open_stage
from echousd.texturing import attach
from echousd.texturing import export_texture_job as export_job
from echousd.texturing import import_texture_job as import_job

OLD, NEW = ["bed", "lamp"], ["bed", "desk"]


def content(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def at_every_operation(folder, begin, act, read, *, ended=lambda: False):
    """Let `act` die everywhere from the state that `begin` makes in a folder; how often a reader was told.

    `read` looks at the folder, raises ValueError for what is half-written, and returns what it saw, file by file where
    each stands for itself; `ended` says whether all was done, so that `act` again would be another step.
    """

    def anew():
        shutil.rmtree(folder, ignore_errors=True)
        begin()
        sweep.cache_clear()

    anew()
    old = read()
    act()
    new, files = read(), content(folder)
    assert new != old
    told = 0
    for moment in itertools.count():
        anew()
        with dying(moment) as state:
            act()
        if not state.died:
            assert moment > 3
            return told
        try:
            found = read()
            if isinstance(found, tuple):
                assert all(part in pair for part, *pair in zip(found, old, new, strict=True)), moment
            else:
                assert found in (old, new), moment
        except ValueError as error:
            if "half-written, by a run that was interrupted" not in str(error):
                raise
            told += 1
        else:
            if found == new and ended():
                continue
        act()
        assert read() == new, moment
        # what a store was about to take in is left to its `gc`
        assert {path: c for path, c in content(folder).items() if "/.new_" not in path} == files, moment


def seen(folder):
    """What a reader sees of a room."""
    stage = open_stage(folder / "bedroom.usda")
    manifest = find_manifest(folder, "bedroom")
    layers = sorted(layer.ExportToString() for layer in stage.GetUsedLayers() if not layer.anonymous)
    for layer in stage.GetUsedLayers():
        layer.Reload()
    return manifest["files"], layers


@pytest.fixture
def quiet():
    with warnings.catch_warnings(), plain_files():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("store", [False, True], ids=["alone", "store"])
@pytest.mark.parametrize("run", ["generate", "edit", "undo", "redo"])
def test_rooms(tmp_path, quiet, run, store):
    top = tmp_path / "top"
    folder, shared = top / "bedroom", top / "store" if store else ""
    root = folder / "bedroom.usda"
    rooms = []

    def begin():
        plain_room(OLD, 0).save(folder, preview=False, store=shared)
        if run in ("undo", "redo"):
            plain_room(NEW, 0, root).save(folder, preview=False)
        if run == "redo":
            history.undo(root)
        rooms[:] = [plain_room(NEW, 1 if run == "generate" else 0, root if run == "edit" else None)]

    acts = {"undo": lambda: history.undo(root), "redo": lambda: history.redo(root)}
    told = at_every_operation(
        top, begin, acts.get(run, lambda: rooms[0].save(folder, preview=False)), lambda: [seen(folder)],
        ended=lambda: run in acts and not (folder / STAGING / DONE).exists(),
    )  # fmt: skip
    assert told > 3


def test_import_of_a_look(tmp_path, monkeypatch):
    graph = small_graph()
    for name in ("nightstand_left", "nightstand_right", "bed", "pendant", "wardrobe"):
        graph = graph.remove_node(name)
    made = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, **BARE)
    root = made.save(tmp_path / "made/bedroom", preview=False)
    export_job(root, tmp_path / "job", "generic", resolution=64)
    paint(tmp_path / "job")
    kept = {}

    def once(name, real):  # what it computes is the same at every moment
        def call(*args, **options):
            if name not in kept:
                kept[name] = real(*args, **options)
            return dict(kept[name]) if isinstance(kept[name], dict) else kept[name]

        return call

    for name in ("read_surfaces", "read_results", "look_files"):
        monkeypatch.setattr(attach, name, once(name, getattr(attach, name)))
    folder = tmp_path / "top/bedroom"

    def act():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import_job(folder / root.name, tmp_path / "job", name="oil", preview=False)

    def begin():
        shutil.copytree(root.parent, folder)

    def ended():
        return not (folder / STAGING / DONE).exists()

    assert at_every_operation(tmp_path / "top", begin, act, lambda: [seen(folder)], ended=ended) > 3


def test_index_of_a_library(tmp_path):
    library, folder = tmp_path / "library", tmp_path / "top"
    library.mkdir()
    trimesh.creation.box((0.5, 0.5, 0.5)).export(library / "stool.obj")
    file = folder / "index.parquet"

    def begin():
        folder.mkdir()
        (library / "chair.obj").unlink(missing_ok=True)
        index([library], file)
        trimesh.creation.box(np.ones(3)).export(library / "chair.obj")
        os.utime(library / "chair.obj", (1, 1))  # the index tells

    def read():
        return [sorted(read_library(file).records)]

    at_every_operation(folder, begin, lambda: index([library], file), read)


def test_end_of_a_batch(tmp_path):
    nodes = [{"name": "desk", "category": "desk"}]
    (tmp_path / "graphs.jsonl").write_text(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes}) + "\n")
    assert batch(tmp_path / "graphs.jsonl", tmp_path / "made", executor=Inline(), **QUICK).complete
    folder = tmp_path / "top"

    finish(shutil.copytree(tmp_path / "made", folder))
    names = sorted({path.name for path in folder.iterdir()} - {path.name for path in (tmp_path / "made").iterdir()})
    assert {"manifest.jsonl", "summary.json"} < set(names)

    def read():
        return tuple(place.read_bytes() if place.is_file() else b"" for place in (folder / name for name in names))

    at_every_operation(folder, lambda: shutil.copytree(tmp_path / "made", folder), lambda: finish(folder), read)
