"""A room in which places are looked for: what stays the same while its boxes move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from echomodel.objective import Plan
from echomodel.objective.support import ON_FLOOR
from echomodel.openings import Opening
from echomodel.vocabulary import Category
from echousd.place.distances import BEHIND, kept_behind
from echousd.place.geometry import Floor
from echousd.place.problem import Posed, Problem, wall_gaps


@dataclass(frozen=True, eq=False)
class Setting:
    """What stays the same.

    Arguments:
        plan: N boxes where they were drawn, what is told of them, their floor and openings, as the objective sees them.
        problem: the same for the solver. draft, heading: (n, 3) and (n,) float, where the boxes were drawn.
        turned: (n,) bool, headings that are stated. behind: (n,) float, metres kept between backs and walls.
        anchor: (n,) int, whom each attends, -1 = nobody; stances: how.
    """

    plan: Plan
    problem: Problem
    size: np.ndarray
    draft: np.ndarray
    heading: np.ndarray
    turned: np.ndarray
    behind: np.ndarray
    anchor: np.ndarray
    stances: tuple[str, ...]

    @property
    def kinds(self) -> tuple[Category, ...]:
        """Rows of the vocabulary."""
        return self.plan.kinds

    @property
    def carrier(self) -> np.ndarray:
        """(n,) int, as `Problem.carrier`."""
        return self.problem.carrier

    @property
    def fixed(self) -> np.ndarray:
        """(n,) bool, boxes that must not move."""
        return self.problem.fixed

    @property
    def floor(self) -> Floor:
        """The floor."""
        assert self.problem.floor is not None
        return self.problem.floor

    @cached_property
    def shared(self) -> np.ndarray:
        """(n, n) float: depth in metres to which two boxes may overlap; without bound for a carrier and its load."""
        i, j, allowed = (values.numpy() for values in self.plan.couples)
        out = np.full((len(self.size), len(self.size)), np.inf)
        out[i, j] = out[j, i] = allowed
        return out

    @cached_property
    def hanging(self) -> np.ndarray:
        """(n,) bool, lamps of the ceiling that go where what they light goes."""
        return np.array([kind.support == "ceiling" for kind in self.kinds], bool) & ~self.fixed

    @cached_property
    def walls(self) -> list[tuple[np.ndarray, np.ndarray, float, float]]:
        """Start (2,), direction (2,), length and the heading of what stands with its back to it, for each wall."""
        start, edge = self.floor.polygon, self.floor.edge
        length = np.linalg.norm(edge, axis=1)
        yaw = np.arctan2(self.floor.normal[:, 0], self.floor.normal[:, 1])
        return [(start[k], edge[k] / length[k], float(length[k]), float(yaw[k])) for k in range(len(start))]

    @cached_property
    def grain(self) -> float:
        """Heading of the longest wall, radians: free furniture stands parallel to it."""
        return max(self.walls, key=lambda wall: wall[2])[3]

    def standing(self, i: int) -> bool:
        """Whether a box stands on the floor itself."""
        return bool(self.carrier[i] == ON_FLOOR)

    def told(self, i: int) -> np.ndarray:
        """(r, 3) int, the triplets that name a box."""
        rows: np.ndarray = self.problem.triplets[(self.problem.triplets[:, [0, 2]] == i).any(1)]
        return rows


def setting_of(at: Posed, turned: np.ndarray, *, openings: Sequence[Opening], outline: np.ndarray) -> Setting:
    """The setting of a posed problem with a floor, whose boxes were drawn where they stand.

    Arguments:
        turned: (n,) bool, headings that are stated.
        openings: doors and windows. outline: (k, 2) float, the floor's corners in the order that these count edges in.
    """
    problem = at.problem
    plan = at.plan(outline, openings)
    vars(plan)["carrier"] = torch.from_numpy(problem.carrier)
    spread = kept_behind(problem.categories, at.size, np.full(len(at.size), np.nan))  # drawn ones are too alike
    told = np.isin(np.arange(len(spread)), [one.subject for one in problem.stated if not one.others])  # of walls
    behind = np.where(problem.fixed, problem.behind, np.where(told, np.minimum(spread, BEHIND[1]), spread))
    leaning = np.flatnonzero(~np.isnan(problem.wall[:, 0, 0]) & ~problem.fixed)
    draft = at.position.copy()
    away = wall_gaps(problem.wall, at.size, draft, at.yaw) - behind  # which the solver would take up later
    draft[leaning[:, None], [0, 2]] -= away[leaning, None] * problem.wall[leaning, 1]
    return Setting(plan, problem, at.size, draft, at.yaw, turned, behind, plan.anchor.numpy(), plan.stance)
