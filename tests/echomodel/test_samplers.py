"""One sweep over all samplers: right distribution, known nodes, seeds, progress, bad arguments."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from echomodel.config import Objective, Sampler
from echomodel.samplers import SAMPLERS, Predict, alpha_sigma, clean_from, expand, sample
from echomodel.training.layout_losses import add_noise, output_from, target

MEAN, SPREAD = 0.7, 0.4
SWEEP = [(s, o) for s in SAMPLERS for o in ("noise", "velocity", "flow")]


def gaussian_denoiser(objective: Objective) -> Predict:
    """The exact posterior mean when the data are normal with MEAN and SPREAD."""

    def predict(x: Tensor, level: Tensor) -> Tensor:
        alpha, sigma = alpha_sigma(expand(level, x), objective)
        gain = alpha * SPREAD**2 / (alpha**2 * SPREAD**2 + sigma**2)
        return MEAN + gain * (x - alpha * MEAN)

    return predict


def start(count: int = 6000, seed: int = 0) -> Tensor:
    return torch.randn(count, 2, generator=torch.Generator().manual_seed(seed))


@pytest.mark.parametrize(("sampler", "objective"), SWEEP)
def test_reaches_the_data_distribution(sampler: Sampler, objective: Objective) -> None:
    generator = torch.Generator().manual_seed(1)
    out = sample(sampler, gaussian_denoiser(objective), start(3000), 400, objective, generator=generator)
    assert out.mean().item() == pytest.approx(MEAN, abs=0.03)
    assert out.std().item() == pytest.approx(SPREAD, rel=0.06)


@pytest.mark.parametrize(("sampler", "objective"), SWEEP)
def test_known_nodes_stay_and_are_shown_at_level_zero(sampler: Sampler, objective: Objective) -> None:
    known = torch.full((8, 2), 3.0)
    mask = torch.arange(8) % 2 == 0
    seen = []

    def predict(x: Tensor, level: Tensor) -> Tensor:
        seen.append((x[mask].clone(), level))
        return gaussian_denoiser(objective)(x, level)

    done: list[tuple[int, int]] = []
    out = sample(
        sampler, predict, start(8), 5, objective, known=known, known_mask=mask,
        generator=torch.Generator().manual_seed(0), progress=lambda *a: done.append(a),
    )  # fmt: skip
    assert torch.equal(out[mask], known[mask])
    assert all(torch.equal(x, known[mask]) and not level[mask].any() and level[~mask].all() for x, level in seen)
    assert not torch.isclose(out[~mask], torch.tensor(3.0)).any()
    assert done == [(i, 5) for i in range(1, 6)]


@pytest.mark.parametrize(("sampler", "objective"), SWEEP)
def test_equal_seeds_give_equal_bits(sampler: Sampler, objective: Objective) -> None:
    generators = [torch.Generator().manual_seed(seed) for seed in (5, 5, 6)]
    runs = [sample(sampler, gaussian_denoiser(objective), start(16), 7, objective, generator=g) for g in generators]
    assert torch.equal(runs[0], runs[1])
    assert torch.equal(runs[0], runs[2]) is (sampler != "ancestral")


@pytest.mark.parametrize("objective", ["noise", "velocity", "flow"])
def test_a_low_temperature_draws_nearer_to_the_middle(objective: Objective) -> None:
    spreads, middles = [], []
    for temperature in (1.0, 0.5, 0.0):
        generator, predict = torch.Generator().manual_seed(1), gaussian_denoiser(objective)
        out = sample("ancestral", predict, start(3000), 50, objective, generator=generator, temperature=temperature)
        spreads.append(out.std().item())
        middles.append(out.mean().item())
    assert spreads[0] > 1.2 * spreads[1] > 1.4 * spreads[2]
    assert middles == pytest.approx([MEAN] * 3, abs=0.03)


@pytest.mark.parametrize("objective", ["noise", "velocity", "flow"])
def test_targets_and_clean_samples_are_inverse(objective: Objective) -> None:
    generator = torch.Generator().manual_seed(2)
    clean, noise = torch.randn(2, 9, 3, generator=generator, dtype=torch.float64)
    level = torch.linspace(0.1, 0.9, 9, dtype=torch.float64)
    noisy, output = add_noise(clean, noise, level, objective), target(clean, noise, level, objective)
    torch.testing.assert_close(clean_from(output, noisy, level, objective), clean)
    torch.testing.assert_close(output_from(clean, noisy, level, objective), output)


def test_bad_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="sampler is 'heun', allowed: ddim, ancestral"):
        sample("heun", gaussian_denoiser("flow"), start(4), 5, "flow")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="steps is 0, at least 1"):
        sample("ddim", gaussian_denoiser("flow"), start(4), 0, "flow")
