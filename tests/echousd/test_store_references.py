"""`store gc` leaves what may be opened or put back: every kind of reference, in every kind of file."""

import io
import shutil
import warnings
import zipfile
from contextlib import nullcontext

import pytest
from pxr import Sdf, Usd

import echousd
from echousd.folder import folder as folders
from echousd.folder import history
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.stage.files import open_stage
from echousd.store import NESTED, Store, keys_named


def sublayer(layer, path):
    layer.subLayerPaths = [path]


def reference(layer, path):
    Sdf.CreatePrimInLayer(layer, "/A").referenceList.prependedItems = [Sdf.Reference(path)]


def payload(layer, path):
    Sdf.CreatePrimInLayer(layer, "/A").payloadList.prependedItems = [Sdf.Payload(path)]


def in_variant(layer, path):
    stage = Usd.Stage.CreateInMemory()
    variants = stage.DefinePrim("/A").GetVariantSets().AddVariantSet("looks")
    variants.AddVariant("painted")
    variants.SetVariantSelection("painted")
    with variants.GetVariantEditContext():
        stage.GetPrimAtPath("/A").CreateAttribute("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(path))
    layer.TransferContent(stage.GetRootLayer())


def inactive(layer, path):
    reference(layer, path)
    layer.GetPrimAtPath("/A").active = False


def attribute(layer, path, kind=Sdf.ValueTypeNames.Asset, value=None, time=None):
    prim = Sdf.CreatePrimInLayer(layer, "/A")
    spec = Sdf.AttributeSpec(prim, "file", kind)
    if time is None:
        spec.default = value or Sdf.AssetPath(path)
    else:
        layer.SetTimeSample(spec.path, time, Sdf.AssetPath(path))


def sampled(layer, path):
    attribute(layer, path, time=1.0)


def listed(layer, path):
    attribute(layer, path, Sdf.ValueTypeNames.AssetArray, Sdf.AssetPathArray([Sdf.AssetPath(path)]))


def clip(layer, path):
    clips = {"default": {"assetPaths": Sdf.AssetPathArray([Sdf.AssetPath(path)]), "primPath": "/A"}}
    Sdf.CreatePrimInLayer(layer, "/A").SetInfo("clips", clips)


def metadata(layer, path):
    Sdf.CreatePrimInLayer(layer, "/A").customData = {"made_of": Sdf.AssetPath(path)}


def layer_data(layer, path):
    layer.customLayerData = {"made_of": Sdf.AssetPath(path)}


KINDS = (sublayer, reference, payload, in_variant, inactive, attribute, sampled, listed, clip, metadata, layer_data)


@pytest.fixture
def stored(tmp_path):
    """A store with one folder, and the path of a file in it from a folder beside."""
    store = Store.create(tmp_path / "store")
    key = store.put({"bed.usda": b"#usda 1.0\n"})
    (tmp_path / "room").mkdir()
    return store, key, f"../store/{key[:2]}/{key}/bed.usda"


def named(store, key, folder):
    """Whether gc leaves the key; it must take it once the folder is gone."""
    left = store.collect([folder], grace=0, dry=True) == []
    shutil.rmtree(folder)
    folder.mkdir()
    assert store.collect([folder], grace=0, dry=True) == [key]
    return left


@pytest.mark.parametrize(
    "place", ["a.usda", "a.usdc", "a.usd", "layers/a.usdc", "history/1.zip", ".redo/1.zip", "p.usdz"]
)
@pytest.mark.parametrize("refer", KINDS)
def test_every_reference_in_every_layer_holds(stored, tmp_path, refer, place):
    store, key, path = stored
    target = tmp_path / "room" / place
    target.parent.mkdir(exist_ok=True)
    packed = target.suffix in (".zip", ".usdz")
    for ending in (".usda", ".usdc") if packed else (target.suffix,):
        file = tmp_path / "room" / f"made{ending}" if packed else target
        layer = Sdf.Layer.CreateNew(str(file))
        refer(layer, path)
        layer.Save()
        del layer
        if packed:
            content = file.read_bytes()
            file.unlink()
            with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED if place.endswith(".zip") else 0) as archive:
                archive.writestr(f"layers/inner{ending}", content)
            assert keys_named([tmp_path / "room"]) == {key}
    assert named(store, key, tmp_path / "room")


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ("room.json", '{{"stored": {{"originals/bed": "{key}"}}}}'),  # what lies in the store refers to it, nobody else
        ("graph.yaml", "asset: {path}"),
        ("wood.mtlx", '<input value="{path}"/>'),
        ("deep/er/room.json", '["{key}"]'),
        (".echousd/7", '{{"stored": {{"assets/bed": "{key}"}}}}'),  # a manifest that a run has not moved yet
    ],
)
def test_every_text_holds(stored, tmp_path, place, text):
    store, key, path = stored
    (tmp_path / "room" / place).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "room" / place).write_text(text.format(key=key, path=path))
    assert named(store, key, tmp_path / "room")


def test_rooms_behind_links_hold(stored, tmp_path):
    store, key, _ = stored
    (tmp_path / "elsewhere/room").mkdir(parents=True)
    (tmp_path / "elsewhere/room/room.json").write_text(key)
    (tmp_path / "room/linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere/back").symlink_to(tmp_path / "room")  # a circle ends
    assert store.collect([tmp_path / "room"], grace=0) == []


def test_a_folder_that_cannot_be_read_ends_it(stored, tmp_path, monkeypatch, echousd_command):
    import os

    store, key, _ = stored
    real = os.scandir

    def refused(place):
        if str(place).endswith("closed"):
            raise PermissionError(13, "Permission denied", str(place))
        return real(place)

    (tmp_path / "room/closed").mkdir()
    monkeypatch.setattr(os, "scandir", refused)
    done = echousd_command("store", "gc", store.root, tmp_path / "room", "--older", 0)
    assert (done.code, done.err) == (2, f"error: {tmp_path / 'room/closed'}: Permission denied\n")
    assert list(store.keys()) == [key]


def test_a_damaged_archive_or_layer_names_nothing(stored, tmp_path):
    store, key, _ = stored
    for place, content in (("1.zip", b"PK\3\4..."), ("a.usdc", b"PXR-USDC..."), ("b.usd", b"\xff\xfe")):
        (tmp_path / "room" / place).write_bytes(content)
    assert store.collect([tmp_path / "room"], grace=0) == [key]


def nested(depth, content):
    """A zip of a zip of ... of a layer."""
    name = "a.usda"
    for _ in range(depth):
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w") as archive:
            archive.writestr(name, content)
        name, content = "a.zip", held.getvalue()
    return content


def test_archives_hold_archives_to_a_depth_and_nothing_is_taken_beyond(stored, tmp_path, echousd_command):
    store, key, path = stored
    target = tmp_path / "room/1.zip"
    target.write_bytes(nested(NESTED, path.encode()))
    assert keys_named([tmp_path / "room"]) == {key}
    for depth in (NESTED + 1, 60):
        target.write_bytes(nested(depth, path.encode()))
        done = echousd_command("store", "gc", store.root, tmp_path / "room", "--older", 0)
        found = f"archives within archives, more than {NESTED} deep, which may name any asset; move it away"
        assert (done.code, done.err) == (2, f"error: {target}: {found}\n")
        assert list(store.keys()) == [key]


@pytest.mark.parametrize(
    ("first", "name", "content", "fits"),
    [
        (400, "b.usda", b"-" * 400, True),
        (600, "b.usda", b"-" * 600, False),
        (300, "b.zip", nested(1, b"-" * 200), True),
        (300, "b.zip", nested(1, b"-" * 320), False),  # 740 bytes and the 320 in the inner one
        (300, "b.png", b"-" * 5000, True),  # is not unpacked
    ],
)
def test_all_that_an_archive_unpacks_to_is_bounded(tmp_path, monkeypatch, first, name, content, fits):
    target = tmp_path / "1.zip"
    monkeypatch.setattr("echousd.store.LARGEST", 1000)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.usda", "-" * first)
        archive.writestr(name, content)
    with nullcontext() if fits else pytest.raises(ValueError, match=r"1\.zip: unpacks to more than 1000 bytes, which"):
        assert keys_named([tmp_path]) == set()


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_archive_damaged_anywhere_names_nothing_or_ends_it(tmp_path, method):
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", method) as archive:
        archive.writestr("a.usda", "-" * 50)
    content, target = whole.getvalue(), tmp_path / "1.zip"
    for place in range(len(content)):
        target.write_bytes(content[:place] + bytes([content[place] ^ 0xFF]) + content[place + 1 :])
        try:
            assert keys_named([tmp_path]) == set()
        except ValueError as error:
            said = str(error)
            assert said.startswith(f"{target}: cannot be read (")
            assert said.endswith("), which may name any asset; move it away")


def test_a_layer_in_an_archive_is_not_the_file_of_its_name(stored, tmp_path, monkeypatch):
    """The room's own folder, where layers of an earlier state have the names of those of today."""
    _, key, path = stored
    monkeypatch.chdir(tmp_path / "room")
    for content in (path, "./other.usda"):
        layer = Sdf.Layer.CreateNew("layout.usdc") if content == path else Sdf.Layer.FindOrOpen("layout.usdc")
        layer.subLayerPaths = [content]
        layer.Save()
        if content == path:
            with zipfile.ZipFile("1.zip", "w") as archive:
                archive.write("layout.usdc")
    assert keys_named([tmp_path / "room"]) == {key}


def two(*more):
    nodes = [Node("bed", "double_bed"), Node("lamp", "floor_lamp"), *more]
    places = {node.name: (1.5 * i - 1.5, 0.0, 0.0) for i, node in enumerate(nodes)}
    nodes = [node.replaced(size=(0.5, 0.5, 0.5), position=places[node.name], yaw=0.0) for node in nodes]
    return SceneGraph(room=RoomSpec("bedroom", size=(6.0, 4.0)), nodes=tuple(nodes))


@pytest.mark.parametrize("crate", [False, True])
def test_all_states_of_a_room_open_after_gc(tmp_path, crate, echousd_command):
    store = tmp_path / "store"
    options = echousd.RoomOptions(crate=crate, walls=False, dress="none")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = echousd.generate(two(), model=None, shapes="boxes", drafts=1, steps=2, place=False, options=options)
        root = made.save(tmp_path / "room", preview=False, store=store)
        states = [read_room(root).graph.names]
        for graph in (two(Node("chair", "chair")), two().remove_node("lamp")):
            edit(root, graph, shapes="boxes", drafts=1, steps=2, place=False).save(root.parent, preview=False)
            states.append(read_room(root).graph.names)
    unused = Store.open(store).put({"nobody": b""})

    def collected():
        return echousd_command("store", "gc", store, "--older", 0).out

    assert collected().startswith("removed  1 of ")
    assert not Store.open(store).folder(unused).exists()
    for step, seen in ((history.undo, states[1::-1]), (history.redo, states[1:]), (history.undo, states[1::-1])):
        for names in seen:
            step(root)
            assert collected().startswith("removed  0 of ")
            assert read_room(root).graph.names == names
            assert open_stage(root)


def test_what_an_interrupted_run_has_not_moved_yet_holds(tmp_path, monkeypatch, echousd_command):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = echousd.generate(two(), shapes="boxes", drafts=1, steps=2, place=False, walls=False, dress="none")
        root = made.save(tmp_path / "room", preview=False, store=tmp_path / "store")
        bigger = edit(root, two(Node("chair", "chair")), shapes="boxes", drafts=1, steps=2, place=False)
        with monkeypatch.context() as patch:
            patch.setattr(folders, "finish", lambda *_: None)
            bigger.save(root.parent, preview=False)
        assert echousd_command("store", "gc", tmp_path / "store", "--older", 0).out.startswith("removed  0 of ")
        assert read_room(root).graph.names == ("bed", "lamp", "chair")
