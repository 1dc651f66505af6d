"""An echo over appearance beside the table of harmonies: colours of a room's roles denoised, each hearing the others.

    python benchmarks/appearance.py held-out [--folds 2]
    python benchmarks/appearance.py rooms LOT FOLDER --count 8

A role is a column of `harmonies.toml` (wall, floor, wood, cloth ...), its colour three numbers of OKLab; the network of
two layers of attention over the roles learns from our own twenty harmonies and mixtures of two. `held-out`: four of
them are kept from it, of each half of the roles is told; mean distance of the others in OKLab, beside the same network
whose roles hear nobody, the row of the table that is nearest in what is told, and the mean of all rows. `rooms` draws
each room in a row of the table and in a harmony of the network's, for `pairs.py shuffle` (ours = the network's).
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from room_sheets import drawn_by_lot, graphs_of

from echousd import generate
from echousd.assets.colors import oklab
from echousd.shapes.finishes.baking import hexadecimal
from echousd.shapes.finishes.slots import HARMONIES
from echousd.srgb import of_hexadecimal

ROLES = list(HARMONIES["oak"])
TABLE = np.array([[oklab(np.array([of_hexadecimal(word)]))[0] for word in row.values()] for row in HARMONIES.values()])
MEAN, STD = TABLE.mean(0), TABLE.std(0) + 0.02
STEPS, BATCH, DRAWS, TIMES = 2500, 64, 16, 24
# From OKLab to linear RGB.
CONES = np.linalg.inv(
    [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
     [0.0259040371, 0.7827717662, -0.8086757660]]
)  # fmt: skip
LINEAR = np.linalg.inv(
    [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
     [0.0883024619, 0.2817188376, 0.6299787005]]
)  # fmt: skip


class Net(torch.nn.Module):
    """Colours without noise from noisy ones (n, roles, 3) at times (n,); `alone`: no role hears another."""

    def __init__(self, alone: bool, wide: int = 48) -> None:
        super().__init__()
        self.role = torch.nn.Parameter(0.1 * torch.randn(len(ROLES), wide))
        self.color, self.time = torch.nn.Linear(3, wide), torch.nn.Linear(8, wide)
        kind = {"dropout": 0.1, "batch_first": True, "norm_first": True}
        self.layers = torch.nn.ModuleList(
            [torch.nn.TransformerEncoderLayer(wide, 4, 2 * wide, **kind) for _ in range(2)]
        )
        self.out = torch.nn.Linear(wide, 3)
        self.deaf = ~torch.eye(len(ROLES), dtype=torch.bool) if alone else None

    def forward(self, x: torch.Tensor, t: torch.Tensor) -> torch.Tensor:
        waves = t[:, None] * torch.exp(torch.linspace(0, 4, 4))
        h = self.color(x) + self.role + self.time(torch.cat([torch.sin(waves), torch.cos(waves)], 1))[:, None]
        for layer in self.layers:
            h = layer(h, src_mask=self.deaf)
        return self.out(h)


def trained(rows: np.ndarray, seed: int, *, alone: bool = False, steps: int = STEPS) -> Net:
    """The network after so many steps on some rows of the table."""
    torch.manual_seed(seed)
    net, data = Net(alone), torch.tensor((TABLE[rows] - MEAN) / STD, dtype=torch.float32)
    optimizer = torch.optim.AdamW(net.parameters(), 2e-3, weight_decay=1e-2)
    for step in range(steps):
        first, second = (data[torch.randint(len(data), (BATCH,))] for _ in range(2))
        share = 0.35 * torch.rand(BATCH, 1, 1)  # a little of a second harmony
        x = first * (1 - share) + second * share + 0.05 * torch.randn_like(first)
        t = torch.rand(BATCH)
        angle = (t * np.pi / 2)[:, None, None]
        loss = ((net(torch.cos(angle) * x + torch.sin(angle) * torch.randn_like(x), t) - x) ** 2).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        optimizer.param_groups[0]["lr"] = 2e-3 * (1 - step / steps)
    return net.eval()


@torch.no_grad()
def drawn(net: Net, told: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(`DRAWS`, roles, 3) OKLab of draws in which the `known` roles have the colours that are `told`."""
    torch.manual_seed(0)
    z, held = torch.tensor((told - MEAN) / STD, dtype=torch.float32), torch.tensor(known)[:, None]
    x = torch.randn(DRAWS, *z.shape)
    for now, then in zip(np.linspace(1, 0, TIMES + 1)[:-1], np.linspace(1, 0, TIMES + 1)[1:], strict=True):
        sin, cos = np.sin(now * np.pi / 2), np.cos(now * np.pi / 2)
        x = torch.where(held, cos * z + sin * torch.randn_like(x), x)
        clean = net(x, torch.full((DRAWS,), float(now)))
        x = np.cos(then * np.pi / 2) * clean + np.sin(then * np.pi / 2) * (x - cos * clean) / max(sin, 1e-3)
    return x.numpy() * STD + MEAN


def held_out(folds: int) -> None:
    """Print the distances."""
    luck = np.random.default_rng(0)
    order, found = luck.permutation(len(TABLE)), dict[str, list[float]]()
    for fold in range(folds):
        test = order[4 * fold : 4 * fold + 4]
        rest = np.setdiff1d(order, test)
        nets = {"hears": trained(rest, fold), "deaf": trained(rest, fold, alone=True)}
        for truth, known in ((TABLE[row], luck.random(len(ROLES)) < 0.5) for row in np.repeat(test, 3)):
            near = rest[np.argmin(((TABLE[rest] - truth)[:, known] ** 2).sum((1, 2)))]
            guesses = {word: drawn(net, truth, known).mean(0) for word, net in nets.items()}
            guesses |= {"nearest row": TABLE[near], "mean": TABLE[rest].mean(0)}
            for word, guess in guesses.items():
                found.setdefault(word, []).append(float(np.linalg.norm((guess - truth)[~known], axis=1).mean()))
        print(fold, {word: round(float(np.mean(values)), 4) for word, values in found.items()}, flush=True)


def rooms(lot: int, folder: Path, count: int) -> None:
    """Each room in a row of the table, and in a harmony that nobody told the network anything of."""
    table = list(HARMONIES)
    draws = drawn(trained(np.arange(len(TABLE)), 7, steps=900), MEAN, np.zeros(len(ROLES), bool))
    for number, colors in enumerate(np.clip((draws @ CONES.T) ** 3 @ LINEAR.T, 0, 1)[:count]):
        HARMONIES[f"drawn_{number}"] = dict(zip(ROLES, (hexadecimal(tuple(color)) for color in colors), strict=True))
    folder.mkdir(parents=True, exist_ok=True)
    graphs = list(graphs_of(["samples", "people", "more"]))
    for number, (name, graph, seed) in enumerate(drawn_by_lot(graphs, count, lot)):
        for who, palette in (("theirs", table[(7 * number + 3) % len(table)]), ("ours", f"drawn_{number}")):
            root = generate(graph, seed=seed, palette=palette).save(folder / f"{who}_{number}")
            Image.open(root.with_suffix(".png")).save(folder / f"{who}_{number}.png")
        print(number, name, seed, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    steps = parser.add_subparsers(dest="step", required=True)
    steps.add_parser("held-out").add_argument("--folds", type=int, default=2)
    step = steps.add_parser("rooms")
    step.add_argument("lot", type=int)
    step.add_argument("folder", type=Path)
    step.add_argument("--count", type=int, default=8)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    if asked.step == "rooms":
        rooms(asked.lot, asked.folder, asked.count)
    else:
        held_out(asked.folds)


if __name__ == "__main__":
    main()
