"""Runs in one process: rooms that are complete stay, what fails is told, what another run does is respected."""

import json
import shutil
import tarfile
from pathlib import Path

import numpy as np
import pytest
from inline_batches import QUICK, Inline, batch, digests, small
from pxr import Usd, UsdGeom

from echousd.batches import batch as front
from echousd.batches import batch as running
from echousd.batches import work
from echousd.batches.batch import generate_many
from echousd.batches.plan import load_plan, read_journals, room_digest, shard_folder
from echousd.batches.sources import find_graphs, sampled_graph
from echousd.batches.verify import finish, manifest_rows, summary, verify, write_sheet, write_webdataset
from echousd.folder.lock import locked
from echousd.graph import SceneGraph
from echousd.make import layouts
from echousd.store import Store

SAMPLES = Path(__file__).parents[3] / "samples"


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """An undisturbed run: two good graphs and a poisonous one."""
    folder = tmp_path_factory.mktemp("batch")
    source = small(folder)
    result = batch(source, folder / "run", executor=Inline(), workers=1, **QUICK)
    return source, folder / "run", result


def test_a_poisonous_graph_is_recorded_and_the_others_are_made(calm):
    source, folder, result = calm
    assert (result.rooms, result.done, result.failed, result.complete) == (3, 2, 1, False)
    failed = [row for row in read_journals(folder).values() if row["state"] == "failed"]
    assert len(failed) == 1
    assert f"{source}:2" in failed[0]["error"]
    assert next((room[-6:], problem[:7]) for room, problem in verify(folder)) == ("000001", "failed:")


def test_manifest_sheet_and_index_hold_every_room(calm):
    _, folder, _ = calm
    found = finish(folder)
    rows = [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]
    assert [row["state"] for row in rows] == ["done", "failed", "done"]
    assert rows[0]["categories"] == {"double_bed": 1, "wardrobe": 1}
    assert (folder / rows[0]["root"]).is_file()
    assert rows[0]["sha256"] == room_digest((folder / rows[0]["root"]).parent)
    assert (found["done"], found["failed"]) == (2, 1)
    rows = summary(manifest_rows(load_plan(folder), folder))
    assert (rows["done"], rows["failed"]) == (2, 1)
    page = (folder / "index.html").read_text()
    assert page.index("graphs_000001") < page.index("graphs_000000")  # broken first
    assert "http" not in page
    stage = Usd.Stage.Open(str(folder / "index.usda"), Usd.Stage.LoadNone)
    assert len(stage.GetPrimAtPath("/Rooms").GetAllChildren()) == 2
    stage.Load()
    assert stage.GetPrimAtPath("/Rooms/graphs_000000/Objects").IsValid()


def test_the_index_has_rooms_upright_and_apart_whatever_their_unit_and_axis(tmp_path):
    bed = "{category: double_bed, size: [1.6, 0.9, 2], position: [0, 0, 0], yaw: 0}"
    (tmp_path / "bed.yaml").write_text(f"room: {{type: bedroom, size: [4, 5]}}\nobjects: {{bed: {bed}}}\n")
    varied = {"up_axis": ["Z", "Y"], "meters_per_unit": [0.01, 1.0]}
    folder = tmp_path / "run"
    batch(tmp_path / "bed.yaml", folder, executor=Inline(), workers=1, count=4, variations=varied, **QUICK)
    finish(folder)
    stage = Usd.Stage.Open(str(folder / "index.usda"))
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 0.01)
    cache = UsdGeom.BBoxCache(0, ["default"])
    beds = [
        cache.ComputeWorldBound(stage.GetPrimAtPath(f"{room.GetPath()}/Objects/bed")).ComputeAlignedRange()
        for room in stage.GetPrimAtPath("/Rooms").GetChildren()
    ]
    sizes = np.array([bed.GetSize() for bed in beds])
    assert len(beds) == 4
    np.testing.assert_allclose(sizes, [(160, 200, 90)] * 4, atol=0.1)
    assert all(bed.GetMin()[2] == pytest.approx(0, abs=0.01) for bed in beds)
    middles = np.array([bed.GetMidpoint() for bed in beds])[:, :2]
    apart = np.linalg.norm(middles[:, None] - middles[None], axis=-1)
    assert apart[~np.eye(4, dtype=bool)].min() > 400


def test_the_sheet_says_why_a_room_fails_the_check(calm, tmp_path):
    _, folder, _ = calm
    rows = list(manifest_rows(load_plan(folder), folder))
    assert [row["check_errors"] for row in rows if row["check"]] == [[]] * sum(row["check"] for row in rows)
    wrong = {**rows[0], "check": False, "check_errors": ["lamp is floating"], "collisions": 1}
    page = write_sheet(tmp_path, [*rows[2:], wrong], "a night").read_text()
    assert '<p class="fault">collisions: 1</p>' in page
    assert '<p class="fault">fails echousd check</p><p class="fault">lamp is floating</p>' in page


def test_a_run_that_was_ended_is_gone_on_with_to_the_same_bytes(calm, tmp_path):
    source, folder, _ = calm
    out = tmp_path / "run"
    with pytest.raises(KeyboardInterrupt):
        batch(source, out, executor=Inline(), workers=1, progress=_interrupt, **QUICK)
    assert len(digests(out)) < 2
    executor = Inline({"graphs_000002": ["died", "died"]})
    result = batch(source, out, executor=executor, workers=1, resume=True, **QUICK)
    assert (result.done, result.failed) == (2, 1)
    assert digests(out) == digests(folder)
    again = Inline()
    batch(source, out, executor=again, workers=1, resume=True, **QUICK)
    assert again.calls == []


def test_rooms_that_want_further_drafts_are_the_same_whatever_was_ended(tmp_path, monkeypatch):
    things = ("stool", "desk", "plant", "wardrobe", "double_bed")
    graphs = [
        SceneGraph.from_json(
            json.dumps({"room": {"type": "bedroom"}, "nodes": [{"name": n, "category": n} for n in some]})
        )
        for some in (things[:1], things[:2], things[1:3], things[2:], things[3:])
    ]
    source = tmp_path / "graphs.jsonl"
    source.write_text("".join(json.dumps(json.loads(graph.to_json())) + "\n" for graph in graphs))
    # one room is pleased with anything, one with the third draft, one with nothing
    limit = {1: 9.0, 2: 0.3, 3: -9.0}
    monkeypatch.setattr(
        "echousd.make.layouts._wishes",
        lambda graph, found, *_: (max(float(found[0].position[0, 0]) - limit[len(graph.nodes)], 0.0),),
    )
    further = []
    sample = layouts.LayoutSearch.sampled

    def noted(self, graph, number, count=1):
        further.append((len(graph.nodes), count))
        return sample(self, graph, number, count)

    monkeypatch.setattr(layouts.LayoutSearch, "sampled", noted)
    options, out = {**QUICK, "drafts": 5}, tmp_path / "run"
    batch(source, tmp_path / "calm", executor=Inline(), workers=1, **options)
    assert [row.get("error", "") for row in read_journals(tmp_path / "calm").values()] == [""] * 5
    assert [count for nodes, count in further if nodes == 1] == [1]
    assert {count for nodes, count in further if nodes == 3} == {1, 2}
    for resume in (False, True, True):
        with pytest.raises(KeyboardInterrupt):
            batch(source, out, executor=Inline(), workers=1, resume=resume, progress=_stop_when_done(), **options)
    assert batch(source, out, executor=Inline(), workers=1, resume=True, **options).complete
    assert digests(out) == digests(tmp_path / "calm")
    for room, place in zip(generate_many(graphs, **options), sorted((out / "rooms").glob("*/*")), strict=True):
        told = json.loads((place / f"{place.name}.json").read_text())
        assert json.loads(room.graph.to_json()) == told["graph"]


def _stop_when_done():
    """Ends a run after the first room that it makes."""

    def tell(progress):
        if progress.made:
            raise KeyboardInterrupt

    return tell


def _interrupt(progress):
    raise KeyboardInterrupt


def test_a_damaged_room_is_made_again_and_set_aside(calm, tmp_path):
    source, folder, _ = calm
    out = tmp_path / "run"
    shutil.copytree(folder, out)
    (out / "rooms" / "0000" / "graphs_000000" / "layers" / "graph.usdc").write_text("#usda 1.0\n")
    assert "graphs_000000: changed since it was made" in [f"{room}: {problem}" for room, problem in verify(out)]
    with pytest.warns(
        UserWarning, match=r"graphs_000000: changed since it was made; kept as .*set_aside.graphs_000000_"
    ):
        batch(source, out, executor=Inline(), workers=1, resume=True, **QUICK)
    assert digests(out) == digests(folder)
    assert len(list((out / ".batch" / "set_aside").iterdir())) == 1


def test_tars_for_training_hold_preview_and_json_of_every_room(calm, tmp_path):
    _, folder, _ = calm
    out = tmp_path / "run"
    shutil.copytree(folder, out)
    (out / "rooms" / "0000" / "graphs_000000" / "graphs_000000.png").write_bytes(b"picture")
    finish(out, webdataset=True)
    rows = list(manifest_rows(load_plan(out), out))
    first = (out / "webdataset" / "rooms-000000.tar").read_bytes()
    with tarfile.open(out / "webdataset" / "rooms-000000.tar") as tar:
        assert tar.getnames() == ["graphs_000000.json", "graphs_000000.png", "graphs_000002.json"]
        told = json.loads(tar.extractfile("graphs_000000.json").read())
        assert tar.extractfile("graphs_000000.png").read() == b"picture"
    assert told["room"]["graph"]["nodes"][0]["name"] == "double_bed"
    assert told["categories"] == {"double_bed": 1, "wardrobe": 1}
    assert len(write_webdataset(out, rows, rooms=1)) == 2
    assert len(write_webdataset(out, rows)) == 1 == len(list((out / "webdataset").iterdir()))
    assert (out / "webdataset" / "rooms-000000.tar").read_bytes() == first


def test_palettes_openings_and_dressing_vary(tmp_path):
    graph = sampled_graph("bedroom", 0, 0, 1.5)
    nodes = tuple(node for node in graph.nodes if node.category == "double_bed")
    assert graph.room.openings
    (tmp_path / "graph.json").write_text(graph.replaced(nodes=nodes, relations=()).to_json())
    varied = {"palette": ["coast", "clay"], "openings": ["kept", "drawn"]}
    walled = {**QUICK, "walls": True}
    batch(tmp_path / "graph.json", tmp_path / "run", count=4, executor=Inline(), variations=varied, **walled)
    found = [json.loads(p.read_text()) for p in sorted((tmp_path / "run" / "rooms").glob("*/*/*.json"))]
    assert [room["palette"] for room in found] == ["coast", "coast", "clay", "clay"]
    openings = [room["graph"]["room"]["openings"] for room in found]
    assert openings[0] == openings[2] == json.loads(graph.to_json())["room"]["openings"]
    assert openings[0] not in (openings[1], openings[3])
    root = next((tmp_path / "run" / "rooms").glob("*/graph_000002/graph_000002.usda"))
    stage = Usd.Stage.Open(str(root))
    assert stage.GetPrimAtPath("/Room").GetVariantSet("palette").GetVariantSelection() == "clay"
    with pytest.raises(ValueError, match="palette is 'mud', allowed: "):
        batch(tmp_path / "graph.json", tmp_path / "other", palette="mud", **QUICK)


def test_graphs_come_from_parquet(calm, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    pyarrow = pytest.importorskip("pyarrow")
    source, _, _ = calm
    texts = [line for line in source.read_text().splitlines() if line.endswith("}")]
    parquet.write_table(pyarrow.table({"graph": texts}), tmp_path / "graphs.parquet")
    found = list(find_graphs([str(tmp_path / "graphs.parquet")]))
    assert [entry.error for entry in found] == ["", ""]
    assert [entry.text for entry in found] == [entry.text for entry in find_graphs([str(source)]) if entry.text]


def test_a_damaged_asset_of_the_store_is_told_and_made_again(calm, tmp_path, echousd_command):
    source, folder, _ = calm
    out = tmp_path / "run"
    shutil.copytree(folder, out)
    store = Store.open(out / "store")
    manifest = json.loads((out / "rooms" / "0000" / "graphs_000000" / "graphs_000000.json").read_text())
    place = store.folder(manifest["stored"]["assets/double_bed"])
    file = place / "double_bed_geo.usdc"
    file.chmod(0o644)
    file.write_bytes(b"no crate")
    told = [f"{room}: {problem}" for room, problem in verify(out)]
    assert "graphs_000000: 1 of its assets are missing in the store or changed" in told
    for words, count in ((("batch", "verify", out), "wrong"), (("store", "verify", out / "store"), "changed")):
        done = echousd_command(*words, "--json")
        assert done.code == 1
        assert json.loads(done.out)["ok"] is False
        assert json.loads(done.out)[count]
    batch(source, out, executor=Inline(), workers=1, resume=True, **QUICK)
    assert [problem[:7] for _, problem in verify(out)] == ["failed:"]
    assert digests(out) == digests(folder)
    shutil.rmtree(place)
    assert len(list(verify(out))) == 2


def test_rooms_that_travel_alone_have_all_in_their_folders(calm, tmp_path):
    source, folder, _ = calm
    batch(source, tmp_path / "run", executor=Inline(), workers=1, self_contained=True, **QUICK)
    assert not (tmp_path / "run" / "store").exists()
    rooms = sorted((tmp_path / "run" / "rooms").glob("*/*"))
    assert all((room / "assets").is_dir() for room in rooms)
    assert [problem[:7] for _, problem in verify(tmp_path / "run")] == ["failed:"]
    assert not list((folder / "rooms").glob("*/*/assets"))


def test_a_room_that_kills_every_worker_is_given_up(calm, tmp_path):
    source, _, _ = calm
    executor = Inline({"graphs_000000": ["died"] * 9, "graphs_000002": ["limit"]})
    result = batch(source, tmp_path / "run", executor=executor, workers=1, **QUICK)
    assert (result.done, result.failed) == (0, 3)
    assert executor.calls.count("graphs_000000") == running.TRIES
    assert executor.calls.count("graphs_000002") == 1


def test_max_failures_stops_the_run(calm, tmp_path):
    source, _, _ = calm
    result = batch(source, tmp_path / "run", executor=Inline(), workers=1, max_failures=0, **QUICK)
    assert result.stopped == "1 rooms failed, allowed: 0"


def test_a_full_disk_stops_the_run(calm, tmp_path, monkeypatch):
    source, folder, _ = calm
    out = tmp_path / "run"

    def full(job):
        raise ValueError(f"{job.folder}: cannot be written (No space left on device); nothing was changed")

    with monkeypatch.context() as patch:
        patch.setattr(work, "room", full)
        result = batch(source, out, executor=Inline(), workers=1, **QUICK)
    assert "no space left on device; make room and go on with --resume" in result.stopped
    assert batch(source, out, executor=Inline(), workers=1, resume=True, **QUICK).done == 2
    assert digests(out) == digests(folder)


def test_a_run_whose_folder_is_moved_stops_and_goes_on_there(calm, tmp_path):
    source, folder, _ = calm
    out, moved = tmp_path / "run", tmp_path / "moved"

    def move(progress):
        if out.is_dir() and not moved.exists():
            out.rename(moved)

    with pytest.raises(ValueError, match=r"run: was moved or removed meanwhile; go on with --resume where it is"):
        batch(source, out, executor=Inline(), workers=1, progress=move, **QUICK)
    assert not (out / "rooms").exists()
    assert batch(source, moved, executor=Inline(), workers=1, resume=True, **QUICK).done == 2
    assert digests(moved) == digests(folder)


def test_another_plan_and_another_run_are_refused(calm, tmp_path):
    source, folder, _ = calm
    with pytest.raises(ValueError, match=r"another plan \(seed was 0, now 4\)"):
        batch(source, folder, executor=Inline(), resume=True, seed=4, **QUICK)
    with pytest.raises(ValueError, match=r"holds a run of 3 rooms; go on with it \(--resume\)"):
        batch(source, folder, executor=Inline(), **QUICK)
    with locked(shard_folder(folder, (0, 1))):
        import threading

        said = []
        thread = threading.Thread(target=lambda: said.append(_refusal(source, folder)))
        thread.start()
        thread.join()
    assert "is writing it" in said[0]
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(ValueError, match=r"holds graphs.jsonl|holds mine\.txt and no run of echousd batch"):
        batch(source, tmp_path, executor=Inline(), **QUICK)


def _refusal(source, folder):
    try:
        batch(source, folder, executor=Inline(), resume=True, **QUICK)
    except ValueError as error:
        return str(error)
    return ""


def test_shards_make_the_same_rooms_together(calm, tmp_path):
    source, folder, _ = calm
    out = tmp_path / "run"
    for i in range(2):
        batch(source, out, executor=Inline(), workers=1, shard=(i, 2), **QUICK)
    assert digests(out) == digests(folder)
    with pytest.raises(ValueError, match="shard is 2/2, allowed: i/n"):
        batch(source, out, executor=Inline(), shard=(2, 2), **QUICK)


def test_generate_many_makes_the_same_rooms(calm, tmp_path):
    source, folder, _ = calm
    graphs = [SceneGraph.from_json(source.read_text().splitlines()[k]) for k in (0, 2)]
    (tmp_path / "second.json").write_text(graphs[1].to_json())
    graphs[1] = tmp_path / "second.json"
    rooms = list(generate_many(graphs, **QUICK))
    for room, name in zip(rooms, ("graphs_000000", "graphs_000002"), strict=True):
        place = tmp_path / "rooms" / "0000" / name
        room.save(place, preview=False, store=tmp_path / "store")
        assert room_digest(place) == room_digest(folder / "rooms" / "0000" / name)


def test_weights_are_known_by_their_bytes(tmp_path):
    for name in ("one", "same", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "weights.safetensors").write_bytes(b"changed" if name == "other" else b"bytes")
    one, same, other = (front.weights_hash(str(tmp_path / name)) for name in ("one", "same", "other"))
    assert one == same != other
    (tmp_path / "none").mkdir()
    with pytest.raises(ValueError, match="no weights there"):
        front.weights_hash(str(tmp_path / "none"))
