import numpy as np
import pytest

from echomodel.triangles import area_normals, cross


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(3,), (0, 3), (7, 3), (2, 5, 3)])
def test_a_vector_product_is_numpy_s_bit_for_bit(shape, kind):
    one, two = np.random.default_rng(3).normal(size=(2, *shape)).astype(kind)
    found = cross(one, two)
    assert found.dtype == kind
    np.testing.assert_array_equal(found, np.cross(one, two))


def test_a_normal_is_twice_as_long_as_its_triangle_s_area():
    triangle = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]]], float)
    np.testing.assert_array_equal(area_normals(triangle), [[0, 0, 6]])
