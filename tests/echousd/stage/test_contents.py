"""Meshes of objects as the measures of a room see them: pieces that are closed, and what is open."""

import numpy as np
import pytest

from echousd.stage.contents import Shape

FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])  # a tetrahedron, seen from outside
CORNERS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0)])


def test_closed_pieces_stand_apart_and_open_ones_together():
    apart = [CORNERS + np.array([4.0 * number, 0, 0]) for number in range(4)]
    faces = [FACES, FACES + 4, FACES[:3] + 8, FACES + 12]  # the third has a hole
    order = np.random.default_rng(0).permutation(15)
    points, mixed = np.concatenate(apart), np.concatenate(faces)[order]
    shape = Shape(points, mixed, np.ones(3), np.zeros(3), 0.0)
    loose, closed = shape.pieces
    assert loose.shape == (3, 3, 3)
    assert [len(part) for part in closed] == [4, 4, 4]
    assert [float(part[..., 0].min()) for part in closed] == [0.0, 4.0, 12.0]
    assert np.ptp(closed[2].reshape(-1, 3), axis=0).tolist() == [1, 1, 1]
    low, high = shape.closed_spans
    assert low[:, 0].tolist() == pytest.approx([0, 4, 12])
    assert high[:, 0].tolist() == pytest.approx([1, 5, 13])
    hollow = Shape(points, faces[2], np.ones(3), np.zeros(3), 0.0).pieces
    assert (len(hollow[0]), hollow[1]) == (3, [])
