"""Every expectation of a room in one table: what is looked at, in which unit, its weight, what a person is told.

In a conflict the kinds count in their order: relations, physics, living, composition. Whoever draws, moves, judges or
explains a room asks this table and holds no distance of his own.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass

from echomodel.objective import access, company, composition, crowding, fitted, physics, sight, sizes
from echomodel.objective.plan import Found, Plan
from echomodel.vocabulary import vocabulary

# What a broken term costs, and a unit that is missed of it, by its kind.
PRICE = {"relations": (6.0, 4.0), "physics": (3.0, 10.0), "living": (2.0, 1.0), "composition": (1.5, 1.0)}
KINDS = tuple(PRICE)


@dataclass(frozen=True)
class Term:
    """One expectation.

    Arguments:
        find: the boxes that it is about with their margins in its unit, >= 0 iff kept; reports call the term by its
            name, its docstring is what is expected.
        says: sentences for a person, with {a} the box, {b} what it is about, {x} the number measured.
        source: where its numbers come from.
        kind: one of `KINDS`. unit: of the margin: `m`, `rad` or `share`.
        slack: what a search and a loss ask for beyond the margin, in its unit.
        weight: of a missed unit; none counts twice what breaking it at all does.
    """

    find: Callable[[Plan], Found]
    says: tuple[str, ...]
    source: str
    kind: str = "living"
    unit: str = "m"
    slack: float = 0.01
    weight: float = 1.0

    @property
    def name(self) -> str:
        """How reports call it."""
        return self.find.__name__

    @property
    def means(self) -> str:
        """What is expected, one sentence."""
        return (inspect.getdoc(self.find) or "").partition("\n\n")[0].replace("\n", " ")


RELATIONS = (
    *(Term(physics.told(name), (f"{{a}} is not {name} {{b}}",), "what the word means", "relations", unit)
      for name, unit in physics.measured()),
    Term(physics.placed, tuple(f"{{a}} is not {row.name}" for row in vocabulary().placements), "what the words mean",
         "relations"),
)  # fmt: skip
PHYSICS = (
    Term(physics.apart, ("{a} runs {x:.2f} m into {b}",), "solids; a chair under its table", "physics", slack=0.0),
    Term(physics.on_floor, ("{a} reaches {x:.2f} m through a wall",), "solids", "physics", slack=0.0),
    Term(physics.rests, ("{a} has {x:.2f} m of air below or above it", "{a} stands beside {b}, not on it"), "gravity",
         "physics", slack=0.0),
    Term(physics.in_height, ("{a} lies {x:.2f} m below the floor", "{a} reaches {x:.2f} m through the ceiling"),
         "solids", "physics", slack=0.0),
)  # fmt: skip
REAL = "real rooms (statistics of 896, 300 measured): "
LIVING = (
    Term(access.parallel, ("{a} is turned by {x:.0f} degrees against the walls",),
         REAL + "98 to 100 % of such furniture within 5 degrees", unit="rad"),
    Term(access.at_wall, ("{a} has no wall behind it", "{a} stands {x:.2f} m off the wall behind it"),
         REAL + "84 to 93 % within 0.15 m, gaps over 0.3 m are rare"),
    Term(company.seat_faces, ("{a} looks {x:.0f} degrees past {b}",),
         REAL + "chairs at corners look at their table by up to 45 degrees", unit="rad"),
    Term(company.seat_in_reach, ("{a} stands {x:.2f} m from {b}",),
         REAL + "95 % of chairs within 0.25 m, at desks and at tables"),
    Term(company.seat_before_desk, ("{a} stands {x:.2f} m beside the middle of {b}, not before it",),
         REAL + "19 of 20 such seats within a third of the width"),
    Term(company.lounger_faces, ("{a} turns its back on {b} ({x:.0f} degrees)",),
         REAL + "armchairs take part in their group", unit="rad"),
    Term(company.table_before_sofa, ("{a} leaves only {x:.2f} m before {b}",
          "{a} lies {x:.2f} m before {b}, out of reach", "{a} lies {x:.2f} m beside the middle of {b}, not before it"),
         REAL + "95th percentile of the gap, a leg's width; within the sofa's width"),
    Term(company.nightstand_at_head, ("{a} stands {x:.2f} m beside {b}", "{a} stands in {b}",
          "{a} stands {x:.2f} m from the head of {b}", "{a} is turned by {x:.0f} degrees against {b}"),
         REAL + "95 % within 0.34 m beside and 0.4 m along the bed"),
    Term(company.nightstands_alike, ("{a} stands {x:.2f} m further from the bed than {b}",),
         REAL + "98 % of pairs differ by less than 0.15 m"),
    Term(company.bench_at_foot, ("{a} stands {x:.2f} m from the foot of {b}",
          "{a} lies {x:.2f} m beside the middle of {b}"),
         REAL + "95 % within 0.35 m of the foot, and 0.38 of the bed's width"),
    Term(sight.screen_in_view, ("{a} lies {x:.0f} degrees off where {b} looks",
          "{a} is turned by {x:.0f} degrees away from {b}", "{a} is only {x:.1f} m from {b}, too near to watch",
          "{a} is {x:.1f} m from {b}, too far to watch"),
         REAL + "98 % of sofas and 95 % of beds look within 25 and 30 degrees of it, 99 % from within 5.2 m"),
    Term(sight.screen_on_axis, ("{a} stands {x:.2f} m beside the axis of {b}",),
         REAL + "92 % of those in view within 0.6 m of the axis", slack=0.3),
    Term(sight.screen_not_behind, ("{a} turns its back on {b} ({x:.0f} degrees)",),
         REAL + "95 % of armchairs are turned less from their group's screen", unit="rad"),
    Term(sight.pendant_over, ("{a} hangs {x:.2f} m beside a table",),
         REAL + "half hang over the table itself, others over beds, sofas and the middle"),
    Term(sight.pendant_centred, ("{a} hangs {x:.2f} m off the middle of {b}",),
         "Neufert: the light over a table hangs over its middle", slack=0.1),
    Term(sight.pendants_in_row, ("{a} hangs {x:.2f} m out of the row with {b}", "{a} hangs only {x:.2f} m from {b}"),
         REAL + "six of seven pairs within 0.15 m of one line, all apart"),
    Term(sight.lamp_on_surface, ("{a} stands on nothing that carries it",), "what the word means"),
    Term(access.front_free, ("the front of {a} has {x:.2f} m before {b}",),
         "access depths of the vocabulary, 60 % of them", slack=0.1),
    Term(access.bed_side_free, ("{a} cannot be got into: {x:.2f} m beside it",),
         "a person needs 0.3 m to sit down on a bed", slack=0.15),
    Term(access.door_free, ("{a} reaches {x:.2f} m into the way of a door",), "the leaf's quarter circle"),
    Term(access.window_free, ("{a} covers a window",), "0.35 m before the glass, 0.3 m over the sill"),
    Term(crowding.groups_apart, ("{a} leaves only {x:.2f} m to {b}, which is no part of its group",),
         REAL + "2nd to 3rd percentile of the gap by role, 0.05 to 0.2 m", slack=0.3),
    Term(crowding.chair_pulls_out, ("{a} can be pulled back by only {x:.2f} m before {b}",),
         REAL + "3rd percentile before furniture, 5th before a wall (0.1 m); at desks the 10th and 3rd (0.33, 0.19 m)",
         slack=0.3),
    Term(crowding.table_amid,
         ("the chairs at one side of {a} have {x:.2f} m behind them to {b}, while those opposite have room to spare",),
         REAL + "90 % of tables with chairs opposite each other", slack=0.2),
    Term(crowding.knees_free, ("{a} has {x:.2f} m before it, then {b}",),
         REAL + "3rd percentile before sofas 0.58 m; armchairs look into the room", slack=0.15),
    Term(crowding.seat_room, ("one cannot sit down on {a}: {x:.2f} m before it stands {b}",),
         REAL + "94 % of sofas and armchairs have 0.25 m before them"),
    Term(crowding.loungers_apart, ("{a} leaves only {x:.2f} m to {b}",),
         REAL + "90 % of the seats of a group leave 0.05 m, most others overlap", slack=0.1),
    Term(crowding.bed_foot_free, ("the foot of {a} leaves {x:.2f} m to {b}",), REAL + "90 % leave 0.38 m or more",
         slack=0.15),
    Term(crowding.lamp_aside, ("{a} stands {x:.2f} m before the front of {b}",),
         REAL + "98 % of lamps and plants leave fronts free, 33 of 34 the knees of who sits"),
    Term(company.chairs_even, ("the chairs of {a} are uneven: their middle lies {x:.2f} m off",),
         "one chair pulled out moves the middle of four by 0.1 m"),
    Term(company.chairs_opposite, ("the chairs at opposite sides of {a} are staggered by {x:.2f} m",),
         REAL + "95 % of such tables within 0.12 m"),
    Term(company.chairs_level, ("one chair of {a} is pushed under it by {x:.2f} m more than another",),
         REAL + "95 % of chairs opposite each other, 92 % of neighbours"),
    Term(company.sofas_in_circle, ("{a} turns its back on the group of {b} ({x:.0f} degrees)",),
         "the same as for armchairs", unit="rad"),
    Term(company.at_its_side, ("{a} stands before {b}, not beside it",),
         REAL + "97 % of side tables and lamps, 93 % of armchairs leave their sofa's knees free"),
    Term(company.not_alone, ("{a} stands alone in the room, {x:.2f} m from everything",),
         REAL + "98 % of plants are at a wall or touch something, 98 % of side tables within 0.3 m of something"),
    Term(composition.sofa_ahead, ("{b}, which is no part of its group, stands {x:.2f} m before {a}",),
         REAL + "97 % of sofas have a metre before them to other groups"),
    Term(composition.floor_used, ("beside {a} a circle of {x:.1f} m of the floor is bare, others stand close",),
         REAL + "98 % have no empty circle of 1.05 times the root of each piece's share of the floor"),
    Term(sight.view_free, ("{b} stands between {a} and who watches it",), "a straight line"),
    Term(fitted.row_flush, ("{a} stands {x:.2f} m out of the row of {b}",),
         "DIN EN 1116: kitchen units adjoin in one front line", weight=4.0),
    Term(fitted.hung_over, ("only {x:.0f} % of {a} hang over a worktop",
          "{a} hangs {x:.2f} m beside the middle of {b}"), "a hood draws what rises from its hob; DIN EN 1116",
         weight=4.0),
    Term(fitted.aisle, ("{a} and {b} leave an aisle of {x:.2f} m",),
         "NKBA kitchen guideline 6: 1.22 m for two cooks (1.07 m for one); Neufert: 1.2 m"),
    Term(fitted.hob_safe, ("{a} has {x:.2f} m of worktop beside it", "{a} is {x:.2f} m from the corner at {b}",
          "{a} lies under a window by {x:.2f} m"),
         "NKBA kitchen guidelines 17 and 20: 0.38 m beside a hob to put a pan down (0.4 m: a unit), no window over it"),
    Term(fitted.standing_room, ("{a} has {x:.2f} m before it, then {b}",),
         "VDI 6000: 0.6 m before a toilet, 0.75 m before tub and shower, 0.9 m before a washing machine; a basin 0.7 m,"
         " between its 0.55 m and NKBA's 0.76 m", slack=0.05),
    Term(sizes.scale, ("{a} is {x:.2f} m wide", "{a} is {x:.2f} m high", "{a} is {x:.2f} m deep"),
         "a fifth over the 95th percentile of the class, half of the 5th", unit="share", weight=0.3),
)  # fmt: skip
COMPOSITION = (
    Term(composition.floor_served,
         ("{x:.0f} % of the floor lies more than a metre from everything, the most beyond {a}",),
         REAL + "84 % leave less of their floor to nothing, for what stands in them", "composition", "share"),
    Term(composition.elbow_room, ("{x:.2f} m of {a} a seat: too little for the elbows",
          "two chairs at {a} have {x:.2f} m between them"),
         REAL + "96 % leave 0.55 m of a table's edge a seat (DIN 68880: 0.6 m), 95 % 0.03 m between chairs",
         "composition"),
    Term(composition.chairs_at_sides, ("{x:.2f} m of {a} a seat, though another of its sides is free",),
         "DIN 68880: 0.6 m of a table's edge a seat; 95 % of real tables",
         "composition"),
    Term(composition.bench_fits, ("{a} reaches {x:.2f} m beyond its side of {b}",),
         REAL + "99 % of seats are shorter than their side of a table", "composition"),
    Term(composition.workers_apart, ("{a} and {b} work only {x:.2f} m apart",),
         "ASR A1.2: a workplace is a metre wide and deep", "composition"),
    Term(crowding.desks_in_line, ("the backs of {a} and {b} lie {x:.2f} m out of line",), "two desks in a row are one",
         "composition"),
    Term(composition.wardrobe_opens, ("{a} has {x:.2f} m before it, then {b}",),
         "a leaf of half a metre and who stands aside of it; 65 % of real beds, all real armchairs", "composition"),
    Term(fitted.work_triangle, ("hob, sink and fridge of {a} lie cramped: {x:.1f} m from one to the next and back",
          "{x:.1f} m from {a} to sink, fridge and back", "{b} stands {x:.2f} m in the way from {a} to sink and fridge"),
         "NKBA kitchen guideline 3: three legs of 1.2 m (3.6 m) to 7.9 m in all, none through an island",
         "composition"),
    Term(composition.each_served, ("{a} has none of what {b} has twice",),
         "a desk or table without its chair, a bed without its nightstand", "composition", "share"),
)  # fmt: skip
TERMS = (*RELATIONS, *PHYSICS, *LIVING, *COMPOSITION)
