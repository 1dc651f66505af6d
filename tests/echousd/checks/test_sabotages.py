"""Every sabotage of the table gets a finding that names what is wrong, and where."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import torch
from pxr import Usd

import echousd
from echomodel.boxes import Boxes
from echousd.checks import RULES, CheckReport, check, report
from echousd.checks.reading import Reading
from echousd.checks.report import JOINED, check_layout, find_faults, safely
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.room import RoomOptions

sys.path.insert(0, str(Path(__file__).parent))
from sabotages import SABOTAGES, Sabotage
from test_check import FOUND

Named = set[tuple[str, str]]

# name -> category, size, place and turn, with which the furniture branch makes and dresses a bedroom
PLACES = {
    "bed": ("double_bed", (1.8, 1.0, 2.1), (0, 0, -0.84), 0.0),
    "nightstand": ("nightstand", (0.5, 0.5, 0.4), (1.25, 0, -1.68), 0.0),
    "lamp": ("table_lamp", (0.25, 0.45, 0.25), (1.25, 0.5, -1.68), 0.0),
    "wardrobe": ("wardrobe", (1.6, 2.2, 0.6), (-1.2, 0, 1.59), np.pi),
    "tv_stand": ("tv_stand", (1.4, 0.5, 0.4), (0.9, 0, 1.69), np.pi),
    "tv": ("tv", (1.0, 0.6, 0.15), (0.9, 0.5, 1.69), np.pi),
    "pendant": ("pendant_lamp", (0.5, 0.5, 0.5), (0, 2.1, 0.4), 0.0),
}
RELATIONS = (
    ("lamp", "standing_on", "nightstand"),
    ("tv", "standing_on", "tv_stand"),
    ("nightstand", "close_by", "bed"),
)


def bedroom(folder: Path) -> Path:
    """The root layer of a room of walls, furniture and its dressing that `check` finds nothing in."""
    graph = SceneGraph(
        room=RoomSpec("bedroom", size=(4.4, 3.8), height=2.6),
        nodes=tuple(Node(name, told[0]) for name, told in PLACES.items()),
        relations=tuple(Relation(*told) for told in RELATIONS),
    )
    columns = zip(*(told[1:] for told in PLACES.values()), strict=True)
    boxes = Boxes(*(torch.tensor(np.array(column), dtype=torch.float32) for column in columns))
    options = RoomOptions(walls=True, dress="some")
    return echousd.generate(graph, seed=1, shapes="parts", boxes=boxes, options=options).save(folder, preview=False)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Usd.Stage:
    return Usd.Stage.Open(str(bedroom(tmp_path_factory.mktemp("room") / "bedroom")))


def named(told: CheckReport) -> Named:
    """(rule or problem, prim or object) of all that a report says."""
    found = {(fault.rule, fault.prim) for fault in (*told.errors, *told.warnings)}
    found |= {(wrong.problem, wrong.object) for wrong in told.placement}
    found |= {("collision", name) for hit in told.collisions for name in (hit.first, hit.second)}
    return found | {("broken", one.subject) for one in told.broken}


def after(stage: Usd.Stage, sabotage: Sabotage, judge: Callable[[Usd.Stage], Named]) -> Named:
    """What is named once a stage is sabotaged; the stage is as it was then."""
    try:
        with Usd.EditContext(stage, stage.GetSessionLayer()):
            sabotage.change(stage)
        return judge(stage)
    finally:
        stage.GetSessionLayer().Clear()
        for layer in stage.GetUsedLayers():
            if layer.dirty:
                layer.Reload(force=True)


def judged(rule: str) -> Callable[[Usd.Stage], Named]:
    """The part of a check that a finding comes from: one rule of ours, what is measured, or all."""
    ours = next((each for each in RULES if each.name == rule), None)
    if ours is not None and ours not in JOINED:
        return lambda stage: {(rule, str(found.path)) for found in safely(ours, Reading(stage))}

    def faults(stage: Usd.Stage) -> Named:  # OpenUSD's, or of one rule that looks at the articulated room as well
        with patch.object(report, "RULES", (ours,) if ours else ()), ExitStack() as stack:
            if ours:
                stack.enter_context(patch.object(report, "_faults_of_usd", lambda stage: (set(), set())))
            return named(CheckReport("", (), (), *find_faults(Reading(stage))))

    def layout(stage: Usd.Stage) -> Named:
        with ExitStack() as stack:
            if rule != "collision":  # meshes that reach into one another take longest to find
                stack.enter_context(patch.object(report, "find_collisions", lambda whole: ()))
            return named(CheckReport("", (), (check_layout(Reading(stage), "", "strict")[1],), (), ()))

    return faults if ":" in rule else layout


def test_nothing_is_wrong_with_the_room(room: Usd.Stage) -> None:
    assert named(check(room)) == set()


@pytest.mark.parametrize("sabotage", SABOTAGES, ids=lambda one: one.name)
def test_each_sabotage_is_named(room: Usd.Stage, sabotage: Sabotage) -> None:
    assert (sabotage.rule, sabotage.prim) in after(room, sabotage, judged(sabotage.rule))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda told: told["verdicts"][0].update(state="broken"), "says that 'lamp standing_on nightstand' is broken"),
        (lambda told: told["verdicts"].pop(), "says nothing of 'nightstand close_by bed'"),
        (lambda told: told["relations"].update(kept=9), "its verdicts say 3 kept"),
        (lambda told: told.update(seed=-1), "seed is -1, allowed"),
    ],
)
def test_a_manifest_says_what_is_measured(room: Usd.Stage, change: Callable[[dict], object], message: str) -> None:
    root = Path(room.GetRootLayer().realPath)
    file = root.with_suffix(".json")
    before = file.read_text()
    told = json.loads(before)
    change(told)
    file.write_text(json.dumps(told))
    with ExitStack() as stack:
        stack.callback(file.write_text, before)
        stack.enter_context(patch.object(report, "find_faults", lambda stage: ((), ())))  # of the stage itself
        stack.enter_context(patch.object(report, "find_collisions", lambda whole: ()))
        errors = check(room).errors
        found = [fault for fault in errors if message in fault.message]
        assert {(fault.rule, fault.prim) for fault in found} == {("echo:Manifest", "/Room")}, errors
        layer = root.parent / "layers/layout.usda"
        written = layer.read_text()
        layer.write_text(written + "\n")  # somebody's own change: the room is measured, its manifest no longer asked
        found = [fault for fault in check(room).errors if fault.rule == "echo:Manifest"]
        layer.write_text(written)
        assert bool(found) == ("seed" in message)


def test_every_rule_has_a_sabotage_or_a_broken_file() -> None:
    told = {sabotage.rule for sabotage in SABOTAGES} | set().union(*FOUND.values())
    assert {rule.name for rule in RULES} - told == {"echo:PayloadsLoaded"}  # has a test of its own
