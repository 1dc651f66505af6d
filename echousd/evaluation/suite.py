"""The suite: every system is asked the same rooms, and every table holds the same honest rows."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np

from echomodel.loading import load_model
from echomodel.metrics.pictures import SIDE, WEIGHTS, features
from echomodel.metrics.tasks import tasks_of
from echomodel.progress import StageListener
from echomodel.roomboxes import RoomBoxes
from echousd.evaluation.runs import HONEST, SECTIONS, Run, SuiteSettings, rooms_against, rooms_of, run_systems
from echousd.evaluation.sections import RUNNERS
from echousd.evaluation.systems import System, described

OWN = {"relations", "shapes"}  # sections that ask by tasks of their own
LIBRARIES = ("numpy", "scipy", "torch", "scikit-learn", "echousd")


def evaluate(settings: SuiteSettings, progress: StageListener | None = None) -> tuple[dict[str, Any], Run]:
    """Lay out and score: what the report says, and the rooms.

    Raises ValueError for systems, sets and sections that there are not.
    """
    for kind in WEIGHTS:
        if path := getattr(settings, kind):  # hours before they are wanted
            features(np.zeros((1, SIDE, SIDE, 3), np.uint8), kind, path)
    systems = [System.parse(name) for name in dict.fromkeys([*settings.systems, *HONEST])]
    systems = list({system.name: system for system in systems}.values())
    theirs = {system.name: rooms_of(system, settings) for system in systems if system.foreign}
    rooms, others = rooms_against(settings)
    tasks = tasks_of(rooms, settings.seed, told=settings.relations)
    chosen = [name for name in SECTIONS if name in (settings.only or SECTIONS)]
    able = [s for s in systems if not s.foreign and {*chosen} - OWN]
    asked, seconds = run_systems(able, tasks, settings, progress)
    made = {s.name: asked.get(s.name) or [t.room for t in theirs[s.name][0]] for s in systems if s.foreign or asked}
    of = {s.name: theirs[s.name][0] if s.foreign else tasks for s in systems}
    run = Run(
        settings, systems, tasks, others, made, of, seconds, [note for _, notes in theirs.values() for note in notes]
    )
    tables = []
    for number, name in enumerate(chosen):
        tables += RUNNERS[name](run)
        if progress:
            progress("figures", number + 1, len(chosen))
    found = {
        "settings": {name: value for name, value in asdict(settings).items() if name != "workers"},
        "about": about(systems, rooms, others),
        "systems": {system.name: described(system) for system in systems},
        "tables": tables,
        "missing": run.missing,
    }
    return found, run


def about(systems: Sequence[System], rooms: Sequence[RoomBoxes], others: Sequence[RoomBoxes]) -> dict[str, Any]:
    """Versions, and hashes of data and weights."""
    text = json.dumps([room.to_json() for room in [*rooms, *others]], sort_keys=True)
    weights = {"shipped": load_model(None).hash} | {s.name: load_model(s.weights).hash for s in systems if s.weights}
    return {
        "versions": {"python": platform.python_version()} | {name: version(name) for name in LIBRARIES},
        "data": hashlib.sha256(text.encode()).hexdigest(),
        "weights": weights,
        "rooms": len(rooms),
        "objects": sum(map(len, rooms)),
    }
