"""One writer per folder: the second is refused by name or waits, and a dead writer's lock is taken over."""

import errno
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest
from filelock import SoftFileLock, Timeout

from echousd.folder import lock as locks
from echousd.folder.folder import claim, write_together
from echousd.folder.lock import LOCK, locked, owner_of, run_of

HOLDER = textwrap.dedent("""
    import sys, time
    from pathlib import Path
    from echousd.folder.lock import locked
    with locked(Path(sys.argv[1])):
        print("held", flush=True)
        time.sleep(float(sys.argv[2]))
""")
RACER = textwrap.dedent("""
    import sys
    from pathlib import Path
    from echousd.folder.folder import claim, write_together
    from echousd.folder.lock import locked
    folder, me, wait = Path(sys.argv[1]), sys.argv[2], sys.argv[3] == "wait"
    print("ready", flush=True)
    sys.stdin.readline()
    done = refused = 0
    for turn in range(8):
        mine = f"{me} {turn}".encode()
        try:
            with locked(folder, wait=wait):
                claim(folder, force=True)
                write_together(folder, {f"assets/{i}.usda": mine for i in range(8)} | {"room.usda": mine},
                               last=["room.usda"], remove=[])
                found = {path.read_bytes() for path in folder.rglob("*.usda")}
                assert found == {mine}, found
                done += 1
        except ValueError as error:
            assert "is writing it" in str(error), error
            refused += 1
    print(done, refused)
""")


def start(code, *words):
    process = subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    )  # fmt: skip
    assert process.stdout.readline() in ("held\n", "ready\n")
    return process


def test_second_writer_is_refused_by_name_and_waits_if_told_to(tmp_path):
    folder = tmp_path / "room"
    holder = start(HOLDER, folder, 1.0)
    said = rf"room: process {holder.pid} on [\w.-]+ \(since \d\d:\d\d:\d\d\) is writing it; try later, or wait for it"
    with pytest.raises(ValueError, match=said), locked(folder):
        pass
    started = time.perf_counter()
    with locked(folder, wait=True):
        assert time.perf_counter() - started > 0.2
        assert (folder / LOCK).read_text().startswith(f"process {os.getpid()} on ")
    holder.communicate()


def test_lock_of_a_killed_process_is_taken_over(tmp_path):
    holder = start(HOLDER, tmp_path, 60)
    os.kill(holder.pid, signal.SIGKILL)
    holder.communicate()
    assert (tmp_path / LOCK).exists()
    with locked(tmp_path):
        assert (tmp_path / LOCK).read_text().startswith(f"process {os.getpid()} on ")
    assert not (tmp_path / LOCK).exists()


def claim_locked(folder):
    with locked(folder):
        claim(folder, force=True)


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b'{"process": -1, "host": "a", "since": 1}', b"[" * 5000])
def test_lock_that_cannot_be_read_is_nobodys(tmp_path, content):
    (tmp_path / LOCK).write_bytes(content)
    with locked(tmp_path):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="only flock says who holds it")
def test_an_owner_that_nobody_can_read_is_another_process(tmp_path):
    with locked(tmp_path):
        (tmp_path / LOCK).write_bytes(b"process 1\x1b[2J")
        assert owner_of(tmp_path) == "another process"


def test_what_a_folder_is_held_for_is_told_as_long_as_it_is_held(tmp_path, monkeypatch):
    monkeypatch.setattr(locks.socket, "gethostname", lambda: "h" * 60)
    assert run_of(tmp_path) == ""
    with locked(tmp_path, run="edit 1"):
        assert re.fullmatch(rf"process {os.getpid()} on h{{40}} \(since \d\d:\d\d:\d\d\)", owner_of(tmp_path))
        with locked(tmp_path, run="other") as outermost:
            assert not outermost
            assert run_of(tmp_path) == "edit 1"
        assert run_of(tmp_path) == "edit 1"
    assert run_of(tmp_path) == ""


def test_a_hundred_characters_of_a_lock_are_told(tmp_path):
    (tmp_path / LOCK).write_text("process " + "1" * 200)
    assert owner_of(tmp_path) == "process " + "1" * 92


def test_on_disks_without_locks_the_marker_decides(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "FileLock", SoftFileLock)
    with locked(tmp_path):
        with pytest.raises(Timeout):
            SoftFileLock(tmp_path / LOCK, timeout=0).acquire()
        assert owner_of(tmp_path) == "another process"
    assert not (tmp_path / LOCK).exists()


def test_a_thread_enters_again_and_another_does_not(tmp_path):
    found = []

    def other():
        try:
            claim_locked(tmp_path)
        except ValueError as error:
            found.append(str(error))

    with locked(tmp_path), locked(tmp_path):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
    assert len(found) == 1
    assert f"process {os.getpid()} on" in found[0]
    claim_locked(tmp_path)


def test_lock_that_is_a_link_or_a_pipe_is_refused(tmp_path):
    (tmp_path / "room").mkdir()
    (tmp_path / "data").write_text("precious")
    (tmp_path / "room" / LOCK).symlink_to(tmp_path / "data")
    with pytest.raises(ValueError, match=r"\.echousd\.lock: is a link; remove it"):
        claim_locked(tmp_path / "room")
    assert (tmp_path / "data").read_text() == "precious"
    (tmp_path / "room" / LOCK).unlink()
    os.mkfifo(tmp_path / "room" / LOCK)
    with pytest.raises(ValueError, match=r"\.echousd\.lock: is no plain file; remove it"):
        claim_locked(tmp_path / "room")


def test_folder_that_a_failed_run_created_disappears(tmp_path):
    with pytest.raises(KeyError), locked(tmp_path / "a/b/room"):
        raise KeyError
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize("wait", ["wait", "refuse"])
def test_races_of_three_writers(tmp_path, wait):
    """Each of 8 rounds per process is a whole room of one writer; nobody fails but by being refused."""
    racers = [start(RACER, tmp_path / "room", name, wait) for name in "abc"]
    for racer in racers:
        racer.stdin.write("go\n")
        racer.stdin.flush()
    counts = []
    for racer in racers:
        out, _ = racer.communicate(timeout=120)
        assert racer.returncode == 0, out
        counts.append([int(word) for word in out.split()])
    assert all(done + refused == 8 for done, refused in counts)
    assert sum(done for done, _ in counts) >= (24 if wait == "wait" else 1)
    files = {path.read_bytes() for path in (tmp_path / "room").rglob("*") if path.is_file()}
    assert len(files) == 1


def test_write_together_alone_takes_the_lock_where_it_moves_files(tmp_path):
    holder = start(HOLDER, tmp_path, 5)
    with pytest.raises(ValueError, match="is writing it"):
        write_together(tmp_path, {"a.usda": b"a"}, last=[], remove=[])
    holder.kill()
    holder.communicate()
    assert not (tmp_path / "a.usda").exists()


def test_a_folder_that_cannot_be_made_says_why(tmp_path):
    (tmp_path / "word").write_text("mine")
    told = rf"word/room: cannot be written \({os.strerror(errno.ENOTDIR)}\); nothing was changed$"
    with pytest.raises(ValueError, match=told), locked(tmp_path / "word/room"):
        pass
    assert (tmp_path / "word").read_text() == "mine"
