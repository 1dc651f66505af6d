"""EchoModel: seeds, known boxes and shapes, edits, shared furniture, and bad input named."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys

import pytest
import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.model import CompactModel
from echomodel.compact.sampling import agreeing
from echomodel.config import CompactConfig, from_dict, to_json
from echomodel.echo import EchoModel, equal_furniture
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.training.recipe import with_settings
from echomodel.vocabulary import vocabulary

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True)
SIZES = {
    "latent": {"width": 16},
    "layout": {"width": 32, "layers": 2, "drafts": 1, "steps": 3, "sampler": "ddim"},
    "autoencoder": {"width": 8},
    "shape": {
        "width": 16,
        "layers": 1,
        "heads": 2,
        "echo_width": 16,
        "steps": 2,
        "components": 8,
        "tokens": 2,
        "sampler": "ddim",
    },
}


@pytest.fixture(scope="module")
def model() -> EchoModel:
    torch.manual_seed(0)
    net = CompactModel(from_dict(CompactConfig, SIZES), STATISTICS)
    for parameter in net.parameters():
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.03)  # measured drafts magnify a wild network's rounding
    net.autoencoder.initialise(torch.rand(4, 16, 16, 16) * 2 - 1)
    net.shape.initialise(torch.randn(12, 6, 16, 16, 16), torch.Generator().manual_seed(0))
    return EchoModel(net)


def bedroom() -> GraphBatch:
    return GraphBatch.single([14, 23, 23], [[1, 1, 0], [2, 2, 0], [1, 13, 2]], floor=(4.0, 3.0))


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def boxes(count: int = 3) -> Boxes:
    return Boxes(torch.ones(count, 3), torch.zeros(count, 3), torch.zeros(count))


def test_equal_seeds_give_equal_bits(model: EchoModel) -> None:
    runs = [model.sample_layout(bedroom(), generator=seeded(seed)) for seed in (1, 1, 2)]
    assert torch.equal(runs[0].position, runs[1].position)
    assert not torch.equal(runs[0].position, runs[2].position)
    grids = [model.sample_shapes(bedroom(), boxes(), generator=seeded(seed)) for seed in (1, 1)]
    assert torch.equal(*grids)


def test_what_is_drawn_unguided_hangs_and_stands_where_it_is_carried(model: EchoModel) -> None:
    words = vocabulary()
    kinds = [words.category_id(word) for word in ("pendant_lamp", "desk", "table_lamp")]
    graph = GraphBatch.single(kinds, [[2, words.predicate_id("standing_on"), 1]], floor=(4.0, 3.0), height=2.6)
    found = model.sample_layout(graph, generator=seeded(), relation_guidance=0.0)
    bottom, top = found.position[:, 1], (found.position + found.size)[:, 1]
    wanted = torch.stack([torch.tensor(2.6), torch.tensor(0.0), top[1]])
    torch.testing.assert_close(torch.stack([top[0], bottom[1], bottom[2]]), wanted)


def test_known_boxes_and_shapes_come_back_unchanged(model: EchoModel) -> None:
    mask = torch.tensor([True, False, False])
    given = Boxes(torch.tensor([[2.0, 1, 2], [torch.nan] * 3, [0, 0, 0]]), torch.ones(3, 3), torch.tensor([0.3, 0, 0]))
    found = model.sample_layout(bedroom(), generator=seeded(), known=given, known_mask=mask)
    assert torch.equal(found.size[0], given.size[0])
    assert torch.equal(found.position[0], given.position[0])
    assert found.yaw[0] == given.yaw[0]
    assert torch.isfinite(found.size).all()
    grid = torch.rand(3, 64, 64, 64) * 2 - 1
    shapes = model.sample_shapes(bedroom(), boxes(), generator=seeded(), known=grid, known_mask=mask)
    assert torch.equal(shapes[0], grid[0])
    assert not torch.equal(shapes[1], grid[1])


def test_what_is_known_shapes_the_rest(model: EchoModel) -> None:
    mask, noise = torch.tensor([True, False, False]), torch.randn(3, 8, generator=seeded())
    results = []
    for shift in (0.0, 1.5):
        given = Boxes(torch.ones(3, 3), torch.full((3, 3), shift), torch.zeros(3))
        results.append(
            model.sample_layout(bedroom(), generator=seeded(), known=given, known_mask=mask, noise=noise).position[1:]
        )
    assert not torch.allclose(*results)


def test_an_edit_changes_the_result(model: EchoModel) -> None:
    graph, noise = bedroom(), torch.randn(3, 8, generator=seeded())
    edit = GraphEdit(before=graph.triplets[1:], added=torch.zeros(3, dtype=torch.bool))
    assert edit.touched(graph).tolist() == [True, True, False]
    plain = model.sample_layout(graph, generator=seeded(), noise=noise)
    edited = model.sample_layout(graph, generator=seeded(), noise=noise, edit=edit)
    assert not torch.equal(plain.position, edited.position)


def test_equal_furniture_starts_from_equal_noise() -> None:
    graph = GraphBatch.single([12, 12, 12, 13, 12], [[0, 13, 1], [2, 15, 1], [3, 13, 0], [4, 5, 0]])
    assert equal_furniture(graph).tolist() == [0, 0, 0, 3, 4]


def test_equal_furniture_gets_one_shape_that_a_known_piece_dictates(model: EchoModel) -> None:
    graph = GraphBatch.single([12, 12, 12, 13], [[0, 13, 1], [3, 13, 0]])
    boxes = Boxes(torch.rand(4, 3) + 0.3, torch.zeros(4, 3), torch.zeros(4))
    grids = model.sample_shapes(graph, boxes, generator=torch.Generator().manual_seed(0), steps=2)
    assert torch.equal(grids[0], grids[1])
    assert not torch.equal(grids[0], grids[2])

    def predict(x: Tensor, level: Tensor) -> Tensor:
        return x

    x = torch.tensor([[1.0], [3.0], [5.0], [9.0]])
    agreed = agreeing(predict, torch.tensor([0, 0, 2, 2]))
    torch.testing.assert_close(agreed(x, torch.ones(4)), torch.tensor([[2.0], [2.0], [7.0], [7.0]]))
    told = agreed(x, torch.tensor([1.0, 0.0, 1.0, 1.0]))
    torch.testing.assert_close(told[:2], torch.tensor([[3.0], [3.0]]), rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    "graph",
    [
        GraphBatch.single([3]),
        GraphBatch.single([3, 4]),
        GraphBatch.single([i % 46 for i in range(200)], [[0, 1, 1]]),
        GraphBatch.pack([GraphBatch.single([1]), GraphBatch.single([2, 3], [[0, 5, 1]], floor=(3.0, 3.0))]),
    ],
    ids=["one node", "no edges", "200 nodes", "two scenes"],
)
def test_unusual_graphs_work(model: EchoModel, graph: GraphBatch) -> None:
    found = model.sample_layout(graph, generator=seeded())
    found.check()
    assert len(found) == graph.num_nodes


def test_bad_input_is_named(model: EchoModel) -> None:
    graph, mask = bedroom(), torch.tensor([True, False, False])
    zero = Boxes(torch.zeros(3, 3), torch.zeros(3, 3), torch.zeros(3))
    with pytest.raises(ValueError, match="box 0 has an extent that is not positive"):
        model.sample_layout(graph, generator=seeded(), known=zero, known_mask=mask)
    with pytest.raises(ValueError, match="known_mask belong together"):
        model.sample_layout(graph, generator=seeded(), known=zero)
    with pytest.raises(ValueError, match=r"known: 2 values and a \(3,\) torch.bool mask for a graph of 3 nodes"):
        model.sample_layout(graph, generator=seeded(), known=boxes(2), known_mask=mask)
    with pytest.raises(ValueError, match="rules is 'loose', allowed: sgfront, strict"):
        model.sample_layout(graph, generator=seeded(), rules="loose")
    with pytest.raises(ValueError, match="2 boxes for a graph of 3 nodes"):
        model.sample_shapes(graph, boxes(2), generator=seeded())
    bad = Boxes(torch.full((3, 3), torch.nan), torch.zeros(3, 3), torch.zeros(3))
    with pytest.raises(ValueError, match="box 0 is not finite"):
        model.sample_shapes(graph, bad, generator=seeded())
    grid = torch.full((3, 64, 64, 64), torch.nan)
    with pytest.raises(ValueError, match="known shape of node 0 holds values that are not finite"):
        model.sample_shapes(graph, boxes(), generator=seeded(), known=grid, known_mask=mask)
    with pytest.raises(ValueError, match="category of node 0 is 99"):
        model.sample_layout(GraphBatch.single([99]), generator=seeded())


def test_configurations_survive_json_and_settings() -> None:
    config = with_settings(CompactConfig(), ["layout.steps=7", "shape.objective=velocity", 'rules=["strict"]'])
    assert (config.layout.steps, config.shape.objective, config.rules) == (7, "velocity", ("strict",))
    assert from_dict(CompactConfig, json.loads(to_json(config))) == config
    with pytest.raises(ValueError, match=r"layout.steps is 'many', expected int"):
        with_settings(CompactConfig(), ["layout.steps=many"])
    with pytest.raises(ValueError, match=r"shape.objective is 'v', allowed: noise, velocity, flow"):
        with_settings(CompactConfig(), ["shape.objective=v"])


def test_draws_side_by_side_are_draws_one_by_one(model: EchoModel, monkeypatch: pytest.MonkeyPatch) -> None:
    together = model.sample_shapes(bedroom(), boxes(), generator=seeded(), candidates=3)
    monkeypatch.setattr("echomodel.compact.shape.TOGETHER", 1)
    done: list[tuple[int, int]] = []
    alone = model.sample_shapes(
        bedroom(), boxes(), generator=seeded(), candidates=3, progress=lambda *part: done.append(part)
    )
    torch.testing.assert_close(together, alone, rtol=1e-4, atol=1e-4)
    assert done == [(k, 6) for k in range(1, 7)]


def test_a_batch_gives_what_single_runs_give(model: EchoModel) -> None:
    graphs = [
        bedroom(),
        GraphBatch.single([7]),
        GraphBatch.single([3, 4, 5], [[0, 5, 1], [2, 12, 1]], floor=(3.0, 5.0)),
    ]
    packed, noise = GraphBatch.pack(graphs), torch.randn(7, 8, generator=seeded())
    together = model.sample_layout(packed, generator=seeded(), noise=noise, steps=5)
    shapes = model.sample_shapes(packed, boxes(7), generator=seeded(), noise=noise)
    start = 0
    for graph in graphs:
        part = slice(start, start + graph.num_nodes)
        own = noise[part]
        alone = model.sample_layout(graph, generator=seeded(), noise=own, steps=5)
        for name in ("size", "position", "yaw"):
            torch.testing.assert_close(getattr(alone, name), getattr(together, name)[part], rtol=1e-3, atol=1e-4)
        grids = model.sample_shapes(graph, boxes(len(own)), generator=seeded(), noise=own)
        torch.testing.assert_close(grids, shapes[part], rtol=1e-3, atol=1e-4)
        start += graph.num_nodes


def test_models_pickle(model: EchoModel) -> None:
    again = pickle.loads(pickle.dumps(model))
    grids = [one.sample_shapes(bedroom(), boxes(), generator=seeded()) for one in (model, again)]
    assert torch.equal(*grids)
    assert set(again.model.shape.state_dict()) == set(CompactModel(model.config, STATISTICS).shape.state_dict())


def test_shapes_need_no_torch_before_them() -> None:
    """Whoever samples shapes with the weights of numpy loads torch on the way, which must keep no slopes then."""
    script = (
        "import sys, numpy as np\nfrom echomodel.boxes import Boxes\nfrom echomodel.echo import EchoModel\n"
        "from echomodel.graph import GraphBatch\nfrom echomodel.randomness import Noise\n"
        "graph = GraphBatch.single([0, 1], device=None)\n"
        "size, place = np.ones((2, 3), np.float32), np.zeros((2, 3), np.float32)\n"
        "model = EchoModel.load(device=None)\nassert 'torch' not in sys.modules\n"
        "boxes = Boxes(size, place, place[:, 0])\n"
        "made = model.sample_shapes(graph, boxes, generator=Noise(3), steps=1, candidates=2)\n"
        "print(type(made).__name__, made.shape)\n"
    )
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert told.stdout == "ndarray (2, 64, 64, 64)\n", told.stderr[-500:]
