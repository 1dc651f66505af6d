"""How far long work is, told while it is done: on a terminal by bars of rich, elsewhere in lines without it."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from echomodel.files import tables
from echomodel.progress import StageListener
from echousd.cli.output import say

TITLES = tables("stages.toml", __file__)
LONG = 100  # steps of a stage of which a log hears every tenth part


@contextmanager
def progress_bar() -> Iterator[StageListener]:
    """A bar per stage on a terminal, elsewhere a plain line per stage and for every tenth of a long one (on stderr)."""
    if sys.stderr.isatty() or os.environ.get("FORCE_COLOR"):
        from echousd.cli.terminal import bars

        with bars(TITLES) as listen:
            yield listen
        return
    tenths: dict[str, int] = {}

    def tell(stage: str, done: int, total: int) -> None:
        title = TITLES.get(stage, stage)
        if stage not in tenths:
            say(title, err=True)
        tenth = 10 * done // total if total >= LONG else 0
        if tenth > tenths.setdefault(stage, 0):
            tenths[stage] = tenth
            say(f"{title} {done}/{total}", err=True)

    yield tell
