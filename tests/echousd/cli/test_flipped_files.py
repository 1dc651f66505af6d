"""Damaged files of a finished room: every command works, or says in one line which file or prim is at fault.

`benchmarks/flipped_files.py` tries many more.
"""

from __future__ import annotations

import re
import shutil

import pytest
from flips import KINDS, Flip, end_of, fault, files_of
from mutations import COMMANDS
from small_room import BARE, StandIn, small_graph

import echousd

DAMAGED = ("graph", "check --json", "glb")


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return made.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.mark.parametrize("command", ["graph --json", "check --json", "usda"])
@pytest.mark.parametrize("name", ["bedroom.usda", "layers/graph.usda", "assets/bed/bed.usda"])
def test_bytes_that_are_no_text(room, name, command, tmp_path):
    """OpenUSD hands them on, in values, in names, and where it quotes a layer that it cannot read."""
    folder = shutil.copytree(room.parent, tmp_path / "bedroom")
    text = (folder / name).read_bytes()
    for place in [found.end() - 1 for found in re.finditer(rb'["@]\w|\n +\w', text)][:40:10]:
        (folder / name).write_bytes(text[:place] + b"\xff" + text[place + 1 :])
        assert not end_of(COMMANDS[command](folder / room.name, tmp_path / "out"), tmp_path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", [".usda", ".usdc", ".json"])
def test_a_damaged_file_is_named(room, kind, ending):
    names = [name for name in files_of(room) if name.endswith(ending)]
    number = KINDS.index(kind)
    flip = Flip(names[number % len(names)], kind, number)
    assert not fault(room, flip, DAMAGED[number % len(DAMAGED)])
