"""Terms of relations: what the graph states, between two pieces and of single ones in the room."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from echomodel.objective.found import Found, found, joined, nobody
from echomodel.objective.plan import Plan
from echomodel.rules import RULE_SETS, rule_set
from echomodel.rules.geometry import pairs
from echomodel.rules.placements import Spread, Walls, margin_of
from echomodel.vocabulary import vocabulary


@dataclass(frozen=True)
class Told:
    """The margins of a relation wherever the graph states it, by the plan's own set of rules."""

    predicate: str

    @property
    def means(self) -> str:
        """What a graph asks for with the word."""
        rule = rule_set("strict").rules.get(self.predicate)
        return rule.means if rule is not None else ""

    def __call__(self, plan: Plan) -> Found:
        """Two pieces stand to each other as the graph says."""
        rules = rule_set(plan.rules)
        rule = rules.rules.get(self.predicate)
        i, j = plan.told(self.predicate)
        if rule is None or rule.margin is None or not len(i):
            return nobody(plan.size)
        keep = plan.moved[i] | plan.moved[j]
        i, j = i[keep], j[keep]
        if not len(i):
            return nobody(plan.size)
        of = pairs(plan, i, j, plan.centres, oriented=rules.oriented, fronts=plan.fronts)
        return found(i, rule.margin(of), other=j)


def placed(plan: Plan) -> Found:
    """A piece stands in the room as the graph says: against a wall, in a corner, between two others."""
    out = nobody(plan.size)
    for one in plan.stated:
        rows = [plan.everywhere(number) for number in (one.subject, *one.others)]
        every = {number: Spread(plan.size[at], plan.position[at], plan.yaw[at])
                 for number, at in zip((one.subject, *one.others), rows, strict=True)}  # fmt: skip
        floor = plan.floor[int(plan.scene[one.subject])]
        corners = floor[torch.isfinite(floor).all(1)]
        walls = Walls(corners.detach().cpu().numpy()) if len(corners) else None
        if walls is None and not one.others:
            continue
        margin = margin_of(one, every, walls, {one.subject: plan.kinds[one.subject].name})
        about = rows[1] if one.others else torch.full_like(rows[0], -1)
        number = [row.name for row in vocabulary().placements].index(one.placement)
        out = joined(out, found(rows[0], margin, other=about, words=torch.full_like(rows[0], number)))
    return out


def measured() -> list[tuple[str, str]]:
    """Names of the predicates that a set of rules measures, each with the unit of its margin."""
    known = {name for rules in RULE_SETS.values() for name, rule in rules.rules.items() if rule.margin is not None}
    return [
        (row.name, "share" if row.measures == "size" else "m") for row in vocabulary().predicates if row.name in known
    ]
