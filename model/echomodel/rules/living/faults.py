"""The living rules in one list, and what a person would point at in a room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from echomodel.openings import Opening
from echomodel.rules.geometry import BoxesLike
from echomodel.rules.living import access, company, crowding, groups, lamps, sight, sizes, walls, zones
from echomodel.rules.living.found import Found
from echomodel.rules.living.plan import CLEAR_HEIGHT, Plan, plan_of
from echomodel.rules.living.ways import Ways, ways


@dataclass(frozen=True)
class Rule:
    """One living rule.

    Arguments:
        name: how reports call it.
        find: the boxes that it is about with their margins, metres, radians or a share, >= 0 iff kept.
        says: sentences for a person, with {a} the box, {b} what it is about, {x} the number measured.
        source: where the threshold comes from.
        weight: of the missed margin in guidance, per metre, radian or share.
    """

    name: str
    find: Callable[[Plan], Found]
    says: tuple[str, ...]
    source: str
    weight: float = 1.0


REAL = "real rooms (statistics of 896, 300 measured): "
RULES = (
    Rule("parallel", walls.parallel, ("{a} is turned by {x:.0f} degrees against the walls",),
         REAL + "98 to 100 % of such furniture within 5 degrees"),
    Rule("at_wall", walls.at_wall,
         ("{a} has no wall behind it", "{a} stands {x:.2f} m off the wall behind it"),
         REAL + "84 to 93 % within 0.15 m, gaps over 0.3 m are rare"),
    Rule("seat_faces", groups.seat_faces, ("{a} looks {x:.0f} degrees past {b}",),
         REAL + "chairs at corners look at their table by up to 45 degrees"),
    Rule("seat_in_reach", groups.seat_in_reach, ("{a} stands {x:.2f} m from {b}",),
         REAL + "99 % of dining chairs within 0.45 m"),
    Rule("lounger_faces", groups.lounger_faces, ("{a} turns its back on {b} ({x:.0f} degrees)",),
         REAL + "armchairs take part in their group"),
    Rule("table_before_sofa", groups.table_before_sofa,
         ("{a} leaves only {x:.2f} m before {b}", "{a} lies {x:.2f} m before {b}, out of reach",
          "{a} lies {x:.2f} m beside the middle of {b}, not before it"),
         REAL + "95th percentile of the gap, a leg's width; within the sofa's width"),
    Rule("nightstand_at_head", groups.nightstand_at_head,
         ("{a} stands {x:.2f} m beside {b}", "{a} stands in {b}", "{a} stands {x:.2f} m from the head of {b}",
          "{a} is turned by {x:.0f} degrees against {b}"),
         REAL + "95 % within 0.34 m beside and 0.4 m along the bed"),
    Rule("nightstands_alike", groups.nightstands_alike,
         ("{a} stands {x:.2f} m further from the bed than {b}",),
         REAL + "98 % of pairs differ by less than 0.15 m"),
    Rule("screen_in_view", sight.screen_in_view,
         ("{a} lies {x:.0f} degrees off where {b} looks", "{a} is turned by {x:.0f} degrees away from {b}",
          "{a} is only {x:.1f} m from {b}, too near to watch", "{a} is {x:.1f} m from {b}, too far to watch"),
         REAL + "98 % of sofas and 95 % of beds look within 25 and 30 degrees of it, 99 % from within 5.2 m"),
    Rule("screen_not_behind", sight.screen_not_behind, ("{a} turns its back on {b} ({x:.0f} degrees)",),
         REAL + "95 % of armchairs are turned less from their group's screen"),
    Rule("pendant_over", lamps.pendant_over, ("{a} hangs {x:.2f} m beside a table",),
         REAL + "half hang over the table itself, others over beds, sofas and the middle"),
    Rule("lamp_on_surface", lamps.lamp_on_surface, ("{a} stands on nothing that carries it",), "what the word means"),
    Rule("front_free", access.front_free,
         ("the front of {a} has {x:.2f} m before {b}",), "access depths of the vocabulary, 60 % of them"),
    Rule("bed_side_free", access.bed_side_free, ("{a} cannot be got into: {x:.2f} m beside it",),
         "a person needs 0.3 m to sit down on a bed"),
    Rule("door_free", access.door_free, ("{a} reaches {x:.2f} m into the way of a door",), "the leaf's quarter circle"),
    Rule("window_free", access.window_free, ("{a} covers a window",), "0.35 m before the glass, 0.3 m over the sill"),
    Rule("groups_apart", crowding.groups_apart, ("{a} leaves only {x:.2f} m to {b}, which is no part of its group",),
         REAL + "2nd to 3rd percentile of the gap by role, 0.05 to 0.2 m"),
    Rule("chair_pulls_out", crowding.chair_pulls_out, ("{a} can be pulled back by only {x:.2f} m before {b}",),
         REAL + "3rd percentile before furniture, 5th before a wall (0.1 m); at desks the 10th and 3rd (0.33, 0.19 m)"),
    Rule("table_amid", crowding.table_amid,
         ("the chairs at one side of {a} have {x:.2f} m behind them to {b}, while those opposite have room to spare",),
         REAL + "90 % of tables with chairs opposite each other"),
    Rule("knees_free", crowding.knees_free, ("{a} has {x:.2f} m before it, then {b}",),
         REAL + "3rd percentile before sofas 0.58 m; armchairs look into the room"),
    Rule("seat_room", crowding.seat_room, ("one cannot sit down on {a}: {x:.2f} m before it stands {b}",),
         REAL + "94 % of sofas and armchairs have 0.25 m before them"),
    Rule("bed_foot_free", crowding.bed_foot_free, ("the foot of {a} leaves {x:.2f} m to {b}",),
         REAL + "90 % leave 0.38 m or more"),
    Rule("lamp_aside", crowding.lamp_aside, ("{a} stands {x:.2f} m before the front of {b}",),
         REAL + "98 % of lamps and plants leave fronts free"),
    Rule("chairs_even", company.chairs_even, ("the chairs of {a} are uneven: their middle lies {x:.2f} m off",),
         "one chair pulled out moves the middle of four by 0.1 m"),
    Rule("chairs_opposite", company.chairs_opposite,
         ("the chairs at opposite sides of {a} are staggered by {x:.2f} m",),
         REAL + "95 % of such tables within 0.12 m"),
    Rule("sofas_in_circle", company.sofas_in_circle, ("{a} turns its back on the group of {b} ({x:.0f} degrees)",),
         "the same as for armchairs"),
    Rule("at_its_side", company.at_its_side, ("{a} stands before {b}, not beside it",),
         REAL + "97 % of side tables and lamps, 93 % of armchairs leave their sofa's knees free"),
    Rule("not_alone", company.not_alone, ("{a} stands alone in the room, {x:.2f} m from everything",),
         REAL + "side tables, lamps and plants stand at something"),
    Rule("sofa_ahead", zones.sofa_ahead, ("{b}, which is no part of its group, stands {x:.2f} m before {a}",),
         REAL + "97 % of sofas have a metre before them to other groups"),
    Rule("floor_used", zones.floor_used, ("beside {a} a circle of {x:.1f} m of the floor is bare, others stand close",),
         REAL + "98 % have no empty circle of 1.05 times the root of each piece's share of the floor"),
    Rule("view_free", sight.view_free, ("{b} stands between {a} and who watches it",), "a straight line"),
    Rule("scale", sizes.scale, ("{a} is {x:.2f} m wide", "{a} is {x:.2f} m high", "{a} is {x:.2f} m deep"),
         "a fifth over the 95th percentile of the class, half of the 5th", weight=0.3),
)  # fmt: skip
REACHED = "reached"


@dataclass(frozen=True)
class Fault:
    """Something that a person would point at.

    Arguments:
        object: number of the box; other: number of the box that it is about, -1 = none.
        rule: name of the rule that is broken. margin: by how much, negative, metres, radians or a share.
        says: the sentence, with {a} and {b} for the two.
    """

    object: int
    other: int
    rule: str
    margin: float
    says: str = field(compare=False)

    def sentence(self, names: Sequence[str]) -> str:
        """The fault in words, with the names of the boxes."""
        other = names[self.other] if self.other >= 0 else "a wall"
        return self.says.replace("{a}", names[self.object]).replace("{b}", other)


def faults(
    boxes: BoxesLike,
    categories: Sequence[str],
    floor: np.ndarray | None = None,
    openings: Sequence[Opening] = (),
    relations: np.ndarray | Tensor | None = None,
    *,
    given: np.ndarray | None = None,
) -> list[Fault]:
    """What a person would point at in a room, in the order of the rules; see `plan_of` for the arguments.

    A rule counts a box at most once. What the relations state decides whom a box attends.
    """
    plan = plan_of(boxes, categories, floor, openings, relations, given=given)
    return faults_of(plan) + unreached(plan)


def faults_of(plan: Plan) -> list[Fault]:
    """The faults of all rules with a margin, for any number of rooms; numbers count through them."""
    out = []
    with torch.no_grad():
        for rule in RULES:
            seen = rule.find(plan)
            for row in (seen.margin < 0).nonzero()[:, 0].tolist():
                who, other = int(seen.who[row]), int(seen.other[row])
                if bool(plan.given[who]):
                    continue
                text = rule.says[int(seen.words[row]) % len(rule.says)]
                said = text.replace("{a}", "\0").replace("{b}", "\1").format(x=float(seen.measure[row]))
                said = said.replace("\0", "{a}").replace("\1", "{b}")
                out.append(Fault(who, other, rule.name, float(seen.margin[row]), said))
    return out


def unreached(plan: Plan) -> list[Fault]:
    """Pieces of one room that cannot be walked to; none where the floor is unknown."""
    walked = walk(plan)
    if walked is None:
        return []
    furniture = plan.standing & plan.of("seat", "sofa", "board", "bed", "storage")
    reached = walked.reached
    attends = plan.anchor.numpy()  # a nightstand is reached from its bed, a chair with its table
    reached = reached | ((attends >= 0) & reached[attends])
    lost = np.flatnonzero(furniture.numpy() & ~reached & ~plan.given.numpy())
    return [Fault(int(i), -1, REACHED, -1.0, "{a} cannot be walked to from the door") for i in lost]


def walk(plan: Plan) -> Ways | None:
    """Where a robot gets to in a plan of one room, None where its floor is unknown."""
    corners = plan.floor[0][torch.isfinite(plan.floor[0]).all(1)].numpy()
    if len(corners) < 3:
        return None
    size, position, yaw = (value.detach().numpy() for value in (plan.size, plan.position, plan.yaw))
    in_the_way = (plan.standing & ~plan.movable).numpy() & (size[:, 1] > CLEAR_HEIGHT)
    return ways(size, position, yaw, in_the_way, corners, plan.openings[0])


def missed(plan: Plan) -> Tensor:
    """() float, how much of all rules is missed, differentiable: the sum of the missed margins with their weights."""
    total = plan.size.new_zeros(())
    for rule in RULES:
        seen = rule.find(plan)
        free = (~plan.given[seen.who]).to(seen.margin)
        total = total + rule.weight * ((-seen.margin).clamp(min=0, max=2.0) * free).sum()
    return total
