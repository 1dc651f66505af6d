"""Train a recipe on a machine that has torch, numpy, scipy and safetensors alone; nothing is installed.

    python model/recipes/train.py model/recipes/layout_gpu.toml --total 28 --minutes 9 -o runs/gpu [--parts PARTS]

The same command again goes on. The first call measures the rate of the steps and sets the recipe's last step so that
all calls together take `--total` minutes. `--parts` leaves weights, log and the checkpoint in files of at most 15 MB
there, and a run folder that is empty goes on from such files.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from safetensors import safe_open
from safetensors.torch import save_file

from echomodel.training.recipe import Recipe, read_recipe
from echomodel.training.run import open_run
from echomodel.training.trainer import Trainer

PART = 15e6  # bytes
TRIAL = 20.0  # seconds over which the rate is measured


def main() -> None:
    """Train for some minutes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the run's folder")
    parser.add_argument("--minutes", type=float, default=9.0, help="of this call, data and start included")
    parser.add_argument("--total", type=float, help="minutes of all calls; default: the recipe's steps")
    parser.add_argument("--parts", type=Path, help="folder of small files that travel")
    options = parser.parse_args()
    began = time.monotonic()
    checkpoint, recipe = options.output / "checkpoint.safetensors", read_recipe(options.recipe, options.set)
    if not checkpoint.exists() and options.parts and any(options.parts.glob("checkpoint-*.safetensors")):
        joined(options.parts, checkpoint)
    resume = checkpoint.exists()
    if resume and options.total:
        recipe = replace(recipe, steps=int(said(checkpoint)["recipe"]["steps"]))

    def report(step: int, values: dict[str, float]) -> None:
        told = (f"{name} {value:.4g}" for name, value in values.items())
        print(f"{time.monotonic() - began:5.0f} s  step {step}", *told, flush=True)

    trainer = open_run(recipe, options.output, resume=resume, report=report)
    print(f"{time.monotonic() - began:5.0f} s  {trainer.device}, step {trainer.step} of {recipe.steps}", flush=True)
    if options.total and not resume:
        measured(trainer, recipe, options.total * 60 - (time.monotonic() - began))
    trainer.run(seconds=options.minutes * 60 - (time.monotonic() - began))
    print(f"{time.monotonic() - began:5.0f} s  stopped at step {trainer.step} of {trainer.recipe.steps}", flush=True)
    if options.parts:
        options.parts.mkdir(parents=True, exist_ok=True)
        split(checkpoint, options.parts)
        for name in ("weights.safetensors", "log.csv"):
            shutil.copyfile(options.output / name, options.parts / name)


def measured(trainer: Trainer, recipe: Recipe, seconds: float) -> None:
    """Set the last step by the rate of some steps, the first ones, which are slow, left out."""
    first = trainer.run(seconds=TRIAL / 2)
    rate = (trainer.run(seconds=TRIAL) - first) / TRIAL
    steps = max(2 * trainer.step, int(rate * (seconds - TRIAL)) // 10 * 10)
    print(f"{rate:.2f} steps a second: {steps} steps in all", flush=True)
    cooldown = min(recipe.optimizer.cooldown, steps // 2)
    trainer.recipe = replace(recipe, steps=steps, optimizer=replace(recipe.optimizer, cooldown=cooldown))


def said(path: Path) -> dict:
    """What a checkpoint says of itself, its recipe as JSON."""
    with safe_open(path, "pt") as handle:
        note = handle.metadata()
    return {**note, "recipe": json.loads(note["recipe"])}


def split(checkpoint: Path, folder: Path) -> None:
    """Write a checkpoint as `checkpoint-<n>.safetensors`, each of at most `PART` bytes."""
    for old in folder.glob("checkpoint-*.safetensors"):
        old.unlink()
    with safe_open(checkpoint, "pt") as handle:
        parts: list[dict] = [{}]
        size = 0
        for key in handle.keys():  # noqa: SIM118
            tensor = handle.get_tensor(key)
            bytes_ = tensor.numel() * tensor.element_size()
            if parts[-1] and size + bytes_ > PART:
                parts, size = [*parts, {}], 0
            parts[-1][key], size = tensor, size + bytes_
        for number, tensors in enumerate(parts):
            note = {**handle.metadata(), "parts": str(len(parts))}
            save_file(tensors, folder / f"checkpoint-{number}.safetensors", metadata=note)


def joined(folder: Path, checkpoint: Path) -> None:
    """The checkpoint of all parts in a folder; raises ValueError where one is missing or of another step."""
    tensors, notes = {}, []
    for path in sorted(folder.glob("checkpoint-*.safetensors")):
        with safe_open(path, "pt") as handle:
            notes.append(handle.metadata())
            tensors |= {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118
    if len({json.dumps(note, sort_keys=True) for note in notes}) > 1 or int(notes[0]["parts"]) != len(notes):
        raise ValueError(f"{folder}: holds {len(notes)} parts of checkpoints, expected {notes[0]['parts']} of one step")
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    save_file(tensors, checkpoint, metadata={key: notes[0][key] for key in ("step", "recipe")})


if __name__ == "__main__":
    main()
