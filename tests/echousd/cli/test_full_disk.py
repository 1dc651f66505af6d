"""A disk that is full: one line, exit code 2, and nothing half-written is left."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from echousd.cli.output import say_json
from echousd.cli.terminal import Terminal

GRAPH = "room: {type: bedroom, size: [4.0, 3.4]}\nobjects: {bed: double_bed, pendant: pendant_lamp}\n"
CODE = (
    "import sys; sys.path[:0] = sys.argv[1].split('|'); import resource, signal\n"
    "from echousd.cli.main import run\n"
    "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))\n"
    "sys.exit(run(sys.argv[3:]))"
)


def full(most, *words):
    """Run a command that may write no file larger than so many bytes; what the system says is what a full disk says."""
    command = [sys.executable, "-c", CODE, "|".join(p for p in sys.path if p), str(most), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.skipif(os.name != "posix", reason="this system limits no file's size")
@pytest.mark.parametrize("topic", ["graph --png", "data plot", "data rooms", "new"])
def test_what_was_begun_disappears(tmp_path, topic):
    (tmp_path / "graph.yaml").write_text(GRAPH)
    out = tmp_path / "out"
    out.mkdir()
    words = {
        "graph --png": ("graph", tmp_path / "graph.yaml", "--png", out / "graph.png"),
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
