"""What parts of the layout branch are worth: each left out of a training at an equal budget, three seeds, 400 rooms.

    python benchmarks/ablations.py -o runs/ablations [--steps 800] [--seeds 1 2 3] [--only full echo] [--rooms 400]

A branch of a fifth of the shipped numbers learns from the beginning on the latent graph that ships, on the rooms of
`recipes/rooms/searched.npz`, once whole and once without each of

* `echo`: every object alone in the branch; what is told still reaches it through the latent graph
* `pairs`, `walls`: the network is not told how a draft's pairs stand, or its gaps to walls, doors and windows
* `margins`: no hinge on relations, collisions and walls in the loss
* `search`: as many rooms of the generator as they come, in place of those that a search left without a fault.

Each run is judged by one draw of rooms that no training used, one near relation an object told. Differences to `full`
are of the same rooms and seed; intervals of 95 % by bootstrap over rooms and, within it, seeds. Complete runs are kept,
so that the same command goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from drafts import ROWS, generated, judged
from torch import Tensor

from echomodel.compact.layout import Layout, measured
from echomodel.compact.model import CompactModel, load_weights
from echomodel.data.roomset import RoomSet, kept_out, pack_rooms
from echomodel.files import SHIPPED
from echomodel.metrics.layouts import Task, tasks_of
from echomodel.rooms.generator import generate_rooms
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.recipe import OptimizerConfig, Recipe
from echomodel.training.rooms import PackedRooms
from echomodel.training.trainer import Trainer

SEARCHED = Path(__file__).parents[1] / "model" / "recipes" / "rooms" / "searched.npz"
WIDTH, LAYERS = 96, 6
GENERATED = 5_000_000  # seed of the rooms that nobody searched
DRAWS = 4000  # of the bootstrap
POWER = 2.8  # standard errors that a difference needs to be found in four of five trials, at 5 %


@dataclass(frozen=True)
class Without:
    """What a run leaves out: fields of the recipe, whether objects hear one another, what is told of a draft."""

    recipe: tuple[tuple[str, float], ...] = ()
    echo: bool = True
    silent: frozenset[str] = frozenset()
    searched: bool = True


RUNS = {
    "full": Without(),
    "echo": Without(echo=False),
    "pairs": Without(silent=frozenset({"pairs"})),
    "walls": Without(silent=frozenset({"walls", "openings"})),
    "margins": Without(recipe=(("relation_weight", 0.0), ("physics_weight", 0.0))),
    "search": Without(searched=False),
}


def telling(silent: frozenset[str]) -> Callable[..., tuple[Tensor, ...]]:
    """`measured`, with zeros in place of what the network is not told."""

    def told(*arguments: Any) -> tuple[Tensor, ...]:
        names = ("walls", "openings", "pairs")
        return tuple(of * (name not in silent) for name, of in zip(names, measured(*arguments), strict=True))

    return told


class Silent:
    """The layers between drafts hear less while a `with` lasts; losses measure everything."""

    def __init__(self, silent: frozenset[str]) -> None:
        self.told, self.usual = telling(silent), Layout._measure

    def __enter__(self) -> None:
        told, usual = self.told, self.usual

        def measure(layout: Layout, clean: Tensor, context: Any) -> Any:
            before = layout.measure
            layout.measure = told
            found = usual(layout, clean, context)
            layout.measure = before
            return found

        Layout._measure = measure

    def __exit__(self, *_: object) -> None:
        Layout._measure = self.usual


@cache
def rooms_of(searched: bool, folder: Path) -> tuple[PackedRooms, PackedRooms]:
    """Rooms to train on, of the search or of the generator, and held-out ones."""
    source = SEARCHED
    if not searched:
        source = folder / "generated.npz"
        if not source.exists():
            count = len(RoomSet(SEARCHED))
            held = kept_out(np.arange(count)).tolist()
            pack_rooms(source, generate_rooms(count, GENERATED), held, {"kind": "rooms", "seed": GENERATED})
    rules = load_weights([SHIPPED / "layout.safetensors"])[0].config.rules
    rooms = RoomSet(source)
    return PackedRooms.from_set(rooms, rules, held=False), PackedRooms.from_set(rooms, rules, held=True)


def trained(name: str, seed: int, steps: int, folder: Path) -> Path:
    """The weights of a run, trained unless they are there."""
    weights = folder / f"{name}-{seed}" / "weights.safetensors"
    if weights.exists():
        return weights
    what, shipped = RUNS[name], load_weights([SHIPPED / "layout.safetensors"])[0]
    layout = replace(shipped.config.layout, width=WIDTH, layers=LAYERS, echo=what.echo)
    config = replace(shipped.config, layout=layout)
    rate = OptimizerConfig(rate=2e-3, schedule="trapezoid", warmup=40, cooldown=steps * 5 // 8, average=0.99)
    recipe = Recipe(
        stage="layout", steps=steps, seed=seed, nodes=512, frozen=("latent",), relation_weight=10.0, measure_weight=2.0,
        physics_weight=4.0, validate_every=10**9, save_every=10**9, log_every=100, optimizer=rate, model=config,
    )  # fmt: skip
    recipe = replace(recipe, **dict(what.recipe))
    torch.manual_seed(seed)
    model = CompactModel(config, shipped.statistics, LayoutStage.saved)
    model.latent.load_state_dict(shipped.latent.state_dict())
    with Silent(what.silent):
        stage = LayoutStage(*rooms_of(what.searched, folder), recipe)
        stage.validate = lambda model: {}
        Trainer(recipe, model, stage, folder / "at_work").run()
    (folder / "at_work").rename(weights.parent)
    return weights


def scores_of(name: str, seed: int, steps: int, folder: Path, tasks: list[Task]) -> np.ndarray:
    """Part and whole of `ROWS` in each room (R, 3, 2) that a run's weights draw."""
    weights = trained(name, seed, steps, folder)
    kept = weights.with_name(f"scores{len(tasks)}.npy")
    if not kept.exists():
        with Silent(RUNS[name].silent):
            np.save(kept, judged(str(weights), "alone", tasks)[0])
    return np.load(kept)


def shares(scores: np.ndarray) -> np.ndarray:
    """(3,) of scores (..., 3, 2): of all rooms and seeds."""
    total = scores.reshape(-1, 3, 2).sum(0)
    return total[:, 0] / total[:, 1]


def spread(mine: np.ndarray, full: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (2, 3) of the differences of scores (seeds, R, 3, 2), and their standard errors (3,)."""
    luck, (seeds, rooms) = np.random.default_rng(0), mine.shape[:2]
    found = []
    for _ in range(DRAWS):
        who, which = luck.integers(seeds, size=seeds)[:, None], luck.integers(rooms, size=rooms)
        found.append(shares(mine[who, which]) - shares(full[who, which]))
    return np.quantile(found, [0.025, 0.975], axis=0), np.std(found, axis=0)


def main() -> None:
    """Train and judge what is missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=800)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--only", nargs="+", choices=RUNS, default=list(RUNS))
    parser.add_argument("--rooms", type=int, default=400)
    options = parser.parse_args()
    torch.set_num_threads(1)
    options.output.mkdir(parents=True, exist_ok=True)
    rooms = [room for room in generated(options.rooms, None) if len(room) > 1]
    tasks = tasks_of(rooms, 0, stated=1.0)
    found: dict[str, list[np.ndarray]] = {}
    for seed in options.seeds:
        for name in options.only:
            found.setdefault(name, []).append(scores_of(name, seed, options.steps, options.output, tasks))
            row = zip(ROWS, shares(found[name][-1]), strict=True)
            print(f"{name} {seed}: " + ", ".join(f"{what} {value:.3f}" for what, value in row), flush=True)
    print(f"{len(tasks)} rooms, {sum(len(task.room) for task in tasks)} objects, {len(options.seeds)} seeds")
    print("| without | " + " | ".join(ROWS) + " |\n|---|---|---|---|")
    scores = {name: np.stack(of) for name, of in found.items()}
    for name, of in scores.items():
        cells = [f"{value:.3f}" for value in shares(of)]
        if name != "full" and "full" in scores:
            (low, high), error = spread(of, scores["full"])
            cells = [
                f"{cell} [{a:+.3f}, {b:+.3f}], power {POWER * e:.3f}"
                for cell, a, b, e in zip(cells, low, high, error, strict=True)
            ]
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
