"""A store that somebody sent: links, pipes and devices in it reach nothing outside, and nothing waits for ever."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from echousd.store import MARK, Store

KEY = "ab" + "0" * 30
SECRET = b"precious"


def sparse(path: Path, size: int) -> None:
    """A file that is large and takes no room."""
    with path.open("wb") as file:
        file.truncate(size)


@pytest.fixture
def store(tmp_path):
    made = Store.create(tmp_path / "store")
    made.put({"bed.usda": b"#usda 1.0\n"})
    (tmp_path / "outside" / "ab" / KEY).mkdir(parents=True)
    secret = tmp_path / "outside" / "ab" / KEY / "secret.txt"
    secret.write_bytes(SECRET)
    secret.chmod(0o600)
    return made


def state_of(store):
    """What lies outside of the store, with its rights."""
    outside = store.root.parent / "outside"
    return {p: (p.lstat().st_mode, p.read_bytes() if p.is_file() else b"") for p in sorted(outside.rglob("*"))}


@pytest.mark.parametrize(
    ("link", "to"), [("ab", "ab"), (f"ab/{KEY}", f"ab/{KEY}"), (".new_x", f"ab/{KEY}"), (f"ab/{KEY}/link", "ab")]
)
@pytest.mark.parametrize("words", [("verify",), ("gc", "--older", "0")])
def test_links_lead_nowhere(store, link, to, words, echousd_command):
    place = store.root / link
    place.parent.mkdir(parents=True, exist_ok=True)
    target = store.root.parent / "outside" / to
    place.symlink_to(target)
    if link.startswith("."):
        os.utime(place, (1, 1), follow_symlinks=False)
    before = state_of(store)
    done = echousd_command("store", words[0], store.root, *words[1:])
    assert done.code in (0, 1, 2)
    assert state_of(store) == before
    if link == "ab":
        assert f"{place}: a link, allowed in a store: folders" in done.err
    elif words[0] == "gc":
        assert not place.is_symlink()  # the link is what goes
    elif KEY in link:
        assert done.code == 1
    if link == "ab":
        with pytest.raises(ValueError, match="a link, allowed in a store"):
            store.folder(KEY)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (os.mkfifo, "not a regular file"),
        (lambda mark: mark.symlink_to("/dev/zero"), "not a regular file"),
        (lambda mark: sparse(mark, 8 << 30), "8589934592 bytes, allowed: at most 65536"),
        (lambda mark: mark.write_text("[" * 60_000), "cannot be read as JSON"),
        (lambda mark: mark.write_text("[1]"), "not a store of this version"),
    ],
)
def test_a_mark_is_read_with_doubt(store, make, told, echousd_command):
    (store.root / MARK).unlink()
    make(store.root / MARK)
    for command in ("verify", "gc"):
        done = echousd_command("store", command, store.root)
        assert done.code == 2
        assert MARK in done.err
        assert told in done.err


def test_what_is_too_large_is_not_held_in_memory(store):
    place = store.root / "ab" / KEY
    place.mkdir(parents=True)
    sparse(place / "file", 20 << 30)
    assert list(store.wrong()) == [KEY]
    with pytest.raises(ValueError, match=r"bytes, allowed in a store: folders of"):
        store.read(KEY)


def test_a_key_is_found_across_blocks(store, monkeypatch):
    (used,) = store.keys()
    room = store.root.parent / "rooms"
    room.mkdir()
    for shift in range(60):
        (room / "room.usda").write_text("-" * shift + f"@../store/{used[:2]}/{used}/bed.usda@" + "-" * 90)
        monkeypatch.setattr("echousd.store.BLOCK", 41)
        assert store.collect([room], grace=0, dry=True) == []
