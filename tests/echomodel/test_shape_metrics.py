"""Scores of shapes on cases whose answer is known."""

import numpy as np
import pytest

from echomodel.metrics.pointsets import set_scores, surface_points, surface_scores
from echomodel.tsdf import FILLED, RESOLUTION, TRUNCATION, mesh_from_tsdf


def box_grid(half, shift=0.0):
    """Exact distances of a box, half extents in voxels, moved along x by `shift` voxels."""
    axis = np.arange(RESOLUTION) - (RESOLUTION - 1) / 2
    x, y, z = np.meshgrid(axis - shift, axis, axis, indexing="ij")
    q = np.abs(np.stack([x, y, z], -1)) - half
    distance = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
    return np.clip(distance / TRUNCATION, -1, 1).astype(np.float32)


def test_a_grid_matches_itself():
    scores = surface_scores(box_grid(20), box_grid(20))
    assert scores["f_score"] == 1.0
    assert scores["iou"] == 1.0
    assert scores["chamfer"] < 0.001


def test_a_slab_moved_by_two_voxels_loses_its_faces():
    half = np.array([3, 28, 28])
    scores = surface_scores(box_grid(half, 2.0), box_grid(half))
    assert scores["iou"] == pytest.approx(4 / 8)  # 6 voxels thick, 4 in common, 8 in all
    # The two faces are two voxels away, the four rims still lie on each other: 4 * 6 * 56 of 2 * 56^2 + 4 * 6 * 56.
    assert scores["f_score"] == pytest.approx(4 * 6 / (2 * 56 + 4 * 6), abs=0.04)
    assert scores["chamfer"] == pytest.approx(2 / FILLED * 0.82, rel=0.1)


def test_one_voxel_is_within_the_threshold_and_two_are_not():
    near = surface_scores(box_grid(20), box_grid(20.8))
    far = surface_scores(box_grid(20), box_grid(22))
    assert near["f_score"] > 0.9
    assert far["f_score"] < 0.05


def test_nothing_scores_nothing():
    scores = surface_scores(np.ones((64, 64, 64), np.float32), box_grid(10))
    assert scores == {"f_score": 0.0, "precision": 0.0, "recall": 0.0, "chamfer": 1.0, "iou": 0.0}


def clouds():
    rng = np.random.default_rng(0)
    shapes = [rng.random((200, 3)).astype(np.float32) * size for size in (0.2, 0.5, 1.0)]
    return np.stack([shape + rng.normal(0, 0.002, shape.shape) for shape in shapes for _ in range(3)]).astype("f4")


def test_a_set_covers_itself_and_not_another():
    points = clouds()
    same = set_scores({"chair": points}, {"chair": points})["chair"]
    assert same["cov"] == 1.0
    assert same["mmd"] == pytest.approx(0, abs=1e-9)
    apart = set_scores({"chair": points}, {"chair": points + 10, "desk": points})
    assert apart["chair"]["acc"] == 1.0
    assert set(apart) == {"chair"}


def test_points_repeat_for_equal_seeds():
    mesh = mesh_from_tsdf(box_grid(10))
    np.testing.assert_array_equal(surface_points(mesh, 50, seed=3), surface_points(mesh, 50, seed=3))
    assert surface_points(mesh, 50).shape == (50, 3)
