"""The objective: what a person expects of a room, each term with its margin, weight and sentence."""

from echomodel.objective.faults import BY_EYE, REACHED, Fault, faults, faults_of, unreached, walk
from echomodel.objective.plan import Plan, plan_of
from echomodel.objective.table import KINDS, TERMS, Term

__all__ = [
    "BY_EYE", "KINDS", "REACHED", "TERMS", "Fault", "Plan", "Term", "faults", "faults_of", "plan_of",
    "unreached", "walk",
]  # fmt: skip
