"""Autoencoder and shape denoiser: PCA, patches, echoes and the paper's ablations as switches."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.shape import Autoencoder, from_patches, to_patches
from echomodel.config import CompactConfig, from_dict
from echomodel.graph import GraphBatch

STATISTICS = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)
SHAPE = {"width": 16, "layers": 1, "heads": 2, "echo_width": 16, "components": 24, "tokens": 3}


def small_model(**shape: object) -> CompactModel:
    torch.manual_seed(0)
    raw = {"latent": {"width": 8}, "layout": {"width": 16, "layers": 1, "drafts": 0}, "shape": {**SHAPE, **shape}}
    model = CompactModel(from_dict(CompactConfig, raw), STATISTICS, ("latent", "autoencoder", "shape"))
    for parameter in model.parameters():
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.1)
    return model.eval()


def spheres(count: int = 3) -> Tensor:
    axis = (torch.arange(64) + 0.5) / 64 - 0.5
    x, y, z = torch.meshgrid(axis, axis, axis, indexing="ij")
    return torch.stack([((x**2 + y**2 * (1 + k) + z**2).sqrt() - 0.4) * 16 for k in range(count)]).clamp(-1, 1)


def denoise(model: CompactModel, x: Tensor, level: Tensor, graph: GraphBatch) -> Tensor:
    pairs = pairs_of(graph)
    context = model.shape.context(graph, torch.ones(len(x), 3), pairs, model.latent(graph.category, pairs))
    return model.shape(x, level, context)


def test_patches_there_and_back() -> None:
    grids = torch.randn(2, 8, 12, 16)
    patches = to_patches(grids, 4)
    assert patches.shape == (2, 64, 2, 3, 4)
    assert torch.equal(patches[0, :, 1, 2, 3], grids[0, 4:8, 8:12, 12:16].flatten())
    assert torch.equal(from_patches(patches, 4), grids)


def test_untrained_autoencoder_is_the_pca_of_patches() -> None:
    grids, config = spheres(), CompactConfig()
    coder = Autoencoder(config)
    coder.initialise(grids)
    rows = to_patches(grids, 4).flatten(2).transpose(1, 2).reshape(-1, 64).double()
    mean = rows.mean(0)
    _, _, basis = torch.linalg.svd(rows - mean, full_matrices=False)
    basis = basis[: config.autoencoder.channels]
    expected = ((rows - mean) @ basis.T @ basis + mean).float().clamp(-1, 1)
    rebuilt = to_patches(coder(grids), 4).flatten(2).transpose(1, 2).reshape(-1, 64)
    torch.testing.assert_close(rebuilt, expected, rtol=1e-3, atol=1e-4)
    latent = coder.encode(grids)
    assert latent.shape == (3, config.autoencoder.channels, 16, 16, 16)
    assert latent.square().mean().item() == pytest.approx(1.0, rel=1e-3)


def test_codes_are_the_principal_components_of_latents() -> None:
    """Latents that vary in few directions come back exactly; codes have unit power and fall in spread."""
    model = small_model()
    g = torch.Generator().manual_seed(0)
    directions = torch.randn(5, 6 * 16**3, generator=g)
    mixed = torch.randn(40, 5, generator=g) * torch.tensor([9.0, 4.0, 2.0, 1.0, 0.5])
    latents = (mixed @ directions / 50 + 0.3).reshape(40, 6, 16, 16, 16)
    model.shape.initialise(latents, g)
    codes = model.shape.codes(latents)
    torch.testing.assert_close(model.shape.latents(codes), latents, rtol=1e-3, atol=1e-3)
    spread = codes.std(0)
    assert bool((spread[:4] > spread[1:5]).all())
    assert spread[5:].max() < 0.05 * spread[0]
    basis = model.shape.basis[:5]
    torch.testing.assert_close(basis @ basis.T, torch.eye(5), rtol=0, atol=1e-3)


def test_objects_hear_of_each_other_only_with_echoes() -> None:
    graph = GraphBatch.single([4, 4, 8], [[0, 13, 1]])
    x = torch.randn(3, 24)
    other = x.clone()
    other[1] += 1.0
    for echo, heard in ((True, True), (False, False)):
        with torch.no_grad():
            model = small_model(echo=echo)
            change = (denoise(model, x, torch.ones(3), graph) - denoise(model, other, torch.ones(3), graph))[0]
        assert (change.abs().max() > 1e-6).item() is heard


def test_time_reaches_the_echo() -> None:
    graph, x = GraphBatch.single([4, 8], [[0, 13, 1]]), torch.randn(2, 24)
    with torch.no_grad():
        model = small_model()
        outs = [denoise(model, x, torch.tensor([0.5, level]), graph)[0] for level in (0.2, 0.9)]
    assert (outs[0] - outs[1]).abs().max() > 1e-6


def test_a_batch_is_its_single_runs() -> None:
    model = small_model()
    graphs = [GraphBatch.single([4, 8, 9], [[0, 13, 1], [1, 8, 2]]), GraphBatch.single([3]), GraphBatch.single([1, 1])]
    x, level = torch.randn(6, 24), torch.rand(6)
    with torch.no_grad():
        together = denoise(model, x, level, GraphBatch.pack(graphs))
        start = 0
        for graph in graphs:
            part = slice(start, start + graph.num_nodes)
            alone = denoise(model, x[part], level[part], graph)
            torch.testing.assert_close(alone, together[part], rtol=1e-4, atol=1e-5)
            start += graph.num_nodes


def test_gradients_reach_the_latent_graph() -> None:
    model, graph = small_model(), GraphBatch.single([4, 8, 9], [[0, 13, 1]])
    denoise(model, torch.randn(3, 24), torch.ones(3), graph).square().sum().backward()
    assert all(
        parameter.grad is not None and parameter.grad.abs().sum() > 0
        for name, parameter in model.latent.named_parameters()
        if name != "touched"
    )
