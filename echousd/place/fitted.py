"""Fitted units are planned first, as one group along the walls; everything else is placed around them."""

import numpy as np

from echomodel.objective.table import cost_of
from echomodel.rooms.runs import Run, Site, obstacles, runs
from echomodel.rules import margins
from echomodel.vocabulary import vocabulary
from echousd.place.building import part_of
from echousd.place.problem import Problem

MISSED = 3.0  # what a relation costs that a plan breaks
SHARE = 0.5  # of what a plan costs by itself beside what the objective says of it


def fitted(at: Problem, rigid: np.ndarray) -> tuple[Problem, np.ndarray]:
    """The room with its fitted units in the best run that there is, and (n,) bool which these are; none = as it was.

    Arguments:
        rigid: (n,) bool, boxes that keep their size, whatever proportions theirs may have.
    """
    kinds = at.kinds
    none = np.zeros(len(kinds), bool)
    mine = np.array([kind.stands == "row" or (kind.stands == "over" and bool(kind.task)) for kind in kinds], bool)
    mine &= ~at.fixed & ~at.turned
    if sum(kinds[i].stands == "row" for i in np.flatnonzero(mine)) < 2:
        return at, none
    number = {int(i): k for k, i in enumerate(np.flatnonzero(mine))}
    above = vocabulary().predicate_id("above")
    over = {number[a]: number[b] for a, word, b in at.triplets.tolist()
            if word == above and a in number and b in number}  # fmt: skip
    fixed = at.fixed & np.array([kind.support in ("floor", "wall") for kind in kinds], bool)
    outline = at.plan.floor[0]
    site = Site(outline, obstacles(outline, at.plan.openings[0], at.size[fixed], at.position[fixed], at.yaw[fixed]))

    def built(run: Run) -> tuple[np.ndarray, Problem]:
        who = np.flatnonzero(mine)[run.which]
        size, position, yaw = at.size.copy(), at.position.copy(), at.yaw.copy()
        size[who], position[who], yaw[who] = run.size, run.position, run.yaw
        return who, at.at(size, position, yaw)

    def missed(run: Run) -> float:
        _, boxes = built(run)
        margin = margins(boxes.plan, stated, rules=at.rules, center=at.centre, fronts=at.plan.fronts)
        return MISSED * float((margin < 0).sum())

    stated = at.triplets[(mine | at.fixed)[at.triplets[:, [0, 2]]].all(1)]
    found = runs([kinds[i] for i in number], at.size[mine], ~rigid[mine], site, over=over, draft=at.position[mine],
                 missed=missed if len(stated) else None)  # fmt: skip
    best, least = (at, none), np.inf
    for run in found:
        who, placed = built(run)
        planned = np.isin(np.arange(len(kinds)), who)
        cost = cost_of(part_of(placed.plan, planned | fixed)) + SHARE * run.cost
        if cost < least - 1e-4:
            best, least = (placed, planned), cost
    return best
