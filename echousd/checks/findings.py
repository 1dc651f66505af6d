"""What a rule reports: one finding, and helpers that every family of rules needs to walk a stage."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from pxr import Sdf, Usd, UsdGeom


@dataclass(frozen=True)
class Finding:
    """A fault at a prim (or property) path; the message says what was found and what is allowed."""

    path: Sdf.Path
    message: str
    warning: bool = False


RuleFunction: TypeAlias = Callable[[Usd.Stage], Iterator[Finding]]


@dataclass(frozen=True)
class Rule:
    """A rule of our own: registered with UsdValidation as `name`; `doc` says what it demands."""

    name: str
    doc: str
    find: RuleFunction


def prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """All prims that are active, defined and loaded, instances included."""
    return iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))


def distinct_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """The same prims, those of an instance's prototype once."""
    seen: set[Sdf.Path] = set()
    for prim in prims(stage):
        if prim.IsInstanceProxy():
            prototype = prim.GetPrimInPrototype().GetPath()
            if prototype in seen:
                continue
            seen.add(prototype)
        yield prim


def applied(prim: Usd.Prim) -> list[str]:
    """Applied API schemas as authored, known to this process or not."""
    return list(prim.GetPrimTypeInfo().GetAppliedAPISchemas())


def is_guide(prim: Usd.Prim) -> bool:
    """Whether a prim is there for tools rather than for the eye (purpose guide or proxy)."""
    return UsdGeom.Imageable(prim).ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)
