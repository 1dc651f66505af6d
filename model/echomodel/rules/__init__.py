"""Relation rules, defined once: verdicts for labels, checks and metrics, signed margins for placing and guidance."""

from echomodel.late import Late
from echomodel.rules.margins import fronts, judged, margins, measured, verdicts
from echomodel.rules.sets import RULE_SETS, Rule, RuleSet, aligned, centred, facing, opposite, rule, rule_set

label_rooms = Late("echomodel.rules.labels:label_rooms")
label_relations = Late("echomodel.rules.labels:label_relations")
__all__ = [
    "RULE_SETS", "Rule", "RuleSet", "aligned", "centred", "facing", "fronts", "judged", "label_relations",
    "label_rooms", "margins", "measured", "opposite", "rule", "rule_set", "verdicts",
]  # fmt: skip
