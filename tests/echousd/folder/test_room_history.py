"""Steps back and forth: exact, and nothing that a person put into the folder meanwhile is changed or lost."""

import json
import shutil
import warnings
import zipfile

import pytest
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.folder import history
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.store import Store

MINE = b"#usda 1.0\n# mine\n"


def change(root, graph):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = edit(root, graph, model=StandIn(0.5), shapes="boxes", place=False)
        return made.save(root.parent, preview=False)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    room = echousd.generate(small_graph(), model=StandIn(0.5), shapes="boxes", place=False, **BARE)
    return room.save(tmp_path_factory.mktemp("made") / "bedroom", preview=False)


@pytest.fixture
def root(made, tmp_path):
    shutil.copytree(made.parent, tmp_path / "bedroom")
    return tmp_path / "bedroom" / made.name


def files(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def room_only(found):
    return {path: content for path, content in found.items() if not path.startswith(".redo/")}


def with_chair():
    return small_graph().add_node("chair", "nightstand").relate("chair", "close_by", "wardrobe")


def put(root, path, content=MINE):
    place = root.parent / path
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes(content)
    return place


@pytest.mark.parametrize("step", [history.undo, history.redo])
def test_a_persons_file_where_a_step_would_write_is_left(root, step):
    fewer = small_graph().remove_node("pendant")
    change(root, fewer if step is history.undo else with_chair())
    if step is history.redo:
        history.undo(root)
    own = put(root, "assets/pendant/pendant.usda" if step is history.undo else "assets/chair/chair.usda")
    before = files(root.parent)
    with pytest.raises(ValueError, match=rf"{own.name}: is not the room's; move it away first, then"):
        step(root)
    assert files(root.parent) == before
    own.rename(root.parent / "kept.usda")
    step(root)
    assert (root.parent / "kept.usda").read_bytes() == MINE
    read_room(root)


def test_a_persons_file_that_is_as_the_step_would_write_it_is_no_hindrance(root):
    asset = root.parent / "assets/pendant/pendant.usda"
    content = asset.read_bytes()
    change(root, small_graph().remove_node("pendant"))
    put(root, "assets/pendant/pendant.usda", content)
    history.undo(root)
    assert asset.read_bytes() == content


def test_a_persons_link_where_a_step_would_write_is_left(root):
    change(root, small_graph().remove_node("pendant"))
    own = root.parent / "assets/pendant/pendant.usda"
    own.parent.mkdir()
    own.symlink_to("../../gone.usda")
    with pytest.raises(ValueError, match=r"pendant.usda: is not the room's; move it away first"):
        history.undo(root)
    assert own.is_symlink()


def test_a_persons_archives_are_kept(root):
    own = [put(root, path) for path in ("history/1.zip", "history/3.zip", ".redo/2.zip", ".redo/9.zip")]
    states = [room_only(files(root.parent))]
    for graph in (with_chair(), small_graph()):
        change(root, graph)
        states.append(room_only(files(root.parent)))
    assert [e["restores"] for e in json.loads(root.with_suffix(".json").read_text())["history"]] == [
        "history/2.zip", "history/4.zip",
    ]  # fmt: skip
    for state in reversed(states[:-1]):
        history.undo(root)
        assert room_only(files(root.parent)) == state
    for state in states[1:]:
        history.redo(root)
        assert room_only(files(root.parent)) == state
    history.undo(root)
    change(root, small_graph().remove_node("lamp"))  # what was taken back is given up
    assert sorted(path.name for path in (root.parent / ".redo").iterdir()) == ["2.zip", "9.zip"]
    assert all(path.read_bytes() == MINE for path in own)


def test_an_archive_that_was_changed_is_not_taken(root):
    change(root, with_chair())
    place = root.parent / "history/1.zip"
    with zipfile.ZipFile(place, "a") as archive:
        archive.writestr("layers/more.usda", "")
    before = files(root.parent)
    with pytest.raises(
        ValueError, match=r"1.zip: was changed since it was written, so that the room cannot be put back"
    ):
        history.undo(root)
    assert files(root.parent) == before


@pytest.mark.parametrize("content", [b"", b"PK", b"no archive"])
def test_a_damaged_archive_is_told_where_it_might_be_the_one_that_is_asked_for(root, content):
    change(root, with_chair())
    history.undo(root)
    (place,) = (root.parent / ".redo").iterdir()
    whole = place.read_bytes()
    place.write_bytes(content or whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=f"{place.name}: "):
        history.redo(root)
    place.with_name("7.zip").write_bytes(whole)  # another beside it is the one
    history.redo(root)
    assert "chair" in (root.parent / "layers/graph.usda").read_text()


def test_an_archive_that_names_what_is_not_of_the_room_is_named_and_not_taken(root):
    to = json.loads(root.with_suffix(".json").read_bytes())
    for files, removes in (({"notes.txt": b""}, ()), ({}, ("notes.txt",))):
        with pytest.raises(ValueError, match=r"bedroom/history/1.zip: names 'notes.txt', which is no file of the room"):
            history._step(root.parent, "history/1.zip", files, removes, to["files"], to, "undo")


def test_a_step_gives_back_what_a_person_had_edited_before_it(root):
    """The root layer that the edit merged with its own, and a layer that it replaced, beside which a copy is kept."""
    text = root.read_text().rstrip()
    root.write_text(text[:-1] + '\n    # a remark\n    def Cube "Toy"\n    {\n    }\n}\n')
    layer = put(root, "layers/layout.usda", (root.parent / "layers/layout.usda").read_bytes() + b"# mine\n")
    before = files(root.parent)
    change(root, with_chair())
    after = room_only(files(root.parent))
    assert b"Toy" in after[root.name]
    assert after[root.name] != before[root.name]
    assert layer.read_bytes() != before["layers/layout.usda"]
    history.undo(root)
    assert before.items() <= files(root.parent).items()
    history.redo(root)
    assert room_only(files(root.parent)) == after
    root.write_bytes(root.read_bytes() + b"# more\n")
    with pytest.raises(ValueError, match=r"bedroom.usda: was changed since; move it away first, then take the edit"):
        history.undo(root)


def test_an_edit_that_changes_nothing_is_no_step_where_an_asset_is_kept_for_a_layer(root):
    put(root, "shot.usda", b'#usda 1.0\ndef "A" (references = @./assets/pendant/pendant.usda@) {}\n')
    for _ in range(2):
        change(root, small_graph().remove_node("pendant"))
        assert [e["number"] for e in json.loads(root.with_suffix(".json").read_text())["history"]] == [1]
    history.undo(root)
    assert "pendant" in read_room(root).graph.names


def test_a_layer_that_was_moved_away_before_an_undo_is_not_taken_by_the_redo(root):
    change(root, with_chair())
    layer = root.parent / "layers/layout.usda"
    layer.rename(root.parent / "kept.usda")
    history.undo(root)
    history.redo(root)
    assert layer.is_file()


def test_remarks_in_a_root_layer_that_is_merged_are_kept_beside_it(root):
    text = root.read_text().rstrip()
    root.write_text(text[:-1] + '\n    # a remark\n    def Cube "Toy"\n    {\n    }\n}\n')
    mine = root.read_bytes()
    again = echousd.generate(small_graph(), seed=1, model=StandIn(0.5), shapes="boxes", **BARE)
    with pytest.warns(UserWarning, match="bedroom.usda: not as echousd wrote it; kept as bedroom.edited.usda"):
        again.save(root.parent, preview=False)
    assert (root.parent / "bedroom.edited.usda").read_bytes() == mine
    change(root, with_chair())
    assert len(list(root.parent.glob("*.edited*"))) == 1  # as USD writes it: nothing to keep


def test_a_state_whose_assets_left_the_store_is_not_begun(tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(0.5), shapes="boxes", place=False, **BARE)
    root = room.save(tmp_path / "bedroom", preview=False, store=tmp_path / "store")
    change(root, small_graph().remove_node("pendant"))
    store = Store.open(tmp_path / "store")
    with zipfile.ZipFile(root.parent / "history/1.zip") as archive:
        key = json.loads(archive.read("bedroom.json"))["stored"]["assets/pendant"]
    store.remove(key)
    before = files(root.parent)
    with pytest.raises(ValueError, match=rf"assets/pendant \({key}\) is not in the store .*; nothing was changed"):
        history.undo(root)
    assert files(root.parent) == before
