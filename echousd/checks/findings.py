"""What a rule reports: one finding, and helpers that every family of rules needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from pxr import Sdf, Usd

from echousd.checks.reading import Reading


@dataclass(frozen=True)
class Finding:
    """A fault at a prim (or property) path; the message says what was found and what is allowed."""

    path: Sdf.Path
    message: str
    warning: bool = False


RuleFunction: TypeAlias = Callable[[Reading], Iterator[Finding]]


@dataclass(frozen=True)
class Rule:
    """A rule of our own: registered with UsdValidation as `name`; `doc` says what it demands."""

    name: str
    doc: str
    find: RuleFunction


def applied(prim: Usd.Prim) -> list[str]:
    """Applied API schemas as authored, known to this process or not."""
    return list(prim.GetPrimTypeInfo().GetAppliedAPISchemas())
