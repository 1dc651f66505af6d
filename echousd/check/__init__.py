"""Checks of rooms on stages: relations, collisions, placement, and what USD's own validators do not catch."""

from echousd.check.check import CheckReport, check_room
from echousd.check.collisions import Collision
from echousd.check.placement import Misplacement
from echousd.check.relations import MeasuredRelation
from echousd.check.validity import RULES, Fault, register

__all__ = ["RULES", "CheckReport", "Collision", "Fault", "MeasuredRelation", "Misplacement", "check_room", "register"]
