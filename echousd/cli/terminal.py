"""The console that commands print on: what stands in files cannot steer the terminal; how far long work is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.text import Text

from echomodel.progress import StageListener
from echousd.cli.output import quiet, safe

TITLES = {
    "read": "Reading the graph",
    "load": "Loading the model",
    "assets": "Choosing models",
    "layout": "Drawing layouts",
    "place": "Placing the furniture",
    "shapes": "Shaping the furniture",
    "meshes": "Cleaning the meshes",
    "settle": "Simulating the room",
    "write": "Writing the layers",
    "preview": "Drawing the preview",
    "rooms": "Making the rooms",
    "models": "Reading the models",
}


LONG = 100  # steps of a stage of which a log hears every tenth part


class Terminal(Console):
    """A rich console of `safe` texts, cells of tables included, without markup unless it is asked for; or quiet."""

    def __init__(self, *, markup: bool = False, **options: Any) -> None:
        super().__init__(markup=markup, highlight=False, quiet=quiet.get(), **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """The text as rich shows it, without characters that a terminal obeys."""
        return super().render_str(safe(text), **options)


@contextmanager
def progress_bar() -> Iterator[StageListener]:
    """A bar per stage on a terminal, elsewhere a plain line per stage and for every tenth of a long one (on stderr)."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Terminal(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    tasks: dict[str, Any] = {}
    tenths: dict[str, int] = {}
    with Progress(*columns, console=console, disable=console.quiet or not console.is_terminal) as bar:

        def listen(stage: str, done: int, total: int) -> None:
            title = TITLES.get(stage, stage)
            if stage not in tasks:
                tasks[stage] = bar.add_task(title, total=total)
                if not console.is_terminal:
                    console.print(title)
            bar.update(tasks[stage], completed=done, total=total)
            tenth = 10 * done // total if total >= LONG else 0
            if tenth > tenths.get(stage, 0) and not console.is_terminal:
                tenths[stage] = tenth
                console.print(f"{title} {done}/{total}")

        yield listen
