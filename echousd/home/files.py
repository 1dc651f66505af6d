"""Homes in files, told apart by extension as scene graphs are."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echomodel.late import Late
from echousd.naming import STAGE_FORMS, TEXT_FORMS

if TYPE_CHECKING:  # what a single room does not need is not loaded to see that it is one
    from echousd.home.graph import HomeGraph

read_file, write_text = Late("echousd.graph.files:read_file"), Late("echousd.graph.files:write_text")


def load_home(path: str | Path) -> HomeGraph | None:
    """The home in a file (YAML, JSON, stage), None where the file holds a single room's graph or none.

    Raises `GraphError` or StageError naming the file and the fault.
    """
    path = Path(path)
    if path.suffix.lower() in STAGE_FORMS:
        from echousd.stage.files import open_stage
        from echousd.stage.read import is_home

        stage = open_stage(path)
        if not is_home(stage):
            return None
        from echousd.home.stages import read_home

        return read_home(stage)
    if path.suffix.lower() not in TEXT_FORMS:
        return None

    def read(text: str, *rest: Any) -> HomeGraph | None:
        if not re.search(r"""(^|[{,])\s*["']?rooms["']?\s*:""", text, re.MULTILINE):
            return None
        from echousd.graph.text import read_text
        from echousd.home.graph import home_of_plain

        return read_text(lambda d: home_of_plain(d) if isinstance(d, dict) and "rooms" in d else None, text, *rest)

    return read_file(path, read)


def save_home(home: HomeGraph, path: Path) -> None:
    """Write a home to a file in the form of its extension; raises `GraphError` or StageError."""
    if path.suffix.lower() in TEXT_FORMS:
        write_text(path, home.to_json() if TEXT_FORMS[path.suffix.lower()] == "json" else home.to_yaml())
        return
    from echousd.home.stages import write_home

    write_home(home, path)
