"""Which pieces of a room do not rest, and why."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import Usd

from echousd.settle.engine import Course, SettleUnavailable, simulate
from echousd.settle.solids import Body, World, body_root, read_world
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.layouts import layout_names, showing_layout

__all__ = ["Motion", "SettleReport", "SettleUnavailable", "settle", "settle_layouts"]
SECONDS = 2.0
SHIFT, TURN = 0.01, 1.0  # metres and degrees that a piece may move
FALL, TOPPLE = 0.01, 20.0  # metres and degrees from which we say that it fell
DEEP = 0.002  # metres that pieces may overlap at the start


@dataclass(frozen=True, eq=False)
class Motion:
    """How a piece moved.

    Arguments:
        name, path: of its prim. shift: metres. turn: degrees. place: (4, 4) float, prim to world at the end, metres.
        why: a few words, empty for what rests.
    """

    name: str
    path: str
    shift: float
    turn: float
    place: np.ndarray
    why: str = ""

    @property
    def rests(self) -> bool:
        """Whether it moved less than a person would see."""
        return self.shift <= SHIFT and self.turn <= TURN

    def to_json(self) -> dict[str, Any]:
        """The entry of a report."""
        return {
            "object": self.name, "prim": self.path, "shift": round(self.shift, 4), "turn": round(self.turn, 2),
            "why": self.why,
        }  # fmt: skip


@dataclass(frozen=True)
class SettleReport:
    """How every body of a stage moved within some seconds; `layout` is "" where there is only one."""

    source: str
    seconds: float
    motions: tuple[Motion, ...]
    layout: str = ""

    @property
    def restless(self) -> tuple[Motion, ...]:
        """The pieces that do not rest, the one that moved furthest first."""
        moved = [motion for motion in self.motions if not motion.rests]
        return tuple(sorted(moved, key=lambda motion: -motion.shift))

    @property
    def ok(self) -> bool:
        """Whether everything rests."""
        return not self.restless

    @property
    def sentences(self) -> tuple[str, ...]:
        """One for every piece that does not rest."""
        which = f"{self.layout}: " if self.layout else ""
        return tuple(f"{which}{motion.name} does not rest: it {motion.why}" for motion in self.restless)

    def to_json(self) -> dict[str, Any]:
        """The entry of `echousd check --settle --json`."""
        return {
            "layout": self.layout, "seconds": self.seconds, "pieces": len(self.motions),
            "restless": [motion.to_json() for motion in self.restless],
        }  # fmt: skip


def settle_layouts(stage: Usd.Stage | str | os.PathLike[str], *, layout: int | None = None) -> tuple[SettleReport, ...]:
    """`settle` for every layout of a room, or for one; raises what it raises, and ValueError for no such layout."""
    stage = opened(stage)
    names: tuple[str | int | None, ...] = (layout_names(stage) or (None,)) if layout is None else (layout,)
    reports = []
    for name in names:
        with showing_layout(stage, name) as shown:
            reports.append(replace(settle(stage), layout="" if name is None else shown))
    return tuple(reports)


def settle(stage: Usd.Stage | str | os.PathLike[str], *, seconds: float = SECONDS) -> SettleReport:
    """Simulate the physics of a stage.

    Arguments:
        stage: an open stage or a file. seconds: of simulated time.

    Raises:
        ValueError: the file cannot be opened, or there is nothing that could move.
        SettleUnavailable: MuJoCo is not installed (extra `sim`).
    """
    stage = opened(stage)
    world = read_world(stage)
    if not world.bodies:
        raise StageError(f"{source(stage)}: no rigid body with a collider, nothing to simulate")
    try:
        course = simulate(world, seconds)
    except SettleUnavailable:
        raise
    except ValueError as error:
        raise StageError(f"{source(stage)}: cannot be simulated ({error})") from None
    motions = []
    for body, place in zip(world.bodies, course.places, strict=True):
        shift = float(np.linalg.norm(place[:3, 3] - body.place[:3, 3]))
        cosine = (np.trace(place[:3, :3] @ body.place[:3, :3].T) - 1) / 2
        turn = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        rests = shift <= SHIFT and turn <= TURN
        why = "" if rests else _why(stage, world, course, body, place)
        motions.append(Motion(body.name, body.path, shift, turn, place, why))
    return SettleReport(source(stage), seconds, tuple(motions))


def _why(stage: Usd.Stage, world: World, course: Course, body: Body, place: np.ndarray) -> str:
    """What was wrong at the start, else what it did."""
    up = -world.gravity / max(float(np.linalg.norm(world.gravity)), 1e-9)
    deepest: dict[str, float] = {}
    for first, second, depth in course.overlaps:
        for one, other in ((first, second), (second, first)):
            if _owner(stage, one) == body.path and depth > DEEP:
                name = _owner(stage, other).rpartition("/")[2]
                deepest[name] = max(depth, deepest.get(name, 0.0))
    if deepest:
        other = max(deepest, key=lambda name: deepest[name])
        return f"stands {1000 * deepest[other]:.0f} mm deep in {other}"
    drop = float((body.place[:3, 3] - place[:3, 3]) @ up)
    tilt = float(np.degrees(np.arccos(np.clip((place[:3, :3] @ body.place[:3, :3].T @ up) @ up, -1, 1))))
    if tilt > TOPPLE:
        return f"topples by {tilt:.0f} degrees"
    if drop > FALL:
        return f"falls {drop:.2f} m"
    if tilt > TURN:
        return f"tilts by {tilt:.1f} degrees: it does not stand flat"
    return "is pushed or slides"


def _owner(stage: Usd.Stage, collider: str) -> str:
    root = body_root(stage.GetPrimAtPath(collider))
    if root is not None:
        return str(root.GetPath())
    above = collider.split("/")
    return "/".join(above[:4])  # /Room/Shell/Floor, /Room/Objects/picture
