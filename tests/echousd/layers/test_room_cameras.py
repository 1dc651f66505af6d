"""Cameras of a room: what they see, where they are sharp, and how it is told."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux
from small_room import small_graph, small_room

import echousd
from echomodel.openings import Opening
from echousd.draw.outside import perspective_views
from echousd.draw.sight import ASPECT, Furniture
from echousd.draw.views import inside_view, shifted, stage_views
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.layers.cameras import main_piece, room_points, write_cameras
from echousd.options import RoomOptions
from echousd.shapes import walls
from echousd.stage.pen import Pen


@pytest.fixture(scope="module")
def room():
    return small_room(seed=3, place=False, shapes="boxes")


@pytest.fixture(scope="module")
def stage(room, tmp_path_factory):
    return Usd.Stage.Open(str(room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)))


def test_the_volume_of_a_room_holds_floor_and_furniture(room):
    points, position, size = room_points(room), room.boxes.position, room.boxes.size
    tops = position[:, 1] + size[:, 1]
    heights = {round(float(y), 4) for y in points[:, 1]}
    assert {round(float(y), 4) for y in (*position[:, 1], *tops, 0.0)} <= heights
    assert (points[:, 1].min(), points[:, 1].max()) == pytest.approx((-walls.THICKNESS, tops.max()))


def test_lenses_are_told_in_tenths_of_a_metre(stage):
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/perspective"))
    assert camera.GetHorizontalApertureAttr().Get() == pytest.approx(0.36)
    assert camera.GetFocalLengthAttr().Get() == pytest.approx(0.30)


def test_a_bay_is_within_the_hint_and_the_picture_from_above(tmp_path):
    spec = RoomSpec(
        "study", size=(3.5, 3.4), style="country", openings=(Opening("bay", "window", 0, 0.8, 1.8, 1.3, 0.9),)
    )
    graph = SceneGraph(spec, (Node("desk", "desk"),))
    rooms = (echousd.generate(graph, seed=seed, shapes="boxes", walls=True, dress="none") for seed in range(9))
    room = next(one for one in rooms if walls.millwork(one.graph, one.provenance.seed).bay)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "study", preview=False)))
    cache = UsdGeom.BBoxCache(0, [UsdGeom.Tokens.default_])
    box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    wide = max(box.GetSize()[0], box.GetSize()[2])
    assert wide > 3.5 + 2 * walls.WALL + 0.3  # a bay stands out
    hint = np.array(UsdGeom.ModelAPI(stage.GetDefaultPrim()).GetExtentsHint())
    np.testing.assert_allclose(hint, [box.GetMin(), box.GetMax()], atol=0.02)
    top = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/top"))
    high = top.GetPrim().GetAttribute("xformOp:translate").Get()[1] - box.GetMax()[1]
    assert high * top.GetHorizontalApertureAttr().Get() / top.GetFocalLengthAttr().Get() > wide


def test_cameras_see_everything_and_light_is_there(stage, room):
    for camera in ("perspective", "top"):
        frustum = UsdGeom.Camera(stage.GetPrimAtPath(f"/Room/Cameras/{camera}")).GetCamera(0).frustum
        to_view = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
        for number, name in enumerate(room.names):
            low, high = room.meshes[name].bounds
            for corner in np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3):
                seen = to_view.Transform(Gf.Vec3d(*(room.pose(number) @ [*corner, 1])[:3]))
                assert max(abs(v) for v in seen) <= 1.0, (camera, name)
    assert stage.GetPrimAtPath("/Room/Lights/sky").IsA(UsdLux.DomeLight)
    assert stage.GetPrimAtPath("/Room/Lights/ceiling").IsA(UsdLux.RectLight)


def test_the_camera_above_has_the_whole_room_and_little_else_in_its_picture(stage, room):
    points = room_points(room)
    low, high = points.min(0), points.max(0)
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/top")).GetCamera(0)
    eye = np.array(camera.transform.ExtractTranslation())
    np.testing.assert_allclose(eye[[0, 2]], ((low + high) / 2)[[0, 2]], atol=1e-5)
    assert np.array(camera.transform.TransformDir(Gf.Vec3d(0, 0, -1))).round(6).tolist() == [0, -1, 0]
    assert np.array(camera.transform.TransformDir(Gf.Vec3d(0, 1, 0))).round(6).tolist() == [1, 0, 0]
    assert camera.horizontalAperture == camera.verticalAperture
    side = camera.horizontalAperture / camera.focalLength * (eye[1] - high[1])  # of the picture at the tops, metres
    assert 1.0 < side / (high - low)[[0, 2]].max() < 1.1
    assert eye[1] > 5 * side  # from afar, so that heights hardly show
    near, far = camera.clippingRange.min, camera.clippingRange.max
    assert near < eye[1] - high[1]
    assert eye[1] - low[1] < far < 1.2 * eye[1]
    assert camera.focusDistance == pytest.approx(eye[1])


def test_a_camera_is_sharp_where_what_the_room_is_for_stands():
    floor = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    size, position = np.array([(1.8, 0.6, 2.0), (0.4, 0.4, 0.4)]), np.array([(0.9, 0, -0.9), (-1.5, 0, 1.5)])
    furniture, points = Furniture(size, position, np.zeros(2)), np.insert(floor, 1, 2.5, axis=1)
    for main, at in ((0, (0.9, 0.3, -0.9)), (1, (-1.5, 0.2, 1.5)), (None, (0, 2.5, 0))):
        stage = Usd.Stage.CreateInMemory()
        write_cameras(Pen(stage.GetRootLayer()), points, furniture, floor, main=main)
        camera = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/perspective")).GetCamera(0)
        away = np.linalg.norm(np.array(camera.transform.ExtractTranslation()) - at)
        assert camera.focusDistance == pytest.approx(away, rel=1e-5)
        assert camera.clippingRange.min == pytest.approx(max(inside_view(floor, furniture, 2.5, main=main)[2], 0.05))
        assert 10 < camera.clippingRange.max < 50
        assert camera.horizontalAperture / camera.verticalAperture == pytest.approx(ASPECT)


def test_what_a_room_is_for_is_its_largest_bed_or_what_its_type_is_known_by():
    def main(room, *words):
        size = np.array([(1.0 + 0.1 * row, 0.5, 1.0) for row in range(len(words))])
        return main_piece(room, words, Furniture(size, np.zeros_like(size), np.zeros(len(words))))

    assert main("bedroom", "desk", "single_bed", "double_bed", "wardrobe") == 2
    assert main("bedroom", "wardrobe", "nightstand") is None
    assert main("living_room", "dining_table", "sofa", "tv_stand") == 1
    assert main("dining_room", "sofa", "dining_table") == 1
    assert main("living_room", "sofa", "sofa") == 1  # the larger


@pytest.mark.parametrize(("ceiling", "top"), [(False, 3.0), (True, 3.0 + walls.THICKNESS)])
def test_the_volume_of_a_room_with_walls_reaches_to_their_outside(room, ceiling, top):
    walled = replace(
        room, graph=small_graph(height=3.0), options=RoomOptions(walls=True, ceiling=ceiling, dress="none")
    )
    points = room_points(walled)
    wide = np.array([2.0, 1.7]) + walls.WALL
    np.testing.assert_allclose([points.min(0), points.max(0)], [
        (-wide[0], -walls.THICKNESS, -wide[1]), (wide[0], top, wide[1])], atol=1e-6)  # fmt: skip


def test_a_camera_inside_has_the_shift_of_its_view(monkeypatch):
    level = np.array([[1.0, 0, 0, 0], [0, 1, 0, 1.2], [0, 0, 1, 3], [0, 0, 0, 1]])
    view = shifted(level, 0.25, 0.15)
    monkeypatch.setattr("echousd.layers.cameras.inside_view", lambda *_: (view, 24.0, 0.0))
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, "Y")
    floor = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    none = Furniture(*np.zeros((2, 0, 3)), np.zeros(0))
    write_cameras(Pen(stage.GetRootLayer()), np.insert(floor, 1, 2.5, axis=1), none, floor)
    np.testing.assert_allclose(stage_views(stage)["perspective"].matrix, view, atol=1e-6)


def test_camera_stands_where_no_tall_piece_hides_the_others():
    low = [(0.6, 0.5, 0.6)] * 3
    size = np.array([*low, (1.8, 2.3, 0.6)])
    position = np.array([(-1.0, 0, -0.5), (0.0, 0, -0.5), (1.0, 0, -0.5), (0.6, 0, 1.0)])
    furniture = Furniture(size, position, np.array([0, 0, 0, np.pi]))
    assert furniture.hidden(np.array([0.6, 1.5, 4.0])).sum() > 1.5  # from behind the wardrobe
    assert not furniture.hidden(np.array([0.0, 6.0, 0.0])).any()
    corners = np.concatenate([position - size / 2, position + size * (0.5, 1, 0.5)])
    for turn in range(4):  # wherever the wardrobe stands, the camera stands elsewhere
        cos, sin = np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)
        rotate = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
        turned = Furniture(size, position @ rotate.T, furniture.yaw + turn * np.pi / 2)
        eye = perspective_views(corners @ rotate.T, turned)[0][:3, 3]
        assert turned.hidden(eye).sum() < 1.0
        assert (rotate.T @ eye)[2] < 0
