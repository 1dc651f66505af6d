"""The published model as a whole: conditions, batches, sampling, ablations, the paper's wiring, bad input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch
import trimesh
from published_shapes import fit_to_box, mesh_from_grid, vertex_points

from echomodel.config import from_dict
from echomodel.metrics.pointsets import chamfer, compare_sets
from echomodel.vocabulary import vocabulary
from echoscene.checkpoint import read_bounds, statistics_from_bounds
from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig, paper, shape_unet
from echoscene.echo import published_scene
from echoscene.encoder import SceneGraphTensors, TripletGCN
from echoscene.model import GraphChange, ReleasedModel, Schedule, ShapeUNet, node_budget
from echoscene.unet import UNet, packed

ENCODER = EncoderConfig(text=12, learned=4, flag=4, hidden=16, layers=2, separated=False)
SMALL = {"hidden": 16, "layers": 2, "code": 8, "predicate": 8, "context": 32}
CONFIG = ReleasedConfig(
    encoder=ENCODER,
    layout=UNetConfig(width=128, mult=(1, 1), blocks=1, attention=(2,), objects=16, **SMALL),
    shape=shape_unet(width=32, mult=(1, 1), blocks=1, attention=(2,), objects=32, grid=8, **SMALL),
    vqvae=VQConfig(channels=8, codes=16, resolution=32),
)
BOUNDS = [0.1, 0.1, 0.1, 3.0, 3.0, 3.0, -2.0, 0.0, -2.0, 2.0, 3.0, 2.0, -3.2, 3.2]


def _paper() -> ReleasedConfig:
    return ReleasedConfig(
        preset="paper",
        encoder=ENCODER,
        layout=replace(CONFIG.layout, objects=32, edge_features=12),
        shape=replace(CONFIG.shape, edge_features=12),
        vqvae=None,
    )


def _model(config: ReleasedConfig = CONFIG) -> ReleasedModel:
    torch.manual_seed(0)
    model = ReleasedModel(config, statistics=statistics_from_bounds(BOUNDS))
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
    model.layout_tables = Schedule.linear(1e-3, 0.2, 60)  # the published 1,000 steps are for tests/parity
    return model.eval()


def _graph(classes: list[int], related: list[list[int]]) -> SceneGraphTensors:
    """A scene with its floor and scene node, and the `in` relations of the published loader."""
    nodes = [*classes, 6, 0]
    inside = [[i, 0, len(nodes) - 1] for i in range(len(nodes) - 1)]
    triples = torch.tensor([*related, *inside]).reshape(-1, 3)
    texts = torch.randn(14, 12, generator=torch.Generator().manual_seed(5))
    edges = torch.randn(len(triples), 12, generator=torch.Generator().manual_seed(6))
    return SceneGraphTensors(torch.tensor(nodes), triples, texts[torch.tensor(nodes)], edges)


def _pack(*graphs: SceneGraphTensors) -> SceneGraphTensors:
    starts = np.cumsum([0, *(len(g.classes) for g in graphs)])
    return SceneGraphTensors(
        torch.cat([g.classes for g in graphs]),
        torch.cat([g.triples + torch.tensor([s, 0, s]) for g, s in zip(graphs, starts, strict=False)]),
        torch.cat([g.node_text for g in graphs]),
        torch.cat([g.edge_text for g in graphs]),
    )


BED = _graph([1, 8, 7], [[1, 5, 0], [2, 7, 1], [0, 8, 1]])
DESK = _graph([5, 4], [[1, 3, 0]])


def test_presets_are_consistent() -> None:
    for config in (ReleasedConfig(encoder=EncoderConfig(classes=36)), paper()):
        assert from_dict(ReleasedConfig, asdict(config)) == config
        with torch.device("meta"):
            model = ReleasedModel(config)
    assert sum(p.numel() for p in model.layout_net.parameters()) > 150e6
    with pytest.raises(ValueError, match=r"unknown field 'encoder\.colour', allowed: classes"):
        from_dict(ReleasedConfig, {"encoder": {"colour": 1}})


def test_a_batch_is_what_single_runs_are() -> None:
    model = _model()
    both = _pack(BED, DESK)
    generator = torch.Generator().manual_seed(1)
    x, t = torch.randn(len(both.classes), 8, generator=generator), torch.full((len(both.classes),), 400)
    with torch.inference_mode():
        together = model.layout_net(x, model.conditions(both)[0], both.triples, t)
        count = len(BED.classes)
        first = model.layout_net(x[:count], model.conditions(BED)[0], BED.triples, t[:count])
        second = model.layout_net(x[count:], model.conditions(DESK)[0], DESK.triples, t[count:])
    assert torch.allclose(together, torch.cat([first, second]), atol=2e-5)


def test_sampling_is_seeded_and_finite() -> None:
    model = _model()
    boxes = [model.sample_layout(BED, generator=torch.Generator().manual_seed(s)) for s in (3, 3, 4)]
    assert torch.equal(boxes[0].position, boxes[1].position)
    assert not torch.equal(boxes[0].position, boxes[2].position)
    assert all(torch.isfinite(v).all() for v in (boxes[0].size, boxes[0].position, boxes[0].yaw))
    latents = model.sample_shapes(BED, generator=torch.Generator().manual_seed(3), steps=3)
    assert latents.shape == (5, 3, 8, 8, 8)
    with torch.inference_mode():
        assert model.vqvae.decode(latents[:1]).shape == (1, 1, 32, 32, 32)


def test_the_published_wiring_ignores_the_encoder_and_the_papers_does_not() -> None:
    before = SceneGraphTensors(BED.classes[1:], DESK.triples[:1], BED.node_text[1:], DESK.edge_text[:1])
    change = GraphChange(before, added=(0,))
    for config, matters in ((CONFIG, False), (_paper(), True)):
        model = _model(config)
        with torch.inference_mode():
            plain = model.conditions(BED)[0]
            edited = model.conditions(BED, change, torch.Generator().manual_seed(0))[0]
            for parameter in model.gconv_net_ec.parameters():
                parameter.mul_(1.5)
            perturbed = model.conditions(BED)[0]
        assert (not torch.allclose(plain, edited)) == matters
        assert (not torch.allclose(plain, perturbed)) == matters


@pytest.mark.parametrize("config", [CONFIG, _paper()], ids=["released", "paper"])
def test_joint_training_step(config: ReleasedConfig) -> None:
    model = _model(config).train()
    both = _pack(BED, DESK)
    count = len(both.classes)
    scene = torch.tensor([0] * len(BED.classes) + [1] * len(DESK.classes))
    generator = torch.Generator().manual_seed(1)
    boxes = torch.randn(count, 8, generator=generator)
    latents = torch.randn(count, 3, 8, 8, 8, generator=generator)
    losses = model.training_losses(both, scene, boxes, latents, generator=generator, budget=6)
    losses["loss"].backward()
    assert torch.isclose(losses["loss"], losses["layout"] + losses["shape"])
    grad = model.gconv_net_ec.gconvs[0].net1[0].weight.grad
    assert (grad is not None) == (config.preset == "paper")
    assert model.obj_embeddings_ec.weight.grad is not None


def test_node_budget_stops_at_the_first_scene_that_does_not_fit() -> None:
    scene = torch.tensor([0] * 3 + [1] * 5 + [2] * 1)
    triples = torch.tensor([[0, 1, 2], [3, 1, 4], [8, 1, 8]])
    assert node_budget(triples, scene, 4)[0] == 3
    kept, inside = node_budget(triples, scene, 8)
    assert (kept, inside.tolist()) == (8, [[0, 1, 2], [3, 1, 4]])
    with pytest.raises(ValueError, match="first scene has 3 nodes, more than the budget of 2"):
        node_budget(triples, scene, 2)


ABLATIONS = {
    "no time in the echo": {"time_in_echo": False},
    "no echo": {"echo": False},
    "concat": {"conditioning": "concat"},
    "concat without echo": {"conditioning": "concat", "echo": False, "objects": 512},
}


@pytest.mark.parametrize("name", ABLATIONS)
def test_ablations_of_table_4(name: str) -> None:
    config = replace(CONFIG.shape, **ABLATIONS[name])
    torch.manual_seed(0)
    net = ShapeUNet(config).eval()
    with torch.no_grad():
        for parameter in net.parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    x, objects = torch.randn(3, 3, 8, 8, 8), torch.randn(3, config.objects)
    triples, t = torch.tensor([[0, 1, 1]]), torch.full((3,), 300)

    def run(x=x, objects=objects, triples=triples) -> torch.Tensor:
        with torch.inference_mode():
            return net(x, objects, triples, t)

    base = run()
    assert base.shape == x.shape
    assert not torch.allclose(base, run(objects=objects + 1), atol=1e-5)  # the condition always matters
    heard = not torch.allclose(base[1], run(x=torch.cat([x[:1] + 1, x[1:]]))[1], atol=1e-6)
    assert heard == config.echo  # node 1 hears of node 0 through the echo alone
    assert torch.allclose(base[2], run(triples=triples[:0])[2], atol=1e-5)  # isolated: edges of others do not matter
    assert any("shape_time_emb" in key for key, _ in net.named_parameters()) == (config.echo and config.time_in_echo)


def test_packed_maps_are_those_that_were_trained() -> None:
    torch.manual_seed(0)
    net = UNet(1, CONFIG.layout).eval()
    with torch.no_grad():
        for parameter in net.parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    state = torch.randn(5, 8), net.embed_time(torch.full((5,), 300)), torch.randn(5, CONFIG.layout.context)
    with torch.inference_mode():
        assert torch.allclose(packed(net).denoise(*state), net.denoise(*state), rtol=1e-4, atol=1e-4)


def test_isolated_nodes_and_missing_edges_work() -> None:
    model = _model()
    bare = SceneGraphTensors(torch.tensor([1]), torch.zeros(0, 3, dtype=torch.int64), torch.randn(1, 12))
    latent, edges = model.encode(bare)
    assert latent.shape == (1, 16)
    assert edges.shape == (0, 16)
    assert torch.isfinite(model.sample_layout(bare, generator=torch.Generator()).size).all()


def test_two_hundred_nodes_work() -> None:
    graph = _graph([1] * 198, [[i, 1, i + 1] for i in range(197)])
    model = _model()
    nodes = model.conditions(graph)[0]
    with torch.inference_mode():
        noise = model.layout_net(torch.randn(200, 8), nodes, graph.triples, torch.full((200,), 10))
    assert torch.isfinite(noise).all()


def _nan() -> torch.Tensor:
    text = BED.node_text.clone()
    text[2, 0] = torch.nan
    return text


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"classes": torch.tensor([1, 99, 7, 6, 0])}, r"class of node 1 is 99, allowed: 0\.\.13"),
        ({"classes": torch.tensor([1, -1, 7, 6, 0])}, r"class of node 1 is -1, allowed: 0\.\.13"),
        ({"triples": BED.triples + torch.tensor([0, 15, 0])}, r"predicate of triplet 0 is 20, allowed: 0\.\.15"),
        ({"triples": BED.triples + torch.tensor([9, 0, 0])}, r"subject of triplet 0 is 10, allowed: 0\.\.4"),
        ({"node_text": _nan()}, r"text feature of node 2 is not finite"),
        ({"node_text": torch.zeros(5, 3)}, r"text features of nodes are \(5, 3\), expected \(5, 12\)"),
        ({"classes": torch.zeros(0, dtype=torch.int64)}, r"graph has no nodes"),
    ],
)
def test_bad_graphs_are_named(changes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _model().sample_layout(replace(BED, **changes), generator=torch.Generator())


def test_bad_conditions_are_named() -> None:
    model = _model()
    with pytest.raises(ValueError, match="the paper preset needs text features on edges"):
        _model(_paper()).conditions(replace(BED, edge_text=None))
    model.statistics = None
    with pytest.raises(ValueError, match="box statistics are missing: convert the checkpoint with --bounds FILE"):
        model.sample_layout(BED, generator=torch.Generator())
    with pytest.raises(ValueError, match="more than 1 value per channel when training"):
        TripletGCN(4, 4, 8, 2, 4).train()(torch.zeros(1, 4), torch.zeros(0, 4), torch.zeros(0, 2, dtype=torch.int64))


class _Text:
    name, width = "lengths", 12

    def __call__(self, texts: Sequence[str]) -> torch.Tensor:
        return torch.tensor([[float(len(text))] * 12 for text in texts]).reshape(-1, 12)


def test_a_labelled_graph_gets_floor_scene_and_texts() -> None:
    classes = vocabulary().coarse_categories
    triples = torch.tensor([[1, 5, 0], [0, 1, 2]])
    scene = published_scene(["bed", "nightstand"], triples, classes=classes, text=_Text(), edges=True)
    assert scene.classes.tolist() == [1, 8, 6, 0]
    assert scene.triples.tolist() == [[1, 5, 0], [0, 1, 2], [0, 0, 3], [1, 0, 3], [2, 0, 3]]
    assert scene.node_text[:, 0].tolist() == [len(word) for word in ("bed", "nightstand", "floor", "room")]
    assert scene.edge_text[0, 0] == len("nightstand close by bed")
    assert scene.edge_text[4, 0] == len("floor in room")
    _model().conditions(scene)
    alone = published_scene(["bed"], torch.zeros(0, 3), classes=classes, text=_Text())
    assert alone.triples.tolist() == [[0, 0, 2], [1, 0, 2]]
    for labels, related, message in (
        (["bed", "spaceship"], [[0, 1, 1]], r"label of node 1 is 'spaceship', allowed: bed, bookshelf"),
        (["floor"], [], r"label of node 0 is 'floor'"),
    ):
        with pytest.raises(ValueError, match=message):
            published_scene(labels, torch.tensor(related), classes=classes, text=_Text())


def test_bounds_file(tmp_path) -> None:
    path = tmp_path / "bounds.txt"
    path.write_text("\n".join(map(str, BOUNDS)))
    assert read_bounds(path) == statistics_from_bounds(BOUNDS)
    path.write_text("1 2 3")
    with pytest.raises(ValueError, match=r"bounds\.txt: box bounds: 3 numbers, expected 14"):
        read_bounds(path)


def test_meshes_of_grids_fill_their_boxes() -> None:
    axis = (np.arange(64) + 0.5) / 64 - 0.5
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    grid = np.maximum.reduce([abs(x) - 0.3, abs(y) - 0.2, abs(z) - 0.4]).clip(-0.2, 0.2).astype(np.float32)
    mesh = mesh_from_grid(grid)
    assert mesh.is_watertight
    assert mesh.volume > 0
    box = np.array([1.0, 2.0, 0.5, 3.0, 0.1, -1.0, 0.0])
    placed = fit_to_box(mesh.vertices, box, centre_first=False)
    assert np.allclose(placed.max(0) - placed.min(0), box[:3])
    assert np.allclose([(placed[:, 0].max() + placed[:, 0].min()) / 2, placed[:, 1].min()], box[3:5])
    with pytest.raises(ValueError, match=r"it never crosses 0\.02"):
        mesh_from_grid(np.ones((8, 8, 8)))
    with pytest.raises(ValueError, match="extent along y is 0, it cannot fill a box"):
        fit_to_box(np.array([[0.0, 0, 0], [1, 0, 1]]), box)
    flat = fit_to_box(mesh.vertices, np.array([1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    assert np.ptp(flat[:, 1]) == 0  # a box without height is a sheet


def test_point_set_metrics() -> None:
    generator = torch.Generator().manual_seed(0)
    sets = torch.randn(6, 40, 3, generator=generator)
    same = compare_sets(sets, sets)
    assert same["mmd"] == 0
    assert same["cov"] == 1
    apart = compare_sets(sets, sets + 10)
    assert apart["acc"] == 1
    assert apart["cov"] < 1
    big = torch.randn(2, 3000, 3, generator=generator)
    assert float(chamfer(big[0], big)[0]) == 0 < float(chamfer(big[0], big)[1])
    with pytest.raises(ValueError, match="not finite"):
        compare_sets(sets / 0, sets)
    with pytest.raises(ValueError, match="0 samples and 6 references"):
        compare_sets(sets[:0], sets)


def test_vertex_points() -> None:
    points = vertex_points(trimesh.creation.icosphere().vertices * 3 + 5, 100)
    assert points.shape == (100, 3)
    assert float(points.abs().max()) == 1.0
    assert vertex_points(np.eye(3), 50).shape == (50, 3)
    with pytest.raises(ValueError, match="no vertices"):
        vertex_points(np.zeros((0, 3)))
    with pytest.raises(ValueError, match="all its vertices in one place"):
        vertex_points(np.ones((4, 3)))
