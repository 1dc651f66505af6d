"""Make or bring up to date the index of a library: what did not change is kept, what is new is read side by side."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

from echousd.assets.catalogues import catalogue_of
from echousd.assets.catalogues.entry import Entry
from echousd.assets.corrections import Corrections, corrected, read_corrections, said_of
from echousd.assets.describe import described, left_out, relative, stamp
from echousd.assets.model_file import STAGES
from echousd.assets.record import AssetRecord
from echousd.assets.table import arrow, read_library, write_library
from echousd.stage.apart import fatal

PACK = 8  # models that a worker reads in one go
SAVED = 20.0  # seconds after which what is done is written, for a run that goes on after this one was killed
FEW = 24  # models that are read faster than workers start

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Indexed:
    """What an indexing run did.

    Arguments:
        file: the index. usable: models that can be chosen. read: models that were opened in this run.
        faults: a line for each model that cannot be used and for each source that could not be read whole.
    """

    file: Path
    models: int
    usable: int
    read: int
    faults: tuple[str, ...]


def index(
    folders: Sequence[Path],
    file: Path,
    *,
    workers: int = 1,
    table: Path | None = None,
    descriptors: bool = False,
    progress: Progress | None = None,
) -> Indexed:
    """Index the models of some folders and libraries.

    Arguments:
        folders: each a library of a known kind (`echousd.assets.catalogues`), a folder of models, or one model.
        file: the Parquet file; models in it whose files have neither another size nor another time are not read again.
        workers: processes. table: a person's corrections (`echousd.assets.corrections`), None = none.
        descriptors: of every shape, by the encoder of the weights that ship (for `--shapes guided`).
        progress: called with (models done, models in all).

    Raises ValueError where a folder is none, nothing is found, or the file is no index and cannot be replaced.
    """
    arrow()
    said: list[str] = []
    entries = list(_entries(folders, said.append))
    if not entries:
        where = ", ".join(map(str, folders))
        kinds = "usd, usda, usdc, usdz, glb, gltf, obj, and libraries"
        why = f" ({said[0]})" if said else ""
        raise ValueError(f"{where}: holds no models; allowed: {kinds}{why}")
    wishes = read_corrections(table) if table is not None and table.exists() else {}
    old_index = read_library(file) if file.exists() else None
    before = old_index.records if old_index is not None and old_index.complete else {}
    done: dict[str, AssetRecord] = {}
    fresh: list[Entry] = []
    for entry in entries:
        old = before.get(entry.key)
        if old is not None and _stays(old, entry, file, wishes) and (old.descriptor or old.fault or not descriptors):
            done[entry.key] = old
        else:
            fresh.append(entry)
    saved = time.monotonic()
    deadly = fatal(entry.file.path for entry in fresh if entry.file.suffix in STAGES)
    for entry in (entry for entry in fresh if entry.file.path in deadly):
        done[entry.key] = left_out(entry, file, deadly[entry.file.path])
    readable = [entry for entry in fresh if entry.file.path not in deadly]
    for count, record in enumerate(_read(readable, file, workers, descriptors), 1):
        done[record.id] = corrected(record, wishes[record.id]) if record.id in wishes else record
        if progress:
            progress(len(done), len(entries))
        if time.monotonic() - saved > SAVED and count < len(readable):
            write_library(file, done.values(), {"unfinished": True})
            saved = time.monotonic()
    write_library(file, done.values())
    faults = [record.fault for record in done.values() if record.fault]
    return Indexed(file, len(done), sum(r.usable for r in done.values()), len(fresh), (*said, *faults))


def _entries(folders: Sequence[Path], tell: Callable[[str], None]) -> Iterator[Entry]:
    """Entries of all folders, keys made unique by the folders' names where two folders have the same."""
    found = [(folder, catalogue_of(folder).entries(folder, tell)) for folder in folders]
    often = Counter(entry.key for _, entries in found for entry in entries)
    seen: set[str] = set()
    for folder, entries in found:
        for entry in entries:
            key = entry.key if often[entry.key] == 1 else f"{folder.name}/{entry.key}"
            if key in seen:
                tell(f"{entry.file}: {key!r} is there twice; the first counts")
                continue
            seen.add(key)
            yield replace(entry, key=key)


def _stays(old: AssetRecord, entry: Entry, file: Path, wishes: Corrections) -> bool:
    """Whether a row is still true: the file is the same one, and nobody corrects it otherwise than before."""
    unchanged = bool(old.stamp) and old.stamp == stamp(entry.file.path)
    place = old.uri.partition("!")[0] == relative(entry.file.path, file)
    return unchanged and place and old.corrected == said_of(wishes.get(old.id, {}))


def _read(entries: list[Entry], file: Path, workers: int, descriptors: bool) -> Iterator[AssetRecord]:
    if workers < 2 or len(entries) < FEW:
        encoder = _encoder(descriptors)
        for entry in entries:
            yield described(entry, file, encoder=encoder)
        return
    packs = [entries[start : start + PACK] for start in range(0, len(entries), PACK)]
    # spawned: USD and numpy hold threads that do not survive a fork
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for future in as_completed([pool.submit(_pack, pack, file, descriptors) for pack in packs]):
            yield from future.result()


def _pack(entries: list[Entry], file: Path, descriptors: bool) -> list[AssetRecord]:
    encoder = _encoder(descriptors)
    return [described(entry, file, encoder=encoder) for entry in entries]


def _encoder(wanted: bool) -> object:
    if not wanted:
        return None
    from echomodel.loading import load_model

    return load_model(None)
