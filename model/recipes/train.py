"""Train a recipe on a machine that has torch, numpy, scipy and safetensors alone; nothing is installed.

    python model/recipes/train.py model/recipes/layout_draws.toml --minutes 9 -o runs/gpu

The same command again goes on.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from echomodel.training.recipe import read_recipe
from echomodel.training.run import open_run


def main() -> None:
    """Train for some minutes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the run's folder")
    parser.add_argument("--minutes", type=float, default=9.0, help="of this call, data and start included")
    options = parser.parse_args()
    began, recipe = time.monotonic(), read_recipe(options.recipe, options.set)

    def report(step: int, values: dict[str, float]) -> None:
        shown = (f"{name} {value:.4g}" for name, value in values.items())
        print(f"{time.monotonic() - began:5.0f} s  step {step} of {recipe.steps}", *shown, flush=True)

    resume = (options.output / "checkpoint.safetensors").exists()
    trainer = open_run(recipe, options.output, resume=resume, report=report)
    trainer.run(seconds=options.minutes * 60 - (time.monotonic() - began))
    print(f"{time.monotonic() - began:5.0f} s  stopped at step {trainer.step} of {recipe.steps}", flush=True)


if __name__ == "__main__":
    main()
