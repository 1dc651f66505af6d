"""Signed distances from meshes and back: exact for solids, one voxel thick for sheets, errors in plain words."""

import numpy as np
import pytest
import trimesh

from echomodel.tsdf import FILLED, RESOLUTION, TRUNCATION, mesh_from_tsdf, tsdf_from_mesh


def voxel_centres():
    axis = np.arange(RESOLUTION) - (RESOLUTION - 1) / 2
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def test_a_box_of_any_aspect_gives_the_distance_to_the_normalised_cube():
    grid = tsdf_from_mesh(trimesh.creation.box([2.0, 0.5, 1.0]))
    q = np.abs(voxel_centres()) - FILLED / 2
    exact = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
    assert grid.shape == (64, 64, 64)
    assert grid.dtype == np.float32
    error = np.abs(grid * TRUNCATION - np.clip(exact, -TRUNCATION, TRUNCATION))
    assert error.mean() < 0.005
    assert error.max() < 0.2  # voxels; at the edges the nearest sample may lie on the other face


def test_a_surface_goes_there_and_back():
    mesh = trimesh.creation.annulus(0.3, 0.5, 0.1)
    back = mesh_from_tsdf(tsdf_from_mesh(mesh))
    assert back.is_watertight
    assert back.volume == pytest.approx(mesh.volume / np.prod(mesh.extents), rel=0.01)
    assert back.euler_number == mesh.euler_number
    np.testing.assert_allclose(back.bounds, [[-0.5, 0, -0.5], [0.5, 1, 0.5]], atol=0.01)


def test_an_open_sheet_becomes_a_thin_solid_and_a_closed_solid_beside_it_stays_itself():
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    cube = trimesh.creation.box([0.4, 0.4, 0.4])
    cube.apply_translation([0.5, 0.5, 0.8])
    back = mesh_from_tsdf(tsdf_from_mesh(trimesh.util.concatenate([sheet, cube])))
    parts = sorted(back.split(), key=lambda part: part.extents[2])
    assert [part.is_watertight for part in parts] == [True, True]
    assert 0.9 / 60 < parts[0].extents[2] < 1.6 / 60
    assert parts[1].volume == pytest.approx(cube.volume, rel=0.03)


@pytest.mark.parametrize(
    ("grid", "text"),
    [
        (np.ones((64, 64, 64)), "no surface: every voxel is outside"),
        (-np.ones((8, 8, 8)), "no surface: every voxel is inside"),
        (np.ones((64, 64)), r"shape \(64, 64\), need a cube"),
        (np.full((4, 4, 4), np.nan), "NaN"),
    ],
)
def test_a_grid_without_surface_is_refused(grid, text):
    with pytest.raises(ValueError, match=text):
        mesh_from_tsdf(grid)


def test_a_mesh_without_area_is_refused():
    with pytest.raises(ValueError, match="0 faces"):
        tsdf_from_mesh(trimesh.Trimesh())
    with pytest.raises(ValueError, match="single point"):
        tsdf_from_mesh(trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False))
