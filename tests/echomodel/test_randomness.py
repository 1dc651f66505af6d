"""Scenes that are packed draw the noise that they would draw alone."""

import numpy as np
import pytest
import torch

from echomodel.randomness import Noise, normal
from echomodel.scene_noise import SceneGenerators


def generator(seed):
    return torch.Generator().manual_seed(seed)


def test_a_scene_draws_the_same_noise_whatever_it_is_packed_with():
    together = normal((10, 3), SceneGenerators([generator(1), generator(2)], [2, 3]), "cpu").reshape(2, 5, 3)
    assert torch.equal(together[:, :2].reshape(4, 3), torch.randn((4, 3), generator=generator(1)))
    assert torch.equal(together[:, 2:].reshape(6, 3), torch.randn((6, 3), generator=generator(2)))


def test_generators_and_scenes_must_agree():
    with pytest.raises(ValueError, match="1 generators for 2 scenes, expected one each"):
        SceneGenerators([generator(0)], [1, 2])
    with pytest.raises(ValueError, match="noise for 4 rows, expected a multiple of the pack's 3 nodes"):
        normal((4, 2), SceneGenerators([generator(0)], [3]), "cpu")


def test_scenes_of_one_generator_draw_as_they_would_alone():
    def source():
        one = generator(1)
        return SceneGenerators([one, one, generator(2)], [2, 3, 4])

    drawn = normal((18, 3), source(), "cpu").reshape(2, 9, 3)
    assert torch.equal(drawn[:, :5].reshape(10, 3), torch.randn((10, 3), generator=generator(1)))


@pytest.mark.parametrize("seed", [0, 7, 2**32 + 5, 2**63 - 1])
def test_noise_is_that_of_torch_without_torch(seed):
    own, other = Noise(seed), generator(seed)
    for shape in [(16,), (6, 8), (5, 3, 7), (17,), (3, 86), (31,)]:
        drawn = normal(shape, own, None)
        assert drawn.dtype == np.float32
        assert np.abs(drawn - torch.randn(shape, generator=other).numpy()).max() < 1e-5


def test_few_numbers_are_drawn_from_a_block_and_scenes_draw_noise_as_they_would_alone():
    assert np.array_equal(Noise(3).draw(5), Noise(3).draw(16)[:5])
    packed = normal((5, 3), SceneGenerators([Noise(1), Noise(2)], [2, 3]), None)
    assert np.array_equal(packed, np.concatenate([normal((2, 3), Noise(1), None), normal((3, 3), Noise(2), None)]))
    assert torch.equal(normal((4, 4), Noise(1), "cpu"), torch.from_numpy(normal((4, 4), Noise(1), None)))
