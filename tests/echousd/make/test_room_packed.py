"""Layouts of many graphs in one pass are those of single runs."""

from pathlib import Path

import pytest
import torch

import echousd
from echomodel.loading import load_model
from echomodel.randomness import SceneGenerators, normal
from echousd.graph.floors import with_plan
from echousd.make.layouts import Draws, first_drafts, packs, sample_boxes
from echousd.progress import StageTimer

SAMPLES = Path(__file__).parents[3] / "samples"


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


def test_packs_keep_the_order_and_the_budget():
    assert packs(range(5), [3, 3, 9, 2, 2], most=6) == [[0, 1], [2], [3, 4]]


def test_many_layouts_are_those_of_single_runs():
    graphs = [echousd.read_graph(SAMPLES / f"{name}.usda") for name in ("bedroom", "study")]
    model = load_model(None)

    many = first_drafts(model, graphs, [4, 5], steps=4)
    again = first_drafts(model, graphs, [4, 5], steps=4)
    assert all(torch.equal(a.position, b.position) for a, b in zip(many, again, strict=True))
    for graph, seed, boxes in zip(graphs, (4, 5), many, strict=True):
        draws = Draws(seed, steps=4, guided=False)
        (alone,) = sample_boxes(model, with_plan(graph, seed), draws, timer=StageTimer())
        assert float((alone.position - boxes.position).abs().max()) < 2.5e-4
        assert float((alone.size - boxes.size).abs().max()) < 2.5e-4
    (other,) = first_drafts(model, [graphs[0]], [5], steps=4)
    assert not torch.equal(other.position, many[0].position)
