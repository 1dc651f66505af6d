"""What a rule is and reports: a finding; and helpers that every family of rules needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

from pxr import Sdf, Usd

from echousd.checks.reading import Reading
from echousd.stage.values import UNREADABLE

Function: TypeAlias = Callable[..., Iterator[Any]]


@dataclass(frozen=True)
class Finding:
    """A fault at a prim (or property) path; the message says what was found and what is allowed."""

    path: Sdf.Path
    message: str
    warning: bool = False


@dataclass(frozen=True)
class Rule:
    """A rule of our own, called `name`, and what finds its faults."""

    name: str
    find: Callable[[Reading], Iterator[Finding]]


RULES: list[Rule] = []  # filled by the modules of rules as they are imported


def rule(name: str, over: str = "", of: type | None = None) -> Callable[[Function], Callable[[Reading], Any]]:
    """Make a rule of a generator of findings.

    Arguments:
        over: what of a `Reading` the generator is called for one by one, "" = for the reading alone. What it yields as
            text is said of that prim; one that cannot be read is passed over, as the rules on values report it.
        of: schema that these prims must be of, or have applied.
    """

    def made(function: Function) -> Callable[[Reading], Any]:
        def find(reading: Reading) -> Iterator[Finding]:
            for each in getattr(reading, over):
                if of is None or (each.HasAPI(of) if issubclass(of, Usd.APISchemaBase) else each.IsA(of)):
                    try:
                        for found in function(reading, each):
                            yield Finding(each.GetPath(), found) if isinstance(found, str) else found
                    except UNREADABLE:
                        continue

        RULES.append(Rule(name, find if over else function))
        return RULES[-1].find

    return made


def applied(prim: Usd.Prim) -> list[str]:
    """Applied API schemas as authored, known to this process or not."""
    return list(prim.GetPrimTypeInfo().GetAppliedAPISchemas())
