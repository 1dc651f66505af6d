import pytest

from echomodel.files import whole_file


def test_a_file_appears_at_the_end_of_the_block(tmp_path):
    path = tmp_path / "weights.safetensors"
    with whole_file(path) as beside:
        beside.write_text("new")
        assert not path.exists()
        assert not list(tmp_path.glob("*.safetensors"))  # nobody takes the other name for the file
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")

    def half() -> None:
        with whole_file(path) as beside:
            beside.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        half()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_rights_stay_and_the_ending_can_be_chosen(tmp_path):
    path = tmp_path / "room.usda"
    path.write_text("old")
    path.chmod(0o640)
    with whole_file(path, ".usda") as beside:
        assert beside.suffix == ".usda"
        beside.write_text("new")
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_new_file_has_the_rights_of_any_whoever_wrote_it(tmp_path):
    (tmp_path / "any").touch()
    path = tmp_path / "weights.safetensors"
    with whole_file(path) as beside:
        written = tmp_path / "own"  # as libraries do that write beside and rename
        written.touch(0o600)
        written.replace(beside)
    assert path.stat().st_mode == (tmp_path / "any").stat().st_mode
