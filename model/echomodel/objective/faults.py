"""What a person would point at in a room: the terms that it misses, in words."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from echomodel.arrays import rows
from echomodel.objective.plan import Plan
from echomodel.objective.table import TERMS, WALKED, Term

MOST = 2.0  # of a missed unit counts
ROUNDING = 1e-4  # metres: boxes are written to a tenth of a millimetre, meshes in single precision
BY_EYE = ("living", "composition")  # kinds of terms; relations and collisions have verdicts of their own


@dataclass(frozen=True)
class Fault:
    """Something that a person would point at.

    Arguments:
        object: number of the box; other: number of the box that it is about, -1 = none.
        rule: name of the term that is broken. margin: by how much, negative, metres, radians or a share.
        says: the sentence, with {a} and {b} for the two.
    """

    object: int
    other: int
    rule: str
    margin: float
    says: str = field(compare=False)

    def sentence(self, names: Sequence[str]) -> str:
        """The fault in words, with the names of the boxes."""
        other = names[self.other] if self.other >= 0 else "a wall"
        return self.says.replace("{a}", names[self.object]).replace("{b}", other)


def faults(plan: Plan) -> list[Fault]:
    """What a person would point at in one room, in the order of the terms, each box at most once by each."""
    return faults_of(plan) + unreached(plan)


def faults_of(plan: Plan, kinds: Collection[str] = BY_EYE, terms: Sequence[Term] = TERMS) -> list[Fault]:
    """The faults of all terms of some kinds, for any number of rooms; numbers count through them."""
    out = []
    for term in (term for term in terms if term.kind in kinds):
        seen = term.find(plan)
        for row in rows(seen.margin < -ROUNDING).tolist():
            who, other = int(seen.who[row]), int(seen.other[row])
            if bool(plan.fixed[who]):
                continue
            text, number = term.says[int(seen.words[row]) % len(term.says)], max(float(seen.measure[row]), 0.0)
            sentence = text.format(a="{a}", b="{b}", x=number)
            out.append(Fault(who, other, term.name, float(seen.margin[row]), sentence))
    return out


def unreached(plan: Plan) -> list[Fault]:
    """What closes ways in one room, or cannot be walked to; nothing where the floor is unknown."""
    return faults_of(plan, terms=WALKED)
