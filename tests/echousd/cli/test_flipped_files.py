"""Damaged files of a finished room: every command works, or says in one line which file or prim is at fault.

`benchmarks/flipped_files.py` tries many more.
"""

from __future__ import annotations

import pytest
from flips import KINDS, Flip, fault, files_of
from small_room import BARE, StandIn, small_graph

import echousd

COMMANDS = ("graph", "check --json", "glb")


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return made.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", [".usda", ".usdc", ".json"])
def test_a_damaged_file_is_named(room, kind, ending):
    names = [name for name in files_of(room) if name.endswith(ending)]
    number = KINDS.index(kind)
    flip = Flip(names[number % len(names)], kind, number)
    assert not fault(room, flip, COMMANDS[number % len(COMMANDS)])
