"""Lights of a room: by day, in the evening and at night; the sun through a window, lamps where they hang."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdPhysics
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.openings import Opening
from echousd.graph import RoomSpec
from echousd.layers.cameras import room_points
from echousd.layers.lights import ASIDE, ELEVATION, HUES, LAMPS, TIMES, image_files, write_lights
from echousd.options import RoomOptions
from echousd.stage.lights import SHARES
from echousd.stage.pen import Pen

WINDOW = Opening("window", "window", 0, 0.8, 1.4, 1.3, 0.9)  # in the wall at -z


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(WINDOW,)))
    room = echousd.generate(
        graph, model=StandIn(), place=False, shapes="boxes", options=RoomOptions(walls=True, dress="none")
    )
    return Usd.Stage.Open(str(room.save(tmp_path_factory.mktemp("lights") / "bedroom", preview=False)))


def intensity(stage: Usd.Stage, name: str) -> float:
    return UsdLux.LightAPI(stage.GetPrimAtPath(f"/Room/Lights/{name}")).GetIntensityAttr().Get()


def test_day_evening_and_night(stage) -> None:
    times = stage.GetPrimAtPath("/Room").GetVariantSets().GetVariantSet("light")
    assert times.GetVariantNames() == ["day", "evening", "night"]
    assert times.GetVariantSelection() == "day"
    seen = {}
    for name in ("day", "evening", "night"):
        times.SetVariantSelection(name)
        seen[name] = [intensity(stage, light) for light in ("sky", "sun", "lamp_pendant")]
    times.SetVariantSelection("day")
    assert seen["day"][0] > seen["evening"][0] > seen["night"][0] > 0
    assert seen["day"][1] > seen["evening"][1] == seen["night"][1] == 0
    assert seen["day"][:2] == pytest.approx(
        [0.5 * SHARES["walls"][0], SHARES["walls"][2]]
    )  # as they are said, nothing taken
    assert seen["day"][2] < seen["evening"][2] == seen["night"][2]
    for name in ("evening", "night"):  # the panel stands for lamps then, and has the colour of those at ceilings
        times.SetVariantSelection(name)
        panel, lamp = (
            UsdLux.LightAPI(stage.GetPrimAtPath(f"/Room/Lights/{light}")).GetColorAttr().Get()
            for light in ("ceiling", "lamp_pendant")
        )
        assert panel == lamp
    times.SetVariantSelection("day")


def test_the_sun_falls_in_through_the_window(stage) -> None:
    matrix = UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Lights/sun")).ComputeLocalToWorldTransform(0)
    way = np.array(matrix.TransformDir(Gf.Vec3d(0, 0, -1)))
    assert np.linalg.norm(way) == pytest.approx(1)
    low, high = np.sin(np.radians(ELEVATION))
    assert low - 1e-4 <= -way[1] <= high + 1e-4
    assert way[2] > 0.5
    assert ASIDE[0] - 1e-4 <= abs(way[0]) / way[2] <= ASIDE[1] + 1e-4  # however wide the window is


def test_rooms_differ_in_their_sun_and_in_what_lies_outside_by_their_seed() -> None:
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(WINDOW,)))
    skies, suns = set(), set()
    for seed in range(6):
        room = echousd.generate(
            graph, model=StandIn(), place=False, shapes="boxes", seed=seed, options=RoomOptions(dress="none")
        )
        again = image_files(room)
        assert again == image_files(room)
        skies.update(again.values())
        sun = UsdGeom.Xformable(room.stage.GetPrimAtPath("/Room/Lights/sun")).ComputeLocalToWorldTransform(0)
        suns.add(tuple(np.round(sun.TransformDir(Gf.Vec3d(0, 0, 1)), 3)))
    assert len(skies) > 2
    assert len(suns) > 2


def test_evenings_are_blue_outside_and_lamps_are_warmer_the_nearer_one_sits(stage) -> None:
    times, hues = stage.GetPrimAtPath("/Room").GetVariantSets().GetVariantSet("light"), {}
    for name in ("day", "evening"):
        times.SetVariantSelection(name)
        hues[name] = UsdLux.LightAPI(stage.GetPrimAtPath("/Room/Lights/sky")).GetColorAttr().Get()
    times.SetVariantSelection("day")
    assert hues["day"][0] > hues["day"][2]
    assert hues["evening"][2] > 2 * hues["evening"][0]
    hanging, standing = (
        UsdLux.LightAPI(stage.GetPrimAtPath(f"/Room/Lights/lamp_{name}")).GetColorAttr().Get()
        for name in ("pendant", "lamp")
    )
    assert standing[2] / standing[0] < hanging[2] / hanging[0] < 1


def test_there_is_a_sky_to_look_at_and_a_sun_that_blanks_no_wall(stage, tmp_path) -> None:
    dome = UsdLux.DomeLight(stage.GetPrimAtPath("/Room/Lights/sky"))
    assert dome.GetTextureFileAttr().Get().resolvedPath.endswith("textures/sky.jpg")
    with Image.open(dome.GetTextureFileAttr().Get().resolvedPath) as picture:
        up, down = (np.asarray(picture)[share * picture.height // 10].mean(0) for share in (1, 8))
    assert up[2] > up[0] > 120
    assert down[1] > down[2]
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(WINDOW,)))
    options = RoomOptions(walls=True, ceiling=True, dress="none")
    room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", options=options)
    closed = Usd.Stage.Open(str(room.save(tmp_path / "closed", preview=False)))
    assert intensity(closed, "sun") > 2 * intensity(stage, "sun")  # through the window alone
    bare = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", **BARE).save(
        tmp_path / "bare", preview=False
    )
    assert not (bare.parent / "textures/sky.jpg").exists()  # nobody looks past walls that are not there


def test_sun_panel_and_bulbs_are_as_large_as_real_ones(stage) -> None:
    sun = UsdLux.DistantLight(stage.GetPrimAtPath("/Room/Lights/sun"))
    assert sun.GetAngleAttr().Get() == pytest.approx(0.53, abs=0.02)  # degrees
    assert sun.GetNormalizeAttr().Get()
    bulb = UsdLux.SphereLight(stage.GetPrimAtPath("/Room/Lights/lamp_lamp"))
    assert 0.02 < bulb.GetRadiusAttr().Get() < 0.06
    panel = UsdLux.RectLight(stage.GetPrimAtPath("/Room/Lights/ceiling"))
    sides = panel.GetWidthAttr().Get(), panel.GetHeightAttr().Get()
    assert sides == pytest.approx((0.3 * 4.3, 0.3 * 3.7), abs=0.01)
    place = UsdGeom.Xformable(panel).ComputeLocalToWorldTransform(0)
    assert np.array(place.TransformDir(Gf.Vec3d(0, 0, -1))).round(6).tolist() == [0, -1, 0]
    x, y, z = place.ExtractTranslation()
    assert (x, z) == pytest.approx((0, 0), abs=1e-6)
    assert 2.7 < y < 2.8
    dome = UsdLux.DomeLight(stage.GetPrimAtPath("/Room/Lights/sky"))
    assert dome.GetTextureFormatAttr().Get() == "latlong"


def test_lamps_give_what_bulbs_give_that_one_buys() -> None:
    sold = {"ceiling": (1500, 4000), "floor": (1000, 3000), "table": (450, 3000), "wall": (400, 3000)}
    assert {*LAMPS} == {*sold}
    for where, (lumens, kelvin) in LAMPS.items():
        assert lumens == pytest.approx(sold[where][0], rel=1e-6)
        assert kelvin == pytest.approx(sold[where][1], rel=0.1)


def test_lights_are_coloured_without_temperatures_which_blender_does_not_read(stage) -> None:
    for name in ("sun", "ceiling", "lamp_pendant"):
        light = UsdLux.LightAPI(stage.GetPrimAtPath(f"/Room/Lights/{name}"))
        assert not light.GetEnableColorTemperatureAttr().Get()
        red, green, blue = light.GetColorAttr().Get()
        assert (red > 1.2 > green > 0.8 > blue) == (name == "lamp_pendant")


def test_lamps_shine_where_they_are(stage) -> None:
    cache = UsdGeom.BBoxCache(0, ["default"])
    for name, below in (("pendant", True), ("lamp", False)):
        bulb = UsdGeom.Xformable(stage.GetPrimAtPath(f"/Room/Lights/lamp_{name}")).ComputeLocalToWorldTransform(0)
        box = cache.ComputeWorldBound(stage.GetPrimAtPath(f"/Room/Objects/{name}")).ComputeAlignedRange()
        place = bulb.ExtractTranslation()
        assert box.GetMin()[0] < place[0] < box.GetMax()[0]
        edge = box.GetMin()[1] if below else box.GetMax()[1]
        assert 0.04 < (edge - place[1] if below else place[1] - edge) < 0.1
    light = UsdLux.SphereLight(stage.GetPrimAtPath("/Room/Lights/lamp_pendant"))
    stage.GetPrimAtPath("/Room").GetVariantSets().SetSelection("light", "evening")
    assert light.GetNormalizeAttr().Get()  # Blender takes a sphere's intensity for radiance times area in any case
    candela = light.GetIntensityAttr().Get() * 30 / 4
    stage.GetPrimAtPath("/Room").GetVariantSets().SetSelection("light", "day")
    assert candela == pytest.approx(1500 / (4 * np.pi), rel=1e-3)  # 1,500 lumens all round


@pytest.mark.parametrize(
    ("lamps", "lit"),
    [
        (("lamp",), {"evening": 85.0, "night": 75.0}),  # the panel gives what one lamp does not
        (("lamp", "pendant"), {"evening": 1950 / 13.6 + 20, "night": 1950 / 13.6 + 20}),  # and a little in any case
    ],
)
def test_evenings_and_nights_are_as_bright_as_people_have_them(lamps, lit) -> None:
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), height=2.5, openings=(WINDOW,)))
    for name in {"lamp", "pendant"} - {*lamps}:
        graph = graph.remove_node(name)
    stage = lights_of(graph)
    fallen = {name: lumens(stage, name) for name in ("day", "evening", "night")}
    assert {name: fallen[name] for name in lit} == pytest.approx(lit, rel=1e-3)
    panel = UsdLux.RectLight(stage.GetPrimAtPath("/Room/Lights/ceiling"))
    assert panel.GetWidthAttr().Get() < 4.0  # within the ceiling
    size = panel.GetWidthAttr().Get() * panel.GetHeightAttr().Get()
    height = panel.GetPrim().GetAttribute("xformOp:translate").Get()[1] + 0.02
    assert intensity(stage, "ceiling") == pytest.approx(0.12 * 1.6 * height**2 / size, rel=1e-3)


def test_where_many_lamps_shine_a_camera_exposes_less() -> None:
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), height=2.5, openings=(WINDOW,)))
    one = intensity(evening(lights_of(graph)), "lamp_pendant")
    for number in range(3):
        graph = graph.add_node(f"more_{number}", "pendant_lamp")
    stage = evening(lights_of(graph))
    told = 4 * 1500 + 450  # lumens
    assert intensity(stage, "lamp_pendant") == pytest.approx(one * 160 / (told / 13.6), rel=1e-3)
    assert intensity(stage, "sky") == pytest.approx(0.5 * 1.4 * 0.16 * 160 / (told / 13.6), rel=1e-2)


def lights_of(graph) -> Usd.Stage:
    """A stage of the lights of a room that is not drawn by a network."""
    options = RoomOptions(walls=True, ceiling=False, dress="none")
    room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", options=options)
    stage = Usd.Stage.CreateInMemory()
    points = room_points(room)
    write_lights(Pen(stage.GetRootLayer()), room, np.array([points.min(0), points.max(0)]))
    return stage


def evening(stage: Usd.Stage) -> Usd.Stage:
    stage.GetPrimAtPath("/Room").GetVariantSets().SetSelection("light", "evening")
    return stage


def lumens(stage: Usd.Stage, time: str) -> float:
    """What panel and lamps throw on a square metre of a floor of 4 x 3.4 m; the variant of the day is left chosen."""
    times = stage.GetPrimAtPath("/Room").GetVariantSets().GetVariantSet("light")
    times.SetVariantSelection(time)
    panel = UsdLux.RectLight(stage.GetPrimAtPath("/Room/Lights/ceiling"))
    size = panel.GetWidthAttr().Get() * panel.GetHeightAttr().Get()
    lamps = [prim.GetName() for prim in stage.GetPrimAtPath("/Room/Lights").GetChildren() if "lamp_" in prim.GetName()]
    total = intensity(stage, "ceiling") * size + sum(intensity(stage, lamp) for lamp in lamps)
    times.SetVariantSelection("day")
    return total * np.pi * 30 / 13.6


def test_bulbs_are_where_their_lamps_are_in_every_layout(tmp_path) -> None:
    room = echousd.generate(small_graph(), model=StandIn(), place=False, shapes="boxes", **BARE)
    moved = Boxes(room.boxes.size, room.boxes.position + 0.1, room.boxes.yaw)
    stage = Usd.Stage.Open(str(replace(room, layouts=(room.boxes, moved)).save(tmp_path / "two", preview=False)))
    layouts = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    assert layouts.GetVariantSelection() == "layout_0"
    places = []
    for name in ("layout_0", "layout_1"):
        layouts.SetVariantSelection(name)
        bulb = UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Lights/lamp_pendant"))
        places.append(np.array(bulb.ComputeLocalToWorldTransform(0).ExtractTranslation()))
        assert intensity(stage, "lamp_pendant") > 0
    assert places[1] - places[0] == pytest.approx(0.1, abs=1e-6)


def test_openings_of_the_graph_point_to_what_they_became(tmp_path) -> None:
    door = Opening("door", "door", 1, 0.4, 0.9, 2.0)
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(WINDOW, door)))
    room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", options=RoomOptions(dress="none"))
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    found = {}
    for name in ("window", "door"):
        prim = stage.GetPrimAtPath(f"/Room/SceneGraph/Openings/{name}")
        ends = {word: prim.GetRelationship(f"echo:{word}") for word in ("wall", "frame", "leaf")}
        found[name] = {word: rel.GetTargets()[0] for word, rel in ends.items() if rel.GetTargets()}
        assert all(stage.GetPrimAtPath(path) for path in found[name].values())
    assert set(found["window"]) == {"wall", "frame"}
    assert str(found["window"]["wall"]) == "/Room/Shell/Wall_1"
    assert str(found["door"]["wall"]) == "/Room/Shell/Wall_2"
    turns = UsdGeom.Xformable(stage.GetPrimAtPath(found["door"]["leaf"])).GetOrderedXformOps()
    assert [op.GetOpName() for op in turns] == ["xformOp:translate", "xformOp:rotateY"]
    cache = UsdGeom.BBoxCache(0, [UsdGeom.Tokens.default_])
    leaf = cache.ComputeWorldBound(stage.GetPrimAtPath(found["door"]["leaf"])).ComputeAlignedRange()
    low, high = np.array(leaf.GetMin()), np.array(leaf.GetMax())  # shut: in its wall at +x, between its two sides
    assert (low >= (1.9, -0.01, -1.31)).all()
    assert (high <= (2.3, 2.01, -0.39)).all()
    assert high[2] - low[2] > 0.7
    stage.GetPrimAtPath(found["door"]["leaf"]).GetParent().GetVariantSet("articulation").SetVariantSelection(
        "articulated"
    )
    hung = UsdPhysics.MassAPI(stage.GetPrimAtPath(found["door"]["leaf"]))
    assert 15 < hung.GetMassAttr().Get() < 30  # kg, as light as a hollow door
    assert np.abs(hung.GetCenterOfMassAttr().Get()).max() == pytest.approx(1.0, abs=0.1)  # half as high as it is


def test_rooms_of_a_home_have_one_sun_and_others_their_own() -> None:
    def suns(**spec) -> set:
        graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(WINDOW,), **spec))
        found = set()
        for seed in range(6):
            room = echousd.generate(
                graph, seed=seed, model=StandIn(), place=False, shapes="boxes", walls=True, dress="none"
            )
            pen = Pen.blank("lights", ".usda", {})
            write_lights(pen, room, room_points(room))
            sun = pen.layer.GetAttributeAtPath("/Room/Lights/sun.xformOp:transform").default
            found.add(tuple(np.array(sun).round(6).flatten().tolist()))
        return found

    assert len(suns(walls=(0.1, 0.1, 0.1, 0.1))) == 1
    assert len(suns()) > 3


def test_what_is_left_of_lights_and_colours_of_the_sky_are_shares_and_the_sky_makes_up_for_what_is_closed() -> None:
    assert {*TIMES} == {*HUES}
    numbers = np.array([*TIMES.values(), *HUES.values(), *((panel,) * 3 for _, panel, _ in SHARES.values())])
    assert ((numbers >= 0) & (numbers <= 1)).all()
    assert SHARES["open"][0] < SHARES["walls"][0] < SHARES["ceiling"][0]
