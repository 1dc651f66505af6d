"""Numbers, texts and files that no option may take: one line, exit code 2, and nothing that a terminal obeys."""

from __future__ import annotations

import json
import math
import os

import pytest

from echousd.cli.output import check_picture, one_line, plain_json, safe
from echousd.graph.syntax import parse_yaml

ROOM = "room: bedroom\nobjects: {bed: double_bed}\n"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("new", "OUT.yaml", "--room", "bedroom", "--size", "3", "inf"), "--size is inf, allowed: a finite number"),
        (("data", "plot", "x", "-o", "y.png", "--columns", "0"), "--columns"),
        (
            ("generate", "x.yaml", "-o", "OUT", "--dress", "none", "--dress-graph"),
            "dress is 'none', allowed: some, full",
        ),
        (("batch", "x.yaml", "-o", "OUT", "--dress", "none", "--dress-graph"), "dress is 'none', allowed: some, full"),
    ],
)
def test_numbers_that_no_option_takes(echousd_command, tmp_path, words, told):
    done = echousd_command(*(str(tmp_path / word) if word.startswith("OUT") else word for word in words))
    assert done.code == 2
    assert told in done.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("nodes=0", "nodes is 0, allowed: 1 to 1000000"),
        ("threads=100000", "threads is 100000, allowed: 0 to 1024"),
        ("steps=-1", "steps is -1, allowed: 1 to 1000000000"),
        ("relation_weight=NaN", "relation_weight is nan"),
        ("optimizer.rate=Infinity", "optimizer.rate is inf"),
    ],
)
def test_numbers_that_no_recipe_takes(echousd_command, tmp_path, setting, told):
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('stage = "layout"\nsteps = 10\n')
    done = echousd_command("train", recipe, "--set", setting, "-o", tmp_path / "run")
    assert done.code == 2
    assert f"{recipe}: {told}" in done.err


def test_terminals_obey_nothing_that_a_file_says(echousd_command, tmp_path):
    assert safe("a\x1b[31mred\x07\u202eb") == "a\\x1b[31mred\\x07\\u202eb"
    assert len(one_line("x" * 10**6)) < 400
    assert one_line("two\nlines") == "two lines"
    assert safe(f"reaches from {-1e300:.2f} to {1e50:.0f} m") == "reaches from -1.000e+300 to 1.000e+50 m"
    assert safe(f"/rooms/{'1' * 60}/a.png") == f"/rooms/{'1' * 60}/a.png"  # names of files stay as they are
    named = tmp_path / "room\x1b]0;mine\x07.usda"
    done = echousd_command("graph", named)
    assert done.code == 2
    assert "\x1b" not in done.err
    assert "\\x1b]0;mine" in done.err
    graph = tmp_path / "graph.yaml"
    graph.write_text('room: bedroom\nobjects: {bed: {category: double_bed, attributes: {note: "\\e[2J [bold]"}}}\n')
    assert "\x1b" not in echousd_command("graph", graph, "--json").out
    shown = echousd_command("graph", graph).out
    assert "\x1b" not in shown
    assert "[bold]" in shown


def test_json_has_no_nan():
    text = json.dumps(plain_json({"a": [math.nan, 1.0, (math.inf,)]}), allow_nan=False)
    assert json.loads(text) == {"a": [None, 1.0, [None]]}


def test_pictures_replace_only_pictures_of_ours(echousd_command, tmp_path):
    graph, picture = tmp_path / "graph.yaml", tmp_path / "bed.png"
    graph.write_text(ROOM)
    picture.write_bytes(b"a photo of somebody's")
    done = echousd_command("graph", graph, "-o", picture)
    assert done.code == 2
    assert "exists and is no picture of echousd; choose another place or use --force" in done.err
    assert picture.read_bytes() == b"a photo of somebody's"
    assert echousd_command("graph", graph, "-o", picture, "--force").code == 0
    assert echousd_command("graph", graph, "-o", picture).code == 0  # its own
    with pytest.raises(ValueError, match="is no picture"):
        check_picture(graph, force=False)


def test_limits_say_what_was_found(echousd_command, tmp_path):
    large = tmp_path / "large.yaml"
    large.write_text(ROOM + "#" * (9 * 2**20))
    assert "9.1 MiB, allowed: 8 MiB for a scene graph" in echousd_command("graph", large).err
    large.write_text("room: bedroom\nobjects:\n" + "".join(f"  n{i}: nightstand\n" for i in range(5001)))
    assert "the graph has 5001 objects, allowed: 5000" in echousd_command("graph", large).err
    corners = [[math.cos(i / 501 * 2 * math.pi), math.sin(i / 501 * 2 * math.pi)] for i in range(501)]
    large.write_text(json.dumps({"room": {"type": "bedroom", "floor_polygon": corners}, "objects": {"bed": "bed"}}))
    assert "501 corners, allowed: 500" in echousd_command("graph", large).err
    for text in ("[" * 100_000, "a: " + "{a: " * 500):
        with pytest.raises(ValueError, match="nested too deeply"):
            parse_yaml(text)


def test_pipes_and_odd_paths_are_refused_at_once(echousd_command, tmp_path):
    for ending in ("yaml", "usda"):
        os.mkfifo(tmp_path / f"pipe.{ending}")
        done = echousd_command("graph", tmp_path / f"pipe.{ending}")
        assert done.code == 2
        assert f"pipe.{ending}: not a regular file" in done.err
    odd = tmp_path / "room.usda:SDF_FORMAT_ARGS:a=b.usda"
    odd.write_text("#usda 1.0\n")
    assert ":SDF_FORMAT_ARGS:" in echousd_command("check", odd).err
