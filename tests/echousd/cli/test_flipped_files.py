"""Damaged files of a finished room: every command works, or says in one line which file or prim is at fault.

The gate draws a few; `ECHOUSD_MUTATIONS=200` draws so many.
"""

from __future__ import annotations

import os
import random
import re
import shutil

import pytest
from flips import KINDS, Flip, end_of, fault, files_of
from mutations import COMMANDS
from small_room import BARE, StandIn, small_graph

import echousd

MANY = int(os.environ.get("ECHOUSD_MUTATIONS", "0").replace("all", "600")) or 6
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


@pytest.fixture
def stand_in(monkeypatch):
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)


def test_any_damage_of_any_file(room, stand_in):
    faults, names = [], files_of(room)
    for number in range(MANY):
        draw = random.Random(number)
        flip, command = Flip(draw.choice(names), draw.choice(KINDS), number), draw.choice(sorted(COMMANDS))
        found = fault(room, flip, command)
        faults += [f"echousd {command} with {flip}: {found}"] if found else []
    assert not faults, "\n".join(faults)
