"""A disk that is full: one line, exit code 2, and nothing half-written is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import traceback
from concurrent.futures import ThreadPoolExecutor

import pytest
from inline_batches import Inline

from echousd.cli.main import run
from echousd.cli.output import say_json
from echousd.cli.terminal import Terminal

GRAPH = "room: {type: bedroom, size: [4.0, 3.4]}\nobjects: {bed: double_bed, pendant: pendant_lamp}\n"


def full(most, *words):
    """Run a command that may write no file larger than so many bytes; what the system says is what a full disk says.

    The limit is of a process: a fork of this one, that need not import everything again.
    """
    ends = [os.pipe(), os.pipe()]
    child = os.fork()
    if not child:
        code, sys.dont_write_bytecode = 70, True  # Python would keep modules cut at the limit
        try:
            for number, (_, into) in enumerate(ends, 1):
                os.dup2(into, number)
            sys.stdout, sys.stderr = (os.fdopen(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))
            import resource

            signal.alarm(180)  # whatever it waits for, it ends
            os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
            code = run([str(word) for word in words])
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    for _, into in ends:
        os.close(into)
    with ThreadPoolExecutor(2) as readers:
        said = list(readers.map(lambda end: os.fdopen(end[0], encoding="utf-8").read(), ends))
    return subprocess.CompletedProcess(words, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), *said)


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
@pytest.mark.parametrize("topic", ["graph -o", "data plot", "data rooms", "new"])
def test_what_was_begun_disappears(tmp_path, topic):
    (tmp_path / "graph.yaml").write_text(GRAPH)
    out = tmp_path / "out"
    out.mkdir()
    words = {
        "graph -o": ("graph", tmp_path / "graph.yaml", "-o", out / "graph.png"),
        "data plot": ("data", "plot", tmp_path / "rooms.json", "-o", out / "rooms.png"),
        "data rooms": ("data", "rooms", "-o", out / "rooms.json", "--count", "3"),
        "new": ("new", out / "graph.usda", "--from", tmp_path / "graph.yaml"),
    }[topic]
    if topic == "data plot":
        made = full(10**9, "data", "rooms", "-o", tmp_path / "rooms.json", "--count", "1")
        assert made.returncode == 0, made.stderr
    done = full(600, *words)
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 2, done.stderr
    assert str(out) in last
    assert not list(out.iterdir())


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room")
    (folder / "graph.yaml").write_text(GRAPH)
    words = ("generate", folder / "graph.yaml", "-o", folder / "room", "--shapes", "boxes", "--dress", "none")
    made = full(10**9, *words)
    assert made.returncode == 0, made.stderr
    return folder / "room" / "room.usda"


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
@pytest.mark.parametrize(
    ("most", "words"),
    [
        (600, ("render", "-o", "top.png", "--size", "64")),
        (3_500, ("render", "-o", "cameras", "--cameras", "--size", "64")),
        (600, ("export", "-o", "room.glb")),
        (40_000, ("export", "-o", "flat/room.usda")),
        (600, ("texture", "export", "-o", "job", "--for", "generic")),
    ],
    ids=lambda value: " ".join(value[:3]) if isinstance(value, tuple) else None,
)
def test_nothing_half_made_of_a_room_is_left(tmp_path, room, most, words):
    at = words.index("-o") + 1
    out = tmp_path / "out"
    out.mkdir()
    topic = words[:2] if words[0] == "texture" else words[:1]
    done = full(most, *topic, room, *words[len(topic) : at], out / words[at], *words[at + 1 :])
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 2, done.stderr
    assert str(out) in last
    assert "cannot be written (File too large)" in last
    assert not list(out.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
@pytest.mark.parametrize("most", [600, 60_000, 200_000])
@pytest.mark.parametrize("more", [(), ("--arkit",)])
def test_a_package_needs_room_for_what_it_is_made_of(tmp_path, room, most, more):
    done = full(most, "export", room, "-o", tmp_path / "room.usdz", *more)
    assert done.returncode == 2, done.stderr
    assert "cannot be" in done.stderr
    assert "nothing was changed" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
def test_an_index_is_whole_or_stays_as_it_was(tmp_path, room):
    index = tmp_path / "library.parquet"
    words = ("assets", "index", room.parent / "assets", "-o", index, "--workers", "1")
    done = full(600, *words)
    assert done.returncode == 2, done.stderr
    assert f"{index}: cannot be written" in done.stderr
    assert not list(tmp_path.iterdir())
    assert full(10**9, *words).returncode == 0
    before = index.read_bytes()
    assert full(600, *words).returncode == 2
    assert index.read_bytes() == before
    assert list(tmp_path.iterdir()) == [index]


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
def test_a_batch_on_a_full_disk_goes_on_later(tmp_path, monkeypatch):
    monkeypatch.setattr("echousd.batches.batch._executor", lambda how, rooms, device: Inline())
    graph, out = tmp_path / "graph.yaml", tmp_path / "batch"
    graph.write_text(GRAPH)
    words = ("batch", "run", graph, "-o", out, "--shapes", "boxes", "--dress", "none", "--no-walls")
    done = full(20_000, *words)
    assert done.returncode in (1, 2), done.stderr
    assert "cannot be written (File too large)" in done.stdout + done.stderr
    assert not list(out.rglob("*.partial"))
    assert full(10**9, *words, "--resume").returncode == 0
    assert full(10**9, "batch", "verify", out).returncode == 0


def test_terminals_obey_no_cell_and_no_line(capsys):
    from rich.table import Table

    console = Terminal(force_terminal=False, width=200)
    table = Table("head\x1b[31m", box=None)
    table.add_row("cell\x1b]0;mine\x07 [red]as it is[/red]")
    console.print(table)
    console.print("line\u202e [bold]")
    told = capsys.readouterr().out
    assert not set(told) & {"\x1b", "\x07", "\u202e"}
    assert "[red]as it is[/red]" in told
    assert "line\\u202e [bold]" in told


def test_json_holds_no_numbers_that_are_none(capsys):
    say_json({"a": [float("nan"), 1.5, float("inf")]})
    assert json.loads(capsys.readouterr().out) == {"a": [None, 1.5, None]}
