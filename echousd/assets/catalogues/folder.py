"""Any folder of models: named as their files or folders, with the licence of a text beside them."""

from __future__ import annotations

import re
from collections.abc import Set
from pathlib import Path

from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.licences import licence_beside
from echousd.assets.model_file import MODELS, ModelFile
from echousd.stage.apart import fatal

STAND_IN = re.compile(r"[_\-. ](collision|collider|convex|physics|lod_?[1-9])\d*$", re.IGNORECASE)
# what follows the name of the other one
SHOWN = re.compile(r"([_\-. ](visual|render|mesh|geo|model|base|high|lod_?0))?", re.IGNORECASE)
GENERIC = ("model", "mesh", "scene", "asset", "object", "geo", "geometry", "raw_model", "normalized_model", "untitled")


def entries(folder: Path, tell: Told) -> list[Entry]:
    """One entry for each model file; parts that a USD model consists of are left to it."""
    if folder.is_file():
        return [_entry(folder, folder.parent)]
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in MODELS and p.is_file())
    files = [file for file in files if not any(part.startswith(".") for part in file.relative_to(folder).parts)]
    parts = parts_of_others(files)
    beside: dict[Path, set[str]] = {}
    for file in files:
        beside.setdefault(file.parent, set()).add(file.stem)
    files = [file for file in files if not stands_in(file.stem, beside[file.parent])]
    return [_entry(file, folder) for file in files if file not in parts]


def _entry(file: Path, top: Path) -> Entry:
    key = file.relative_to(top).as_posix()
    stem = file.stem if file.stem.lower() not in GENERIC else file.parent.name
    name = re.sub(r"[_\-.]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stem)).strip()
    licence, author = licence_beside(file.parent, top)
    group = file.parent.name if file.parent != top else ""
    return Entry(key, ModelFile(file, top), name, group=group, licence=licence, author=author)


def stands_in(stem: str, others: Set[str]) -> bool:
    """Whether a file is what stands in for another one beside it: its collision mesh, or a lower level of detail."""
    found = STAND_IN.search(stem)
    name = stem[: found.start()] if found else stem
    return found is not None and any(other.startswith(name) and SHOWN.fullmatch(other, len(name)) for other in others)


def parts_of_others(files: list[Path]) -> set[Path]:
    """Layers that another layer of a list refers to: payloads, sublayers, parts of one model."""
    from pxr import Sdf, Tf

    known = {file.resolve(): file for file in files}
    found: set[Path] = set()
    layers = [file for file in files if file.suffix.lower() in (".usd", ".usda", ".usdc")]
    deadly = fatal(layers)
    for file in layers:
        if file in deadly:
            continue
        try:
            layer = Sdf.Layer.OpenAsAnonymous(str(file))
        except Tf.ErrorException:
            continue
        for name in layer.GetCompositionAssetDependencies():
            other = (file.parent / name).resolve()
            if other in known and known[other] != file:
                found.add(known[other])
    return found


def _is_folder(folder: Path) -> bool:
    return folder.is_dir() or folder.suffix.lower() in MODELS


CATALOGUE = Catalogue("a folder of models", _is_folder, entries)
