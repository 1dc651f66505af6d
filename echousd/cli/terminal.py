"""The console that commands print on: what stands in files cannot steer the terminal; bars of long work."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.text import Text

from echomodel.progress import StageListener
from echousd.cli.output import quiet, safe


class Terminal(Console):
    """A rich console of `safe` texts, cells of tables included, without markup; or quiet."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, highlight=False, quiet=quiet.get(), **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """The text as rich shows it, without characters that a terminal obeys."""
        return super().render_str(safe(text), **options)


@contextmanager
def bars(titles: Mapping[str, str]) -> Iterator[StageListener]:
    """A bar per stage, called by its title."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console, tasks = Terminal(stderr=True), dict[str, Any]()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=console.quiet) as bar:

        def listen(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(titles.get(stage, stage), total=total)
            bar.update(tasks[stage], completed=done, total=total)

        yield listen
