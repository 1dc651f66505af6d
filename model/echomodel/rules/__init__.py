"""Relation rules, defined once: verdicts for labels, checks and metrics, signed margins for placing and guidance."""

from echomodel.late import lates
from echomodel.rules.margins import fronts, judged, margins, measured, verdicts
from echomodel.rules.sets import RULE_SETS, Rule, RuleSet, aligned, centred, facing, opposite, rule, rule_set

label_relations, label_rooms = lates("echomodel.rules.labels", "label_relations", "label_rooms")
__all__ = [
    "RULE_SETS", "Rule", "RuleSet", "aligned", "centred", "facing", "fronts", "judged", "label_relations",
    "label_rooms", "margins", "measured", "opposite", "rule", "rule_set", "verdicts",
]  # fmt: skip
