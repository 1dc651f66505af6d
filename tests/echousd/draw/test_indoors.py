"""The picture from inside: what comes in at the windows, lamps, what the walls throw back, and how it is exposed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from box_room import LAMP, box_room, level_sheet, with_sheet
from PIL import Image
from pxr import Gf, Usd, UsdGeom, UsdLux
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.draw import tracing
from echousd.draw.contact import Contact
from echousd.draw.drawables import image_of
from echousd.draw.from_files import render
from echousd.draw.indoors import Bounced, read_lights
from echousd.draw.rays import World, embree
from echousd.draw.rendering import render_stage
from echousd.draw.scenery import CLOTH, SHEER, read_scenery, with_ceiling
from echousd.draw.tracing import _at_edges, _met, trace
from echousd.draw.views import View, hero_view, view_matrix
from echousd.options import RoomOptions
from echousd.stage.showing import showing_variant

WALLED = RoomOptions(walls=True, dress="none")


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=WALLED)
    return Usd.Stage.Open(str(room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)))


def test_the_picture_is_taken_inside_the_room_and_wider_than_high(stage):
    scenery = read_scenery(stage)
    view = hero_view(stage, scenery)
    lower, upper = scenery.bounds
    assert view.inside
    assert (lower < view.start).all()
    assert (view.start < upper).all()
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/perspective")).GetCamera(0)
    assert camera.aspectRatio == pytest.approx(view.aspect, abs=1e-4)
    np.testing.assert_allclose(view.matrix[:3, 3], camera.transform.ExtractTranslation(), atol=1e-6)
    assert render_stage(stage, size=64, rays=1).size == (64, 40)


def test_a_stage_without_walls_is_shown_from_outside(tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    bare = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    hero, house = (np.asarray(render_stage(bare, view=view, size=32, rays=1)) for view in ("hero", "dollhouse"))
    np.testing.assert_array_equal(hero, house)


def test_the_ceiling_is_as_high_as_the_walls_and_lit(stage):
    scenery = read_scenery(stage)
    closed = with_ceiling(scenery)
    assert len(closed.triangles) == len(scenery.triangles) + 2
    top = closed.triangles[-2:]
    assert top[..., 1] == pytest.approx(scenery.triangles[scenery.wall >= 0][..., 1].max())
    up = View(view_matrix(np.array([1.4, 2.4, 0.9]), np.array([1.41, 3.0, 0.9])), 0.3, False, inside=True)
    above, nothing = (trace(one, up, 16, rays=1).std((0, 1)).max() for one in (closed, scenery))
    assert above > 1e-3 > nothing  # plaster in the lamps' light; nothing is of one colour


def lights_of(**power: float) -> Usd.Stage:
    """A stage in centimetres, Z up, with the lights that are told."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    for name, intensity in power.items():
        kinds = {"dome": UsdLux.DomeLight, "sun": UsdLux.DistantLight, "panel": UsdLux.RectLight}
        kind = kinds.get(name, UsdLux.SphereLight)
        light = kind.Define(stage, f"/{name}")
        light.CreateIntensityAttr(intensity)
        light.CreateNormalizeAttr(name in ("sun", "lamp"))
        light.CreateColorAttr(Gf.Vec3f(1.0, 0.5, 0.25))
        if name not in ("dome", "sun"):
            light.AddTranslateOp().Set(Gf.Vec3d(100, 200, 300))
    return stage


def test_lights_are_read_in_any_unit_and_axis():
    lights = read_lights(lights_of(dome=0.5, sun=2.0, lamp=80000.0))  # 8 m²
    assert lights.sky == 0.5
    np.testing.assert_allclose(lights.sun, [(0, 1, 0), (2.0, 1.0, 0.5)], atol=1e-6)  # straight down from +Z
    np.testing.assert_allclose(lights.bulbs - np.float32((1, 3, -2)), 0, atol=0.051)
    np.testing.assert_allclose(lights.power, [(2.0, 1.0, 0.5)])
    dark = read_lights(lights_of(dome=0.0))
    assert dark.sky == 0.0
    assert dark.sun is None
    assert read_lights(lights_of()).sky == 1.0  # a stage that tells nothing of light is seen by day


def test_panels_are_read_in_any_unit_and_axis_and_shine_down():
    lights = read_lights(lights_of(dome=1.0, panel=40000.0, lamp=80000.0))  # a square centimetre
    (panel,) = lights.panels
    np.testing.assert_allclose(panel[0], (1, 3, -2), atol=1e-6)
    np.testing.assert_allclose(np.cross(panel[1], panel[2]), (0, 0.005**2, 0), atol=1e-9)
    np.testing.assert_allclose(panel[3], (40000.0, 20000.0, 10000.0), rtol=1e-5)
    assert lights.power.max() == 2.0
    assert len(read_lights(lights_of(dome=1.0)).panels) == 0


def test_a_panel_lights_what_is_below_it_and_nothing_above():
    side = np.array([(0.0, 1.5, 0.0), (0.0, 0.0, 0.4), (0.4, 0.0, 0.0), (1.0, 1.0, 1.0)], np.float32)
    scenery, _ = box_room(sky=0.0, sun=None, panels=side[None])
    black = replace(scenery, flat_colors=np.full_like(scenery.flat_colors, 0.02))
    both = View(view_matrix(np.array([-1.9, 1.5, 0.0]), np.array([0.0, 1.5, 0.0])), 1.2, False, inside=True)
    picture = trace(black, both, 48, rays=2).mean(-1)
    assert picture[-8:].mean() > 4 * picture[:8].mean()


def test_a_room_without_a_ceiling_is_lit_as_it_were_told_with_one(tmp_path):
    """By day and in the evening: sky to sun to panel to lamps."""
    for light in ("day", "evening"):
        found = []
        for ceiling in (False, True):
            options = RoomOptions(walls=True, dress="none", ceiling=ceiling)
            room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=options)
            stage = Usd.Stage.Open(str(room.save(tmp_path / f"{light}{ceiling}", preview=False)))
            with showing_variant(stage, "light", light):
                lights = with_ceiling(read_scenery(stage)).lights
            sun = np.zeros(3) if lights.sun is None else lights.sun[1]
            found.append(np.concatenate([sun, lights.panels[0, 3], *lights.power]) / lights.sky)
        np.testing.assert_allclose(*found, rtol=0.02)


def test_a_lamp_lights_what_is_near_it_and_a_window_what_is_before_it():
    lamp = {"bulbs": np.array([[(1.0, 0.5, 0.0)]], np.float32), "power": np.array([(3.0, 3.0, 3.0)], np.float32)}
    scenery, down = box_room(sky=0.0, **lamp)
    bright = trace(scenery, down, 96, rays=2).mean(-1)
    assert bright.max() > 1.3 * np.median(bright)
    across, _ = np.unravel_index(bright.argmax(), bright.shape)
    row = down.matrix[:3, :3].T @ (np.array([1.0, 0.0, 0.0]) - down.matrix[:3, 3])
    assert abs((1 - row[1] / -row[2] / 0.7) * 48 - across) < 12  # under the lamp
    pane = np.array([[(2.0, 1.0, 0.0), (0.0, 0.0, 0.8), (0.0, 0.6, 0.0)]], np.float32)
    sunless, _ = box_room(sky=1.0, sun=None)
    lit = trace(replace(sunless, panes=pane), down, 24, rays=2).mean(-1)
    towards = down.matrix[:3, 1] @ (1.0, 0.0, 0.0) > 0
    near, far = (lit[:6], lit[-6:]) if towards else (lit[-6:], lit[:6])
    # the pane is in the wall's plane, which stops no ray that ends before it
    assert near.mean() > far.mean() + 0.02


def test_right_before_a_window_nothing_sparks():
    pane = np.array([[(1.99, 0.8, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32)  # down to the floor
    scenery, _ = box_room(sky=1.0, sun=None)
    view = View(view_matrix(np.array([1.7, 1.2, 0.0]), np.array([1.701, 0.0, 0.0])), 0.25, False, inside=True)
    along = trace(replace(scenery, panes=pane), view, 64, rays=1).mean(-1)
    assert along.mean() > 0.5
    assert np.abs(np.diff(along, axis=1)).mean() < 0.003  # from pixel to pixel along the window


def test_what_a_wall_throws_back_has_its_colour_and_corners_are_darker_than_open_walls():
    lamp = {"bulbs": np.array([[(0.0, 1.5, 0.0)]], np.float32), "power": np.ones((1, 3), np.float32)}
    scenery, down = box_room(sky=0.0, **lamp)
    right = (scenery.triangles[..., 0] > 1.9).all(1)
    red = np.where(right[:, None], np.float32([0.7, 0.05, 0.05]), np.float32(0.6))
    picture = trace(replace(scenery, flat_colors=red), down, 96, rays=2)
    axis = 0 if abs(down.matrix[0, 1]) > 0.5 else 1
    ends = [np.take(picture, part, axis).reshape(-1, 3).mean(0) for part in (range(12), range(84, 96))]
    hue = sorted(float(end[0] / end[2]) for end in ends)
    assert hue[1] > 1.03 * hue[0]  # the floor before the red wall is redder than the one before the white wall
    middle, corner = picture[40:56, 40:56].mean(), picture[:6, :6].mean()
    assert corner < 0.9 * middle


def test_a_lamp_shines_from_its_shade_and_throws_no_shadow_of_its_own_on_the_ceiling():
    """A dish below six glowing candles, the bulb below the dish as stages have it."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    dish = UsdGeom.Cube.Define(stage, "/Lamp/Dish")
    dish.AddTranslateOp().Set(Gf.Vec3d(0, 2.0, 0))
    dish.AddScaleOp().Set(Gf.Vec3f(0.3, 0.02, 0.3))
    light = UsdLux.SphereLight.Define(stage, "/Lamp/Bulb")
    light.CreateIntensityAttr(10.0)
    UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(0, 1.9, 0))
    ring = np.linspace(0, 2 * np.pi, 7)[:-1]
    candles = np.stack([0.25 * np.cos(ring), np.full(6, 2.1), 0.25 * np.sin(ring)], 1)
    corners = 0.02 * np.array([(0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (-1.0, -1.0, 1.0)])
    candles = (candles[:, None] + corners).astype(np.float32)
    far = candles + np.float32(2.0)
    spots = read_lights(stage, [far, candles]).bulbs[0]
    apart = np.linalg.norm(spots[:, None] - candles.mean(1), axis=-1)
    assert apart.min(1).max() < 1e-5
    assert set(apart.argmin(1)) == set(range(6))
    bare = read_lights(stage, [far]).bulbs[0]
    assert np.linalg.norm(bare - (0, 1.9, 0), axis=1).max() < 0.051
    ceiling = {"bulbs": read_lights(stage, [candles]).bulbs, "power": np.full((1, 3), 3.0, np.float32)}
    scenery, _ = box_room(sky=0.0, **ceiling)
    up = View(view_matrix(np.array([0.0, 0.5, 0.0]), np.array([0.01, 3.0, 0.0])), 0.7, False, inside=True)
    dark = read_scenery(stage).triangles
    added = {
        "triangles": dark, "normals": np.zeros_like(dark) + np.float32((0, -1, 0)), "st": np.zeros((len(dark), 3, 2)),
        "flat_colors": np.zeros((len(dark), 3)), "emissive": np.zeros((len(dark), 3)), "gloss": np.zeros(len(dark)),
        "thin": np.zeros(len(dark)), "texture": np.full((len(dark), 2), -1), "wall": np.full(len(dark), -1),
    }  # fmt: skip
    joined = {key: np.concatenate([getattr(scenery, key), more]).astype(more.dtype) for key, more in added.items()}
    picture = trace(replace(scenery, **joined), up, 96, rays=2).mean(-1)
    beside, middle = picture[44:52, 76:80].mean(), picture[44:52, 63:66].mean()
    assert middle > 0.9 * beside


def test_a_fine_pattern_is_an_even_tone_from_afar_and_seen_from_near(tmp_path):
    scenery, down = box_room(sky=0.0, **LAMP)
    board = np.where(np.indices((256, 256)).sum(0) % 2, 255, 0).astype(np.uint8)
    Image.fromarray(np.repeat(board[..., None], 3, 2)).save(tmp_path / "chess.png")
    chess = (partial(image_of, "/Chess", str(tmp_path / "chess.png")), np.ones(3, np.float32))
    spread = {}
    for side in (1.0, 100.0):
        sheet = with_sheet(scenery, level_sheet(side, side), texture=np.array([(0, -1)] * 2))
        picture = trace(replace(sheet, images=(chess,)), down, 96, rays=2).mean(-1)
        spread[side] = float(picture[40:56, 40:56].std())
    assert spread[1.0] < 0.03  # seven fields a pixel
    assert spread[100.0] > 0.15


@pytest.mark.parametrize("lit", ["lamp", "sun"])
def test_an_image_of_normals_turns_a_surface_as_if_it_were_turned(tmp_path, lit):
    if lit == "lamp":
        scenery, down = box_room(sky=0.0, bulbs=np.array([[(1.0, 1.4, 0.0)]], "f4"), power=np.ones((1, 3), "f4"))
    else:
        towards = np.array([(0.6, 0.8, 0.0), (1.0, 1.0, 1.0)], np.float32)
        scenery, down = box_room(sky=0.2, sun=towards)
        open_ = ((scenery.triangles[..., 0] < 1.9) | (scenery.triangles[..., 0] > 2.1)).any(1)  # where it shines in
        open_ &= (scenery.triangles[..., 1] < 2.9).any(1)
        names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "thin", "st", "texture", "wall")
        pane = np.array([[(2.0, 1.5, 0.0), (0.0, 0.0, 2.0), (0.0, 1.5, 0.0)]], np.float32)
        scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[open_] for name in names})
    seen = []
    for turn in np.radians((-12, 0, 12)):
        ahead = np.array([np.sin(turn), 0, np.cos(turn)])  # to the right of the image, +x
        Image.new("RGB", (8, 8), tuple(np.rint(127.5 * (ahead + 1)).astype(int))).save(tmp_path / "normal.png")
        image = (partial(image_of, "/Normal", str(tmp_path / "normal.png")), np.ones(3, np.float32))
        drawn = with_sheet(
            replace(scenery, images=(image,)), level_sheet(0.4, 0.4, y=0.6), texture=np.array([(-1, 0)] * 2)
        )
        about = np.array([(np.cos(turn), -np.sin(turn), 0), (np.sin(turn), np.cos(turn), 0), (0, 0, 1)])
        turned = with_sheet(scenery, level_sheet(0.4, 0.4, y=0.0) @ about + (0, 0.6, 0))
        seen.append([trace(one, down, 160, rays=3)[76:84, 76:84].mean() for one in (drawn, turned)])
    (away, _), (level, _), (towards, _) = seen
    assert away < 0.98 * level < 0.98**2 * towards
    assert [drawn for drawn, _ in seen] == pytest.approx([turned for _, turned in seen], rel=0.03)


PANEL = {
    "bulbs": np.zeros((0, 24, 3), np.float32), "power": np.zeros((0, 3), np.float32),
    "panels": np.array([[(0.0, 2.9, 0.0), (1.5, 0.0, 0.0), (0.0, 0.0, 1.5), (0.3, 0.3, 0.3)]], np.float32),
}  # fmt: skip


def test_fine_pictures_are_darker_beside_what_is_black_than_cells_of_light_tell(monkeypatch):
    scenery, _ = box_room(sky=0.0, **PANEL)
    eye = View(view_matrix(np.array([0.3, 1.2, 0.0]), np.array([1.78, 0.0, 0.0])), 0.25, False, inside=True)
    strip = np.array([(1.85, 0.0, -0.5), (1.85, 0.0, 0.5), (1.85, 0.1, 0.5), (1.85, 0.1, -0.5)])
    taken = []
    for near in (tracing.NEAR, np.float32(0)):
        monkeypatch.setattr(tracing, "NEAR", near)
        tones = (with_sheet(scenery, strip, flat_colors=np.full((2, 3), tone)) for tone in (0.0, 0.8))
        black, white = (trace(one, eye, 160, rays=3)[80:96, 70:90].mean() for one in tones)  # the floor before it
        taken.append(1 - black / white)
    assert taken[0] > 1.5 * taken[1] > 0


def test_fine_pictures_keep_small_shadows_where_things_stand(monkeypatch):
    scenery, _ = box_room(sky=0.0, **PANEL)
    eye = View(view_matrix(np.array([0.0, 0.8, 1.2]), np.array([0.0, 0.0, 0.0])), 0.25, False, inside=True)
    darkest = []
    for band, pool in ((tracing.BAND, tracing.POOL), (0.0, (tracing.POOL[0],) * 2)):
        monkeypatch.setattr(tracing, "BAND", band)
        monkeypatch.setattr(tracing, "POOL", pool)
        picture = trace(with_sheet(scenery, level_sheet(0.08, 0.08, y=0.04)), eye, 480, rays=3)
        darkest.append(picture[200:330, 235:245].mean((1, 2)).min())  # of the floor below it
    assert darkest[0] < 0.92 * darkest[1]


def test_what_shines_is_spread_a_little_over_what_is_beside_it(monkeypatch):
    scenery, down = box_room(sky=0.0, **LAMP)
    shade = with_sheet(scenery, level_sheet(0.6, 0.6, y=0.3), emissive=np.full((2, 3), 0.5))
    spread = trace(shade, down, 160, rays=2)
    monkeypatch.setattr("echousd.draw.tracing.HALO", (0.02, 0.0))
    more = (spread - trace(shade, down, 160, rays=2)).mean(-1)
    assert more.min() >= 0
    assert more[80, 60] > 0.005 > more[80, 8]  # three hundredths of the picture from its border, and far from it


def test_what_is_mirrored_has_the_colour_of_the_light():
    scenery, down = box_room(sky=0.0, **LAMP | {"power": np.array([(1.5, 1.0, 0.5)], np.float32)})
    floor = (np.abs(scenery.triangles[..., 1]) < 0.1).all(1)
    dull, steel = (
        trace(replace(scenery, gloss=np.where(floor, gloss, 0).astype(np.float32)), down, 48, rays=2).mean((0, 1))
        for gloss in (0.0, 0.6)
    )
    assert steel[0] / steel[2] == pytest.approx(dull[0] / dull[2], rel=0.03)


def test_a_floor_is_darker_where_something_touches_it_and_nowhere_else():
    scenery, down = box_room(sky=0.0, **LAMP)
    fence = with_sheet(scenery, np.array([(-0.8, 0.0, 0.6), (0.8, 0.0, 0.6), (0.8, 0.4, 0.6), (-0.8, 0.4, 0.6)]))
    bare, fenced = (trace(one, down, 96, rays=2).mean(-1) for one in (scenery, fence))
    share = fenced / bare
    assert np.percentile(share, 2) < 0.93
    assert np.median(share) > 0.97


def test_a_bar_thinner_than_a_pixel_has_no_gaps():
    scenery, down = box_room(sky=0.0, **LAMP)
    bar = np.full((2, 3), 0.02)
    across = abs(down.matrix[0, 0]) > 0.5
    turn = np.array([[np.cos(0.1), 0, np.sin(0.1)], [0, 1, 0], [-np.sin(0.1), 0, np.cos(0.1)]])
    corners = level_sheet(*((3.0, 0.05) if across else (0.05, 3.0)), y=0.3) @ turn  # a pixel is 0.07 m there
    with_bar, without = (
        trace(one, down, 48, rays=2).mean(-1) for one in (with_sheet(scenery, corners, flat_colors=bar), scenery)
    )
    darker = (without - with_bar)[:, 8:40].max(0)
    assert darker.min() > 0.35 * np.median(darker)


def test_a_thin_slanting_trim_is_as_even_as_what_lights_it(monkeypatch):
    lamps = np.array([(x, 1.5, z) for x in (-1.5, 1.5) for z in (-1.5, 1.5)], np.float32)
    scenery, down = box_room(sky=0.0, bulbs=lamps[:, None], power=np.ones((4, 3), np.float32))
    turn = np.array([[np.cos(0.3), 0, np.sin(0.3)], [0, 1, 0], [-np.sin(0.3), 0, np.cos(0.3)]])
    corners = level_sheet(2.4, 0.05, y=0.3) @ turn  # two pixels wide
    glowing = trace(with_sheet(scenery, corners, emissive=np.ones((2, 3))), down, 160, rays=1)
    trim, here = with_sheet(scenery, corners), glowing.min(-1) > 0.8
    noise = []
    for pooled in (tracing._pooled, lambda seen, light, fine: light):  # and where each is lit by what it asked alone
        monkeypatch.setattr(tracing, "_pooled", pooled)
        pictures = [trace(trim, down, 160, rays=2, seed=seed).mean(-1)[here] for seed in range(6)]
        noise.append(np.std(pictures, axis=0).mean())
    assert noise[0] < 0.87 * noise[1]


def test_the_rim_of_what_is_round_is_lit_as_what_is_beside_it():
    import trimesh

    lamps = np.array([(x, 1.5, z) for x in (-1.5, 1.5) for z in (-1.5, 1.5)], np.float32)
    scenery, down = box_room(sky=0.0, bulbs=lamps[:, None], power=np.ones((4, 3), np.float32))
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.6)  # so coarse that normals at its rim look away
    form = {"triangles": ball.triangles + np.array((0, 0.8, 0)), "normals": ball.vertex_normals[ball.faces]}
    flat = {
        name: np.zeros((80, *shape))
        for name, shape in (("gloss", ()), ("thin", ()), ("st", (3, 2)), ("emissive", (3,)))
    }
    flat |= {"texture": np.full((80, 2), -1), "wall": np.full(80, -1), "flat_colors": np.full((80, 3), 0.9)}
    white, glowing = (
        trace(with_sheet(scenery, level_sheet(1, 1), **form, **look), down, 160, rays=2).mean(-1)
        for look in (flat, flat | {"emissive": np.ones((80, 3))})
    )
    assert white[glowing > 0.7].min() > 0.55  # 0.48 where normals that look away are turned into the ball


def test_light_comes_through_a_curtain_and_not_through_a_board():
    scenery, down = box_room(sky=0.0, **LAMP)
    curtain, board = (
        trace(with_sheet(scenery, level_sheet(0.3, 0.3, y=2.0), thin=np.full(2, thin)), down, 32, rays=2).mean(-1)
        for thin in (0.3, 0.0)
    )
    darker = [picture[:2].mean() - picture[14:18, 14:18].mean() for picture in (curtain, board)]  # than the floor
    assert darker[0] < darker[1] - 0.1


def test_one_sees_through_thin_cloth_before_a_window_what_lies_outside_and_its_folds():
    pane = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.5), (0.0, 0.8, 0.0)]], np.float32)
    view = View(view_matrix(np.array([-1.8, 1.0, 0.0]), np.array([0.5, 1.0, 0.0])), 0.3, False, inside=True)
    lawn = np.full((8, 64, 3), 255, np.uint8)  # behind the cloth alone, so that light is white
    lawn[:, 14:19] = 40, 160, 40
    scenery, _ = box_room(sky=1.0, sun=None, view=lawn)
    wall = (scenery.triangles[..., 0] > 1.9).all(1)
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "thin", "st", "texture", "wall")
    scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[~wall] for name in names})

    def green(thin: float, aside: float = 0.0) -> float:
        x = np.array([1.8 - aside, 1.8 + aside])  # of the left and the right border
        sheet = np.array([(x[0], 0, -0.7), (x[1], 0, 0.7), (x[1], 2, 0.7), (x[0], 2, -0.7)])
        picture = trace(with_sheet(scenery, sheet, thin=np.full(2, thin)), view, 32, rays=1)[14:18, 14:18]
        return float(picture[..., 1].mean() - picture[..., 0].mean())

    assert green(CLOTH) < 0.02
    assert green(SHEER * CLOTH) > green(SHEER * CLOTH, 0.12) + 0.01 > 0.05  # less where it turns aside


def test_a_shade_is_brightest_at_its_bulb():
    scenery, down = box_room(sky=0.0, **LAMP)
    white = replace(scenery, flat_colors=np.full_like(scenery.flat_colors, 0.8))
    shade = with_sheet(white, level_sheet(1.6, 1.6, y=1.2), emissive=np.full((2, 3), 0.5))
    picture = trace(shade, down, 96, rays=2).mean(-1)
    middle, rim = picture[46:50, 46:50].mean(), picture[46:50, 6:10].mean()
    assert 1.0 > middle > rim + 0.02


def test_who_looks_into_a_mirror_sees_what_is_before_it():
    scenery, down = box_room(
        sky=1.0, bulbs=np.array([[(0.0, 1.5, 0.0)]], np.float32), power=np.ones((1, 3), np.float32)
    )
    floor, above = ((np.abs(scenery.triangles[..., 1] - level) < 0.1).all(1) for level in (0.0, 3.0))
    down = replace(down, half=0.2)
    colors = np.where(above[:, None], np.float32([0.7, 0.05, 0.05]), np.float32(0.6))
    plain, mirrored = (
        trace(
            replace(scenery, flat_colors=colors, gloss=np.where(floor, gloss, 0).astype(np.float32)), down, 32, rays=2
        )
        for gloss in (0.5, 0.9)
    )
    assert plain[..., 0].mean() < 2 * plain[..., 1].mean()
    assert mirrored[..., 0].mean() > 2 * mirrored[..., 1].mean()


@pytest.mark.parametrize(
    ("eye", "thin", "red"), [((0.01, 2.5, 0), 1, True), ((0.01, 2.5, 0), 0, False), ((1.8, 0.4, 0), 1, False)]
)
def test_through_glass_one_sees_what_lies_behind_and_aslant_its_surface(eye, thin, red):
    scenery, down = box_room(sky=1.0, **LAMP)
    floor = (np.abs(scenery.triangles[..., 1]) < 0.1).all(1)
    scenery = replace(scenery, flat_colors=np.where(floor[:, None], np.float32([0.7, 0.05, 0.05]), np.float32(0.6)))
    for level in (0.06, 0.05):  # both sides of a pane
        scenery = with_sheet(scenery, level_sheet(1.6, 1.6, level), thin=np.full(2, thin))
    view = replace(down, matrix=view_matrix(np.array(eye), np.array([0.0, 0.06, 0.0])), half=0.05)
    seen = trace(scenery, view, 16, rays=2).mean((0, 1))
    assert (seen[0] > 2 * seen[1]) == red


def test_a_pane_has_a_tint_and_rays_go_on_both_sides_of_its_edge():
    """It had an edge only where what lies behind changed with it: glasses were drawn jagged."""
    scenery, down = box_room(sky=1.0, **LAMP)
    for level in np.linspace(1.0, 1.05, 6):
        scenery = with_sheet(scenery, level_sheet(0.8, 0.8, level), thin=np.ones(2))
    dark = Bounced.dark(*scenery.bounds)
    world = World(embree(scenery.triangles), scenery, down, 64, np.zeros(4), dark, np.zeros(3, np.float32), True)
    _, seen = _met(world, np.arange(64 * 64), np.full((2, 1), 0.5))
    pane = seen.shown > 0
    red, green, _ = seen.glow[:, pane].mean(1)
    assert green > 1.05 * red > 0
    edges = _at_edges(world, seen, (64, 64))
    rim = np.flatnonzero(edges & (np.abs(np.gradient(pane.reshape(64, 64).astype(float))).sum(0) > 0).ravel())
    assert len(rim) > 40
    pixel, more = _met(world, rim, np.random.default_rng(0).random((2, len(rim))), seen)
    assert ((more.shown > 0) > pane[pixel]).any()
    assert ((more.shown > 0) < pane[pixel]).any()


def test_a_glossy_floor_mirrors_the_window_and_more_so_aslant():
    pane = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32)
    scenery, _ = box_room(sky=1.0, sun=None)
    wall = (scenery.triangles[..., 0] > 1.9).all(1)  # that the pane is in
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "st", "texture", "wall")
    scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[~wall] for name in names})
    floor = (np.abs(scenery.triangles[..., 1]) < 0.1).all(1)
    view = View(view_matrix(np.array([-1.8, 0.6, 0.0]), np.array([0.5, 0.0, 0.0])), 0.9, False, inside=True)
    dull, glossy = (
        trace(replace(scenery, gloss=np.where(floor, gloss, 0).astype(np.float32)), view, 144, rays=2).mean(-1)
        for gloss in (0.0, 0.3)
    )
    gain = glossy / dull
    mirrored, beside, near = gain[72:84, 66:78].mean(), gain[84:96, :12].mean(), gain[132:, 66:78].mean()
    assert mirrored > beside + 0.04
    assert mirrored > near + 0.04  # there one looks down on it


def test_what_lies_outside_is_exposed_for_itself_and_darker_in_the_evening():
    """However dark or bright the room is, the view is neither black nor burnt white."""
    pane = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32)
    view = View(view_matrix(np.array([-1.8, 1.0, 0.0]), np.array([0.5, 1.0, 0.0])), 0.9, False, inside=True)
    meadow, seen = np.full((8, 16, 3), 120, np.uint8), []
    for sky, power in ((1.0, 0.0), (1.0, 40.0), (0.08, 1.0)):
        lamp = {"bulbs": np.array([[(0.0, 2.0, 0.0)]], np.float32), "power": np.full((1, 3), power, np.float32)}
        scenery, _ = box_room(sky=sky, sun=None, view=meadow, **lamp)
        wall = (scenery.triangles[..., 0] > 1.9).all(1)
        names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "st", "texture", "wall")
        scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[~wall] for name in names})
        seen.append(trace(scenery, view, 32, rays=1)[15:17, 15:17].mean())
    assert seen[0] == pytest.approx(seen[1], abs=1e-3)
    assert 0.4 < seen[0] < 0.8
    assert seen[2] < 0.8 * seen[0]


def test_a_patch_of_sun_has_a_straight_border():
    """The border of a board's shadow, slightly aslant, in the picture's rows: soft by its sun's width alone."""
    pane = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32)
    scenery, down = box_room(sky=0.1, sun=np.array([(0.1, 0.99, 0.1), (1.4, 1.4, 1.4)], np.float32))
    above = (scenery.triangles[..., 1] > 2.9).all(1)
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "st", "texture", "wall")
    scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[~above] for name in names})
    turn = np.array([[np.cos(0.2), 0, np.sin(0.2)], [0, 1, 0], [-np.sin(0.2), 0, np.cos(0.2)]])
    picture = trace(
        with_sheet(scenery, (level_sheet(3.0, 3.0, y=2.7) + np.array([1.5, 0, 0])) @ turn), down, 96, rays=2
    ).mean(-1)
    lines = picture if abs(down.matrix[0, 0]) > 0.5 else picture.T
    lit = ((lines - lines.min()) / np.ptp(lines)).sum(1)[24:72]  # where in each line light ends, in pixels
    rows = np.arange(len(lit))
    assert np.abs(lit - np.polyval(np.polyfit(rows, lit, 1), rows)).max() < 0.5


def test_what_is_white_darkens_less_where_it_touches():
    scenery, down = box_room(sky=0.0, **LAMP)
    corners = np.array([(-0.8, 0.0, 0.6), (0.8, 0.0, 0.6), (0.8, 0.4, 0.6), (-0.8, 0.4, 0.6)])
    bare = trace(scenery, down, 96, rays=2).mean(-1)
    black, white = (
        trace(with_sheet(scenery, corners, flat_colors=np.full((2, 3), tone)), down, 96, rays=2).mean(-1) / bare
        for tone in (0.02, 0.9)
    )
    near = (black < np.percentile(black, 6)) & (black > 0.6)  # the floor at it, not what it hides
    assert white[near].mean() > black[near].mean() + 0.068


def test_a_room_is_drawn_in_the_light_that_is_asked_for(tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", options=WALLED)
    path = room.save(tmp_path / "bedroom", preview=False)
    lights = (None, "day", "evening")
    day, told, evening = (np.asarray(render(path, size=48, rays=1, light=light), float) for light in lights)
    np.testing.assert_array_equal(day, told)
    assert evening.mean() < 0.9 * day.mean()
    with pytest.raises(ValueError, match="light is 'dusk', allowed: day, evening, night"):
        render(path, size=48, light="dusk")


def upright_sheet(high: float) -> np.ndarray:
    """(4, 3) corners of a sheet at x = 0 that stands on the floor."""
    return np.array([(0, 0, -0.1), (0, 0, 0.1), (0, high, 0.1), (0, high, -0.1)])


@pytest.mark.parametrize(
    ("high", "at", "dark"), [(0.5, 0.0, True), (0.5, 0.012, True), (0.012, 0.0, True), (0.012, 0.012, False)]
)
def test_the_floor_is_dark_where_something_stands_on_it_or_a_rug_ends_and_rugs_where_something_stands(high, at, dark):
    contact = Contact(with_sheet(box_room(sky=0.0, **LAMP)[0], upright_sheet(high)))
    x, up = np.array([0.005, 0.02, 0.3]), np.array([(0.0, 1.0, 0.0)] * 3).T
    near, beside, far = contact.left(np.stack([x, 0 * x + at, 0 * x]), up)
    assert far == 1.0
    assert near < beside < 0.95 if dark else near == 1.0
    assert (contact.left(np.stack([x, 0 * x + at, 0 * x]), up[[1, 0, 2]]) == 1).all()  # on what stands itself


def test_a_picture_shows_where_feet_meet_the_floor(monkeypatch):
    scenery, down = box_room(sky=0.0, **LAMP)
    scenery, down = with_sheet(scenery, upright_sheet(0.3), flat_colors=np.full((2, 3), 0.05)), replace(down, half=0.1)
    there = trace(scenery, down, 48, rays=2).mean(-1)
    monkeypatch.setattr(Contact, "left", lambda self, point, normal: np.ones(point.shape[1], np.float32))
    gain = there / trace(scenery, down, 48, rays=2).mean(-1)
    assert gain.min() < 0.8
    assert np.quantile(gain, 0.7) > 0.95
