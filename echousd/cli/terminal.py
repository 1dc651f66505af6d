"""The console that commands print on: what stands in files cannot steer the terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text

from echousd.cli.output import safe


class Terminal(Console):
    """A rich console of `safe` texts, cells of tables included, and without markup unless it is asked for."""

    def __init__(self, *, markup: bool = False, **options: Any) -> None:
        super().__init__(markup=markup, highlight=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """The text as rich shows it, without characters that a terminal obeys."""
        return super().render_str(safe(text), **options)
