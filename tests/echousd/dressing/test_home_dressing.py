"""What hangs, stands and lies in the rooms of a home: dishes on worktops, coats on racks, towels, toys, blinds."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely
from solid_boxes import box_mesh

from echomodel.dressing import KINDS, PRINTS
from echomodel.dressing import thing as solids_of
from echomodel.furniture import draw_choices, draw_style, solids
from echomodel.openings import Opening
from echousd.dressing import floors, soft_tops, tabletops, upholstery, walls
from echousd.dressing.dress import RULES, bare_walls
from echousd.dressing.laid import laid
from echousd.dressing.setting import Setting, geometry_of, standing
from echousd.dressing.stories import story
from echousd.shapes.geometry import Origin
from echousd.shapes.joinery import assembled
from echousd.shapes.sources.whole import solid_geometry

FLOOR = np.array([(-2.0, -1.5), (2.0, -1.5), (2.0, 1.5), (-2.0, 1.5)])
WINDOW = Opening("window", "window", 0, 1.2, 1.4, 1.2, 0.9)
SIZES = {
    "base_unit": (1.2, 0.9, 0.6), "wall_unit": (1.2, 0.7, 0.35), "coat_rack": (1.3, 1.9, 0.4),
    "towel_radiator": (0.5, 1.2, 0.09), "toy_box": (0.8, 0.45, 0.45), "shoe_cabinet": (0.8, 1.1, 0.25),
    "multi_seat_sofa": (2.1, 0.9, 0.92), "sideboard": (1.5, 0.85, 0.42), "desk": (1.1, 0.74, 0.55),
    "dining_table": (1.6, 0.76, 0.95), "bench": (1.2, 0.45, 0.4),
}  # fmt: skip


def stood(word, seed, at, yaw=0.0, name=None):
    rng, size = np.random.default_rng(seed), np.array(SIZES[word])
    parts = solids(word, draw_style(rng), draw_choices(rng), size)
    made = assembled(parts, size, faces=3000, origin=Origin("parts"))
    return standing(name or word, word, size, np.array(at), yaw, made)


def setting(word="", *, seed=1, use="", openings=()):
    objects = {}
    if word:
        low = {"wall_unit": 1.4, "towel_radiator": 0.35}.get(word, 0.0)
        objects[word] = stood(word, seed, [0.0, low, -1.49 + SIZES[word][2] / 2])
    return Setting(objects, FLOOR, tuple(openings), 2.6, True, False, seed, use)


@pytest.mark.parametrize("word", ["base_unit", "wall_unit", "coat_rack", "toy_box", "shoe_cabinet"])
def test_no_books_lie_where_nobody_reads(word):
    kinds = set()
    for seed in range(12):
        room = setting(word, seed=seed)
        tabletops.tabletops(room)
        kinds |= {thing.kind for thing in room.placed}
    assert not any(KINDS[kind].name.startswith("book") for kind in kinds)
    assert {"base_unit": {"bowl", "bottles", "plates"}, "toy_box": {"bear"}}.get(word, set()) <= kinds


@pytest.mark.parametrize(("word", "kind", "least"), [("coat_rack", "hung_coats", 1), ("towel_radiator", "towel", 1)])
def test_coats_hang_on_racks_and_towels_on_rungs(word, kind, least):
    for seed in range(6):
        room = setting(word, seed=seed)
        walls.hung_up(room)
        host = room.objects[word]
        assert len(room.placed) >= least
        for thing in room.placed:
            assert thing.kind == kind
            assert thing.position[1] > 0.3
            if kind == "hung_coats":  # below the hooks, and none reaches into a bench
                corners = host.geometry.mesh.vertices + host.position
                half = thing.size / 2
                inside = (abs(corners[:, [0, 2]] - thing.position[[0, 2]]) < half[[0, 2]] - 1e-3).all(1)
                assert not (inside & (abs(corners[:, 1] - thing.position[1] - half[1]) < half[1] - 1e-3)).any()
            assert thing.position[1] + thing.size[1] < host.top
            assert abs(thing.position[0]) + thing.size[0] / 2 < host.size[0] / 2 + 0.01


@pytest.mark.parametrize("word", ["coat_rack", "towel_radiator"])
def test_nothing_hangs_in_a_block(word):
    room, size = setting(word), np.array(SIZES[word])
    block = solid_geometry(box_mesh(size), word, Origin("boxes"))
    room.objects[word] = standing(word, word, size, room.objects[word].position, 0.0, block)
    walls.hung_up(room)
    assert room.placed == []


def test_coats_hang_near_the_wall_on_deep_racks_too(monkeypatch):
    monkeypatch.setitem(SIZES, "coat_rack", (1.1, 1.8, 0.5))
    deep = set()
    for seed in range(12):
        room = setting("coat_rack", seed=seed)
        walls.hung_up(room)
        assert max(thing.position[2] - thing.size[2] / 2 for thing in room.placed) + 1.5 < 0.1
        deep |= {thing.size[2] > 0.2 for thing in room.placed}
    assert deep == {False, True}  # before a panel, on a rail


def test_curtains_keep_clear_of_the_coats_on_a_rack():
    met = 0
    for seed, offset in itertools.product(range(6), np.linspace(0.3, 2.6, 24)):
        room = setting("coat_rack", seed=seed, openings=[Opening("window", "window", 0, offset, 1.0, 1.3, 0.9)])
        for rule in (rule for rule in RULES if rule in (walls.curtains, walls.hung_up)):
            rule(room)
        curtains = [thing for thing in room.placed if KINDS[thing.kind].name == "curtain"]
        coats = [thing for thing in room.placed if thing.kind == "hung_coats"]
        assert coats
        met += bool(curtains)
        for one, other in itertools.product(curtains, coats):
            beside = one.footprint.intersection(other.footprint).area < 1e-9
            assert beside or one.position[1] >= other.position[1] + other.size[1], (seed, offset)
    assert met > 20


def test_toys_lie_before_their_chest():
    room = setting("toy_box")
    floors.clusters(room)
    assert {thing.kind for thing in room.placed} & {"toy_ball", "train"}
    assert {thing.kind for thing in room.placed} >= {"blocks", "bear"}
    assert all(thing.position[2] > -1.05 and thing.position[1] == 0 for thing in room.placed)
    bare = setting("base_unit")
    floors.clusters(bare)
    assert bare.placed == []


@pytest.mark.parametrize(("use", "kinds"), [("", {"curtain"}), ("wet", {"blind"}), ("outdoor", set())])
def test_windows_have_what_suits_the_room(use, kinds):
    room = setting(use=use, openings=[WINDOW])
    walls.curtains(room)
    assert {KINDS[thing.kind].name for thing in room.placed} == kinds


@pytest.mark.parametrize("use", ["", "wet", "outdoor"])
def test_pictures_stay_out_of_baths_and_off_balconies(use, monkeypatch):
    monkeypatch.setattr("echousd.dressing.dress.OTHER", 0.0)
    room = setting(use=use, openings=[Opening("door", "door", 1, 0.2, 0.9, 2.0)])
    bare_walls(room)
    assert {KINDS[thing.kind].name for thing in room.placed} == ({"picture"} if not use else set())


def test_all_windows_of_a_room_have_the_same_curtains_and_rooms_differ():
    windows = [Opening(f"window{k}", "window", 0, 0.4 + 2.0 * k, 0.9, 1.3, 0.9) for k in range(2)]
    found = set()
    for seed in range(24):
        room = setting(seed=seed, openings=windows)
        walls.curtains(room)
        hung = {thing.kind for thing in room.placed}
        assert len({(thing.kind, thing.variant) for thing in room.placed if thing.kind in walls.CURTAINS}) == 1
        found |= hung
    assert found >= set(walls.CURTAINS)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", walls.WALL_SHELVES)
def test_shelves_on_walls_carry_books_and_something_beside(kind, seed, monkeypatch):
    """Of whichever form they are."""
    monkeypatch.setattr(walls, "WALL_SHELVES", (kind,))
    room = setting(seed=seed)
    room.full = True
    walls.shelves(room)
    boards = [thing for thing in room.placed if thing.kind == kind]
    wet = setting(seed=seed, use="wet")
    wet.full = True
    walls.shelves(wet)
    assert wet.placed == []
    borne = [thing for thing in room.placed if thing.on]
    assert sum(thing.kind == "book" for thing in borne) >= 3
    assert {thing.kind for thing in borne} - {"book"}
    for thing in borne:
        level, over = thing.position[1], (board for board in boards if board.footprint.contains(thing.footprint))
        assert any(board.position[1] < level <= board.position[1] + board.size[1] + 1e-3 for board in over)


@pytest.mark.parametrize(
    ("low", "tall", "foot", "kinds"),
    [
        (-1.5, 0.6, (0.0, 0.1), walls.CURTAINS),
        (-0.9, 0.6, (0.7, 0.8), walls.CURTAINS),  # to a hand's breadth below the sill
        (-0.9, 1.0, (0.9, 2.1), walls.BLINDS),  # curtains would end above the sill
    ],
)
def test_curtains_reach_as_far_down_as_there_is_room_and_are_bunched_where_there_is_little(low, tall, foot, kinds):
    for seed in range(24):
        room = setting(seed=seed, openings=[WINDOW])
        room.placed = [
            walls.Thing("tent", np.array([1.6, tall, 0.3]), np.array([x, 0.0, -1.3]), 0.0) for x in (low, -low)
        ]
        walls.curtains(room)
        hung = room.placed[2:]
        assert {thing.kind for thing in hung} <= {*kinds}
        assert all(foot[0] < thing.position[1] < foot[1] for thing in hung)


@pytest.mark.parametrize("resident", ["", "child"])
def test_pictures_of_one_wall_are_of_one_kind_and_a_childs_are_a_childs(resident, monkeypatch):
    monkeypatch.setattr("echousd.dressing.dress.OTHER", 0.0)
    walls_seen = set()
    for seed in range(12):
        room = setting(seed=seed)
        room.resident = resident
        bare_walls(room)
        names = [thing.kind for thing in room.placed]
        assert len(set(names)) == len(names)
        kinds = {PRINTS[name]["kind"] for name in names if room.placed[0].yaw == room.placed[names.index(name)].yaw}
        assert len(kinds) == 1
        walls_seen |= {PRINTS[name]["kind"] for name in names}
    assert (walls_seen == {"childs"}) == (resident == "child")
    assert resident or len(walls_seen) > 4


@pytest.mark.parametrize("seed", range(8))
def test_pictures_over_a_piece_hang_on_its_axis_and_about_two_thirds_as_wide(seed):
    room = setting("sideboard", seed=seed)
    walls.pictures(room)
    assert {thing.on for thing in room.placed} == {"sideboard"}
    left, _, right, _ = shapely.union_all([thing.footprint for thing in room.placed]).bounds
    assert left + right == pytest.approx(0.0, abs=0.02)
    assert 0.33 < (right - left) / SIZES["sideboard"][0] < 0.78
    low, high = (pick(one.position[1] + k * one.size[1] for one in room.placed) for pick, k in ((min, 0), (max, 1)))
    assert low >= SIZES["sideboard"][1] + walls.OVER - 0.006
    assert walls.EYE - 0.01 < (low + high) / 2 < walls.HIGHEST


def test_bare_walls_have_other_things_than_pictures_each_once():
    met = set()
    for seed in range(30):
        room = replace(setting(seed=seed), floor=0.45 * FLOOR)
        bare_walls(room)
        others = [thing for thing in room.placed if thing.kind in room.story.decor]
        assert len({thing.kind for thing in others}) == len(others) < len(room.placed)
        assert all(1.4 < thing.position[1] + thing.size[1] / 2 < 1.65 for thing in others)
        met |= {thing.kind for thing in others}
    assert met == set(room.story.decor)


def test_a_hall_has_two_groups_on_a_wall_and_both_sides_of_a_door_something(monkeypatch):
    monkeypatch.setattr("echousd.dressing.dress.OTHER", 0.0)
    room = setting(openings=[Opening("door", "door", 2, 3.4, 0.9, 2.1)])
    room = replace(room, floor=2.0 * FLOOR)
    bare_walls(room)
    beside = [thing for thing in room.placed if thing.position[2] > 2.9]  # the wall with the door
    along = np.array([thing.position[0] for thing in beside])
    assert (along < -0.6).any()
    assert (along > 0.6).any()
    whole = [thing for thing in room.placed if thing.position[2] < -2.9]
    groups = [[one.footprint.bounds for one in whole if one.variant == v] for v in {one.variant for one in whole}]
    (_, left), (right, _) = sorted((min(b[0] for b in one), max(b[2] for b in one)) for one in groups)
    assert right - left > 1.0


def test_curtains_fall_in_folds_that_are_even_at_the_head_and_uneven_at_the_foot():
    size = np.array([0.5, 2.3, 0.085])
    for kind in walls.CURTAINS:
        cloth = max(solids_of(kind, size, np.random.default_rng(1)), key=lambda solid: len(solid.mesh()[0]))
        head, foot = (np.ptp(np.diff(cloth.front[row, 9::10, 0])) for row in (-1, 0))
        assert foot > 0.02 > head, kind
        low, next_up = (np.ptp(cloth.front[row, :, 2]) for row in (0, 1))
        assert next_up < 0.85 * low, kind  # it breaks over the floor


def test_long_rugs_are_runners_and_rugs_of_one_room_differ():
    host = setting("toy_box").objects["toy_box"]
    forms = set()
    for seed in range(30):
        room = setting(seed=seed)
        for extents in ((2.4, 0.8), (0.8, 2.4), (2.0, 1.9), (2.4, 1.7)):
            rug = floors._rug(room, host, np.zeros(3), np.array(extents))
            form = PRINTS[rug.kind]["form"]
            forms.add(form)
            assert (form == "runner") == (max(extents) > 2 * min(extents))
            assert rug.size[0] >= rug.size[2]
            assert form != "round" or rug.size[0] == rug.size[2] == 1.9
            room.placed.append(rug)
        assert len({rug.kind for rug in room.placed}) == 4
    assert forms == {"runner", "round", "oval", "rug"}


def test_a_throw_hangs_over_an_arm_and_not_into_the_seat():
    found = 0
    for seed in range(12):
        room = setting("multi_seat_sofa", seed=seed)
        room.full = True
        host = room.objects["multi_seat_sofa"]
        upholstery.throws(room)
        for throw in room.placed:
            found += 1
            seat, side = soft_tops.Seat.of(host), float(throw.position[0])
            assert 0.8 < abs(side) < 1.05
            x, y, _ = geometry_of("throw", tuple(throw.size.tolist()), throw.variant, throw.lie).mesh.vertices.T
            low = [throw.position[1] + y[way * np.sign(side) * x > 0.1 * throw.size[0]].min() for way in (-1, 1)]
            assert seat.level + 0.02 < low[0] > low[1] > 0.05  # outside it hangs further down
            x, z = host.in_plan(throw.position)
            under = seat.height[np.ix_(np.abs(seat.x - x) < throw.size[0] / 2, np.abs(seat.z - z) < throw.size[2] / 2)]
            assert throw.position[1] + throw.size[1] == pytest.approx(under.max(), abs=0.02)
    assert found >= 10  # of twelve, the high arms of a chesterfield too


def test_what_belongs_together_stands_together_on_shallow_tops():
    beside = 0
    for seed in range(12):
        room = setting("sideboard", seed=seed)
        tabletops.tabletops(room)
        beside += sum(thing.kind in ("candlesticks", "ornament") for thing in room.placed if thing.position[1] > 0.8)
    assert beside >= 12  # at flowers or a vase, within the 42 cm of the top


def test_offices_write_on_small_desks():
    kinds = []
    for seed in range(12):
        room = setting("desk", seed=seed)
        room.story = story("office")
        tabletops.tabletops(room)
        kinds.append({thing.kind for thing in room.placed if thing.on == "desk"})
    assert sum({"monitor", "keyboard"} <= one for one in kinds) >= 10
    assert sum(bool({"papers", "notebook"} & one) for one in kinds) >= 10


def test_a_set_table_has_a_napkin_at_the_left_and_a_glass_at_the_right_of_each_plate():
    table = stood("dining_table", 3, np.zeros(3))
    room = setting()
    seats = [(0.0, 0.7, np.pi), (0.0, -0.7, 0.0)]
    sat = [stood("bench", 1, [x, 0.0, z], yaw, f"seat_{n}") for n, (x, z, yaw) in enumerate(seats)]
    room.objects = {one.name: one for one in (table, *sat)}
    laid(room, table, tabletops.surfaces(table)[0])
    plates = [thing for thing in room.placed if thing.kind == "plate"]
    assert len(plates) == len(seats)
    for plate in plates:
        sides = {}
        for thing in room.placed:
            way = thing.position - plate.position
            ahead = np.array([np.sin(plate.yaw), np.cos(plate.yaw)])  # what a plate turns to who sits there
            if np.linalg.norm(way) < 0.3:
                sides[thing.kind] = float(way[[0, 2]] @ (-ahead[1], ahead[0]))
        assert sides["napkin"] < -0.2 < 0.15 < sides["glass"]


def test_a_hall_has_a_rug_between_what_stands_there():
    doors = [Opening("door", "door", 1, 0.2, 0.9, 2.0)]
    room, wet = (setting("shoe_cabinet", openings=doors, use=use) for use in ("", "wet"))
    floors.rugs(wet)
    floors.rugs(room)
    (rug,) = room.placed
    assert not wet.placed
    assert KINDS[rug.kind].name == "rug"
    assert room.room.buffer(-0.1).contains(rug.footprint)
    taken = [way for way, _ in room.ways] + [one.footprint for one in room.objects.values()]
    assert not any(rug.footprint.intersects(one) for one in taken)


def test_the_only_desk_has_a_rug_before_it_though_it_stands_at_a_wall():
    room = setting("desk")
    floors.rugs(room)
    (rug,) = room.placed
    assert rug.on == "desk"
    assert rug.position[2] > room.objects["desk"].position[2]


@pytest.mark.parametrize("length", [1.2, 3.0])
def test_a_clock_hangs_in_the_middle_of_a_short_wall_and_aside_on_a_long_one(length, monkeypatch):
    wall = walls.walls_of(FLOOR)[2]
    monkeypatch.setattr(walls, "free_walls", lambda *_: [(length, wall.length / 2, wall)])
    room = setting("multi_seat_sofa")
    room.full = True
    walls.clock(room)
    (one,) = room.placed
    aside = abs((one.position[[0, 2]] - wall.start) @ wall.along - wall.length / 2)
    assert aside == pytest.approx(0.0 if length < walls.BROAD else length / 2 - walls.CLOCK / 2, abs=1e-6)
