"""Checks of rooms on stages: relations, collisions, placement, and what USD's own validators do not catch."""

from echousd.checks.placement import Misplacement
from echousd.checks.report import RULES, CheckReport, Fault, check
from echousd.place.geometry import Collision

__all__ = ["RULES", "CheckReport", "Collision", "Fault", "Misplacement", "check"]
