"""Every expectation of a room in one table: what is looked at, in which unit, its weight, what a person is told.

Its rows are those of `terms.toml`, and one for each relation.

In a conflict the kinds count in their order: relations, physics, living, composition. Whoever draws, moves, judges or
explains a room asks this table and holds no distance of his own.
"""

import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from echomodel.arrays import Array, at_least, at_most, repeat
from echomodel.files import tables
from echomodel.late import Late
from echomodel.objective import access, company, composition, crowding, physics, sizes, walks
from echomodel.objective.plan import Found, Plan, found, nobody
from echomodel.vocabulary import Category, vocabulary

# What a broken term costs, and a unit that is missed of it, by its kind.
COST = {"relations": (6.0, 4.0), "physics": (3.0, 10.0), "living": (2.0, 1.0), "composition": (1.5, 1.0)}
KINDS = tuple(COST)


@dataclass(frozen=True)
class OfKind(Late):
    """The function of a term at `place`, imported and asked where a room has boxes of a kind."""

    kind: Callable[[Category], object]

    @cached_property
    def itself(self) -> Callable[[Plan], Found]:
        """The function."""
        return Late(self.place).itself

    def __call__(self, plan: Plan) -> Found:
        return self.itself(plan) if plan.has(self.kind) else nobody(plan.size)


@dataclass(frozen=True)
class Term:
    """One expectation.

    Arguments:
        find: the boxes that it is about with their margins in its unit, >= 0 iff kept; reports call the term by its
            name, its docstring is what is expected.
        says: sentences for a person, with {a} the box, {b} what it is about, {x} the number measured.
        source: where its numbers come from.
        kind: one of `KINDS`. unit: of the margin: `m`, `rad` or `share`.
        slack: what a search and a loss ask for beyond the margin, in its unit.
        ease: the same of a room where nothing is wrong any longer, 0 = no more than its slack.
        weight: of a missed unit; none counts twice what breaking it at all does.
    """

    find: Callable[[Plan], Found]
    says: tuple[str, ...]
    source: str
    kind: str = "living"
    unit: str = "m"
    slack: float = 0.01
    ease: float = 0.0
    weight: float = 1.0

    @property
    def eased(self) -> "Term":
        """The same term, as it is asked of a room where nothing is wrong any longer."""
        return replace(self, slack=max(self.slack, self.ease))

    @property
    def name(self) -> str:
        """How reports call it."""
        return self.find.__name__

    @property
    def means(self) -> str:
        """What is expected, one sentence."""
        told = self.find.itself if isinstance(self.find, OfKind) else self.find
        return (inspect.getdoc(told) or "").partition("\n\n")[0].replace("\n", " ")


REAL = "real rooms (statistics of 896, 300 measured): "
MODULES = {"access": access, "company": company, "composition": composition, "crowding": crowding,
           "physics": physics, "sizes": sizes, "walks": walks}  # fmt: skip
# Modules of which every term looks at boxes of some kind, alone or beside others: asked of rooms that have one.
OF_KINDS: dict[str, Callable[[Category], object]] = {
    "seating": lambda kind: kind.role == "board" or kind.stands == "at",
    "lounging": lambda kind: kind.role == "sofa" or kind.stands in ("company", "before"),
    "sight": lambda kind: kind.role == "screen" or kind.stands == "opposite",
    "fitted": lambda kind: kind.task or kind.clear or kind.stands in ("row", "over"),
}
RELATIONS = (
    *(Term(physics.stated(name), (f"{{a}} is not {name} {{b}}",), "what the word means", "relations", unit)
      for name, unit in physics.measured()),
    Term(physics.placed, tuple(f"{{a}} is not {row.name}" for row in vocabulary().placements), "what the words mean",
         "relations"),
)  # fmt: skip


def _read(*sections: str) -> Iterator[Term]:
    """The rows of `terms.toml`, section by section, those of walks being of the kind `living`."""
    rows = tables("terms.toml", __file__)
    for section in sections:
        for row in rows.get(section, ()):
            module, _, name = row.pop("find").partition(".")
            source = row.pop("source", None) or REAL + row.pop("real")
            place = f"echomodel.objective.{module}:{name}"
            find = OfKind(place, OF_KINDS[module]) if module in OF_KINDS else getattr(MODULES[module], name)
            yield Term(find, tuple(row.pop("says")), source, section if section in KINDS else "living", **row)


TERMS = (*RELATIONS, *_read(*KINDS))
WALKED = tuple(_read("walked"))  # of one room, told apart: a walk takes as long as many poses, and has no gradient


def costs_of(rows_of: Sequence[tuple[Term, Found]], room: Plan) -> tuple[Found, Array]:
    """The rows (P,) of what terms found in a room or its copies, all together, and what each costs (P,) float."""
    every = [(term, seen) for term, seen in rows_of if len(seen.who)]
    if not every:
        return nobody(room.size), room.size[:0, 0]
    xp, count = room.kit, [len(seen.who) for _, seen in every]
    row = [(term.slack, *COST[term.kind], term.weight, term.kind in ("relations", "physics")) for term, _ in every]
    slack, broken, each, weight, always = repeat(room.numbers(row), xp.asarray(count)).T
    who, other, margin = (xp.concat([getattr(seen, name) for _, seen in every]) for name in ("who", "other", "margin"))
    missed = at_most(at_least(slack - margin, 0.0), 2.0)
    blamed = ~room.fixed[who] | (always > 0)
    return found(who, margin, other=other), (broken * (margin < 0) + each * weight * missed) * blamed


def cost_of(room: Plan) -> float:
    """What a plan of one room costs by all terms."""
    return float(costs_of([(term, term.find(room)) for term in TERMS], room)[1].sum())
