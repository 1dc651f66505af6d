"""Small things tell who lives in a room: what is asked for, what the furniture suggests, and where it lies."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
import trimesh

import echousd
from echomodel.dressing import KINDS
from echomodel.vocabulary import vocabulary
from echousd.dressing import tabletops
from echousd.dressing.dress import dressed, setting_of
from echousd.dressing.setting import Setting, Thing, standing
from echousd.dressing.soft_tops import Seat
from echousd.dressing.stories import TABLE, guessed, story
from echousd.dressing.walls import mirror_over
from echousd.graph import SceneGraph
from echousd.graph.fields import RESIDENTS
from echousd.options import RoomOptions
from echousd.shapes.colliders import standing_hull
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.stage.read import read_graph

STUDY = """
room: {type: bedroom, size: [4.2, 3.6]}
nodes:
  - {name: bed, category: single_bed}
  - {name: desk, category: desk}
  - {name: nightstand, category: nightstand}
"""


def test_rooms_dressed_in_full_have_all_that_a_share_of_others_has():
    floor = np.array([[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0], [2.0, -2.0]])
    some, full = (Setting({}, floor, (), 2.6, True, dressed, 0) for dressed in (False, True))
    rng = np.random.default_rng(0)
    assert np.mean([some.has(0.3, rng) for _ in range(2000)]) == pytest.approx(0.3, abs=0.04)
    assert all(full.has(0.01, rng) for _ in range(100))


@pytest.mark.parametrize("mirrored", [False, True])
def test_no_mirror_hangs_over_a_table_that_has_one(mirrored):
    size, slot = np.array([1.1, 0.8, 0.45]), "mirror" if mirrored else "wood"
    part = Part("mesh", trimesh.creation.box(size), {slot: np.arange(12)})
    made = Geometry((part,), (standing_hull(part.mesh),), Origin("parts"))
    host = standing("table", "dressing_table", size, np.zeros(3), 0.0, made)
    assert ("mirror" in mirror_over(host, np.random.default_rng(0))) != mirrored


@pytest.fixture(scope="module")
def rooms():
    """Who is told to live there -> the same room, dressed in full."""
    graph = SceneGraph.from_yaml(STUDY)
    options = {"seed": 2, "shapes": "parts", "dress": "full"}
    told = {who: echousd.generate(graph, options=RoomOptions(resident=who, **options)) for who in ("child", "senior")}
    return told | {None: echousd.generate(graph, options=RoomOptions(**options))}


def kinds_on(room, name):
    return {thing.kind for thing in dressed(room).placed if thing.on == name}


def test_every_resident_has_a_story_of_kinds_and_tops_that_there_are():
    assert set(TABLE) == {"places", "once", "sets", "straight", "loose", "stocked", "hung", "anyone", *RESIDENTS}
    for kinds in (TABLE["once"], TABLE["sets"], TABLE["straight"], TABLE["loose"], *TABLE["stocked"].values()):
        assert {*kinds} <= {*KINDS}
    tops = {row.top for row in vocabulary().categories}
    words = {word for row in vocabulary().categories for word in (row.role, row.top, *row.invites)}
    for who in ("", *RESIDENTS):
        told = story(who)
        lists = (told.beds, told.seats, told.floor, told.sills, *told.tops.values())
        wishes = [wish for one in lists for wish in one]
        assert {kind for wish in wishes for among in (wish.of, *wish.beside) for kind in among} <= {*KINDS}
        assert {*told.shelves, *told.decor, *told.boards} <= {"", *KINDS}
        assert set(told.tops) <= tops
        assert {wish.by for wish in (*told.seats, *told.floor)} <= words
        assert all(wish.at for wish in wishes)


@pytest.mark.parametrize(
    ("room", "furniture", "who"),
    [
        ("bedroom", ("kids_bed", "desk"), "child"),
        ("bedroom", ("single_bed", "desk"), "student"),
        ("bedroom", ("double_bed", "dressing_table"), "couple"),
        ("study", ("desk",), "office"),
        ("bedroom", ("double_bed",), ""),
    ],
)
def test_furniture_suggests_who_lives_there(room, furniture, who):
    assert guessed(room, map(vocabulary().category, furniture)) == who


def test_who_lives_there_is_told_by_what_lies_on_desks_beds_and_floors(rooms):
    assert "drawing" in kinds_on(rooms["child"], "desk")
    assert "laptop" in kinds_on(rooms[None], "desk")  # a single bed and a desk: a student
    assert "laptop" not in kinds_on(rooms["child"], "desk") | kinds_on(rooms["senior"], "desk")
    assert "bear" in kinds_on(rooms["child"], "bed")
    on_floor = {thing.kind for thing in dressed(rooms["child"]).placed if thing.position[1] == 0.0}
    assert on_floor & {"train", "dolls_house"}
    assert "photo" in kinds_on(rooms["senior"], "nightstand")


def test_nothing_stands_alone_on_bare_floor(rooms):
    for room in rooms.values():
        setting = dressed(room)
        rugs = [t.footprint for t in setting.placed if KINDS[t.kind].name == "rug"]
        loose = [t for t in setting.placed if t.position[1] == 0.0 and not KINDS[t.kind].lies]
        for one in loose:
            company = [o.footprint for o in setting.objects.values()]
            company += [t.footprint for t in loose if t is not one] + [setting.room.exterior, *rugs]
            assert min(one.footprint.distance(other) for other in company) < 0.36, one


def test_the_graph_keeps_who_lives_there(rooms, tmp_path):
    room = rooms["child"]
    assert room.graph.room.resident == "child"
    assert rooms[None].graph.room.resident is None
    assert SceneGraph.from_yaml(room.graph.to_yaml()).room.resident == "child"
    assert read_graph(room.save(tmp_path / "room", preview=False)).room.resident == "child"


def test_nobody_else_lives_there():
    with pytest.raises(ValueError, match="resident is 'cat', allowed: child, teen"):
        RoomOptions(resident="cat")
    with pytest.raises(ValueError, match="found 'cat', allowed: child, teen"):
        SceneGraph.from_yaml(STUDY.replace("size:", "resident: cat, size:"))


def test_what_lies_on_a_bed_lies_within_it(rooms):
    for room in rooms.values():
        bed = dressed(room).objects["bed"]
        for thing in dressed(room).placed:
            if thing.on == "bed" and not KINDS[thing.kind].lies:
                assert np.abs(bed.in_plan(thing.position)).max() < bed.size[2] / 2
                assert bed.position[1] + 0.2 < thing.position[1] < bed.top


LOUNGE = """
room: {type: living_room, size: [4.6, 4.2]}
nodes:
  - {name: sofa, category: sofa}
  - {name: armchair, category: armchair}
  - {name: bench, category: bench}
  - {name: coffee_table, category: coffee_table}
"""


def test_what_was_left_on_seats_and_benches_lies_in_sight():
    """On the solids, so that it rests, and so thick that the cloth over these does not bury it."""
    setting = dressed(echousd.generate(SceneGraph.from_yaml(LOUNGE), seed=8, dress="full"))
    left = [t for t in setting.placed if t.kind in {kind for wish in setting.story.seats for kind in wish.of}]
    on = {name: [thing for thing in left if thing.on == name] for name in ("sofa", "armchair")}
    assert on["sofa"]
    assert on["armchair"]
    for name, things in on.items():
        host = setting.objects[name]
        for thing in things:
            there = np.insert(host.in_plan(thing.position), 1, 0.0)
            cloth = Seat.of(host).below(there, thing.size)
            over = thing.position[1] - host.position[1] - cloth
            assert -0.04 < over < 0.005
            assert over + thing.size[1] > 0.4 * thing.size[1]
    assert any(thing.on == "bench" for thing in setting.placed)


@pytest.mark.parametrize("blocked", [False, True])
def test_a_keyboard_lies_before_a_monitor_only(rooms, blocked):
    setting = setting_of(rooms[None])
    setting.story, desk = story("teen"), setting.objects["desk"]
    behind = desk.to_room(np.array([[0, desk.size[1], -0.3 * desk.size[2]]]))[0]
    if blocked:
        setting.placed = [Thing("mirror", np.array([desk.size[0], 0.5, 0.1]), behind, desk.yaw)]
    tabletops.tabletops(setting)
    on = {thing.kind for thing in setting.placed if thing.on == "desk"}
    assert on & {"monitor", "keyboard"} == (set() if blocked else {"monitor", "keyboard"})


def test_a_room_has_one_knitting(rooms):
    setting = setting_of(rooms[None])
    size, far = np.array([0.26, 0.1, 0.17]), np.array([1.0, 0.0, 0.0])
    put = [setting.put_first([Thing("knitting", size, side * far, 0.0)], floor=False, margin=-9.0) for side in (-1, 1)]
    assert [one is None for one in put] == [False, True]


@pytest.mark.parametrize("row", TABLE["hung"])
def test_pictures_that_hang_together_fill_their_width_in_one_form_and_apart(row):
    x, y, w, h = np.array(row["of"], float).T
    assert ((x - w / 2).min(), (x + w / 2).max()) == pytest.approx((-0.5, 0.5), abs=0.002)
    assert (y + h / 2).max() == pytest.approx(-(y - h / 2).min(), abs=0.002)
    assert len(set(w > h)) == 1
    assert ((w / h > 0.7) & (w / h < 0.78) | (w / h > 1.4) & (w / h < 1.5)).all()  # of the sheets
    assert 0.25 < row["wide"][0] * w.min() < row["wide"][1] * w.max() < 1.7
    boxes = shapely.box(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    assert all(one.distance(other) > 0.02 for one, other in combinations(boxes, 2))


def test_glasses_of_a_room_are_a_set_and_those_of_rooms_differ(rooms):
    forms = {who: {t.recipe for t in dressed(room).placed if t.kind == "glass"} for who, room in rooms.items()}
    assert all(len(found) <= 1 for found in forms.values())
    table, tried = TABLE["sets"], set()
    for seed in range(12):
        setting = setting_of(replace(rooms[None], provenance=replace(rooms[None].provenance, seed=seed)))
        surface = tabletops.surfaces(setting.objects["desk"])[0]
        placed = [surface.put(setting, table[0], [(side, 0.0)], word=str(side)) for side in (-0.8, 0.8)]
        assert placed[0].recipe == placed[1].recipe
        tried.add(placed[0].recipe)
    assert len(tried) > 3


def test_large_rooms_have_things_beside_more_than_one_piece():
    boards = "".join(f"  - {{name: shelf_{n}, category: bookshelf}}\n" for n in range(4))
    beside = []
    for size in ("[4.6, 4.2]", "[9.0, 8.0]"):
        graph = SceneGraph.from_yaml(f"room: {{type: study, size: {size}, resident: office}}\nnodes:\n{boards}")
        setting = dressed(echousd.generate(graph, seed=3, shapes="boxes", dress="full"))
        wish = next(wish for wish in setting.story.floor if wish.by == "basket")
        beside.append(sum(t.kind in wish.of and t.position[1] == 0.0 for t in setting.placed))
    assert beside[1] > beside[0]
