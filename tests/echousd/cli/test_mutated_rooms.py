"""One wrong value anywhere in a finished room: every command works, or says in one line which file or prim is at fault.

The gate draws a sample, `ECHOUSD_MUTATIONS=3000` one of so many; `all` tries every property with every value on every
command.
"""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import COMMANDS, SHAPES, VALUES, Mutation, mutate, properties
from pxr import Usd
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.cli.main import run

SECONDS = 60  # for one command: a hang, not a busy machine
ASKED = os.environ.get("ECHOUSD_MUTATIONS", "12")
THOROUGH = ASKED == "all"
QUICK = ("graph", "check --json", "glb")

# What the long run found first.
KNOWN = (
    Mutation("/Room/SceneGraph/nightstand_left__close_by__bed.echo:subject", "huge"),
    Mutation("/Room/Objects/bed.xformOp:translate", "long text"),
    Mutation("/Room/Objects/bed/bed_collider.xformOp:translate", "truth"),
    Mutation("/Room/Objects/pendant.xformOp:rotateY", "nan"),
    Mutation("/Room/Shell/Floor/Floor_mesh.faceVertexCounts", "infinity"),
    Mutation("/Room/Objects/bed/geo/bed_mesh.points", "texts"),
    Mutation("/Room/Shell/Floor/Floor_mesh.primvars:normals", "long text"),
    Mutation("/Room/Objects/bed/geo/bed_mesh.faceVertexIndices", "negative ints"),
    Mutation("/Room/Objects/bed.semantics:labels:category", "negative"),
    Mutation("/Room/Lights/ceiling.light:materialSyncMode", "points of NaN", "sample"),
    Mutation("/Room/Looks/room_wood/image.inputs:file", "text"),
)


class Hang(Exception):
    """A command that does not end."""


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> Path:
    made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return made.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.fixture(autouse=True)
def watch(monkeypatch) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Hang

    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)
    before = signal.signal(signal.SIGALRM, stop)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def fault(room: Path, mutation: Mutation, command: str, folder: Path, capsys) -> str:
    """What is wrong with how a command takes a mutation, "" for nothing."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(room.parent, folder / room.parent.name)
    mutant = folder / room.parent.name / room.name
    mutate(mutant, mutation)
    capsys.readouterr()
    signal.alarm(SECONDS)
    try:
        code = run(COMMANDS[command](mutant, folder / "out"))
    except Hang:
        return f"does not end in {SECONDS} s"
    finally:
        signal.alarm(0)
    told = capsys.readouterr()
    last = (told.err.strip().splitlines() or [""])[-1]
    if code not in (0, 1, 2):
        return f"exit code {code}: {last}"
    if code == 2 and not (str(folder) in last or "</" in last):
        return f"names neither file nor prim: {last}"
    return "a control character on the terminal" if "\x1b" in told.out + last else ""


@pytest.mark.parametrize("command", QUICK)
@pytest.mark.parametrize("mutation", KNOWN, ids=lambda m: f"{m.path.rpartition('/')[2]}-{m.value}")
def test_known_faults(room, mutation, command, tmp_path, capsys):
    assert not fault(room, mutation, command, tmp_path / "room", capsys)


@settings(
    max_examples=int(ASKED.replace("all", "12")),
    derandomize=True,
    database=None,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
    ],  # `fault` empties what was captured
)
@given(data=st.data())
def test_a_sample_of_all_values_at_all_properties(room, data, tmp_path_factory, capsys):
    chosen = Mutation(
        data.draw(st.sampled_from(properties(Usd.Stage.Open(str(room))))),
        data.draw(st.sampled_from(sorted(VALUES))),
        data.draw(st.sampled_from(SHAPES)),
    )
    command = data.draw(st.sampled_from(sorted(COMMANDS)))
    found = fault(room, chosen, command, tmp_path_factory.mktemp("mutant"), capsys)
    assert not found, f"echousd {command} with {chosen}"


@pytest.mark.skipif(not THOROUGH, reason="hours: ECHOUSD_MUTATIONS=all")
def test_all_values_at_all_properties(room, tmp_path, capsys):
    faults = []
    for path in properties(Usd.Stage.Open(str(room))):
        for value in VALUES:
            for shape in SHAPES if value == "nan" else SHAPES[:1]:
                for command in COMMANDS:
                    mutation = replace(Mutation(path, value), shape=shape)
                    found = fault(room, mutation, command, tmp_path / "room", capsys)
                    if found:
                        faults.append(f"echousd {command} with {mutation}: {found}")
    assert not faults, "\n".join(faults)
