"""The objective: what a person expects of a room, each term with its margin, weight and sentence."""

from echomodel.objective.faults import BY_EYE, Fault, faults, faults_of, unreached
from echomodel.objective.plan import Plan, plan_of
from echomodel.objective.table import KINDS, TERMS, WALKED, Term
from echomodel.objective.walks import walk

__all__ = [
    "BY_EYE", "KINDS", "TERMS", "WALKED", "Fault", "Plan", "Term", "faults", "faults_of", "plan_of",
    "unreached", "walk",
]  # fmt: skip
