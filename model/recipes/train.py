"""Train a recipe on a machine that has torch, numpy, scipy and safetensors alone; nothing is installed.

    python model/recipes/train.py model/recipes/layout_draws.toml --total 28 --minutes 9 -o runs/gpu

The same command again goes on. The first call measures the rate of the steps and sets the recipe's last step so that
all calls together take `--total` minutes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from safetensors import safe_open

from echomodel.training.recipe import Recipe, read_recipe
from echomodel.training.start import open_run
from echomodel.training.trainer import Trainer

TRIAL = 20.0  # seconds over which the rate is measured


def main() -> None:
    """Train for some minutes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the run's folder")
    parser.add_argument("--minutes", type=float, default=9.0, help="of this call, data and start included")
    parser.add_argument("--total", type=float, help="minutes of all calls; default: the recipe's steps")
    options = parser.parse_args()
    began = time.monotonic()
    checkpoint, recipe = options.output / "checkpoint.safetensors", read_recipe(options.recipe, options.set)
    resume = checkpoint.exists()
    if resume and options.total:
        with safe_open(checkpoint, "pt") as handle:  # as the first call has set them
            recipe = replace(recipe, steps=int(json.loads(handle.metadata()["recipe"])["steps"]))

    def report(step: int, values: dict[str, float]) -> None:
        told = (f"{name} {value:.4g}" for name, value in values.items())
        print(f"{time.monotonic() - began:5.0f} s  step {step}", *told, flush=True)

    trainer = open_run(recipe, options.output, resume=resume, report=report)
    print(f"{time.monotonic() - began:5.0f} s  {trainer.device}, step {trainer.step} of {recipe.steps}", flush=True)
    if options.total and not resume:
        measured(trainer, recipe, options.total * 60 - (time.monotonic() - began))
    trainer.run(seconds=options.minutes * 60 - (time.monotonic() - began))
    print(f"{time.monotonic() - began:5.0f} s  stopped at step {trainer.step} of {trainer.recipe.steps}", flush=True)


def measured(trainer: Trainer, recipe: Recipe, seconds: float) -> None:
    """Set the last step by the rate of some steps, the first ones, which are slow, left out."""
    first = trainer.run(seconds=TRIAL / 2)
    rate = (trainer.run(seconds=TRIAL) - first) / TRIAL
    steps = max(2 * trainer.step, int(rate * (seconds - TRIAL)) // 10 * 10)
    print(f"{rate:.2f} steps a second: {steps} steps in all", flush=True)
    cooldown = min(recipe.optimizer.cooldown, steps // 2)
    trainer.recipe = replace(recipe, steps=steps, optimizer=replace(recipe.optimizer, cooldown=cooldown))


if __name__ == "__main__":
    main()
