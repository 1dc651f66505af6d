"""Layouts of many graphs in one pass are those of single runs."""

from pathlib import Path

import pytest
import torch

from echomodel.loading import load_model
from echomodel.randomness import SceneGenerators, normal
from echousd.graph import SceneGraph
from echousd.graph.floors import with_plan
from echousd.make.layouts import Draws, draft_rounds, sample_boxes
from echousd.make.packed import packs, sample_round
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


def test_further_drafts_are_those_of_single_runs():
    graphs = [SceneGraph.from_stage(SAMPLES / f"{name}.usda") for name in ("bedroom", "study")]
    model, seeds = load_model(None), (4, 5)
    for number in (1, 2):
        packed = sample_round(model, graphs, seeds, [5, 8], number=number, steps=4)
        for graph, seed, most, drafts in zip(graphs, seeds, (5, 8), packed, strict=True):
            (start, count), timer = draft_rounds(most)[number], StageTimer()
            draws = Draws(seed, start, 4, guided=False)
            alone = sample_boxes(model, with_plan(graph, seed), draws, count=count, timer=timer)
            for a, b in zip(alone, drafts, strict=True):
                assert float((a.position - b.position).abs().max()) < 5e-4


def test_packs_keep_the_order_and_the_budget():
    assert packs(range(5), [3, 3, 9, 2, 2], most=6) == [[0, 1], [2], [3, 4]]


def test_many_layouts_are_those_of_single_runs():
    graphs = [SceneGraph.from_stage(SAMPLES / f"{name}.usda") for name in ("bedroom", "study")]
    model = load_model(None)

    def first(graphs, seeds):
        return [boxes for (boxes,) in sample_round(model, graphs, seeds, [1] * len(graphs))]

    many = first(graphs, [4, 5])
    assert [torch.equal(a.position, b.position) for a, b in zip(many, first(graphs, [4, 5]), strict=True)]
    for graph, seed, boxes in zip(graphs, (4, 5), many, strict=True):
        (alone,) = first([graph], [seed])
        assert float((alone.position - boxes.position).abs().max()) < 2.5e-4
        assert float((alone.size - boxes.size).abs().max()) < 2.5e-4
    (other,) = first([graphs[0]], [5])
    assert not torch.equal(other.position, many[0].position)
