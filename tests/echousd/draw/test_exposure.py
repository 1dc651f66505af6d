"""How bright a picture shows a room: light evened about its mean, contrast, whites that keep their shades."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import box_room, level_sheet, with_sheet

from echousd.draw.indoors import BRIGHT, LUMA, SHARE, evened, exposure
from echousd.draw.tracing import trace


def test_what_is_white_keeps_its_shades_in_the_sun():
    """In a strip of a strong sun from the side a white board that leans to it is lighter than the white floor."""
    scenery, down = box_room(sky=0.5, sun=np.array([(0.8, 0.6, 0.0), (20.0, 20.0, 20.0)], np.float32))
    inside = (np.abs(scenery.triangles[..., 0].mean(1) - 2) > 0.1) & (scenery.triangles[..., 1].mean(1) < 2.9)
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "thin", "st", "texture", "wall")
    pane = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32)
    scenery = replace(scenery, panes=pane, **{name: getattr(scenery, name)[inside] for name in names})
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])  # its normal, upwards, to the sun
    scenery = with_sheet(scenery, (level_sheet(0.4, 0.4, y=0.0) @ turn) + np.array([0.3, 0.3, 0.0]))
    for left, right in ((-2.2, -0.2), (0.2, 2.2)):  # shutters
        scenery = with_sheet(scenery, np.array([(1.8, 0, left), (1.8, 0, right), (1.8, 4, right), (1.8, 4, left)]))
    white = replace(scenery, flat_colors=np.full_like(scenery.flat_colors, 0.85))
    line = trace(white, down, 48, rays=2).mean(-1)[:, 23]
    board, floor = line[19], np.median(line[32:44])
    assert floor < 0.985
    assert floor + 0.005 < board


def test_light_is_evened_about_its_mean():
    light = np.array([0.1, 1.0, 10.0], np.float32) * np.ones((3, 1), np.float32)
    even = evened(light, np.ones(3, np.float32))[0]
    assert even[1] == pytest.approx(1.0)
    assert 10 < even[2] / even[0] < 70  # of 100
    sun, outside = (evened(np.full((3, 1), 5, np.float32), np.ones(3, np.float32), inside)[0, 0] for inside in (1, 0))
    assert 1.8 < sun < 2.6  # a floor in the sun is bright and no blank
    assert outside > 3.5


def test_light_over_wood_and_lawns_comes_nearer_to_the_colour_of_all_of_it():
    white, warm = np.array([1.0, 0.9, 0.8], np.float32), np.array([1.2, 0.9, 0.5], np.float32)
    shown = [evened(one[:, None], white)[:, 0] for one in (white, warm)]
    np.testing.assert_allclose(shown[0], white, atol=1e-6)
    far, near = (np.ptp(np.log(one / white)) for one in (warm, shown[1]))
    assert 0.3 * far < near < 0.7 * far
    assert LUMA @ shown[1] == pytest.approx(LUMA @ warm, rel=0.02)  # as bright


def exposed(color: np.ndarray, light: np.ndarray, day: float = 1.0) -> np.ndarray:
    color = color.astype(np.float32).reshape(-1, 3).T
    return exposure(color, light, day)(color).T.reshape(20, 20, 3)


def test_exposure_brings_dark_and_bright_rooms_to_one_tone():
    rng = np.random.default_rng(0)
    room = rng.uniform(0.2, 1.0, (20, 20, 1)) * np.ones(3)
    white = np.ones(3)
    dark, bright = (exposed(scale * room, white) for scale in (0.2, 5.0))
    np.testing.assert_allclose(dark, bright, atol=1e-5)
    assert np.percentile(bright, SHARE) == pytest.approx(BRIGHT[1], abs=0.02)
    assert np.median(exposed(room, white, day=0.0)) < 0.8 * np.median(bright)  # the evening is darker
    assert exposed(1e-3 * room, white).mean() < 0.1  # night stays night
    sunny = np.where(np.arange(20)[:, None, None] < 2, 6.0, room)  # a tenth of the picture in the sun
    assert np.median(exposed(sunny, white)) > 0.8 * np.median(bright)
    warm = np.array([1.0, 0.7, 0.4])
    left = exposed(warm * room, warm).mean((0, 1)) / exposed(room, white).mean((0, 1))
    assert 1.0 < left[0] / left[2] < 1.6  # of 2.5: the eye adapts to most of a lamp's colour
    by_night = exposed(warm * room, warm, day=0.0).mean((0, 1))
    # to less of it by night, when lamps are warm, not yellow
    assert left[0] / left[2] < by_night[0] / by_night[2] < 1.7


def test_what_glares_is_bleached_and_what_does_not_keeps_its_hue():
    room, white = np.full((3, 100), 0.5), np.ones(3)
    shown = exposure(room.astype(np.float32), white)
    colour = np.array([[0.4, 0.15, 0.1]], np.float32).T
    dim, glare = shown(colour), shown(100 * colour)
    assert glare.min() > 0.9
    assert dim.max() / dim.min() > 3.5


def test_a_dark_tree_before_a_window_is_no_hole_and_keeps_its_colour():
    lights = box_room(sky=1.0)[0].lights
    lawn, tree = (lights.there(np.array([[0.5], [1.0], [0.4]], np.float32) * level) for level in (0.3, 0.02))
    assert 0.3 < tree[1, 0] ** (1 / 2.2) < 0.6 * lawn[1, 0] ** (1 / 2.2)
    assert tree[1, 0] > 1.3 * tree[0, 0]
