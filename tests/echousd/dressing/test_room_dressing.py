"""Small things: where they stand, that they stay out of the way, and that the room is the same without them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
import trimesh
from pxr import Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdValidation
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.boxes2d import turned
from echomodel.dressing import KINDS, PRINTS, SMALL, printed
from echomodel.dressing import thing as solids_of
from echomodel.furniture.solids import pieces_of
from echomodel.openings import Opening
from echomodel.triangles import Mesh
from echomodel.vocabulary import vocabulary
from echousd.checks import check
from echousd.dressing import floors, soft_tops, tabletops, upholstery
from echousd.dressing.dress import RULES, TALL, Dressing, dress, dressed, setting_of
from echousd.dressing.setting import Setting, Thing, geometry_of, meets, standing
from echousd.dressing.soft_tops import STEP, Seat
from echousd.dressing.walls import BLINDS, CURTAINS, RADIATORS, curtains, radiators, sills, sockets
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.layers.compose import room_files
from echousd.options import RoomOptions
from echousd.room import Provenance
from echousd.shapes.fittings import SKIRTING
from echousd.shapes.geometry import Collider, Geometry, Origin, Part
from echousd.shapes.sources.whole import material_groups, solid_geometry
from echousd.shapes.walls import walls
from echousd.stage.read import read_graph

SQUARE = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])


@pytest.fixture(scope="module")
def bare():
    return echousd.generate(
        "samples/living_room.usda", seed=1, shapes="boxes", options=RoomOptions(walls=True, dress="none")
    )


@pytest.fixture(scope="module")
def room(bare):
    return replace(bare, options=RoomOptions(walls=True, dress="full"))


@pytest.fixture(scope="module")
def root(room, tmp_path_factory):
    return room.save(tmp_path_factory.mktemp("rooms") / "living_room", preview=False)


@pytest.fixture(scope="module")
def files(room):
    return room_files(room)


def test_nothing_else_changes(bare, files):
    plain, dressed = room_files(bare), files
    small = {path for path in dressed if path not in plain}
    assert small
    assert all(path == "layers/dressing.usda" or path.startswith(("assets/small_", "textures/")) for path in small)
    touched = {path for path in plain if dressed[path] != plain[path]}
    assert touched <= {"living_room.usda", "layers/materials.usda"}


def test_same_room_same_things(room, files):
    assert room_files(room) == files
    assert not dress(replace(room, options=RoomOptions(walls=False, dress="none"))).layouts


def test_muted_the_room_is_bare(root, room):
    stage = Usd.Stage.Open(str(root))
    assert stage.GetPrimAtPath("/Room/Dressing").GetChildren()
    assert read_graph(stage) == room.graph
    stage.MuteLayer(str(root.parent / "layers/dressing.usda"))
    assert not stage.GetPrimAtPath("/Room/Dressing")
    assert read_graph(stage) == room.graph


def test_every_thing_is_a_proper_prim(root):
    stage = Usd.Stage.Open(str(root))
    assert stage.GetCompositionErrors() == []
    words = {kind.name: kind for kind in KINDS.values()}
    for prim in stage.GetPrimAtPath("/Room/Dressing").GetChildren():
        assert Usd.ModelAPI(prim).GetKind() == "component", prim
        word = UsdSemantics.LabelsAPI(prim, "category").GetLabelsAttr().Get()[0]
        assert UsdSemantics.LabelsAPI(prim, "ade20k").GetLabelsAttr().Get()[0] == words[word].ade20k
        if not words[word].fixed:
            assert prim.HasAPI(UsdPhysics.RigidBodyAPI)
            assert UsdPhysics.MassAPI(prim).GetMassAttr().Get() > 0
        solid = any(below.HasAPI(UsdPhysics.CollisionAPI) for below in Usd.PrimRange(prim))
        assert solid != (words[word].lies or words[word].yields), prim
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetMessage() for error in errors] == []
    assert check(root).ok


def test_things_stay_in_the_room_and_out_of_each_other(room):
    setting = setting_of(room)
    things = dressed(room).placed
    upright = [t for t in things if not KINDS[t.kind].lies]
    assert len(things) >= 30
    for number, one in enumerate(upright):
        assert setting.room.buffer(0.02).contains(one.footprint), one
        for other in upright[number + 1 :]:
            apart = min(one.position[1] + one.size[1], other.position[1] + other.size[1]) <= max(
                one.position[1], other.position[1]
            )
            assert apart or one.footprint.intersection(other.footprint).area < 1e-6, (one, other)


def test_a_window_without_room_for_curtains_has_a_blind_and_no_rail():
    floor = SQUARE
    window = Opening("window", "window", 0, 1.1, 1.8, 1.3, 0.9)
    setting = Setting({}, floor, (window,), 2.7, True, False, 0)
    setting.placed = [Thing("floor_vase", np.array([3.4, 2.4, 0.35]), np.array([0.0, 0.0, -1.8]), 0.0)]
    curtains(setting)
    (blind,) = setting.placed[1:]
    assert KINDS[blind.kind].name == "blind"
    assert not setting.curtained
    assert -2.02 < blind.footprint.bounds[1] < blind.footprint.bounds[3] < -2.0  # between the jambs, not in the room
    assert blind.footprint.bounds[0] > -0.9
    assert blind.position[1] + blind.size[1] < 2.2
    for bare, rails in ((frozenset(), 1), (frozenset({"window"}), 0)):
        pieces = [piece.name for part in walls(floor, 2.7, (window,), bare)[0].inner for piece in part.pieces]
        assert len(pieces) == 3 + rails
        assert sum(name.endswith("rail") for name in pieces) == rails


def test_nothing_small_stands_in_the_way_out_through_a_french_window():
    def free(sill, z):
        window = Opening("window", "window", 0, 1.1, 1.8, 2.2 - sill, sill)
        setting = Setting({}, SQUARE, (window,), 2.7, True, False, 0)
        return setting.clear(Thing("basket", np.array([0.3, 0.4, 0.3]), np.array([0.0, 0.0, z]), 0.0))

    assert [free(sill, z) for sill in (0.3, 0.0) for z in (-1.8, -1.4, -1.2)] == [True, True, True, False, False, True]


@pytest.mark.parametrize(("tall", "x", "kind"), [(2.37, 1.4, "blind"), (2.2, 1.4, "curtain"), (2.37, 1.7, "curtain")])
def test_no_rail_runs_into_what_stands_beside_a_window(tall, x, kind):
    window = Opening("window", "window", 0, 1.1, 1.8, 1.3, 0.9)  # its rail reaches to 1.15 at 2.32
    size = np.array([0.6, tall, 0.5])
    box = trimesh.creation.box(size, trimesh.transformations.translation_matrix((0, tall / 2, 0)))
    part = Part("mesh", Mesh.of(box), {"wood": np.arange(12)})
    geometry = Geometry((part,), (Collider("collider", part.mesh, "convexHull"),), Origin("test"))
    wardrobe = standing("wardrobe", "wardrobe", size, np.array([x, 0.0, -1.75]), 0.0, geometry)
    setting = Setting({"wardrobe": wardrobe}, SQUARE, (window,), 2.7, True, False, 0)
    curtains(setting)
    assert {KINDS[thing.kind].name for thing in setting.placed} == {kind}
    assert bool(setting.curtained) == (kind == "curtain")


@pytest.mark.parametrize("style", [None, "industrial", "modern"])
def test_a_radiator_stands_under_a_window_between_its_curtains(style):
    window = Opening("window", "window", 0, 1.1, 1.8, 1.3, 0.9)
    setting = Setting({}, SQUARE, (window,), 2.7, True, False, 0, style=vocabulary().known_style(style))
    curtains(setting)
    hung = len(setting.placed)
    radiators(setting)
    (found,) = setting.placed[hung:]
    allowed = vocabulary().known_style(style).radiators if style else RADIATORS
    assert found.kind in allowed
    assert all(KINDS[kind].fixed and KINDS[kind].name == "radiator" for kind in allowed)
    assert found.position[1] == 0 < 0.45 < found.size[1] < window.sill - 0.1
    low, high = found.footprint.bounds[::2], found.footprint.bounds[1::2]
    assert -0.9 < low[0] < -0.3 < 0.3 < low[1] < 0.9  # below the pane
    assert -2.0 + SKIRTING < high[0] < high[1] < -1.8
    assert not any(found.footprint.intersects(one.footprint) for one in setting.placed[:hung])


def test_a_told_style_has_its_own_curtains_pictures_rugs_and_cushions(bare):
    for style in vocabulary().styles:
        assert set(style.curtains) <= {*CURTAINS, *BLINDS}
        assert min(len({*style.curtains} & {*kinds}) for kinds in (CURTAINS, BLINDS)) > 0
        kinds = {row.get("kind", name) for name, row in PRINTS.items() if "for" not in row}
        assert set(style.prints) <= kinds
        for form in ("tall", "wide"):
            assert {*printed("picture", form, style=style)} <= {*style.prints}
    graph = bare.graph.replaced(room=bare.graph.room.replaced(style="boho"))
    told = replace(bare, graph=graph, options=RoomOptions(walls=True, dress="full"))
    style, found = vocabulary().style("boho"), set()
    for seed in range(4):
        names = [thing.kind for thing in dressed(replace(told, provenance=Provenance(seed))).placed]
        found |= {PRINTS[name].get("kind", name) for name in names if name in PRINTS}
        assert {name for name in names if name in (*CURTAINS, *BLINDS)} <= {*style.curtains}
    assert found
    assert found <= {*style.prints}


def block(category, size, z):
    """A piece of these extents that stands in the middle of `SQUARE`'s first wall, as one solid."""
    box = trimesh.creation.box(size, trimesh.transformations.translation_matrix((0, size[1] / 2, 0)))
    whole = solid_geometry(box, category, Origin("boxes"))
    return standing(category, category, np.array(size), np.array([0.0, 0.0, z]), 0.0, whole)


def test_no_radiator_stands_behind_furniture_or_below_a_window_that_reaches_down():
    sofa = block("sofa", (2.0, 0.8, 0.9), -1.5)
    for objects, sill in (({"sofa": sofa}, 0.9), ({}, 0.3)):
        setting = Setting(objects, SQUARE, (Opening("window", "window", 0, 1.1, 1.8, 1.3, sill),), 2.7, True, False, 0)
        radiators(setting)
        assert setting.placed == []


@pytest.mark.parametrize(("tall", "wide"), [(0.7, 1.7), (1.1, 0.0)])
def test_a_window_has_a_deep_sill_and_things_on_it_where_nothing_is_in_the_way(tall, wide):
    """They stand before the wall: its solids are hulls for many simulators, which fill the recess of a window."""
    window, desk = Opening("window", "window", 0, 1.1, 1.8, 1.3, 0.9), block("desk", (1.4, tall, 0.7), -1.64)
    setting = Setting({"desk": desk}, SQUARE, (window,), 2.7, True, True, 0)
    sills(setting)
    assert [thing.size[0] for thing in setting.placed[:1]] == pytest.approx([wide] * (wide > 0), abs=0.1)
    for thing in setting.placed:
        assert -2.0 < thing.footprint.bounds[1] < thing.footprint.bounds[3] < -1.86
    carried = [thing for thing in setting.placed if thing.on]
    assert (len(carried) > 1) == (wide > 0)
    assert all(thing.position[1] == pytest.approx(0.902) and not KINDS[thing.kind].fixed for thing in carried)
    curtained = Setting({}, SQUARE, (window,), 2.7, True, True, 0)
    curtains(curtained)
    hung = len(curtained.placed)
    sills(curtained)
    assert 0.8 < curtained.placed[hung].size[0] < 1.3  # between the curtains
    assert not any(curtained.placed[hung].footprint.intersects(one.footprint) for one in curtained.placed[:hung])


def test_a_bed_has_a_socket_in_its_wall_that_nothing_hides():
    bed = block("double_bed", (1.8, 0.5, 2.0), -0.99)
    setting = Setting({"bed": bed}, SQUARE, (), 2.7, True, False, 0)
    sockets(setting)
    (found,) = setting.placed
    assert KINDS[found.kind].fixed
    assert found.footprint.bounds[1] == pytest.approx(-1.998)
    assert 0.9 < abs(found.position[0]) < 1.8
    assert 0.2 < found.position[1] < 0.4


def test_an_undressed_room_has_a_rail_only_where_curtains_would_hang(bare):
    assert dress(bare).bare == dress(replace(bare, options=RoomOptions(walls=True, dress="full"))).bare
    windows = {opening.name for opening in bare.graph.room.openings if opening.kind == "window"}
    assert windows
    assert set() < dress(bare).bare < windows  # a sofa stands under one, which has a blind
    kitchen = bare.graph.replaced(room=bare.graph.room.replaced(type="kitchen"))
    assert dress(replace(bare, graph=kitchen)).bare == windows


def test_nothing_stands_over_an_edge_or_in_the_air(room):
    setting = setting_of(room)
    for rule in RULES:
        rule(setting)
    objects = {**setting.objects, **setting.carriers}
    standing = [t for t in dressed(room).placed if not KINDS[t.kind].fixed and t.on and KINDS[t.kind].name != "cushion"]
    assert standing
    for thing in standing:
        host = objects[thing.on]
        assert host.footprint.contains(thing.footprint), thing
        assert thing.position[1] == pytest.approx(host.top, abs=1e-6)  # boxes have one level


@pytest.mark.parametrize(("name", "least"), [("living_room", 40), ("bedroom", 25)])
def test_full_rooms_are_full_and_clean(name, least, tmp_path):
    room = echousd.generate(f"samples/{name}.usda", seed=1, options=RoomOptions(walls=True, dress="full"))
    things = dressed(room).placed
    assert len(things) >= least
    assert len({thing.kind for thing in things}) >= 15
    assert len(dress(room).recipes) < 50  # single books share their assets
    setting = setting_of(room)
    upright = [t for t in things if not KINDS[t.kind].lies and KINDS[t.kind].name not in ("cushion", "folded_blanket")]
    for number, one in enumerate(upright):
        assert setting.room.buffer(0.02).contains(one.footprint), one
        low, high = one.position[1] + 2e-3, one.position[1] + one.size[1]
        for other in upright[number + 1 :]:
            over = min(high, other.position[1] + other.size[1]) - max(low, other.position[1])
            assert over <= 0 or one.footprint.intersection(other.footprint).area < 1e-6, (one, other)
        for host in setting.objects.values():
            if one.on != host.name and KINDS[one.kind].name != "curtain":
                within = host.top > low and host.position[1] < high
                assert not within or not meets(host, low, high, one.footprint.buffer(-5e-3)), (one, host.name)
    assert check(room.save(tmp_path / name, preview=False)).ok


def test_kinds_of_one_category_agree():
    for kind in KINDS.values():
        same = SMALL[kind.name]
        assert replace(kind, program=same.program, low=same.low, high=same.high, faces=same.faces) == same, kind
        # `check` says by these what is no size of a thing: a row of books is no stack that grew
        assert all(np.less_equal(same.low, kind.low)), kind
        assert all(np.greater_equal(same.high, kind.high)), kind


def test_doors_stay_free(room):
    setting = setting_of(room)
    for thing in dressed(room).placed:
        if KINDS[thing.kind].name != "curtain":
            assert not any(way.intersects(thing.footprint) and thing.position[1] < o.height for way, o in setting.ways)


def test_layouts_have_dressings_of_their_own(tmp_path):
    graph = small_graph()
    room = echousd.generate(
        graph, seed=3, model=StandIn(), place=False, shapes="boxes", options=RoomOptions(dress="some", walls=False)
    )
    moved = Boxes(room.boxes.size, room.boxes.position + 0.1, room.boxes.yaw)
    room = replace(room, layouts=(room.boxes, moved))
    root = room.save(tmp_path / "two", preview=False)
    stage = Usd.Stage.Open(str(root))
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    places = []
    for name in ("layout_0", "layout_1"):
        variants.SetVariantSelection(name)
        things = stage.GetPrimAtPath("/Room/Dressing").GetChildren()
        cache = UsdGeom.XformCache()
        places.append([tuple(cache.GetLocalToWorldTransform(p).ExtractTranslation()) for p in things])
    assert places[0] != places[1]


def test_unknown_amount():
    with pytest.raises(ValueError, match="dress is 'lots', allowed: none, some or full"):
        RoomOptions(dress="lots", walls=False)


def large_room(**options):
    """A large square room with little in it, and a window in one wall."""
    window = Opening("window", "window", 0, 2.2, 1.4, 1.3, 0.9)
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(6.4, 6.0), openings=(window,)))
    made = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, **BARE)
    return replace(made, options=RoomOptions(walls=True, dress="some", **options))


def test_long_bare_walls_get_pictures_and_large_floors_plants(monkeypatch):
    monkeypatch.setattr("echousd.dressing.dress.OTHER", 0.0)
    room = large_room()
    setting = setting_of(room)
    things = dressed(room).placed
    alone = [thing for thing in things if KINDS[thing.kind].name == "picture" and not thing.on]
    yaws = {round(thing.yaw, 3) for thing in alone}
    assert len(yaws) == 4  # all walls
    for yaw in yaws:
        row = [thing for thing in alone if round(thing.yaw, 3) == yaw]
        assert 1 <= len(row) <= 6
        for group in ([one for one in row if one.variant == which] for which in {one.variant for one in row}):
            assert len({thing.size.tobytes() for thing in group}) <= 2
            low, high = (pick(one.position[1] + k * one.size[1] for one in group) for pick, k in ((min, 0), (max, 1)))
            assert 1.4 < (low + high) / 2 < 1.65
    green = [thing for thing in things if thing.kind in ("floor_plant", "floor_vase")]
    assert 1 <= len(green) <= 3
    for thing in green:  # in corners where nothing stands
        assert min(np.linalg.norm(setting.floor - thing.position[[0, 2]], axis=1)) < 0.75
        assert all(thing.footprint.distance(o.footprint) > 0.15 for o in setting.objects.values() if o.top > 0.1)


def test_rugs_are_as_large_as_fits_each_way():
    room = large_room()
    rug = next(thing for thing in dressed(room).placed if thing.kind.startswith("rug"))
    wide, _, deep = room.boxes.size[room.names.index("bed")].tolist()
    assert rug.size[0] < wide + 1.2  # the wardrobe stands there
    assert rug.size[2] == pytest.approx(min(0.75 * deep + 0.5, 2.4), abs=0.01)


def test_armchairs_around_a_table_share_a_rug():
    places = {"a": (-1.1, np.pi / 2), "b": (1.1, -np.pi / 2)}
    chairs = [
        Node(name, "armchair", size=(0.8, 0.8, 0.8), position=(x, 0.0, 0.0), yaw=yaw)
        for name, (x, yaw) in places.items()
    ]
    table = Node("table", "coffee_table", size=(0.9, 0.4, 0.6), position=(0.0, 0.0, 0.0), yaw=0.0)
    graph = SceneGraph(RoomSpec("living_room", size=(5.0, 4.4)), (*chairs, table))
    made = echousd.generate(graph, shapes="boxes", place=False, **BARE)
    rugs = [
        t
        for t in dressed(replace(made, options=RoomOptions(walls=True, dress="some"))).placed
        if KINDS[t.kind].name == "rug"
    ]
    assert [rug.on for rug in rugs] == ["table"]
    assert rugs[0].size[0] > 1.6  # under the chairs' feet, too


def test_the_rug_of_a_sofa_carries_the_front_legs_of_all_seats_around():
    seats = (
        Node("sofa", "multi_seat_sofa", size=(2.2, 0.9, 0.95), position=(0.0, 0.0, -1.7), yaw=0.0),
        Node("left", "armchair", size=(0.8, 0.8, 0.8), position=(-1.5, 0.0, 0.2), yaw=np.pi / 2),
        Node("across", "armchair", size=(0.8, 0.8, 0.8), position=(0.3, 0.0, 1.4), yaw=np.pi),
    )
    table = Node("table", "coffee_table", size=(1.0, 0.4, 0.6), position=(0.0, 0.0, -0.3), yaw=0.0)
    graph = SceneGraph(RoomSpec("living_room", size=(6.0, 5.0)), (*seats, table))
    made = echousd.generate(graph, shapes="boxes", place=False, **BARE)
    setting = setting_of(replace(made, options=RoomOptions(walls=True, dress="some")))
    floors.rugs(setting)
    (rug,) = setting.placed
    for one in (setting.objects[node.name] for node in seats):
        x, _, z = one.size / 2
        front = one.to_room(np.array([[-x, 0.0, z], [x, 0.0, z]]))[:, [0, 2]]
        assert rug.footprint.covers(shapely.LineString(front)), one.name


def test_cushions_lie_before_the_pillows_of_wide_beds():
    room = large_room()
    number = room.names.index("bed")
    wide, tall, deep = room.boxes.size[number].tolist()
    mattress = trimesh.creation.box((wide, 0.45, deep))
    mattress.apply_translation((0, 0.225, 0))
    pillow = trimesh.creation.box((0.6, 0.16, 0.4))
    pillow.apply_translation((0, 0.53, -deep / 2 + 0.3))
    board = trimesh.creation.box((wide, tall, 0.04))
    board.apply_translation((0, tall / 2, -deep / 2 + 0.02))
    cut, slots = material_groups(trimesh.util.concatenate([mattress, pillow, board]), "double_bed")
    colliders = tuple(Collider(name, Mesh.of(of), "convexHull") for name, of in (("board", board), ("bed", mattress)))
    geometry = {**room.geometry, "bed": Geometry((Part("mesh", Mesh.of(cut), slots),), colliders, Origin("boxes"))}
    setting, counts = setting_of(replace(room, geometry=geometry)), set()
    bed = setting.objects["bed"]
    for setting.seed in range(12):
        setting.placed.clear()
        upholstery.bed_cushions(setting)
        counts.add(len(setting.placed))
        assert {KINDS[thing.kind].name for thing in setting.placed} == {"cushion"}
        aside = 0.21 * wide if len(setting.placed) == 2 else 0.0  # a long one alone
        for thing in setting.placed:
            x, y, z = (thing.position - bed.position).tolist()
            assert abs(abs(x) - aside) < 0.16
            assert y == pytest.approx(0.45, abs=0.01)
            assert z > -deep / 2 + 0.5  # not in the pillow
    assert counts == {1, 2}


def test_cameras_ask_about_nothing_small_that_hangs_or_stands_high():
    kinds = {"book": (0.03, 0.22, 0.15), "picture": (0.5, 0.4, 0.03), "floor_plant": (0.4, 1.0, 0.4)}
    kinds |= {"basket": (0.35, 0.3, 0.35)}  # on the floor, where a near plane might cut it open
    things = {
        kind: Thing(kind, np.array(size), np.array([0.0, 0.0 if size[1] > TALL or kind == "basket" else 1.4, 0.0]), 0.0)
        for kind, size in kinds.items()
    }
    low = {"bowl": Thing("bowl", np.array([0.35, 0.1, 0.35]), np.zeros(3), 0.0)}
    assert Dressing((things | low,), {}, {}).hung.size.tolist() == [
        list(kinds[kind]) for kind in ("picture", "floor_plant", "basket")
    ]


def test_what_stands_at_a_height_reaches_there_with_its_foot():
    foot = trimesh.creation.cone(radius=0.1, height=0.4)  # wide where it stands
    foot.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
    part = Part("mesh", Mesh.of(foot), {"metal": np.arange(len(foot.faces))})
    geometry = Geometry((part,), (Collider("collider", part.mesh, "convexHull"),), Origin("test"))
    lamp = standing("lamp", "table_lamp", np.array([0.2, 0.4, 0.2]), np.array([0.0, 0.5, 0.0]), 0.0, geometry)
    assert meets(lamp, 0.5, 0.6, shapely.Point(0.096, 0).buffer(1e-3))
    assert not meets(lamp, 0.5, 0.6, shapely.Point(0.11, 0).buffer(1e-3))
    assert not meets(lamp, 0.8, 0.9, shapely.Point(0.096, 0).buffer(1e-3))


def test_cushions_lie_on_what_is_level_below_them():
    x = z = np.arange(-0.5, 0.5, STEP)
    height = np.full((len(x), len(z)), 0.5)
    height[:, z > 0.2] = 0.545  # a duvet, turned down
    seat, size = Seat(x, z, height, 0.5), np.array([0.4, 0.15, 0.3])
    assert seat.below(np.array([0.0, 0.6, -0.2]), size) == pytest.approx(0.5)
    assert seat.below(np.array([0.0, 0.6, 0.37]), size) == pytest.approx(0.545)
    assert seat.below(np.array([0.0, 0.6, 0.13]), size) is None  # on the edge of the duvet
    assert seat.below(np.array([3.0, 0.6, 0.0]), size) is None


@pytest.mark.parametrize("beside", [False, True])
def test_curtains_hang_over_the_pane_where_something_stands_beside_it(beside):
    floor = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
    window = Opening("window", "window", 0, 1.1, 1.8, 1.3, 0.9)
    setting = Setting({}, floor, (window,), 2.7, True, False, 0)
    shelf = Thing("floor_vase", np.array([0.7, 2.3, 0.35]), np.array([-1.2, 0.0, -1.8]), 0.0)
    setting.placed = [shelf] if beside else []
    curtains(setting)
    hung = [thing for thing in setting.placed if KINDS[thing.kind].name == "curtain"]
    assert len(hung) == 2
    left = min(hung, key=lambda thing: thing.position[0])
    assert left.footprint.intersection(shelf.footprint).area == 0 or not beside
    assert (left.position[0] > -0.85) == beside
    assert sum(thing.position[0] for thing in hung) == pytest.approx(0.0)  # alike on both sides
    assert all(thing.position[1] < 0.1 for thing in hung)


def test_what_is_flat_lies_on_the_solids_of_its_seat():
    """Not on what is seen of it: a back's solid reaches further forward than its cloth, a seat's may be higher."""
    seat, back = trimesh.creation.box((1.6, 0.4, 0.9)), trimesh.creation.box((1.6, 0.8, 0.2))
    seat.apply_translation((0, 0.2, 0))
    back.apply_translation((0, 0.4, -0.35))
    host = SimpleNamespace(geometry=SimpleNamespace(colliders=[SimpleNamespace(mesh=seat), SimpleNamespace(mesh=back)]))
    size = np.array([0.4, 0.06, 0.3])
    np.testing.assert_allclose(soft_tops.upon(host, np.array([0.3, 0.385, 0.1]), size), (0.3, 0.4, 0.1), atol=1e-9)
    np.testing.assert_allclose(soft_tops.upon(host, np.array([0.3, 0.42, 0.1]), size), (0.3, 0.4, 0.1), atol=1e-9)
    assert soft_tops.upon(host, np.array([0.3, 0.4, -0.12]), size) is None  # its back edge is in the back
    assert soft_tops.upon(host, np.array([0.3, 0.35, 0.1]), size) is None  # as high as no seat is above what one sees
    ridge = trimesh.creation.box((1.6, 0.41, 0.04))
    ridge.apply_translation((0, 0.205, 0.2))
    host.geometry.colliders.append(SimpleNamespace(mesh=ridge))
    assert soft_tops.upon(host, np.array([0.3, 0.4, 0.1]), size) is None  # it would lie askew


def test_what_lies_on_a_bed_is_put_before_a_fold_that_would_tilt_it():
    bed, fold = trimesh.creation.box((1.6, 0.5, 2.0)), trimesh.creation.box((1.6, 0.52, 0.1))
    bed.apply_translation((0, 0.25, 0))
    fold.apply_translation((0, 0.26, -0.3))
    host = SimpleNamespace(geometry=SimpleNamespace(colliders=[SimpleNamespace(mesh=bed), SimpleNamespace(mesh=fold)]))
    line = np.arange(-1.0, 1.0, STEP) + STEP / 2
    seat = Seat(line, line, np.full((len(line), len(line)), 0.5), 0.5)
    for turn in (0.0, -0.4, 0.4):
        size = np.array([0.3, 0.02, 0.2])
        body = trimesh.creation.box(size).vertices + np.array([0.0, size[1] / 2, 0.0])
        spot = soft_tops.lying(host, seat, np.array([0.0, 0.5, -0.25]), turn, size, body)
        deep = 0.15 * abs(np.sin(turn)) + 0.1 * np.cos(turn)
        assert -0.25 + deep <= spot[2] < -0.05 + deep
        assert spot[1] == pytest.approx(0.5, abs=0.003)


def test_rows_of_books_on_long_shelves_are_drawn_whole():
    rows = []
    surface = SimpleNamespace(y=0.5, air=0.4, span=np.array([(0.0, 0.0), (1.2, 0.15)]), closed=False)
    surface.area, surface.put = shapely.box(-1.2, -0.15, 1.2, 0.15), lambda *_, size=None, **__: rows.append(size)
    host = SimpleNamespace(name="shelf", position=np.zeros(3), row=SimpleNamespace(task="", top=""))
    for seed in range(20):
        tabletops.stocked(Setting({}, SQUARE, (), 2.7, True, False, seed), host, surface)
    size = max((size for size in rows if size is not None), key=lambda size: size[0])
    for seed in range(20):
        books = pieces_of(solids_of("book_row", size, np.random.default_rng(seed)), size, detail=0)
        assert sum(len(piece.faces) for piece in books) <= KINDS["book_row"].faces


def test_cushions_of_a_sofa_are_a_pair_or_go_together():
    """One plain and one of a print; a child's bed has a child's."""
    floor = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
    seen = {"": set(), "child": set()}
    for who in seen:
        for seed in range(40):
            setting = Setting({}, floor, (), 2.7, True, False, seed, resident=who)
            both = upholstery.designs(setting, setting.rng("sofa"))
            assert sum(kind == "cushion" for kind, _, _ in both) == 1
            seen[who] |= {kind for kind, _, _ in both} - {"cushion"}
    assert len(seen[""]) >= 14
    assert {"cushion_bear", "cushion_smile"} <= seen["child"] - seen[""]


def test_niches_are_cut_into_walls_and_hold_what_stands_in_them(tmp_path):
    spec = RoomSpec("living_room", size=(4.6, 4.0), style="japandi")
    graph = SceneGraph(spec, (Node("sofa", "multi_seat_sofa"), Node("table", "coffee_table")))
    made = (echousd.generate(graph, seed=seed, shapes="boxes", drafts=1, dress="full") for seed in (4, *range(9)))
    room, dressing = next((room, found) for room in made if (found := dress(room)).cuts)
    niches = {name: one for name, one in dressing.layouts[0].items() if one.kind == "niche"}
    assert len(niches) == len(dressing.cuts)
    inside = [one for one in dressing.layouts[0].values() if one.on.startswith("wall shelf")]
    assert inside
    for one in inside:
        (niche,) = (n for n in niches.values() if np.abs(n.position - one.position)[[0, 2]].max() < 0.5)
        assert niche.position[1] < one.position[1] < one.position[1] + one.size[1] < niche.position[1] + niche.size[1]
        hulls = geometry_of(*next(recipe for recipe in dressing.recipes.values() if recipe[0] == "niche")).colliders
        middle = turned((one.position - niche.position)[None, ::2], -niche.yaw)
        local = np.array([*middle[0], one.position[1] + one.size[1] / 2 - niche.position[1]])[[0, 2, 1]]
        assert len(hulls) > 4
        assert not any(hull.mesh.trimesh.contains(local[None])[0] for hull in hulls)
    for other in (room.graph.with_room(walls=(0.1,) * 4), room.graph.with_room(style="industrial")):
        assert not dress(replace(room, graph=other)).cuts
    assert not dress(replace(room, layouts=room.layouts * 2)).cuts
    root = room.save(tmp_path / "room", preview=False)
    assert check(root).ok
    stage = Usd.Stage.Open(str(root))
    name, niche = next(iter(niches.items()))
    place = UsdGeom.Xformable(stage.GetPrimAtPath(f"/Room/Dressing/{name}")).GetOrderedXformOps()[0]
    place.Set(place.Get() + type(place.Get())(0.0, 0.2, 0.0))
    stage.Save()
    told = [one for layout in check(root).layouts for one in layout.placement]
    assert ("outside", name) in [(one.problem, one.object) for one in told]  # it is in the wall


@pytest.mark.parametrize("gone", ["coffee_table", "side_table", "tv_stand"])
def test_small_things_keep_their_names_where_furniture_goes(room, gone):
    """An artist's layer over one of them still meets it."""
    rows = [number for number, name in enumerate(room.names) if name != gone]
    assert len(rows) < len(room.names)
    less = replace(room, graph=room.graph.remove_node(gone), layouts=(room.boxes[np.array(rows)],))
    before, after = (dress(one).layouts[0] for one in (room, less))
    stand = {name: thing for name, thing in before.items() if thing.on not in ("", gone) and thing.position[1] > 0.1}
    assert len(stand) > 3
    assert {name: thing.kind for name, thing in stand.items()}.items() <= {n: t.kind for n, t in after.items()}.items()
