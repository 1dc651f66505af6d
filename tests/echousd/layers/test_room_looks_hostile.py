"""A record of a look that somebody wrote: it leads to no prim that it could break, and rooms still open."""

from __future__ import annotations

import pytest
from pxr import Sdf, Vt
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.layers.paintings import RECORD, brought, read_look
from echousd.make.reading import read_room
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage

PLACES = ("/", ".", "../x", "/Room", "/Room/a.b", "/Room/a{v=x}b", "/Room/a[/b].c", "a b", "")


def layer_of(**change):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    record = {"name": "oil", "objects": {"/Room/Objects/bed": "0"}, "meshes": Vt.StringArray(["/Room/Objects/bed/m"])}
    layer.customLayerData = {RECORD: {**record, **change}}
    return layer


def test_records_name_prims_inside_a_room():
    assert read_look(layer_of(), "looks/oil.usda").objects == {"/Room/Objects/bed": "0"}
    for place in PLACES:
        assert read_look(layer_of(meshes=Vt.StringArray([place])), "") is None
        if place:
            assert read_look(layer_of(objects={place: "0"}), "") is None
            assert read_look(layer_of(objects={"/Room/Objects/bed": "0", place: "0"}), "") is None
    assert read_look(layer_of(objects={"/Room/Objects/bed": "0", "/Room/Objects/desk": 5}), "") is None
    for name in ("a:b", "a" * 65, "", "1"):
        assert read_look(layer_of(name=name), "") is None


@pytest.mark.parametrize(("said", "taken"), [("each", "each"), ("grouped", "grouped"), ("all", "none"), (3, "none")])
def test_a_record_says_whether_small_things_were_painted_or_nothing(said, taken):
    assert read_look(layer_of(dressing=said), "looks/oil.usda").dressing == taken
    assert read_look(layer_of(), "looks/oil.usda").dressing == "none"


@pytest.fixture
def root(tmp_path):
    made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return made.save(tmp_path / "bedroom", preview=False)


@pytest.mark.parametrize("place", ["/", "/Room", "/Room/Objects/bed.x"])
def test_an_edit_leaves_a_room_that_opens(root, place):
    (root.parent / "looks").mkdir()
    layer_of(objects={place: "0", "/Room/Objects/bed": "1"}).Export(str(root.parent / "looks/oil.usda"))
    layer = Sdf.Layer.OpenAsAnonymous(str(root))
    layer.subLayerPaths = ["./looks/oil.usda", *layer.subLayerPaths]
    root.write_text(layer.ExportToString())
    echousd.generate(small_graph(), model=StandIn(0.5), shapes="boxes", place=False, **BARE).save(
        root.parent, preview=False
    )
    assert open_stage(root).GetPrimAtPath("/Room/Objects/bed")


@pytest.mark.parametrize(("kind", "value"), [("double", "1e30"), ("double3", "(nan, 0, 0)"), ("string", '"x"')])
def test_a_place_that_is_none_is_told(root, kind, value):
    layer, found = Sdf.Layer.OpenAsAnonymous(str(root)), Sdf.Layer.CreateAnonymous(".usda")
    found.ImportFromString(f'#usda 1.0\nover "bed" {{\n {kind} xformOp:translate = {value}\n}}\n')
    bed = Sdf.CreatePrimInLayer(layer, "/Room/Objects/bed")
    Sdf.CopySpec(found, Sdf.Path("/bed"), layer, bed.path)
    root.write_text(layer.ExportToString())
    with pytest.raises(StageError, match=r"bedroom.usda: (cannot be read|</Room/Objects/bed>)"):
        read_room(root)


def painted(root, name="oil"):
    """A look in the folder of a room, with a picture beside it, which the room's root layer names."""
    (root.parent / "looks" / name).mkdir(parents=True)
    layer_of(name=name).Export(str(root.parent / f"looks/{name}.usda"))
    (root.parent / f"looks/{name}/bed.png").write_bytes(b"picture")
    layer = Sdf.Layer.OpenAsAnonymous(str(root))
    layer.subLayerPaths = [f"./looks/{name}.usda", *layer.subLayerPaths]
    root.write_text(layer.ExportToString())


def test_looks_of_an_edited_room_go_along_to_another_folder_alone(root, tmp_path):
    painted(root)
    files = {path: (root.parent / path).read_bytes() for path in ("looks/oil/bed.png", "looks/oil.usda")}
    (tmp_path / "link").symlink_to(root.parent)
    assert brought(root, tmp_path / "new") == {"./looks/oil.usda": files}
    assert brought(None, tmp_path / "new") == {}
    for same in (root.parent, tmp_path / "new/../bedroom", tmp_path / "link"):
        assert brought(root, same) == {}


def test_a_look_in_the_place_of_one_that_would_go_along_stays(root, tmp_path):
    painted(root)
    (tmp_path / "new/looks").mkdir(parents=True)
    there = tmp_path / "new/looks/oil.usda"
    there.write_bytes((root.parent / "looks/oil.usda").read_bytes())
    assert [*brought(root, tmp_path / "new")] == ["./looks/oil.usda"]  # the same one is no other
    there.write_text("#usda 1.0\n")
    with pytest.warns(UserWarning, match=r"new/looks/oil.usda: is another look; that of .*bedroom is not taken along"):
        assert brought(root, tmp_path / "new") == {}
