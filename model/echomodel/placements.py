"""Where one object stands in its room: what a graph says of a single node, not of a pair."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Placement:
    """Everything that the product knows of a placement, but for the code of its rule (`echomodel.rules.placements`).

    Arguments:
        others: how many other objects it names, 0 or 2.
        aliases: other words for it.
    """

    name: str
    others: int = 0
    aliases: tuple[str, ...] = ()
