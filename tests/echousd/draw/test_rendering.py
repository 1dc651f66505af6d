import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.draw.drawables import image_of, read_drawables
from echousd.draw.from_files import render, render_turn
from echousd.draw.indoors import LUMA, Bounced
from echousd.draw.outside import turning_views, without_near_walls
from echousd.draw.rays import Seen, World, embree
from echousd.draw.rendering import render_stage
from echousd.draw.scenery import BACKGROUND, class_color, next_room, outside, read_scenery
from echousd.draw.smoothing import RINGS, smooth_light
from echousd.draw.tracing import _light, trace
from echousd.draw.views import hero_view, stage_views
from echousd.options import RoomOptions


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


def pixels(picture):
    return np.asarray(picture, float) / 255


def cube_stage(up="Y", unit=1.0, size=1.0):
    """A red-free cube of 1 m at (1, 0.5, 0), as a mesh."""
    import trimesh

    box = trimesh.creation.box((size / unit,) * 3)
    points = box.vertices if up == "Y" else np.stack([box.vertices[:, 0], -box.vertices[:, 2], box.vertices[:, 1]], 1)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    mesh = UsdGeom.Mesh.Define(stage, "/Cube")
    mesh.CreatePointsAttr(points.astype(np.float32))
    mesh.CreateFaceVertexCountsAttr([3] * 12)
    mesh.CreateFaceVertexIndicesAttr(box.faces.ravel().tolist())
    offset = (1 / unit, 0.5 / unit, 0) if up == "Y" else (1 / unit, 0, 0.5 / unit)
    mesh.AddTranslateOp().Set(Gf.Vec3d(*offset))
    return stage


@pytest.mark.parametrize(("up", "unit"), [("Y", 1.0), ("Z", 1.0), ("Y", 0.01), ("Z", 0.01)])
def test_up_axis_and_units_are_taken_care_of(up, unit):
    scenery = read_scenery(cube_stage(up, unit))
    np.testing.assert_allclose(scenery.bounds, [[0.5, 0, -0.5], [1.5, 1, 0.5]], atol=1e-5)
    outward = (scenery.triangles.mean(1) - [1, 0.5, 0]) * scenery.normals.mean(1)
    assert (outward.sum(1) > 0).all()


@pytest.mark.parametrize("written", [{"up_axis": "Z"}, {"meters_per_unit": 0.01}])
def test_a_room_is_seen_from_the_same_corner_in_any_unit_and_axis(root, tmp_path, written):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE, **written)
    path = room.save(tmp_path / "bedroom", preview=False)
    one, other = (read_scenery(Usd.Stage.Open(str(of))).furniture() for of in (root, path))
    for values in ("size", "position", "facing"):
        np.testing.assert_allclose(getattr(one, values), getattr(other, values), atol=1e-4)
    pictures = [pixels(render(of, view="dollhouse", size=48, colors="class", rays=1)) for of in (root, path)]
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.002


def test_top_view_shows_things_where_they_are(root):
    image = pixels(render(root, view="top", size=96, colors="class"))
    assert image.shape == (96, 96, 3)
    metre = 96 / (4.0 * 1.06)  # the floor is 4 m wide and fills the picture
    hue = image - image.mean(-1, keepdims=True)

    def at(x, z):
        return hue[int(48 - x * metre), int(48 + z * metre)]

    bed, wardrobe, floor = at(0, -0.9), at(-1.6, 0.9), at(1.4, 0.9)
    for found, category in ((bed, "double_bed"), (wardrobe, "wardrobe")):
        wanted = np.array(class_color(category)) ** (1 / 2.2)
        wanted = wanted - wanted.mean()
        assert found @ wanted / (np.linalg.norm(found) * np.linalg.norm(wanted)) > 0.95, category
    assert np.abs(floor).max() < 0.08
    np.testing.assert_allclose(image[1, 1], [0.90, 0.905, 0.915], atol=0.06)  # nothing but background in the corner


def test_same_stage_gives_same_picture_and_materials_differ_from_classes(root):
    first, second = (pixels(render(root, size=48)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert np.abs(first - pixels(render(root, size=48, colors="class"))).max() > 0.1


def test_a_thing_throws_a_shadow_and_nothing_is_blown_out(root):
    image = pixels(render(root, view="top", size=96))
    metre = 96 / (4.0 * 1.06)
    shadow, lit = (
        image[int(48 + 1.7 * metre), int(48 - 0.2 * metre)],
        image[int(48 - 0.8 * metre), int(48 + 1.3 * metre)],
    )
    assert shadow.mean() < 0.85 * lit.mean()
    assert (image >= 0.999).mean() < 0.01


def test_hidden_things_and_colliders_are_not_drawn(root):
    stage = Usd.Stage.Open(str(root))
    names = {mesh.component for mesh in read_drawables(stage)}
    assert names == {"bed", "nightstand_left", "nightstand_right", "lamp", "wardrobe", "pendant", "Floor"}
    stage.SetEditTarget(stage.GetSessionLayer())
    UsdGeom.Imageable(stage.GetPrimAtPath("/Room/Objects/bed")).MakeInvisible()
    assert "bed" not in {mesh.component for mesh in read_drawables(stage)}


def test_instances_are_drawn():
    stage = cube_stage()
    copies = Usd.Stage.CreateInMemory()
    for number in range(3):
        prim = UsdGeom.Xform.Define(copies, f"/Copies/Copy{number}").GetPrim()
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(10 * number, 0, 0))
        inside = copies.DefinePrim(f"/Copies/Copy{number}/Inside")
        inside.GetReferences().AddReference(stage.GetRootLayer().identifier, "/Furniture")
        inside.SetInstanceable(True)
    Sdf.CreatePrimInLayer(stage.GetRootLayer(), "/Furniture")
    stage.GetRootLayer().GetPrimAtPath("/Furniture").specifier = Sdf.SpecifierDef
    Sdf.CopySpec(stage.GetRootLayer(), "/Cube", stage.GetRootLayer(), "/Furniture/Cube")
    found = [mesh.world[0, 3] for mesh in read_drawables(copies)]
    UsdGeom.SetStageMetersPerUnit(copies, 1.0)
    assert [mesh.world[0, 3] for mesh in read_drawables(copies)] == [1.0, 11.0, 21.0]
    assert found == pytest.approx([0.01, 0.11, 0.21])  # USD's default unit is the centimetre


def test_light_is_smoothed_within_a_plane_only():
    rng = np.random.default_rng(0)
    light = 1 + 0.3 * rng.normal(size=(20, 20, 3)).astype(np.float32)
    normal = np.zeros((20, 20, 3), np.float32)
    normal[:, :10, 1], normal[:, 10:, 0] = 1, 1
    light[:, 10:] += 5
    point = np.zeros((20, 20, 3), np.float32)
    planes = (each.transpose(2, 0, 1).copy() for each in (light, normal, point))
    smooth = smooth_light(*planes, [(slice(None), RINGS)]).transpose(1, 2, 0)
    assert smooth[:, :10].std() < 0.4 * light[:, :10].std()
    assert abs(smooth[:, :10].mean() - 1) < 0.1
    assert abs(smooth[:, 10:].mean() - 6) < 0.1


def test_what_steel_mirrors_is_not_smoothed_into_the_pane_in_it():
    gloss = np.full((20, 20), 0.6, np.float32)
    gloss[5:15, 5:15] = 0.4
    light = np.where(gloss > 0.5, np.float32(0.5), np.float32(0.02))[None]
    normal, point = np.zeros((2, 3, 20, 20), np.float32)
    normal[2] = 1
    mixed = smooth_light(light.copy(), normal, point, [(slice(None), RINGS[:2])])
    assert mixed[0, 5, 5] > 0.1  # one flat piece
    apart = smooth_light(light.copy(), normal, point, [(slice(None), RINGS[:2], gloss)])
    np.testing.assert_allclose(apart, light, atol=1e-6)


def test_soft_shadows_from_above_have_no_grain():
    """The sun outside is a wide disc: half in shadow is a gradient, no pattern of dots."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    boxes = ("floor", (8.0, 0.1, 8.0), (0.0, 0.0, 0.0)), ("wall", (0.2, 3.0, 8.0), (-1.0, 1.5, 0.0))
    for name, size, middle in boxes:
        box = UsdGeom.Cube.Define(stage, f"/{name}")
        box.CreateSizeAttr(1.0)
        box.AddTranslateOp().Set(Gf.Vec3d(*middle))
        box.AddScaleOp().Set(Gf.Vec3f(*size))
    bright = pixels(render_stage(stage, view="top", size=240)).mean(-1)[:, 60:180]
    assert np.ptp(bright) > 0.1
    beside = np.abs(np.diff(bright, axis=1))  # along the wall nothing changes
    assert np.quantile(beside, 0.99) < 0.004


def test_one_looks_out_of_windows_and_past_walls_that_are_away(tmp_path):
    data = echousd.generate(
        small_graph(), model=StandIn(), shapes="boxes", place=False, options=RoomOptions(walls=True, dress="none")
    )
    scenery = read_scenery(Usd.Stage.Open(str(data.save(tmp_path / "bedroom", preview=False))))
    windows = [opening for opening in data.graph.room.openings if opening.kind == "window"]
    assert len(scenery.panes) == len(windows) > 0
    middle, side, rise = scenery.panes[0].astype(float)
    np.testing.assert_allclose(2 * np.linalg.norm(side), windows[0].width, atol=0.07)
    np.testing.assert_allclose(2 * np.linalg.norm(rise), windows[0].height, atol=0.07)
    eye = np.array([0.0, 1.4, 0.0])
    aims = np.array([middle + 0.9 * rise, middle - 0.9 * rise, middle + 1.5 * side, 2 * eye - middle])
    assert np.ptp(scenery.lights.view) > 100  # something is seen
    around = np.array([(120, 150, 200)] * 32 + [(90, 120, 60)] * 32, np.uint8)[:, None].repeat(128, axis=1)
    for view in (around, None):
        plain = replace(scenery, panes=scenery.panes[:1], lights=replace(scenery.lights, view=view))
        colors, through = outside(plain, np.tile(eye, (4, 1)).T, (aims - eye).T)
        sky, field, beside, behind = colors.T
        assert through.tolist() == [True, True, False, False]
        assert sky[2] > sky[1] > sky[0]
        assert field[1] > field[2] if view is around else (field == sky).all()
        np.testing.assert_array_equal([beside, behind], [BACKGROUND] * 2)
    turned = np.zeros((64, 128, 3), np.uint8)
    turned[:, 24:40, 0], turned[:, 88:104, 1] = 255, 255  # red at +X, green at -X
    for number, pane in enumerate(np.float32([[(x, 1.4, 0), (0, 0, 1), (0, 1, 0)] for x in (2, -2)])):
        plain = replace(scenery, panes=pane[None], lights=replace(scenery.lights, view=turned))
        assert outside(plain, eye[:, None], pane[0][:, None] - eye[:, None])[0].argmax() == number
    side = scenery.bounds[1][0]
    ways = np.array([(side, 0.0, 0.0), (side + 0.3, -1.4, 0.0)])
    wall, floor = next_room(scenery, np.full(3, 0.5), np.tile(eye, (2, 1)).T, ways.T).T
    assert wall @ LUMA < 0.5  # of white paper in the room's light
    ground = scenery.flat_colors[np.flatnonzero(scenery.normals[:, 0, 1] > 0.9)]
    off = np.abs(ground / (floor / floor.max()) - (ground / (floor / floor.max()))[:, :1]).max(1)
    assert off.min() < 0.01  # a colour that lies on the floor here
    accent = scenery.wall[scenery.largest[1]]
    dark = np.where((scenery.wall == accent)[:, None], 0.3, 1.0).astype(np.float32)
    painted = replace(scenery, flat_colors=scenery.flat_colors * dark)
    assert painted.wall[painted.largest[1]] != accent  # beyond a passage no wall is like an accent wall
    outwards = middle + 5 * (middle - eye) * (1, 0, 1)
    assert len(without_near_walls(scenery, outwards).panes) < len(scenery.panes)


def test_what_light_there_is_everywhere_has_the_colour_of_the_rooms():
    """Beside warm lamps a neutral one would look blue."""
    scenery = read_scenery(cube_stage())
    view = replace(turning_views(scenery, 2)[0], inside=True)
    warm = np.array([1.0, 0.8, 0.5], np.float32)
    world = World(
        embree(scenery.triangles), scenery, view, 64, np.zeros(4), Bounced.dark(*scenery.bounds), 0.0, white=warm
    )
    up, place = np.array([(0.0, 1.0, 0.0)], np.float32).T, np.array([(1.0, 1.2, 0.0)], np.float32).T
    seen = Seen(np.zeros(1, int), place, up, np.zeros((2, 1)), np.zeros((3, 1)), np.zeros(1, bool))
    light = _light(world, seen, 0, np.zeros((4, 1), np.float32))
    np.testing.assert_allclose(light[:3, 0] / light[0, 0], warm, rtol=1e-4)


@pytest.mark.parametrize(("opacity", "size", "faces"), [(0.3, 1.0, 2), (0.3, 0.1, 4), (0.9, 1.0, 4)])
def test_one_looks_through_the_glass_of_a_front(opacity, size, faces):
    """A front of two squares, the second of glass: a clear and large one is left out, no board all of glass."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    for name, squares in (("front", 2), ("screen", 1)):
        mesh = UsdGeom.Mesh.Define(stage, f"/{name}")
        corners = [(x + k, y, 0) for k in range(squares) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        mesh.CreatePointsAttr(size * np.array(corners, np.float32))
        mesh.CreateFaceVertexCountsAttr([4] * squares)
        mesh.CreateFaceVertexIndicesAttr(list(range(4 * squares)))
        material = UsdShade.Material.Define(stage, f"/{name}_glass")
        shader = UsdShade.Shader.Define(stage, f"/{name}_glass/shader")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(opacity)
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        api = UsdShade.MaterialBindingAPI(mesh.GetPrim())
        subset = api.CreateMaterialBindSubset("glass", [squares - 1]).GetPrim()
        UsdShade.MaterialBindingAPI.Apply(subset).Bind(material)
    assert len(read_scenery(stage).triangles) == faces + 2


def test_a_camera_behind_a_wall_sees_what_its_near_plane_leaves(tmp_path):
    options = RoomOptions(walls=True, dress="none")
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=options)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    stage.SetEditTarget(stage.GetSessionLayer())
    camera, (lower, upper) = UsdGeom.Camera.Get(stage, "/Room/Cameras/perspective"), read_scenery(stage).bounds
    camera.ClearXformOpOrder()
    eye = ((lower[0] + upper[0]) / 2, 1.3, upper[2] + 1.5)
    camera.AddTranslateOp(opSuffix="behind").Set(Gf.Vec3d(*eye))
    seen = []
    for near, inside in ((0.05, False), (1.4, False), (2.0, True)):
        camera.GetClippingRangeAttr().Set((near, 50.0))
        view = hero_view(stage, read_scenery(stage))
        assert np.allclose(view.matrix[:3, 3], eye) == inside
        through = stage_views(stage)["perspective"]
        assert (through.near, through.start[2]) == pytest.approx((near, eye[2] - near), abs=1e-5)
        seen.append(pixels(Image.fromarray((trace(read_scenery(stage), through, 96, rays=1) * 255).astype("uint8"))))
    assert np.abs(seen[0] - seen[1]).mean() < 0.02  # the wall from outside, whatever is cut away before it
    assert np.abs(seen[0] - seen[2]).mean() > 0.1


def test_surfaces_are_as_rough_as_their_image_is_in_the_mean_times_its_scale(root):
    stage = Usd.Stage.Open(str(root))
    (floor,) = (mesh for mesh in read_drawables(stage) if mesh.category == "floor")
    image = UsdShade.Shader.Get(stage, "/Room/Looks/floor/roughness")
    fallback, scale = (image.GetInput(name).Get()[0] for name in ("fallback", "scale"))
    assert (fallback, scale) == pytest.approx((0.5, scale))
    assert floor.paints[0][0].roughness == pytest.approx(fallback * scale)
    stage.SetEditTarget(stage.GetSessionLayer())
    image.GetInput("scale").Set((0.2, 0.2, 0.2, 1.0))
    (polished,) = (mesh for mesh in read_drawables(stage) if mesh.category == "floor")
    assert polished.paints[0][0].roughness == pytest.approx(0.1)


def test_a_small_picture_is_quick(root):
    stage = Usd.Stage.Open(str(root))
    render_stage(stage, size=16)
    started = time.process_time()
    render_stage(stage, size=256)
    assert time.process_time() - started < 3.0  # 0.7 s on an idle core


def test_each_image_is_read_once_in_a_size_and_relief_for_fine_pictures_alone(tmp_path, monkeypatch):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, dress="none")
    root, read = room.save(tmp_path / "bedroom", preview=False), []

    def counted(prim, file, halved=0):
        read.append((file, halved))
        return image_of(prim, file, halved)

    monkeypatch.setattr("echousd.draw.scenery.image_of", counted)
    for rays in (2, 3):
        read.clear()
        render_stage(Usd.Stage.Open(str(root)), size=64, rays=rays)
        colors = [one for one in read if "normal" not in one[0]]
        assert len(set(colors)) == len(colors) > 0
        assert (colors != read) == (rays == 3)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"view": "side"}, "view is 'side', allowed: hero, dollhouse, top"),
        ({"colors": "pink"}, "colors is 'pink', allowed: materials, class"),
        ({"size": 5}, "size is 5 pixels, allowed: 16 to 4096"),
    ],
)
def test_bad_arguments_are_named(root, arguments, text):
    with pytest.raises(ValueError, match=text):
        render(root, **arguments)


def test_nothing_to_draw_and_missing_embree(root, monkeypatch):
    with pytest.raises(ValueError, match="nothing to draw, found no visible mesh"):
        render_stage(Usd.Stage.CreateInMemory())
    monkeypatch.setitem(sys.modules, "embreex", None)
    with pytest.raises(ValueError, match=r'pip install "echousd\[render\]"'):
        render(root, size=16)


def test_walls_in_front_of_the_camera_are_cut_away(tmp_path):
    options = RoomOptions(walls=True, dress="none")
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=options)
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    scenery = read_scenery(stage)
    assert scenery.wall.max() == 3
    outside = without_near_walls(scenery, np.array([9.0, 3.0, 8.0]))
    assert len(set(outside.wall[outside.wall >= 0])) == 2
    centre = outside.triangles[outside.wall >= 0].reshape(-1, 3).mean(0)
    assert centre[0] < 0
    assert centre[2] < 0
    image = pixels(render_stage(stage, view="dollhouse", size=64, colors="class"))
    colourful = np.abs(image - image.mean(-1, keepdims=True)).max(-1) > 0.08
    assert colourful.mean() > 0.05  # the furniture is in sight
    inside = stage_views(stage)["perspective"].start
    assert abs(inside[0]) < 2.0
    assert abs(inside[2]) < 1.7
    assert 0.5 < inside[1] < 2.8


@pytest.mark.parametrize(("up", "unit"), [("Y", 1.0), ("Z", 0.01)])
def test_every_camera_draws_what_it_sees(up, unit):
    stage = cube_stage(up, unit)
    for name, across in (("a_at_it", 1.0), ("b_away", 40.0)):  # metres along x; each looks straight down, 2 m wide
        camera = UsdGeom.Camera.Define(stage, f"/{name}")
        camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
        camera.CreateHorizontalApertureAttr(20.0 / unit)
        place = (across / unit, 5 / unit, 0) if up == "Y" else (across / unit, 0, 5 / unit)
        camera.AddTranslateOp().Set(Gf.Vec3d(*place))
        camera.AddRotateXOp().Set(-90.0 if up == "Y" else 0.0)
    picture = pixels(render_stage(stage, view="every-camera", size=32, rays=1))
    assert picture.shape == (32, 64, 3)
    assert np.ptp(picture[:, 32:], axis=(0, 1)).max() < 0.02  # background alone
    seen = np.abs(picture[:, :32] - picture[0, 40]).max(-1) > 1e-3  # grey in the sun on grey
    assert 0.2 < seen.mean() < 0.3  # a quarter of the picture
    assert seen[12:20, 12:20].all()


def test_every_camera_needs_one():
    with pytest.raises(ValueError, match="no camera, which --cameras and view every-camera need"):
        render_stage(cube_stage(), view="every-camera", size=32)


def test_a_sheet_shows_six_views(root):
    sheet = pixels(render(root, view="sheet", size=48, rays=1))
    assert sheet.shape == (96, 144, 3)
    for number, view in ((0, "dollhouse"), (2, "top")):
        alone = pixels(render(root, view=view, size=48, rays=1))
        np.testing.assert_array_equal(sheet[:48, 48 * number : 48 * number + 48], alone)
    cells = [sheet[48:, 48 * number : 48 * number + 48] for number in range(3)]
    assert min(np.abs(a - b).mean() for a, b in combinations([sheet[:48, :48], *cells], 2)) > 0.01


def test_a_sheet_holds_the_default_picture_of_a_room():
    options = RoomOptions(walls=True, dress="none")
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=options)
    stage = room.stage
    sheet = pixels(render_stage(stage, view="sheet", size=48, rays=1))
    np.testing.assert_array_equal(sheet[9:39, 48:96], pixels(render_stage(stage, size=48, rays=1)))
    assert np.ptp(sheet[:9, 48:96], axis=(0, 1)).max() == 0  # a bar above, and one below


def test_a_turn_goes_all_around(root):
    pictures = [pixels(picture) for picture in render_turn(root, frames=8, size=48, rays=1)]
    assert len(pictures) == 8
    assert min(np.abs(a - b).mean() for a, b in combinations(pictures, 2)) > 0.005
    assert all(np.ptp(picture[0], axis=0).max() < 0.05 for picture in pictures)  # nothing reaches the upper border
    with pytest.raises(ValueError, match="frames is 1, allowed: 2 to 360"):
        render_turn(root, frames=1)


def test_command_draws_turns_and_counts_rays(root, tmp_path, echousd_command):
    path = tmp_path / "turn.gif"
    done = echousd_command("render", root, "-o", path, "--view", "turntable", "--frames", 3, "--size", 32)
    assert done.code == 0, done.err
    with Image.open(path) as moving:
        assert (moving.format, moving.n_frames, moving.size) == ("GIF", 3, (32, 32))
    assert (
        echousd_command("render", root, "-o", path, "--view", "turntable", "--frames", 2, "--size", 32).code == 0
    )  # ours
    for words, told in (
        (("-o", tmp_path / "turn.png", "--view", "turntable"), "a turntable is written as .gif, found '.png'"),
        (
            ("-o", tmp_path / "one.png", "--view", "side"),
            "--view is 'side', allowed: hero, dollhouse, top, every-camera, sheet, turntable",
        ),
        (("-o", tmp_path / "one.gif"), "pictures are written as .png, found '.gif'"),
        (("-o", tmp_path / "one.png", "--quality", "best"), "--quality is 'best', allowed: fast, fine"),
    ):
        done = echousd_command("render", root, *words)
        assert (done.code, told in done.err) == (2, True), done.err
    assert [one.name for one in tmp_path.iterdir()] == ["turn.gif"]


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("up", ["Y", "Z"])
def test_a_shifted_lens_shows_what_usd_says(kind, up):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    camera = UsdGeom.Camera.Define(stage, "/eye")
    camera.AddTranslateOp().Set((1.0, 2.0, 3.0))
    camera.AddRotateXYZOp().Set((20.0, 30.0, 40.0))
    camera.CreateProjectionAttr(kind)
    for name, value in (("HorizontalAperture", 36.0), ("VerticalAperture", 24.0), ("FocalLength", 30.0)):
        getattr(camera, f"Create{name}Attr")(value)
    camera.CreateHorizontalApertureOffsetAttr(5.0)
    camera.CreateVerticalApertureOffsetAttr(-7.0)
    view, gf = stage_views(stage)["eye"], camera.GetCamera(0).frustum
    into = gf.ComputeViewMatrix() * gf.ComputeProjectionMatrix()
    for u, v in ((0.0, 0.0), (0.5, -0.75), (-1.0, 1.0)):
        right, above, back, eye = view.matrix[:3].T
        aside = view.half * (u * right + v / view.aspect * above)
        point = eye + aside - back if kind == "orthographic" else eye + 2.0 * (aside - back)
        if up == "Z":
            point = np.array([point[0], -point[2], point[1]])
        np.testing.assert_allclose(into.Transform(Gf.Vec3d(*point))[:2], (u, v), atol=1e-6)


@pytest.mark.parametrize("rays", [2, 3])
def test_a_picture_is_the_same_bit_for_bit_with_one_thread_and_two(root, monkeypatch, rays):
    scenery = read_scenery(Usd.Stage.Open(str(root)))
    view = turning_views(scenery, 2)[0]
    threads, found = set(), []
    for share in (10**9, 2):
        monkeypatch.setattr("echousd.draw.rays.SHARED", share)
        with monkeypatch.context() as patch:
            patch.setattr("echousd.draw.rays.ThreadPoolExecutor", lambda count: told(threads, count))
            found.append(trace(scenery, view, 96, rays=rays))
        assert bool(threads) == (share == 2)
    np.testing.assert_array_equal(*found)


def told(threads, count):
    """A pool that tells which of its threads had something to do."""
    return ThreadPoolExecutor(count, initializer=lambda: threads.add(threading.get_ident()))
