"""Relation rules, defined once: verdicts for labels, checks and metrics, signed margins for placing and guidance."""

from echomodel.rules.labels import aligned, centred, facing, label_relations, label_rooms, opposite  # registers them
from echomodel.rules.margins import fronts, margins, measured, verdicts
from echomodel.rules.sets import RULE_SETS, Rule, RuleSet, rule, rule_set

__all__ = [
    "RULE_SETS", "Rule", "RuleSet", "aligned", "centred", "facing", "fronts", "label_relations", "label_rooms",
    "margins", "measured", "opposite", "rule", "rule_set", "verdicts",
]  # fmt: skip
