import tomllib
from pathlib import Path

import pytest

import echomodel
import echousd
from echomodel.files import tables, whole_file


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


TABLES = [path for package in (echomodel, echousd) for path in Path(package.__file__).parent.rglob("*.toml")]


def test_tables_are_those_of_their_files_from_the_cache_and_without(tmp_path, monkeypatch):
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path))
    assert len(TABLES) > 10
    for cache in ("empty", "full", "damaged"):
        found = {path: tables(path.name, str(path.with_name("__init__.py"))) for path in TABLES}
        assert found == {path: tomllib.loads(path.read_text("utf-8")) for path in TABLES}, cache
        kept = sorted((tmp_path / "tables").iterdir())
        assert len(kept) == len({path.read_bytes() for path in TABLES})
        for path in kept if cache == "full" else ():
            path.write_text(path.read_text("utf-8")[:-9], "utf-8")


def test_tables_are_read_where_a_user_has_no_home(tmp_path, monkeypatch):
    monkeypatch.delenv("ECHOUSD_CACHE", raising=False)
    monkeypatch.setattr(Path, "home", classmethod(lambda cls: (_ for _ in ()).throw(RuntimeError("no home"))))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text("a = 1")
    assert tables("own.toml", str(tmp_path / "own.py")) == {"a": 1}
    assert [path.name for path in tmp_path.iterdir()] == ["own.toml"]


def test_tables_are_read_from_the_cache_and_anew_once_their_file_changed(tmp_path, monkeypatch):
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "cache"))
    (tmp_path / "own.toml").write_text("a = 1")
    assert tables("own.toml", str(tmp_path / "own.py")) == {"a": 1}
    monkeypatch.setattr(tomllib, "loads", lambda text: {"read": text})
    assert tables("own.toml", str(tmp_path / "own.py")) == {"a": 1}
    (tmp_path / "own.toml").write_text("a = 2")
    assert tables("own.toml", str(tmp_path / "own.py")) == {"read": "a = 2"}
