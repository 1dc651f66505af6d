"""An artist's work in a room's folder is kept, or backed up under a free name, and named in a warning."""

import json
import re
import shutil
import warnings

import pytest
from plain_rooms import plain_files, plain_room
from pxr import Sdf, Usd
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.folder.folder import recover, write_together
from echousd.folder.manifest import MAX_SEED, find_manifest
from echousd.folder.merging import merged_root
from echousd.make.edit import edit
from echousd.make.save import write_preview
from echousd.pending import STAGING

MINE = '#usda 1.0\n(\n    defaultPrim = "fern"\n)\ndef Sphere "fern" {}\n'


def make(seed=0, graph=None, **more):
    model = StandIn(0.5)
    return echousd.generate(graph or small_graph(), seed=seed, model=model, shapes="boxes", place=False, **more, **BARE)


def remade(root, graph):
    return edit(root, graph, model=StandIn(0.5), shapes="boxes", place=False)


@pytest.fixture
def root(tmp_path):
    return make().save(tmp_path / "bedroom", preview=False)


@pytest.fixture
def told(recwarn):
    """Every warning so far, one per line."""
    return lambda: "\n".join(str(w.message) for w in recwarn.list)


def test_new_asset_keeps_off_the_name_of_an_artists_file(root, told):
    fern = root.parent / "assets/fern/fern.usda"
    fern.parent.mkdir()
    fern.write_text(MINE)
    graph = small_graph().add_node("fern", "wardrobe")  # nightstands and beds would share one asset
    for _ in range(2):
        remade(root, graph).save(root.parent, preview=False)
        assert fern.read_text() == MINE
    assert find_manifest(root.parent)["assets"]["fern"] == "fern_2"
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(root)))
    assert stage is not None
    assert (root.parent / "assets/fern_2/fern_2_geo.usdc").is_file()
    assert echousd.read_graph(root).names == graph.names
    shutil.rmtree(fern.parent)
    make(1, graph).save(root.parent, preview=False)  # generated anew, the name is free again
    assert find_manifest(root.parent)["assets"]["fern"] == "fern"


@pytest.mark.parametrize("edits", [False, True])
def test_a_room_saved_again_beside_an_artists_file_is_the_same_room(tmp_path, edits):
    """As by a process that died and whose next run finished its work before it did the same once more."""
    folder = tmp_path / "bedroom"
    with plain_files(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        root = plain_room(["bed"], 0).save(folder, preview=False)
        (folder / "assets/desk").mkdir()
        (folder / "assets/desk/desk.usda").write_text(MINE)
        made = plain_room(["bed", "desk"], 0, root if edits else None)
        seen = []
        for _ in range(3):
            made.save(folder, preview=False)
            seen.append({path: path.read_bytes() for path in folder.rglob("*") if path.is_file()})
    assert find_manifest(folder)["assets"]["desk"] == "desk_2"
    assert seen[0] == seen[1] == seen[2]


def test_every_edit_of_a_layer_is_kept(root, told):
    layer = root.parent / "layers/layout.usda"
    edits = []
    for number in range(3):
        edits.append(layer.read_bytes() + b"# mine %d\n" % number)
        layer.write_bytes(edits[-1])
        make(number + 1).save(root.parent, preview=False)
    names = ["layout.edited.usda", "layout.edited_2.usda", "layout.edited_3.usda"]
    assert [(layer.parent / name).read_bytes() for name in names] == edits
    for name in names:
        assert re.search(f"layout.usda: not as echousd wrote it; kept as layers/{name}", told())


def test_one_edit_is_kept_once(root):
    layer = root.parent / "layers/layout.usda"
    mine = layer.read_bytes() + b"# mine\n"
    for seed in (1, 2):
        layer.write_bytes(mine)
        make(seed).save(root.parent, preview=False)
    assert len(list(root.parent.rglob("*.edited*"))) == 1


def test_what_an_artist_adds_to_the_root_survives_every_regeneration(root):
    text = root.read_text().rstrip()
    root.write_text(text[:-1] + '\n    def Cube "Toy"\n    {\n    }\n}\n')
    for seed in (1, 2, 3):
        make(seed).save(root.parent, preview=False)
        layer = Sdf.Layer.OpenAsAnonymous(str(root))
        assert layer.GetPrimAtPath("/Room/Toy")
        assert layer.customLayerData["seed"] == seed


def test_edited_asset_that_was_taken_along_is_still_the_artists(root, told):
    asset = root.parent / "assets/wardrobe/wardrobe.usda"
    mine = asset.read_text() + "# mine\n"
    asset.write_text(mine)
    remade(root, small_graph().add_node("chair", "nightstand")).save(root.parent, preview=False)
    assert asset.read_text() == mine
    make(3).save(root.parent, preview=False)
    assert asset.with_name("wardrobe.edited.usda").read_text() == mine
    assert "wardrobe.usda: not as echousd wrote it; kept as assets/wardrobe/wardrobe.edited.usda" in told()


def test_forced_into_somebodys_folder_all_their_files_are_kept(tmp_path, told):
    folder = tmp_path / "bedroom"
    theirs = ["bedroom.usda", "bedroom.json", "layers/graph.usda", "layers/layout.usda", "notes.txt"]
    for path in theirs:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(f"their {path}")
    make().save(folder, preview=False, force=True)
    for path in theirs[:-1]:
        stem, _, ending = path.rpartition(".")
        assert (folder / f"{stem}.edited.{ending}").read_text() == f"their {path}"
        assert f"{folder / path}: not as echousd wrote it; kept as {stem}.edited.{ending}" in told()
    assert (folder / "notes.txt").read_text() == "their notes.txt"
    make(1).save(folder, preview=False)  # the room is ours by now
    assert len(list(folder.rglob("*.edited*"))) == 4


def test_renamed_copy_keeps_its_roots_name(root, tmp_path):
    copy = tmp_path / "bedroom_blue"
    shutil.copytree(root.parent, copy)
    (copy / "shot.usda").write_text("#usda 1.0\n(\n    subLayers = [@./bedroom.usda@]\n)\n")
    remade(copy / "bedroom.usda", small_graph().add_node("chair", "nightstand")).save(copy, preview=False)
    assert (copy / "bedroom.usda").is_file()
    assert not (copy / "bedroom_blue.usda").exists()
    assert "chair" in echousd.read_graph(copy / "shot.usda").names
    assert make(1).save(copy, preview=False) == copy / "bedroom.usda"


@pytest.mark.parametrize("where", ["set.usda", "shots/a/set.usda", "../shot.usda"])
def test_asset_that_another_layer_refers_to_is_kept(root, told, where):
    layer = (root.parent / where).resolve()
    layer.parent.mkdir(parents=True, exist_ok=True)
    up = "../" * (len(layer.parent.relative_to(root.parent).parts)) if layer.is_relative_to(root.parent) else "bedroom/"
    layer.write_text(f'#usda 1.0\ndef "Other" (references = @./{up}assets/pendant/pendant.usda@) {{}}\n')
    smaller = small_graph().remove_node("pendant").remove_node("wardrobe")
    remade(root, smaller).save(root.parent, preview=False)
    assert not (root.parent / "assets/wardrobe").exists()
    stage = Usd.Stage.Open(str(layer))
    assert stage.GetCompositionErrors() == []
    assert stage.GetPrimAtPath("/Other").GetChildren()
    assert f"pendant.usda: no longer part of the room; kept, as {layer.name} refers to it" in told()
    layer.unlink()
    make(1, smaller).save(root.parent, preview=False)  # nobody needs it any more
    assert not (root.parent / "assets/pendant").exists()


def test_root_that_cannot_be_read_any_more_is_refused(root, echousd_command):
    for broken in (b"#usda 1.0\ndef Xf", root.read_bytes()[:300], b"#usda 1.0\n\xff\xfe"):
        root.write_bytes(broken)
        with pytest.raises(ValueError, match=r"bedroom.usda: edited by hand and no longer readable as USD; repair it"):
            make(1).save(root.parent, preview=False)
        assert root.read_bytes() == broken


def test_somebodys_picture_under_the_previews_name_is_kept(root, told):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("embreex")
    picture = root.with_suffix(".png")
    write_preview(root)
    write_preview(root)
    assert "kept" not in told()
    image.new("RGB", (4, 4), "red").save(picture)
    mine = picture.read_bytes()
    write_preview(root)
    assert picture.with_name("bedroom.edited.png").read_bytes() == mine
    assert "bedroom.png: not as echousd wrote it; kept as bedroom.edited.png" in told()


def test_file_that_appears_while_a_run_is_interrupted_is_kept(tmp_path, told, monkeypatch):
    from echousd.folder import folder as folders

    write_together(tmp_path, {"a.usda": b"old"}, last=[], remove=[])
    with monkeypatch.context() as patch:
        patch.setattr(folders, "finish", lambda *_: None)  # the run ends when its journal is written
        write_together(tmp_path, {"a.usda": b"new", "b.usda": b"new"}, last=[], remove=[])
    (tmp_path / "a.usda").write_bytes(b"mine")
    (tmp_path / "b.usda").write_bytes(b"mine, too")
    recover(tmp_path)
    found = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    assert found == {"a.usda": b"new", "b.usda": b"new", "a.edited.usda": b"mine", "b.edited.usda": b"mine, too"}
    assert "a.usda: not as echousd wrote it; kept as a.edited.usda" in told()
    assert not (tmp_path / STAGING).exists()


@pytest.mark.parametrize("seed", [-1, 2**63, 2**70])
def test_seeds_that_no_layer_can_store_are_refused(root, seed, tmp_path, echousd_command):
    said = f"seed is {seed}, allowed: 0 to {MAX_SEED}"
    with pytest.raises(ValueError, match=said):
        make(seed)
    with pytest.raises(ValueError, match=said):
        edit(root, small_graph(), seed=seed, model=StandIn())
    done = echousd_command("generate", "samples/bedroom.usda", "-o", tmp_path / "new", f"--seed={seed}")
    assert done.code == 2
    assert said in done.err
    done = echousd_command("edit", root, "--add", "chair:nightstand", f"--seed={seed}")
    assert (done.code, done.err) == (2, f"error: {said}\n")
    assert not (tmp_path / "new").exists()


def test_largest_seed_is_stored(tmp_path):
    root = make(MAX_SEED).save(tmp_path / "room", preview=False)
    assert Sdf.Layer.OpenAsAnonymous(str(root)).customLayerData["seed"] == MAX_SEED
    assert json.loads((tmp_path / "room/room.json").read_text())["seed"] == MAX_SEED
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(1).save(tmp_path / "room", preview=False)


ROOT = '#usda 1.0\n(\n    defaultPrim = "Room"\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n'


@pytest.mark.parametrize(
    ("line", "other", "text"),
    [
        ('upAxis = "Y"', 'upAxis = "Z"', "edited by hand, upAxis Z; a room with Y needs another folder$"),
        ("metersPerUnit = 1", "metersPerUnit = 0.01", "edited by hand, metersPerUnit 0.01; a room with 1.0 needs"),
        ('defaultPrim = "Room"', 'defaultPrim = "Loft"', "edited by hand, defaultPrim Loft; a room with Room needs"),
        ('upAxis = "Y"', "upAxis", "edited by hand and no longer readable as USD; repair it or delete it$"),
    ],
)
def test_a_root_in_another_frame_is_not_merged(tmp_path, line, other, text):
    path = tmp_path / "room.usda"
    with pytest.raises(ValueError, match=f"{path}: {text}"):
        merged_root(path, ROOT.replace(line, other).encode(), ROOT.encode())


def test_merged_roots_keep_what_is_theirs_and_get_what_is_ours(tmp_path):
    def root(layers, data):
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.ImportFromString(ROOT)
        layer.subLayerPaths, layer.customLayerData = layers, data
        return layer.ExportToString().encode()

    theirs = root(["./mine.usda", "./layers/look.usdc", "./layers/old.usdc"], {"mine": 1, "seed": 1})
    ours = root(["./layers/look.usdc", "./layers/new.usdc"], {"seed": 2})
    merged = Sdf.Layer.CreateAnonymous(".usda")
    merged.ImportFromString(merged_root(tmp_path / "room.usda", theirs, ours).decode())
    assert list(merged.subLayerPaths) == ["./mine.usda", "./layers/look.usdc", "./layers/new.usdc"]
    assert merged.customLayerData == {"mine": 1, "seed": 2}
