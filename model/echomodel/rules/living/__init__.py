"""Living rules: what a person expects of a room where its graph is silent, each with margin, verdict and sentence."""

from echomodel.rules.living.faults import REACHED, RULES, Fault, Rule, faults, faults_of, missed, unreached, walk
from echomodel.rules.living.plan import Plan, plan_of

__all__ = ["REACHED", "RULES", "Fault", "Plan", "Rule", "faults", "faults_of", "missed", "plan_of", "unreached", "walk"]
