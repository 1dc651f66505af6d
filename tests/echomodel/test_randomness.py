"""Scenes that are packed draw the noise that they would draw alone."""

import pytest
import torch

from echomodel.randomness import SceneGenerators, normal


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
