import numpy as np
import pytest

from echousd.srgb import from_linear, of_hexadecimal, to_linear


def test_known_values():
    assert to_linear(np.array([0.0, 0.04045, 0.5, 1.0])) == pytest.approx([0, 0.0031308, 0.2140411, 1], abs=1e-7)
    assert of_hexadecimal("00bcff") == pytest.approx([0, 0.5028865, 1], abs=1e-7)


def test_there_and_back():
    every = np.linspace(0, 1, 256).reshape(16, 16)
    assert np.abs(from_linear(to_linear(every)) - every).max() < 1e-7  # the standard rounds where the two parts meet
