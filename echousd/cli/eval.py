"""`echousd eval`: systems that lay out rooms, scored by one protocol (`suite`), and studies with people."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from echomodel.files import check_free
from echousd.cli.options import Replace, Written, documented_command
from echousd.cli.output import say_done, say_found

eval_app = typer.Typer(help="Scores of whoever lays out rooms, and studies with people.", no_args_is_help=True)
app = typer.Typer()
app.add_typer(eval_app, name="eval")
Against = Annotated[
    str, typer.Option(help="Rooms of any source, of a set those held out; generated: held-out rooms of the generator.")
]
Count = Annotated[int, typer.Option(help="Rooms that every system lays out.", min=2)]
Seed = Annotated[int, typer.Option(help="Seed of every draw.")]


@documented_command(eval_app, "eval suite")
def suite(
    systems: list[str] | None = None, against: Against = "generated", out: Path = Path("report"), only: str = "",
    count: Count = 24, seed: Seed = 0, relations: float = 1.0, shapes: Path | None = None,
    inception: Path | None = None, clip: Path | None = None, workers: int = 2, force: Replace = False,
    json: Written = False,
) -> None:  # fmt: skip
    """Ask systems the same rooms, score them beside chance and plain baselines, and write a report."""
    from echousd.cli.progress import progress_bar
    from echousd.evaluation.runs import SYSTEMS, SuiteSettings
    from echousd.evaluation.suite import evaluate, report_files, write_report

    for path in report_files(out):
        check_free(path, force=force)
    chosen = tuple(word.strip() for word in only.split(",") if word.strip())
    asked = tuple(systems) if systems else SYSTEMS
    files = {"shapes": shapes, "inception": inception, "clip": clip}
    named: dict[str, Any] = {name: str(path) for name, path in files.items() if path}
    settings = replace(SuiteSettings(asked, against, count, seed, chosen, relations, workers=workers), **named)
    command = f"echousd eval suite {' '.join(asked)} --against {against} --count {count} --seed {seed}"
    command += f" --relations {relations:g}" * (relations != 1.0) + f" --only {','.join(chosen)}" * bool(chosen)
    command += "".join(f" --{name} {path}" for name, path in named.items())
    with progress_bar() as progress:
        found, run = evaluate(settings, progress)
    written = write_report(found, run, out, command)
    say_done(json, written, map(str, written))


@documented_command(eval_app, "eval study")
def study(
    systems: list[str], out: Path = Path("study.html"), against: Against = "generated", count: Count = 12,
    seed: Seed = 0, force: Replace = False, json: Written = False,
) -> None:  # fmt: skip
    """Write a page that shows people pairs of rooms and records which they prefer, offline."""
    from echousd.cli.progress import progress_bar
    from echousd.evaluation.suite import write_study

    check_free(out, force=force)
    with progress_bar() as progress:
        path = write_study(systems, against, count, seed, out, progress)
    say_done(json, [path], [str(path)])


@documented_command(eval_app, "eval answers")
def answers(files: list[Path], json: bool = False) -> None:
    """Say whom people preferred: shares with intervals, an exact test of each pair of systems, and agreement."""
    from echousd.evaluation.suite import preferences

    found = preferences(files)
    lines = [
        f"{row['one']} over {row['other']}: {row['preferred']} of {row['asked']} "
        f"({row['share']:.2f} [{row['low']:.2f}, {row['high']:.2f}], p {row['p']:.3f}), {row['ties']} undecided"
        for row in found["pairs"]
    ]
    people = f"{found['people']} people, {found['kept']} kept; repeats answered alike: {found['repeats']}"
    say_found(json, found, [*lines, people])
