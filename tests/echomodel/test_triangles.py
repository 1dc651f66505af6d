import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from echomodel.triangles import (
    Mesh,
    area_normals,
    bounds_of,
    box,
    connected_pieces,
    cross,
    joined,
    lengths,
    spans_of,
    spread,
)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(3,), (0, 3), (7, 3), (2, 5, 3)])
def test_a_vector_product_is_numpy_s_bit_for_bit(shape, kind):
    one, two = np.random.default_rng(3).normal(size=(2, *shape)).astype(kind)
    found = cross(one, two)
    assert found.dtype == kind
    np.testing.assert_array_equal(found, np.cross(one, two))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(1, 3), (700, 3), (2, 5, 3)])
def test_lengths_and_bounds_are_numpy_s_bit_for_bit(shape, kind):
    points = np.random.default_rng(4).normal(size=shape).astype(kind)
    rows = points.reshape(-1, 3)
    assert lengths(points).dtype == bounds_of(points).dtype == kind
    np.testing.assert_array_equal(lengths(points), np.linalg.norm(points, axis=-1))
    np.testing.assert_array_equal(bounds_of(points), [rows.min(0), rows.max(0)])
    for triangles in (rows, np.stack([rows] * 3, 1) * rows[:, None]):
        np.testing.assert_array_equal(spans_of(triangles), [triangles.min(1), triangles.max(1)])


def test_a_normal_is_twice_as_long_as_its_triangle_s_area():
    triangle = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]]], float)
    np.testing.assert_array_equal(area_normals(triangle), [[0, 0, 6]])


@given(st.integers(1, 60), st.integers(0, 2**31))
def test_connected_pieces_are_those_of_scipy_in_the_order_of_their_points(points, seed):
    rng = np.random.default_rng(seed)
    faces = rng.integers(points, size=(rng.integers(1, 50), 3))
    links = np.concatenate([faces[:, :2], faces[:, 1:]]).T
    found = connected_components(coo_array((np.ones(links.shape[1]), links), shape=(points, points)))[1]
    first = np.unique(found[faces[:, 0]], return_inverse=True)[1]
    np.testing.assert_array_equal(connected_pieces(faces, points), first)


def test_a_long_strip_in_any_order_is_one_piece():
    strip = np.arange(5000)[:, None] + np.arange(3)
    assert not connected_pieces(np.random.default_rng(0).permutation(5002)[strip], 5002).any()


def test_meshes_joined_keep_their_corners():
    one, two = Mesh(np.arange(9.0).reshape(3, 3), np.array([[0, 1, 2]])), Mesh(-np.eye(4, 3), np.array([[1, 2, 3]]))
    np.testing.assert_array_equal(joined([one, two]).triangles, [one.vertices, two.vertices[1:]])


def test_a_box_is_closed_and_ends_at_its_corners():
    made = box((1, 2, 3), (2, 4, 7))
    np.testing.assert_array_equal(made.bounds, [(1, 2, 3), (2, 4, 7)])
    assert made.trimesh.volume == pytest.approx(8.0)
    assert made.closed
    assert not Mesh(made.vertices, made.faces[1:]).closed


def test_points_are_spread_evenly_over_the_area():
    triangles = np.array([[[0, 0, 0], [3, 0, 0], [0, 1, 0]], [[0, 0, 5], [1, 0, 5], [0, 1, 5]], np.zeros((3, 3))])
    points, face = spread(triangles, 4000)
    np.testing.assert_array_equal(np.bincount(face, minlength=3), [3000, 1000, 0])
    np.testing.assert_array_equal(points[:, 2], 5.0 * face)
    x, y = points[face == 0, :2].T
    assert min(x.min(), y.min()) >= 0
    assert (x / 3 + y).max() <= 1 + 1e-12
    np.testing.assert_allclose(points[face == 0].mean(0), [1, 1 / 3, 0], atol=0.01)
