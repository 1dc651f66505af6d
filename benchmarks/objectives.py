"""What the layout branch should predict: noise, velocity or flow, trained alike and scored on held-out rooms.

    python benchmarks/objectives.py DATA [--steps 1200] [--objectives noise,velocity,flow] [-o runs/objectives]

DATA is a folder of `echousd data build`. Each objective is trained by model/recipes/latent.toml for as many steps from
the same seed, then samples the same held-out rooms, without guidance. Losses of different targets cannot be compared;
the share of relations kept (both rule sets) and the error of the sizes can.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import torch

from echomodel.compact.model import CompactModel
from echomodel.samplers import SAMPLERS
from echomodel.training.recipe import read_recipe
from echomodel.training.run import open_run

RECIPE = Path(__file__).parents[1] / "model" / "recipes" / "latent.toml"


def scores(stage: object, model: CompactModel, sampler: str, steps: int, rooms: int) -> str:
    """Share of relations kept per rule set, close_by, and the error of the log sizes."""
    config = replace(model.config, layout=replace(model.config.layout, sampler=sampler, steps=steps))
    usual, model.config = model.config, config  # type: ignore[assignment]
    try:
        found = stage.validate(model, rooms)  # type: ignore[attr-defined]
    finally:
        model.config = usual
    return "  ".join(
        f"{rules}: kept {found[f'{rules}/all']:.3f}, close_by {found.get(f'{rules}/close_by', float('nan')):.3f}, "
        f"log size error {found[f'{rules}/log_size_error']:.3f}"
        for rules in config.rules
    )


def main() -> None:
    """Train and print one line per objective, sampler and number of steps."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--objectives", default="noise,velocity,flow")
    parser.add_argument("--sampling", default="5,10,20,50")
    parser.add_argument("--samplers", default="ddim,ancestral")
    parser.add_argument("--rooms", type=int, default=96)
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/objectives"))
    options = parser.parse_args()
    for objective in options.objectives.split(","):
        settings = [
            f"data={options.data}", f"steps={options.steps}", "frozen=[]",
            f"model.layout.objective={objective}",
            f"optimizer.cooldown={options.steps // 4}", f"validate_every={10**9}", "save_every=200",
            f"optimizer.warmup={min(300, options.steps // 4)}", "optimizer.average=0.99",
        ]  # fmt: skip
        folder = options.out / objective
        resume = (folder / "checkpoint.safetensors").exists()

        def report(step: int, values: dict[str, float], name: str = objective) -> None:
            if "loss" in values:
                print(f"{name}: step {step}, loss {values['loss']:.3f}, gradient {values['norm']:.2f}", flush=True)

        trainer = open_run(read_recipe(RECIPE, settings), folder, resume=resume, report=report)
        trainer.run()
        with torch.no_grad():
            for sampler in options.samplers.split(","):
                if sampler not in SAMPLERS:
                    parser.error(f"sampler {sampler!r}, allowed: {', '.join(SAMPLERS)}")
                for steps in map(int, options.sampling.split(",")):
                    line = scores(trainer.stage, trainer.average, sampler, steps, options.rooms)  # type: ignore[arg-type]
                    print(f"{objective:9} {sampler:9} {steps:3d} steps  {line}", flush=True)


if __name__ == "__main__":
    main()
