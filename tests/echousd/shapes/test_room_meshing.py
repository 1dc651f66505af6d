import numpy as np
import pytest
import trimesh
from small_room import ball_tsdf, table_tsdf
from solid_boxes import box_mesh

from echousd.shapes.meshing import decimate, fit, largest_solids, mesh_from_shape


@pytest.mark.parametrize("grid", [ball_tsdf(), table_tsdf()], ids=["ball", "table"])
def test_mesh_fills_its_box_and_is_closed(grid):
    size = (1.2, 0.7, 0.5)
    clean = mesh_from_shape(grid, size, faces=3000)
    np.testing.assert_allclose(clean.bounds, [[-0.6, 0, -0.25], [0.6, 0.7, 0.25]], atol=1e-9)
    assert clean.is_watertight
    assert clean.volume > 0
    assert clean.is_winding_consistent
    assert len(clean.faces) <= 3000


def test_asymmetric_shape_is_centred_on_its_box_not_on_its_mass():
    grid = table_tsdf().copy()
    grid[34:, :54] = 1.0  # only the legs at one side are left
    clean = mesh_from_shape(grid, (1.0, 1.0, 1.0))
    np.testing.assert_allclose(clean.bounds, [[-0.5, 0, -0.5], [0.5, 1, 0.5]], atol=1e-9)
    assert clean.center_mass[0] < -0.01


def test_smoothing_takes_noise_and_keeps_thin_legs():
    rng = np.random.default_rng(0)
    grid = table_tsdf(leg=1.5)
    noisy = np.clip(grid + 0.12 * rng.normal(size=grid.shape), -1, 1)
    mesh = mesh_from_shape(noisy, (1.0, 1.0, 1.0), faces=20_000)
    low = mesh.section((0, 1, 0), (0, 0.3, 0)).to_2D()[0]
    assert len(low.polygons_closed) == 4
    legs = sum(polygon.area for polygon in low.polygons_full)
    assert legs == pytest.approx(4 * (3 / 60) ** 2, rel=0.35)


def test_loose_crumbs_go_and_cavities_are_filled():
    grid = ball_tsdf().copy()
    grid[2:4, 2:4, 2:4] = -1.0  # a crumb in a corner
    grid[30:34, 30:34, 30:34] = 1.0  # a hole nobody can see
    mesh = mesh_from_shape(grid, (1, 1, 1))
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.125, rel=0.02)
    assert (largest_solids(ball_tsdf()) == ball_tsdf()).all()


def test_two_large_solids_both_stay():
    grid = np.ones((64, 64, 64), np.float32)
    grid[2:30, 2:62, 2:62] = grid[34:62, 2:62, 2:62] = -1.0
    assert mesh_from_shape(grid, (1, 1, 1)).body_count == 2


def test_decimation_keeps_small_meshes_and_meets_the_budget():
    box = box_mesh((1, 2, 3))
    assert decimate(box, 100) is box
    ball = trimesh.creation.icosphere(subdivisions=5)
    assert len(decimate(ball, 1000).faces) <= 1000


def test_fit_turns_inside_out_meshes():
    box = trimesh.creation.box((1, 1, 1))
    box.invert()
    assert fit(box, np.array([2.0, 1.0, 1.0])).volume == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("grid", "size", "text"),
    [
        (np.ones((64, 64, 64), np.float32), (1, 1, 1), "TSDF holds no surface: every voxel is outside"),
        (np.ones((64, 64), np.float32), (1, 1, 1), "TSDF has shape"),
        (ball_tsdf(), (1, 0, 1), r"size is \[1.0, 0.0, 1.0\], need three positive numbers"),
    ],
)
def test_bad_shapes_are_named(grid, size, text):
    with pytest.raises(ValueError, match=text):
        mesh_from_shape(grid, size)
