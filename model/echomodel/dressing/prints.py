"""Rows of `prints.toml`: what is printed on pictures and cloths and woven into rugs, by the name of its material."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.files import tables
from echomodel.rows import RoomStyle

# of sheets
ASPECTS = {
    "tall": 0.74, "wide": 1.45, "rug": 1.5, "round": 1.0, "oval": 1.5, "runner": 3.0, "square": 1.0, "lumbar": 1.7,
}  # fmt: skip
TABLE = Path(__file__).with_name("prints.toml")
PRINTS: Mapping[str, Mapping[str, Any]] = tables(TABLE.name, __file__)


def printed(what: str, form: str, resident: str = "", style: RoomStyle | None = None) -> dict[str, list[str]]:
    """Kind -> names of what is printed on sheets of a form, for somebody who has rows of their own, else for anyone.

    `what`: the word that names begin with. `style`: of a room; its prints are taken alone where there are any.
    """
    fit = {name: row for name, row in PRINTS.items() if name.startswith(f"{what}_") and row["form"] == form}
    own = [name for name, row in fit.items() if resident in row.get("for", ())]
    found: dict[str, list[str]] = {}
    for name in own or (name for name, row in fit.items() if "for" not in row):
        found.setdefault(fit[name].get("kind", name), []).append(name)
    return {kind: names for kind, names in found.items() if style and kind in style.prints} or found


def names_of(what: str, form: str, resident: str = "", style: RoomStyle | None = None) -> list[str]:
    """The names of all kinds that are `printed` so."""
    return [name for names in printed(what, form, resident, style).values() for name in names]


def any_of(what: str, form: str, rng: np.random.Generator) -> str:
    """The name of a row that anybody has."""
    return str(rng.choice(names_of(what, form)))
