"""Sweet Home 3D: `.sh3f` archives of OBJ models with a catalogue of names, sizes, creators and licences."""

from __future__ import annotations

from pathlib import Path

from echomodel.data.catalogues import MeshEntry, read_library
from echomodel.data.meshes import class_by_name, reviewed
from echousd.assets.catalogues.entry import Catalogue, Entry, Told
from echousd.assets.model_file import ModelFile
from echousd.assets.naming import fitted

SUFFIX = ".sh3f"


def entries(folder: Path, tell: Told) -> list[Entry]:
    """All models; those that were looked at for this project have the class that was found by eye."""
    libraries = [folder] if folder.is_file() else sorted(p for p in folder.rglob(f"*{SUFFIX}") if p.is_file())
    found: list[Entry] = []
    for library in libraries:
        try:
            found += [_entry(entry) for entry in read_library(library)]
        except (ValueError, KeyError, OSError) as error:
            tell(f"{library}: {error}")
    return found


def _entry(entry: MeshEntry) -> Entry:
    assert entry.size is not None
    category = class_by_name(entry.name, entry.group, entry.size)
    known = reviewed().get(entry.key, {})
    category = "" if category and fitted(category, entry.name, entry.group) else category
    category = "" if known.get("use") == "0" else known.get("class", category)
    return Entry(
        entry.key,
        ModelFile(entry.source, entry.source.parent, entry.member),
        entry.name,
        words=(),
        group=entry.group,
        category=category,
        decided=True,
        dims=entry.size,
        turn=entry.turn,
        licence=entry.licence,
        author=entry.creator,
    )


def _is_library(folder: Path) -> bool:
    """A library, or a folder with libraries somewhere below it."""
    return folder.suffix == SUFFIX or (folder.is_dir() and any(p.is_file() for p in folder.rglob(f"*{SUFFIX}")))


CATALOGUE = Catalogue("Sweet Home 3D", _is_library, entries)
