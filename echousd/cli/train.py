"""`echousd train`: recipes to weights."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("train")(train)


def train(
    recipe: Annotated[Path, typer.Argument(help="Recipe file (TOML), see model/recipes.")],
    settings: Annotated[list[str] | None, typer.Option("--set", help="Change a field: key.sub=value.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--output", help="The run's folder; default: runs/RECIPE.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from the folder's checkpoint.")] = False,
    minutes: Annotated[float | None, typer.Option(help="Stop (with a checkpoint) after so many minutes.")] = None,
) -> None:
    """Train a part of the echo model; a run that was stopped continues bit for bit with --resume.

    Example: echousd train model/recipes/layout.toml --set data=data/full --set steps=20000
    """
    from echomodel.training.recipe import read_recipe
    from echomodel.training.run import open_run
    from echousd.cli.terminal import Terminal

    console = Terminal(stderr=True)
    folder = out or Path("runs") / recipe.stem
    plan = read_recipe(recipe, settings)
    if not resume and (folder / "checkpoint.safetensors").exists():
        raise ValueError(f"{folder}: holds a run already, continue it with --resume or choose another --output")

    def report(step: int, values: dict[str, float]) -> None:
        console.print(f"step {step}/{plan.steps}  " + "  ".join(f"{k} {v:.4g}" for k, v in values.items()))

    trainer = open_run(plan, folder, resume=resume, report=report)
    reached = trainer.run(seconds=None if minutes is None else minutes * 60)
    console.print(f"stopped at step {reached} of {plan.steps}: {folder}/weights.safetensors")
