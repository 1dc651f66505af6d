"""The store: what is put lies once and whole, damage is told, what nobody names goes; rooms that use one."""

import json
import os
import shutil
import threading
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Usd, UsdLux

from echousd.checks import check
from echousd.exporting.formats import export
from echousd.exporting.packing import Reach
from echousd.graph import load_graph
from echousd.make.edit import edit
from echousd.make.pipeline import generate
from echousd.make.reading import read_room
from echousd.options import RoomOptions
from echousd.store import MARK, Store, key_of, store_of

SAMPLES = Path(__file__).parents[2] / "samples"
BED = {"bed.usda": b"#usda 1.0\n", "bed_geo.usdc": b"1234"}


def test_equal_folders_lie_once_and_come_back(tmp_path):
    store = Store.create(tmp_path / "store")
    key = store.put(BED)
    assert store.put(dict(reversed(BED.items()))) == key
    assert list(store.keys()) == [key]
    assert store.read(key) == BED
    assert store.put({**BED, "bed_geo.usdc": b"1235"}) != key
    assert [path.name for path in (tmp_path / "store").iterdir() if path.name.startswith(".")] == []
    assert not os.access(store.folder(key) / "bed.usda", os.W_OK) or os.geteuid() == 0


@given(st.dictionaries(st.text("ab._", min_size=1, max_size=5), st.binary(max_size=9), min_size=1, max_size=4))
def test_the_key_is_of_names_and_bytes(files):
    files = {name: content for name, content in files.items() if set(name) - {"."}}
    assert key_of(files) == key_of(dict(reversed(files.items())))
    for name, content in files.items():
        assert key_of({**files, name: content + b"x"}) != key_of(files)
        assert key_of({(f"{name}c" if n == name else n): c for n, c in files.items()}) != key_of(files)


@pytest.mark.parametrize("name", ["../bed.usda", "/bed.usda", "a\\b", "C:bed", "./bed"])
def test_no_path_leads_out_of_the_store(tmp_path, name):
    with pytest.raises(ValueError, match="allowed: a relative path with forward slashes"):
        Store.create(tmp_path / "store").put({name: b""})


def test_damage_is_told_and_mended(tmp_path):
    store = Store.create(tmp_path / "store")
    key = store.put(BED)
    file = store.folder(key) / "bed_geo.usdc"
    file.chmod(0o644)
    file.write_bytes(b"4321")
    assert list(store.wrong()) == [key]
    with pytest.raises(ValueError, match="changed since it was stored"):
        store.read(key)
    file.write_bytes(b"4")  # cut short: seen when it is put again
    assert store.read(store.put(BED)) == BED
    file = store.folder(key) / "bed_geo.usdc"
    file.unlink()
    file.symlink_to(tmp_path / "elsewhere")
    assert list(store.wrong()) == [key]


def test_many_put_the_same_at_once(tmp_path):
    store, keys = Store.create(tmp_path / "store"), []
    threads = [threading.Thread(target=lambda: keys.append(store.put(BED))) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(keys) == 16
    assert len(set(keys)) == 1
    assert store.read(keys[0]) == BED


def test_what_nobody_names_goes_after_a_while(tmp_path):
    store = Store.create(tmp_path / "store")
    used, unused = store.put(BED), store.put({"a": b"b"})
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "room.usda").write_text(f"@../store/{used[:2]}/{used}/bed.usda@")
    assert store.collect([tmp_path / "room"]) == []  # put a moment ago
    assert store.collect([tmp_path / "room"], grace=0, dry=True) == [unused]
    assert store.collect([tmp_path / "room"], grace=0) == [unused]
    assert list(store.keys()) == [used]


def test_a_folder_that_is_no_store_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"holds file and no store; choose another folder"):
        Store.create(tmp_path)
    with pytest.raises(ValueError, match="is a file, a store must be a folder"):
        Store.create(tmp_path / "file")
    with pytest.raises(ValueError, match=f"no {MARK}"):
        Store.open(tmp_path)
    (tmp_path / MARK).write_text('{"echousd_store": 99}')
    with pytest.raises(ValueError, match="not a store of this version"):
        Store.open(tmp_path)


def room_of(seed):
    graph = load_graph(SAMPLES / "bedroom.yaml")
    options = RoomOptions(walls=True, dress="some")
    return generate(graph, seed=seed, shapes="boxes", drafts=1, steps=2, options=options)


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A room with a store beside it, and the same room alone."""
    top = tmp_path_factory.mktemp("shared")
    made = room_of(0)
    return made.save(top / "bed", preview=False, store=top / "store"), made.save(top / "alone" / "bed", preview=False)


def copied(shared, tmp_path):
    shutil.copytree(shared[0].parents[1], tmp_path / "top")
    return tmp_path / "top" / "bed" / "bed.usda"


def test_a_room_with_a_store_is_the_same_room(shared):
    stored, alone = shared
    assert not {path.name for path in stored.parent.iterdir()} & {"assets", "textures"}
    stages = [Usd.Stage.Open(str(root)) for root in shared]
    found = [
        [(str(p.GetPath()), p.GetAttribute("points").Get() if p.HasAttribute("points") else None) for p in s.Traverse()]
        for s in stages
    ]
    assert found[0] == found[1]
    sky = UsdLux.DomeLight(stages[0].GetPrimAtPath("/Room/Lights/sky")).GetTextureFileAttr().Get().resolvedPath
    assert Path(sky).is_relative_to((stored.parents[1] / "store").resolve())
    assert [error.rule for error in check(stored).errors] == [error.rule for error in check(alone).errors]


def test_exports_take_along_what_lies_in_the_store(shared, tmp_path):
    names = []
    for root, name in zip(shared, ("stored", "alone"), strict=True):
        export(root, tmp_path / f"{name}.usdz")
        export(root, tmp_path / f"{name}.glb")
        names.append(sorted(zipfile.ZipFile(tmp_path / f"{name}.usdz").namelist()))
    assert len(names[0]) == len(names[1]) > 5
    assert (tmp_path / "stored.glb").stat().st_size == (tmp_path / "alone.glb").stat().st_size


def test_an_edited_room_goes_on_with_its_store_or_leaves_it(shared, tmp_path):
    root = copied(shared, tmp_path)
    before = read_room(root)
    graph = before.graph.replaced(nodes=before.graph.nodes[:-1], relations=())
    changed = edit(root, graph, model=None)
    changed.save(root.parent, preview=False)
    assert json.loads((root.parent / "bed.json").read_text())["store"] == "../store"
    assert not (root.parent / "assets").exists()
    changed.save(tmp_path / "other", preview=False)
    assert read_room(tmp_path / "other" / "other.usda").carried == read_room(root).carried
    changed.save(root.parent, preview=False, store="")
    assert "store" not in json.loads((root.parent / "bed.json").read_text())
    assert (root.parent / "assets").is_dir()


def test_a_store_that_is_gone_or_foreign_is_told(shared, tmp_path):
    root = copied(shared, tmp_path)
    manifest = root.with_suffix(".json")
    told = json.loads(manifest.read_text())
    for wrong in ("/etc", "..\\store", "a\0b"):
        manifest.write_text(json.dumps({**told, "store": wrong}))
        with pytest.raises(ValueError, match="allowed: a relative path"):
            read_room(root)
    manifest.write_text(json.dumps({**told, "stored": {"assets/bed": "../../.."}}))
    with pytest.raises(ValueError, match=r"stored\.assets/bed is"):
        read_room(root)
    manifest.write_text(json.dumps(told))
    shutil.rmtree(tmp_path / "top" / "store")
    with pytest.raises(ValueError, match=f"no {MARK}|does not compose"):
        read_room(root)


def test_reach_ends_at_what_a_key_names(shared, tmp_path):
    root = copied(shared, tmp_path)
    reach = Reach.of(Usd.Stage.Open(str(root)))
    store = Store.open(tmp_path / "top" / "store")
    key = next(store.keys())
    file = next(store.folder(key).iterdir())
    assert reach.holds(str(file))
    assert store_of(file) == Store(store.root.resolve())
    secret = tmp_path / "secret.png"
    secret.write_bytes(b"")
    link = store.folder(key) / "link.png"
    link.symlink_to(secret)
    assert not reach.holds(str(link))
    assert not reach.holds(str(store.root / MARK))
    plain = tmp_path / key[:2] / key / "file.png"
    plain.parent.mkdir(parents=True)
    plain.write_bytes(b"")
    assert not reach.holds(str(plain))  # no mark there


def test_commands_of_the_store(echousd_command, shared, tmp_path):
    root = copied(shared, tmp_path)
    store = tmp_path / "top" / "store"
    unused = Store.open(store).put(BED)
    assert echousd_command("store", "verify", store).out.startswith("ok ")
    assert echousd_command("store", "gc", store, "--older", 0, "--dry-run").out.startswith("unused   1 of ")
    assert echousd_command("store", "gc", store, "--older", 0).out.startswith("removed  1 of ")
    assert not Store.open(store).folder(unused).exists()
    assert check(root).errors == ()
    key = next(Store.open(store).keys())
    file = next(Store.open(store).folder(key).iterdir())
    file.chmod(0o644)
    file.write_bytes(b"")
    found = echousd_command("store", "verify", store)
    assert (found.code, found.out.split()[0]) == (1, "changed")
    found = echousd_command("store", "gc", store, tmp_path / "nowhere")
    assert (found.code, "no such folder; allowed: folders with the rooms" in found.err) == (2, True)
