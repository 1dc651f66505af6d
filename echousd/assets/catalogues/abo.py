"""Amazon Berkeley Objects: `3dmodels/metadata/3dmodels.csv.gz`, glb models, and listings that name them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.catalogues.tables import json_lines, rows_of, words
from echousd.assets.model_file import ModelFile

TABLE = "3dmodels.csv"
SAID = ("style", "material", "color", "brand", "pattern")


def entries(folder: Path, tell: Told) -> list[Entry]:
    """Models of the table whose files are there."""
    table = _table(folder)
    assert table is not None
    listed: dict[str, Mapping[str, Any]] = {}
    for file in sorted(folder.rglob("listings_*.json*")):
        try:
            for item in json_lines(file):
                listed.setdefault(str(item.get("3dmodel_id", "")), item)
        except ValueError as error:
            tell(str(error))
    found = []
    models = table.parent.parent / "original"
    for row in rows_of(table):
        said, key = Path(row.get("path", "")), row.get("3dmodel_id", "")
        if key and said.name and not said.is_absolute() and ".." not in said.parts and (models / said).is_file():
            found.append(_entry(key, models / said, folder, listed.get(key, {})))
    if not found:
        tell(f"{table}: none of its models is below {models}")
    return found


def _entry(key: str, path: Path, folder: Path, item: Mapping[str, Any]) -> Entry:
    tags = tuple(filter(None, (words(item.get(name)) for name in SAID)))
    return Entry(
        key,
        ModelFile(path, folder),
        words(item.get("item_name")) or key,
        words=tuple(filter(None, (words(item.get("product_type")).replace("_", " ").lower(),))),
        turn=np.eye(3),
        licence="CC-BY-4.0",
        author="Amazon.com (Amazon Berkeley Objects)",
        tags=tags,
    )


def _table(folder: Path) -> Path | None:
    """The table of models somewhere below a folder."""
    return next((p for p in sorted(folder.rglob(f"{TABLE}*")) if p.name in (TABLE, f"{TABLE}.gz")), None)


CATALOGUE = Catalogue("Amazon Berkeley Objects", _table, entries)
