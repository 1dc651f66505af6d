"""How objects usually stand to one another, where nobody says it: what a first graph is made with."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Habit:
    """How objects of some categories stand to the first of `anchors` that the room holds.

    Arguments:
        categories: whose habit it is.
        anchors: categories to relate to, the preferred ones first.
        predicates: what holds between the object and its anchor.
        sides: predicates of which successive objects at one anchor get one each, in turn.
        among: what holds between an object and the first of its kind at the anchor, for pieces that come in sets.
    """

    categories: tuple[str, ...]
    anchors: tuple[str, ...]
    predicates: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()
    among: tuple[str, ...] = ()
