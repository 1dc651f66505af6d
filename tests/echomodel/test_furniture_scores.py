"""What furniture made of parts is scored on: sizes that such furniture comes in."""

import numpy as np
import pytest
import torch

from echomodel.furniture import Choices, draw_style, solids
from echomodel.furniture.style import described
from echomodel.metrics.furniture import piece_scores, style_scores, usual_size
from echomodel.objective.sizes import size_range


@pytest.mark.parametrize("category", ["kids_bed", "desk", "floor_lamp"])
def test_sizes_are_those_a_person_takes_for_one_of_the_kind(category):
    rng = np.random.default_rng(3)
    sizes = np.array([usual_size(category, rng) for _ in range(400)])
    low, high = map(np.array, size_range(category))
    assert (sizes >= low).all()
    assert (sizes <= high).all()
    assert (sizes.std(0) > 0.02).all()


def test_style_scores_tell_suites_of_one_style_from_others():
    def by_suite(graph, sizes):
        assert sizes.shape == (graph.num_nodes, 3)
        assert int(graph.category.max()) < 7
        style = graph.scene if len(graph.triplets) else torch.arange(graph.num_nodes)
        drawn = [draw_style(np.random.default_rng(int(number))) for number in style]
        return torch.from_numpy(np.stack([described(one, Choices(np.zeros(18))) for one in drawn]))

    scores = style_scores(by_suite, 7, 5, 2)
    assert scores["told"] == scores["ratio"] == 0
    assert scores["untold"] > 0.1
    assert scores["other"] > 0.1


def test_a_piece_is_closed_whole_and_fills_its_box():
    size = np.array([0.5, 0.9, 0.5])
    parts = solids("chair", draw_style(np.random.default_rng(0)), Choices(np.zeros(18)), size)
    mesh, scores = piece_scores(parts, size)
    assert scores == {"closed": 1.0, "loose": 0.0, "box_error": pytest.approx(0, abs=1e-6)}
    assert mesh.extents == pytest.approx(size)
