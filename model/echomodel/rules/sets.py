"""The two sets of rules: `sgfront` (what the published code measures) and `strict` (the same words, meant).

A rule is registered here or with `@rule("name")` in a module that `echomodel.rules` imports, and nowhere else.
"""

import inspect
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from echomodel.arrays import Array, at_least, clipped, dot, kit
from echomodel.boxes2d import axes, hull, seen
from echomodel.files import tables
from echomodel.rules.geometry import TINY, PairGeometry
from echomodel.vocabulary import vocabulary

Margin = Callable[[PairGeometry], Array]
Divisor = Callable[[Array, Array], Array]

APART = 0.05  # metres between two centres for left, right, front and behind
OVERLAP = 0.3  # largest intersection over the smaller volume for the same four
VOLUME = 0.15  # relative difference of volume for bigger and smaller
HEIGHT = 0.1  # relative difference of the tops for taller and shorter
TOUCH = 0.04  # metres of vertical play for standing on
NEAR = 0.45  # metres for close by and symmetrical to
SIDES, ACROSS = 0.2, 0.9  # metres between sides that are close by as well: half the longer box, within these
LOOK = math.cos(math.radians(30.0))  # of the angle between two ways that are the same


@dataclass(frozen=True)
class Rule:
    """What one predicate means in one set of rules.

    Arguments:
        margin: signed margin (P,) float of pairs, metres or ratio, satisfied iff >= 0; None where it is not measured.
        label: margin that a pair needs to be labelled with the predicate; None where rooms are not labelled with it.
        open: the bound itself does not count (satisfied iff > 0).
        same_category: only objects of one category are labelled with it.
        means: what a person is told that it asks for.
    """

    margin: Margin | None
    label: Margin | None = None
    open: bool = False
    same_category: bool = False
    means: str = ""


@dataclass(frozen=True)
class RuleSet:
    """Named rules: what each predicate means, by its name.

    Arguments:
        name: `strict` or `sgfront`.
        oriented: whether boxes are measured with their yaw (else as the published code does).
        rules: predicate -> rule; one of a predicate that the vocabulary does not hold is not asked.
    """

    name: str
    oriented: bool
    rules: dict[str, Rule]

    @property
    def margins(self) -> dict[int, Margin]:
        """Predicate id -> margin of a batch of pairs."""
        return {number: rule.margin for number, rule in self._by_id() if rule.margin is not None}

    @property
    def labels(self) -> dict[int, Margin]:
        """Predicate id -> margin that a pair needs to be labelled with it."""
        return {number: rule.label for number, rule in self._by_id() if rule.label is not None}

    @property
    def open(self) -> frozenset[int]:
        """Ids of the predicates whose bound itself does not count."""
        return frozenset(number for number, rule in self._by_id() if rule.open)

    @property
    def same_category(self) -> frozenset[int]:
        """Ids of the predicates that only objects of one category are labelled with."""
        return frozenset(number for number, rule in self._by_id() if rule.same_category)

    def _by_id(self) -> Iterator[tuple[int, Rule]]:
        words = vocabulary()
        known = words.predicate_names
        return ((words.predicate_id(name), rule) for name, rule in self.rules.items() if name in known)


def _beside(axis: int, sign: float, needed: float) -> Margin:
    """Subject on the given side of the object by at least `needed` metres, without running into it."""

    def margin(pair: PairGeometry) -> Array:
        return pair.kit.minimum(sign * pair.offset[:, axis] - needed, OVERLAP - pair.overlap_ratio)

    return margin


def _relative(values: Callable[[PairGeometry], tuple[Array, Array]], sign: float, needed: float, to: Divisor) -> Margin:
    """(s - o) over what `to` makes of both."""

    def margin(pair: PairGeometry) -> Array:
        s, o = values(pair)
        return sign * (s - o) / to(s, o) - needed

    return margin


def _subject(s: Array, o: Array) -> Array:
    """As published: the ratio to the subject, so that `bigger` and `smaller` are not quite inverse."""
    return kit(s).where(abs(s) < TINY, TINY, s)


def _larger(s: Array, o: Array) -> Array:
    """Bounded, and `bigger` is exactly the inverse of `smaller`."""
    return at_least(kit(s).maximum(s, o), 1e-6)


def _volumes(pair: PairGeometry) -> tuple[Array, Array]:
    return pair.size_s.prod(-1), pair.size_o.prod(-1)


def _tops(pair: PairGeometry) -> tuple[Array, Array]:
    return pair.top_s, pair.top_o


def _close(pair: PairGeometry) -> Array:
    return NEAR - pair.corner_distance


def _near(pair: PairGeometry) -> Array:
    """Corners are close, as published, or sides: real sideboards keep a metre from their table, for its chairs."""
    xp = pair.kit
    reach = clipped(xp.amax(xp.maximum(pair.size_s, pair.size_o)[:, ::2], 1) / 2, SIDES, ACROSS)
    level = xp.maximum(pair.position_s[:, 1] - pair.top_o, pair.position_o[:, 1] - pair.top_s)
    sides = xp.minimum(reach + pair.footprint_penetration, NEAR - level)
    return xp.maximum(_close(pair), sides)


def _symmetrical(pair: PairGeometry) -> Array:
    """One image of the subject is near the object and, where both have a front, looks the way that the object looks."""
    if pair.fronts is None:
        return NEAR - pair.mirror_distance(point=False)
    xp, near = pair.kit, NEAR - pair.mirror_distances[:, :2]
    alike = xp.where(pair.fronts[:, None], pair.mirror_likeness - LOOK, near)
    return xp.amax(xp.minimum(near, alike), 1)


def _rules(
    ahead: float, to: Divisor, heights: Mapping[str, Margin], symmetrical: Margin, open_: Collection[str] = ()
) -> dict[str, Rule]:
    """Rules that label what they measure.

    Arguments:
        ahead: metres for front and behind. to: what differences of sizes are divided by. heights, symmetrical: what
            the sets do not share. open_: predicates whose bound itself does not count.
    """
    margins = {
        "left": _beside(2, -1.0, APART),
        "right": _beside(2, 1.0, APART),
        "front": _beside(0, 1.0, ahead),
        "behind": _beside(0, -1.0, ahead),
        "close_by": _close,
        **heights,
        "bigger_than": _relative(_volumes, 1.0, VOLUME, to),
        "smaller_than": _relative(_volumes, -1.0, VOLUME, to),
        "taller_than": _relative(_tops, 1.0, HEIGHT, to),
        "shorter_than": _relative(_tops, -1.0, HEIGHT, to),
        "symmetrical_to": symmetrical,
    }
    return {
        name: Rule(margin, margin, open=name in open_, same_category=name == "symmetrical_to")
        for name, margin in margins.items()
    }


CARRIED: dict[str, Margin] = {
    "above": lambda pair: pair.kit.minimum(pair.position_s[:, 1] - pair.top_o - TOUCH, pair.footprint_penetration),
    "standing_on": lambda pair: pair.kit.minimum(TOUCH - abs(pair.position_s[:, 1] - pair.top_o), pair.centre_inside),
}
STRICT = RuleSet("strict", True, _rules(APART, _larger, CARRIED, _symmetrical))
for name, means in tables("means.toml", __file__).items():
    STRICT.rules[name] = replace(STRICT.rules[name], means=means.format_map(globals()))

PUBLISHED: dict[str, Margin] = {"standing_on": lambda pair: TOUCH - abs(pair.position_s[:, 1] - pair.position_o[:, 1])}
OPEN = ("standing_on", "symmetrical_to")
SGFRONT = RuleSet(
    "sgfront", False, _rules(-APART, _subject, PUBLISHED, lambda pair: NEAR - pair.mirror_distance(point=True), OPEN)
)
# Labels need a real distance where the check tolerates a wrong one; only the floor carries `standing on`, because the
# check compares the bottoms of the two.
SGFRONT.rules["front"] = replace(SGFRONT.rules["front"], label=_beside(0, 1.0, APART))
SGFRONT.rules["behind"] = replace(SGFRONT.rules["behind"], label=_beside(0, -1.0, APART))
SGFRONT.rules["standing_on"] = replace(SGFRONT.rules["standing_on"], label=None)
# It labels `above` by height alone: a ceiling lamp is above everything that does not reach it.
SGFRONT.rules["above"] = Rule(None, lambda pair: pair.position_s[:, 1] - pair.top_o)

# what is learned stays what is published
STRICT.rules["close_by"] = replace(STRICT.rules["close_by"], margin=_near, label=_close)

RULE_SETS = {rules.name: rules for rules in (STRICT, SGFRONT)}


def rule_set(name: str) -> RuleSet:
    """The set called `name`; raises ValueError for any other word."""
    if name not in RULE_SETS:
        raise ValueError(f"unknown rules {name!r}: allowed are {', '.join(RULE_SETS)}")
    return RULE_SETS[name]


def rule(predicate: str, *, sets: Sequence[str] = ("strict",), labels: bool = False) -> Callable[[Margin], Margin]:
    """Decorator that registers a margin, of numpy's and torch's arrays alike, as what a predicate means.

    Arguments:
        predicate: name of its row.
        sets: rule sets that measure it.
        labels: whether rooms are labelled with it too (only what is labelled can be learned).

    Raises ValueError for an unknown set, or one that has a rule for the predicate.
    """

    def register(margin: Margin) -> Margin:
        for name in sets:
            rules = rule_set(name).rules
            if predicate in rules:
                raise ValueError(f"predicate {predicate!r} has a rule in the set {name!r} already")
            rules[predicate] = Rule(margin, margin if labels else None, means=inspect.getdoc(margin) or "")
        return margin

    return register


LINE = 0.1  # metres beside the line


def _faces(yaw: Array, way: Array) -> Array:
    """(P,) how much better than `LOOK` a front at `yaw` (P,) points along `way` (P, 2)."""
    return dot(axes(yaw)[1], way) / kit(way).sqrt(at_least(dot(way, way), TINY)) - LOOK


@rule("facing")
def facing(pair: PairGeometry) -> Array:
    """The subject's front looks at the object's centre, to 30 degrees, or straight ahead at any part of it."""
    xp, local = pair.kit, seen(-pair.flat, pair.yaw_s)
    across = hull(pair.footprint_o[0], pair.yaw_o - pair.yaw_s)[:, 0]
    return xp.maximum(_faces(pair.yaw_s, -pair.flat), xp.minimum(across - abs(local[:, 0]), local[:, 1]))


@rule("opposite")
def opposite(pair: PairGeometry) -> Array:
    """Both look at each other."""
    return pair.kit.minimum(_faces(pair.yaw_s, -pair.flat), _faces(pair.yaw_o, pair.flat))


@rule("aligned_with")
def aligned(pair: PairGeometry) -> Array:
    """The subject's centre lies in line with the object's, beside it or before it."""
    return LINE - pair.kit.minimum(abs(pair.local[:, 0]), abs(pair.local[:, 1]))


@rule("centered_on")
def centred(pair: PairGeometry) -> Array:
    """The subject's centre lies on the line through the object's middle along its front."""
    return LINE - abs(pair.local[:, 0])
