"""Models of others in a store: each lies there once by itself, and the room's keys name it."""

from echousd.folder.stored import Shelf
from echousd.store import Store


def test_a_model_of_somebody_lies_by_itself_and_nothing_does_without_files(tmp_path):
    shelf = Shelf(Store.create(tmp_path / "store"), tmp_path / "room")
    assert shelf.kept_apart("lamp", {}, "lamp.usda") is None
    assert shelf.keys == {}
    files = {"lamp.usda": b"#usda 1.0\n", "brass.png": b"picture"}
    layer = shelf.kept_apart("lamp", files, "lamp.usda")
    assert layer is not None
    assert shelf.keys == {"originals/lamp": layer.parent.name}
    assert {path.name: path.read_bytes() for path in layer.parent.iterdir()} == files
    assert layer.parents[2] == (tmp_path / "store").resolve()
    again = Shelf(Store.open(tmp_path / "store"), tmp_path / "other").kept_apart("oil_lamp", files, "lamp.usda")
    assert again == layer
