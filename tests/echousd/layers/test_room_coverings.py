"""What covers floors and walls: chosen by the seed, the paper behind the bed, and in every harmony."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from pxr import Usd, UsdShade
from small_room import StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.layers.structure import COVERS, FLOORS, covered_walls, floor_slot, shell_prims
from echousd.options import RoomOptions
from echousd.room import Provenance
from echousd.shapes.finishes.slots import HARMONIES, SLOTS, metres_of
from echousd.shapes.looks import palette_of_room
from echousd.shapes.walls import millwork


@pytest.fixture(scope="module")
def room():
    return echousd.generate(
        small_graph(), model=StandIn(), shapes="boxes", place=False, options=RoomOptions(walls=True, dress="none")
    )


def seeded(room, seed):
    return replace(room, provenance=Provenance(seed=seed))


def test_floors_and_the_wall_behind_the_bed_differ_from_room_to_room(room):
    floors = [floor_slot(seeded(room, seed)) for seed in range(120)]
    covers = [covered_walls(seeded(room, seed)) for seed in range(120)]
    assert set(floors) == {"carpet", *FLOORS["wood"]}
    assert 24 < floors.count("carpet") < 56
    assert 10 < floors.count("floor") < 40
    assert 3 < floors.count("boards_walnut") < 26
    assert {slot for cover in covers for slot in cover.values()} == {*COVERS} - {""}
    assert 48 < covers.count({}) < 84
    assert len({wall for cover in covers for wall in cover}) == 1  # the one behind the bed
    papered = next(seed for seed, cover in enumerate(covers) if cover)
    assert covered_walls(replace(seeded(room, papered), options=RoomOptions(walls=False, dress="none"))) == {}


@pytest.mark.parametrize(("x", "wall"), [(2.0, "Wall_5"), (-2.0, "Wall_1")])
def test_of_two_walls_in_line_that_behind_the_bed_has_paper(room, x, wall):
    corners = ((-3, -3), (-1, -3), (-1, 0), (1, 0), (1, -3), (3, -3), (3, 3), (-3, 3))
    graph = SceneGraph(RoomSpec("bedroom", floor_polygon=corners), (Node("bed", "double_bed"),), ())
    boxes = Boxes(torch.tensor([[1.8, 0.5, 2.0]]), torch.tensor([[x, 0.0, -2.0]]), torch.zeros(1))
    covered = [covered_walls(replace(seeded(room, seed), graph=graph, layouts=(boxes,))) for seed in range(12)]
    assert {name for cover in covered for name in cover} == {wall}


@pytest.mark.parametrize(
    ("word", "z", "wall"), [("desk", -1.7, "Wall_1"), ("table", 0.0, "Wall_2"), ("bookshelf", -1.7, "Wall_1")]
)
def test_without_bed_and_sofa_the_wall_of_a_desk_or_shelf_is_covered_else_the_longest(room, word, z, wall):
    corners = ((-1, -2), (1, -2), (1, 2), (-1, 2))
    graph = SceneGraph(RoomSpec("study", floor_polygon=corners), (Node("it", word),), ())
    boxes = Boxes(torch.tensor([[1.2, 0.75, 0.6]]), torch.tensor([[0.0, 0.0, z]]), torch.zeros(1))
    covered = [covered_walls(replace(seeded(room, seed), graph=graph, layouts=(boxes,))) for seed in range(12)]
    assert {name for cover in covered for name in cover} == {wall}


def test_coverings_are_bound_and_have_their_images(room, tmp_path):
    seed = next(
        s for s in range(999)
        if "wallpaper" in covered_walls(seeded(room, s)).values() and floor_slot(seeded(room, s)) == "carpet"
    )  # fmt: skip
    root = seeded(room, seed).save(tmp_path / "bedroom", preview=False)
    stage = Usd.Stage.Open(str(root))

    def look(path):
        return UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path)).ComputeBoundMaterial()[0].GetPrim().GetName()

    (wall,) = covered_walls(seeded(room, seed))
    assert look(f"/Room/Shell/{wall}/{wall}_mesh") == "wallpaper"
    assert look(f"/Room/Shell/{wall}/{wall}_skirting") == "trim"
    others = [f"Wall_{n}" for n in range(1, 5) if f"Wall_{n}" != wall]
    assert {look(f"/Room/Shell/{name}/{name}_mesh") for name in others} == {"wall"}
    assert look("/Room/Shell/Floor/Floor_mesh") == "floor"
    names = {path.name.split("_")[0] for path in (root.parent / "textures").iterdir()}
    assert {"carpet", "papered"} <= names
    assert "planks" not in names


def test_a_style_has_floors_of_its_own(room):
    graph = room.graph.replaced(room=room.graph.room.replaced(style="art_deco"))
    floors = {floor_slot(replace(seeded(room, seed), graph=graph)) for seed in range(60)}
    assert floors == {"carpet", "herringbone_smoked", "herringbone_walnut", "boards_smoked"}
    for style in vocabulary().styles:
        assert set(style.floors) <= set(SLOTS)


def test_pieces_of_no_set_are_of_two_woods_at_most_and_not_all_of_one(room):
    woods = set()
    for seed in range(6):
        stage = seeded(room, seed).stage
        looks = {prim.GetName() for prim in stage.GetPrimAtPath("/Room/Looks").GetChildren()}
        woods |= {name for name in looks if name.endswith("_wood")}
        if "room_others_wood" in looks:
            shader = UsdShade.Shader(stage.GetPrimAtPath("/Room/Looks/room_others_wood/image"))
            file = str(shader.GetInput("file").Get().path)
            assert file.split("_")[1].removesuffix(".jpg") == HARMONIES[palette_of_room(seed)]["wood2"]
    assert {"room_wood", "room_others_wood"} <= woods


def wet(room, kind, word, walls=True):
    graph = SceneGraph(RoomSpec(kind, size=(3.0, 2.4)), (Node("it", word),), ())
    boxes = Boxes(torch.tensor([[0.6, 0.9, 0.6]]), torch.tensor([[0.0, 0.0, -0.89]]), torch.zeros(1))
    return replace(room, graph=graph, layouts=(boxes,), options=RoomOptions(walls=walls, dress="none"))


def test_patterns_of_floors_and_walls_have_their_own_sizes(room):
    seed = next(
        s for s in range(999)
        if "brick" in covered_walls(seeded(room, s)).values() and floor_slot(seeded(room, s)) == "herringbone"
    )  # fmt: skip
    built = {mesh.path: mesh.form for part in shell_prims(seeded(room, seed)) for mesh in part.meshes}
    (wall,) = covered_walls(seeded(room, seed))
    for path, slot in (("Floor/Floor_mesh", "herringbone"), (f"{wall}/{wall}_mesh", "brick")):
        form = built[f"/Room/Shell/{path}"]
        across = np.sort(np.ptp(form.points, axis=0))[-2:]  # of the whole, but for its thickness
        laid = np.sort(np.ptp(form.st, axis=0)) * metres_of(slot)
        assert laid[-1] == pytest.approx(across[-1], rel=0.2)


@pytest.mark.parametrize(
    ("kind", "word", "private"),
    [("bedroom", "double_bed", True), ("bathroom", "toilet", True), ("living_room", "sofa", False)],
)
def test_nobody_looks_through_the_door_of_a_bedroom_or_bathroom(room, kind, word, private):
    doors = {millwork(wet(room, kind, word).graph, seed).door for seed in range(30)}
    assert ("glazed" not in doors) == private
    assert len(doors) > 2


@pytest.mark.parametrize(
    ("kind", "word", "bare"), [("bathroom", "toilet", True), ("balcony", "armchair", True), ("study", "sofa", False)]
)
def test_only_walls_of_dry_rooms_have_dados(room, kind, word, bare):
    dados = {millwork(wet(room, kind, word).graph, seed).dado for seed in range(30)}
    assert dados == ({""} if bare else {"", "boarding", "paint"})


def test_where_it_is_wet_there_are_tiles(room):
    bath = wet(room, "bathroom", "toilet")
    assert covered_walls(bath) == {f"Wall_{n}": "wall_tiles" for n in range(1, 5)}
    assert covered_walls(wet(room, "kitchen", "hob_unit")) == {"Wall_1": "wall_tiles"}  # behind the run alone
    kitchen = wet(room, "kitchen", "hob_unit")
    table = Boxes(*(torch.cat([values, values]) for values in vars(kitchen.boxes).values()))
    table.position[1] = torch.tensor([0.0, 0.0, 0.3])
    both = kitchen.graph.replaced(nodes=(*kitchen.graph.nodes, Node("table", "dining_table")))
    assert covered_walls(replace(kitchen, graph=both, layouts=(table,))) == {"Wall_1": "wall_tiles"}
    assert covered_walls(wet(room, "bathroom", "toilet", walls=False)) == {}
    assert {floor_slot(seeded(bath, seed)) for seed in range(9)} == {"tiles", "terrazzo"}
