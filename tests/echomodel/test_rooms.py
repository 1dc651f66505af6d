"""The room generator: deterministic, inside its floor, without accidental collisions, like real rooms in numbers."""

from collections import Counter, defaultdict

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon, box

from echomodel.metrics.layouts import Task, layout_scores
from echomodel.rooms.builder import Item, overlaps
from echomodel.rooms.floor import sample_floor
from echomodel.rooms.generator import generate_room, generate_rooms
from echomodel.rooms.recipes import SOFA_KINDS
from echomodel.rooms.statistics import room_requests, room_type_statistics
from echomodel.sizes import room_statistics, size_score
from echomodel.vocabulary import vocabulary

TYPES = [kind.name for kind in vocabulary().room_types]
SEATS = (
    "dining_chair", "chinese_chair", "chair", "office_chair", "stool", "dressing_chair", "lounge_chair", "ottoman",
)  # fmt: skip
# Pairs that are meant to meet: chairs under tables, a table in the corner of an L, pieces side by side.
MEANT = {
    frozenset(pair)
    for pair in (
        *((seat, table) for table in ("dining_table", "desk", "table", "dressing_table") for seat in SEATS),
        *((bed, "nightstand") for bed in ("double_bed", "single_bed", "kids_bed")),
        ("l_shaped_sofa", "coffee_table"), ("coffee_table",), ("tv_stand", "plant"),
    )
}  # fmt: skip


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(300, 5)


def footprint(room, k):
    x, _, z = room.size[k]
    turned = affinity.rotate(box(-x / 2, -z / 2, x / 2, z / 2), -room.yaw[k], (0, 0), use_radians=True)
    return affinity.translate(turned, room.position[k, 0], room.position[k, 2])


def test_rooms_are_a_function_of_seed_and_number(rooms):
    again = generate_rooms(3, 5, start=100)
    for first, second in zip(rooms[100:103], again, strict=True):
        assert first.to_json() == second.to_json()
    assert generate_rooms(1, 6)[0].to_json()["objects"] != rooms[0].to_json()["objects"]
    assert max(generate_rooms(1, 5, styles=4)[0].styles) < 4


def test_words_models_and_frames(rooms):
    words = vocabulary()
    for room in rooms:
        assert words.room_type(room.room_type).name == room.room_type
        for category, style, model in zip(room.categories, room.styles, room.models, strict=True):
            assert words.category(category).name == category
            assert model == f"s{style}_{category}"
        low, high = room.floor_polygon.min(0), room.floor_polygon.max(0)
        assert np.allclose(low + high, 0, atol=1e-9)
        assert (room.size > 0).all()
        assert (np.abs(room.yaw) <= np.pi).all()


@pytest.mark.parametrize("room_type", TYPES)
def test_floors_are_simple_polygons_with_walls_facing_inwards(room_type):
    rng = np.random.default_rng(3)
    shapes = set()
    for _ in range(60):
        floor = sample_floor(room_type_statistics(room_type), rng)
        polygon = Polygon(floor.polygon)
        assert polygon.is_valid
        assert polygon.area == pytest.approx(floor.area)
        shapes.add(len(floor.polygon))
        for wall in floor.walls:
            x, z = wall.point(wall.length / 2, 0.02)
            assert polygon.contains(box(x - 0.01, z - 0.01, x + 0.01, z + 0.01))
        distance = floor.opposite(floor.walls[0], floor.walls[0].length / 2)
        assert distance < np.inf
        x, z = floor.walls[0].point(floor.walls[0].length / 2, distance - 0.02)
        assert polygon.buffer(1e-6).contains(box(x - 0.001, z - 0.001, x + 0.001, z + 0.001))
    assert len(shapes) > 1


def test_furniture_stands_on_the_floor_without_accidental_collisions(rooms):
    for room in rooms:
        floor = Polygon(room.floor_polygon).buffer(0.06, join_style="mitre")
        prints = [footprint(room, k) for k in range(len(room))]
        lamps = ["_lamp" in category and room.position[k, 1] > 0 for k, category in enumerate(room.categories)]
        for i in range(len(room)):
            if not lamps[i]:
                assert prints[i].difference(floor).area < 1e-6, (room.id, room.categories[i])
            for j in range(i):
                apart = room.position[i, 1] >= room.position[j, 1] + room.size[j, 1] - 1e-9
                apart |= room.position[j, 1] >= room.position[i, 1] + room.size[i, 1] - 1e-9
                if apart or lamps[i] or lamps[j]:
                    continue
                shared = prints[i].intersection(prints[j])
                if shared.area and frozenset((room.categories[i], room.categories[j])) not in MEANT:
                    x0, z0, x1, z1 = shared.bounds
                    assert min(x1 - x0, z1 - z0) < 0.08, (room.id, room.categories[i], room.categories[j])


def test_overlap_test_agrees_with_polygons():
    rng = np.random.default_rng(8)
    for _ in range(400):
        a, b = (
            Item("chair", (*rng.uniform(0.3, 2, 3),), *rng.uniform(-1, 1, 3) * [1, 0, 1],
                 yaw=rng.choice([0.0, np.pi / 2, 0.5, 2.2]))
            for _ in range(2)
        )  # fmt: skip
        shapes = [
            affinity.translate(
                affinity.rotate(box(-i.size[0] / 2, -i.size[2] / 2, i.size[0] / 2, i.size[2] / 2), -i.yaw, (0, 0),
                                use_radians=True), i.x, i.z)
            for i in (a, b)
        ]  # fmt: skip
        assert overlaps(a, b, 0.0) == (shapes[0].intersection(shapes[1]).area > 1e-9)


def test_numbers_resemble_real_rooms():
    for room_type, wished in (("bedroom", 5.0), ("living_dining_room", 14.0), ("living_room", 9.0)):
        drawn = generate_rooms(250, 9, room_type=room_type)
        assert abs(np.median([len(room) for room in drawn]) - wished) <= 1.0
        statistics = room_type_statistics(room_type, requests=False)
        for category, (share, _, _) in statistics.presence.items():
            if share > 0.5:
                got = np.mean([category in room.categories for room in drawn])
                assert abs(got - share) < 0.18, (room_type, category)


def test_unknown_room_type_is_named():
    with pytest.raises(ValueError, match="no statistics for room type 'garage': allowed are bedroom"):
        generate_room(np.random.default_rng(0), "garage")


def test_sizes_asked_for_give_the_medians_of_real_rooms():
    asked = room_requests()["size"]
    assert set(asked) <= set(room_statistics()["sizes"])
    assert all(len(shift) == 3 and max(map(abs, shift)) <= 1 for shift in asked.values())
    rooms = generate_rooms(1500, seed=8)
    categories = np.concatenate([room.categories for room in rooms])
    sizes = np.concatenate([room.size for room in rooms])
    for category in ("wardrobe", "coffee_table", "pendant_lamp", "double_bed", "dining_chair", "tv_stand"):
        scores = np.median(size_score(category, sizes[categories == category]), axis=0)
        assert np.abs(scores).max() < 0.25, category  # of a standard deviation


def test_backs_stand_off_their_walls_as_in_real_rooms(rooms):
    gaps, turns, real = defaultdict(list), [], room_statistics()["walls"]
    for room in rooms:
        walls = Polygon(room.floor_polygon).exterior
        for category, size, (x, _, z), yaw in zip(room.categories, room.size, room.position, room.yaw, strict=True):
            back = LineString([(x, z), (x - 99 * np.sin(yaw), z - 99 * np.cos(yaw))])
            gaps[category].append(walls.intersection(back).distance(Point(x, z)) - size[2] / 2)
            turns += [abs((yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4)] * (category == "floor_lamp")
    for category in ("double_bed", "wardrobe", "tv_stand", "nightstand"):
        for got, wished in zip(np.percentile(gaps[category], (25, 50, 75)), real[category]["back_gap"], strict=True):
            assert abs(got - wished) < 0.04, (category, got)
    assert abs(np.mean(np.less(turns, np.radians(5))) - real["floor_lamp"]["axis_aligned"]) < 0.2


def test_halls_hold_several_zones_and_stay_tidy():
    halls = generate_rooms(60, 4, halls=1.0)
    area = np.array([Polygon(room.floor_polygon).area for room in halls])
    count = np.array([len(room) for room in halls])
    assert np.median(area) > 35
    assert area.max() > 60
    assert np.percentile(count, 80) >= 20
    assert max(sum(word in SOFA_KINDS for word in room.categories) for room in halls) >= 2
    assert max(room.categories.count("dining_table") for room in halls) >= 2
    scores: Counter = Counter()
    for hall in halls:
        found = layout_scores(Task(hall, np.zeros((0, 3), int)), hall)
        scores.update({name.removeprefix("term "): v[0] for name, v in found.items() if name.startswith("term ")})
    spacious = {"groups_apart", "chairs_balanced", "bed_foot_free", "chair_pulls_out", "knees_free", "view_free"}
    spacious |= {"screen_in_view", "sofa_ahead", "table_amid", "floor_used", "seats_apart"}
    spacious |= {"floor_served", "elbow_room", "wardrobe_opens", "each_served"}  # nor are a hall's distances a room's
    objects = int(count.sum())
    # To the recipes: screens before windows, leaves, beds along walls, halves, ends, corners, ways from doors.
    unknown = {"screen_on_axis", "window_free", "leaf_aside", "bed_along_wall", "halves_used", "ends_used", "reached"}
    unknown |= {"corners_used", "way_in"}
    for name in unknown:
        scores.pop(name)
    missed = sum(number for rule, number in scores.items() if rule not in spacious)
    assert missed < 0.07 * objects  # .057
    assert scores.total() < 0.22 * objects  # a full hall's zones stand closer than the rules have them
    assert halls[3].to_json() == generate_rooms(1, 4, start=3, halls=1.0)[0].to_json()


def test_a_share_of_halls_leaves_the_other_rooms_alone():
    plain, mixed = generate_rooms(40, 2), generate_rooms(40, 2, halls=0.2)
    same = [a.to_json() == b.to_json() for a, b in zip(plain, mixed, strict=True)]
    assert 0.5 < np.mean(same) < 1.0
