"""Shape branch and autoencoder against the published ones: step, DDIM, loss and gradients, tables, full size."""

from __future__ import annotations

import pytest
import torch
from parity_configs import shape_config, vq_config
from parity_numbers import Numbers, check_gradients, close

from echoscene.config import UNetConfig
from echoscene.model import Schedule, ShapeUNet, ddim, shape_loss
from echoscene.vqvae import VQVAE


class ShapeNet(torch.nn.Module):
    """The denoiser under the prefix that the published files have."""

    def __init__(self, config: UNetConfig) -> None:
        super().__init__()
        self.diffusion_net = ShapeUNet(config)

    def forward(self, *state: torch.Tensor | None) -> torch.Tensor:
        return self.diffusion_net(*state)


def _net(numbers: Numbers) -> ShapeNet:
    return numbers.net(ShapeNet, shape_config(numbers))


def _objects(numbers: Numbers) -> torch.Tensor:
    return numbers["obj_embed"].flatten(1)


@torch.inference_mode()
def test_step() -> None:
    numbers = Numbers("shape_step")
    net = _net(numbers)
    x, triples = numbers["x"], numbers["triples"]
    embedding = net.diffusion_net.embed_time(numbers["t"])
    close(embedding, numbers["time_emb"], 1e-4)
    close(net.diffusion_net.echo(x, _objects(numbers), triples, embedding, None), numbers["echo"], 1e-4)
    close(net(x, _objects(numbers), triples, numbers["t"]), numbers["eps"], 5e-5)


@torch.inference_mode()
def test_ddim() -> None:
    numbers = Numbers("shape_ddim")
    net = _net(numbers)
    timesteps, alphas, after = grid = Schedule.scaled_linear().ddim(numbers.meta["steps"])
    assert timesteps.tolist() == numbers["timesteps"].tolist()
    close(alphas, numbers["ddim_alphas"], 1e-7)
    close(after, numbers["ddim_alphas_prev"], 1e-7)
    states = ddim(lambda x, t: net(x, _objects(numbers), numbers["triples"], t), numbers["x_T"], grid)
    for number, (_, x) in enumerate(states):
        close(x, numbers["x_steps"][number], 1e-3)
    close(x, numbers["out"], 1e-3)


def test_loss_and_gradients() -> None:
    numbers = Numbers("shape_loss")
    net = _net(numbers).train()
    objects = _objects(numbers).requires_grad_()
    tables = Schedule.scaled_linear()
    loss = shape_loss(net, numbers["z0"], objects, numbers["triples"], numbers["t"], numbers["noise"], tables)
    close(loss.detach(), numbers["loss"], 0.0, relative=1e-5)
    loss.backward()
    expected = numbers["grad_obj_embed"].flatten(1)
    close(objects.grad, expected, 1e-3 * float(expected.abs().max()))
    check_gradients(net, numbers.gradient_norms())


def test_tables() -> None:
    numbers = Numbers("shape_tables")
    tables = Schedule.scaled_linear(numbers.meta["linear_start"], numbers.meta["linear_end"])
    for name in ("betas", "alphas_cumprod", "sqrt_alphas_cumprod", "sqrt_one_minus_alphas_cumprod"):
        close(getattr(tables, name), numbers[name], 0.0, relative=2e-7)
    timesteps, alphas, after = tables.ddim(len(numbers["ddim100_timesteps"]))
    assert timesteps.tolist() == numbers["ddim100_timesteps"].tolist()
    close(alphas, numbers["ddim100_alphas"], 1e-7)
    close(after, numbers["ddim100_alphas_prev"], 1e-7)


@torch.inference_mode()
def test_step_at_full_size() -> None:
    numbers = Numbers("full_shape_step")
    net = _net(numbers)
    x, embedding = numbers["x"], net.diffusion_net.embed_time(numbers["t"])
    context = net.diffusion_net.echo(x, _objects(numbers), numbers["triples"], embedding, None)
    # Of three nodes, which hear each other in the echo alone, one is a third of the work.
    close(net.diffusion_net.denoise(x[:1], embedding[:1], context[:1]), numbers["eps"][:1], 1e-4)


@torch.inference_mode()
@pytest.mark.parametrize("name", ["vqvae", "full_vqvae"])
def test_autoencoder(name: str) -> None:
    numbers = Numbers(name)
    net = numbers.net(VQVAE, vq_config(numbers))
    z = net.encode(numbers["sdf"])
    close(z, numbers["z"], 1e-4)
    quantised, index = net.quantise(numbers["z"])[0], net.indices(numbers["z"])
    flat = numbers["z"].movedim(1, -1).reshape(-1, z.shape[1]).double()
    codes = net.quantize.embedding.weight.double()
    chosen, wanted = ((flat - codes[i]).square().sum(1) for i in (index, numbers["indices"]))
    close(chosen, wanted, 1e-6)  # another code only where both are equally near in float32
    if "z_q" in numbers:
        close(quantised, numbers["z_q"], 1e-4)
    close(net.decode(numbers["z"]), numbers["dec"], 1e-3)
    if "recon" in numbers:
        close(net(numbers["sdf"]), numbers["recon"], 1e-3)
