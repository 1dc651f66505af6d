"""3D-FUTURE: `model_info.json` and a folder `<model_id>/raw_model.obj` for each; metres, +Y up, front +Z."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.catalogues.tables import json_of
from echousd.assets.model_file import ModelFile

TABLE = "model_info.json"
FILES = ("raw_model.obj", "normalized_model.obj", "model.obj")


def entries(folder: Path, tell: Told) -> list[Entry]:
    """Models of the tables whose files are there."""
    found: list[Entry] = []
    missing = 0
    for table in _tables(folder):
        told = json_of(table)
        for item in told if isinstance(told, list) else ():
            key = str(item.get("model_id", "")) if isinstance(item, dict) else ""
            place = table.parent / key
            path = next((place / name for name in FILES if (place / name).is_file()), None)
            if not key or "/" in key or ".." in key or path is None:
                missing += 1
                continue
            said = {name: str(item.get(name) or "") for name in ("category", "super-category", "style")}
            tags = tuple(str(item[n]) for n in ("style", "theme", "material") if item.get(n))
            found.append(
                Entry(
                    key,
                    ModelFile(path, folder),
                    said["category"] or key,
                    words=tuple(filter(None, (said["category"], said["super-category"]))),
                    metres=1.0,
                    turn=np.eye(3),
                    licence="3D-FUTURE terms of use (non-commercial)",
                    author="Alibaba Group (3D-FUTURE)",
                    tags=tags,
                )
            )
    if missing:
        tell(f"{folder / TABLE}: {missing} models of the table are not there")
    return found


def _tables(folder: Path) -> list[Path]:
    return [p for p in (folder / TABLE, *sorted(folder.glob(f"*/{TABLE}"))) if p.is_file()]


CATALOGUE = Catalogue("3D-FUTURE", _tables, entries)
