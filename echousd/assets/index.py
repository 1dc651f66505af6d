"""Make or bring up to date the index of a library; look through it: every model with its picture, and corrections."""

import csv
import io
import re
import time
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path, PurePath

import numpy as np

from echomodel.bounded import read_bounded
from echomodel.files import raising, whole_file, write_text
from echomodel.late import Late
from echomodel.vocabulary import vocabulary
from echousd.assets.catalogues import Entry, entries_of
from echousd.assets.colors import swatches
from echousd.assets.describe import PLACEMENT, described, left_out, relative, stamp
from echousd.assets.record import AssetRecord, vector
from echousd.assets.table import OldIndex, arrow, read_library, write_library
from echousd.naming import STAGE_FORMS
from echousd.pages import template
from echousd.stage.apart import fatal

shipped = Late("echomodel.loading:load_model")
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
    folders: Sequence[Path], file: Path, *, workers: int = 1, table: Path | None = None, descriptors: bool = False,
    progress: Progress | None = None,
) -> Indexed:  # fmt: skip
    """Index the models of some folders and libraries.

    Arguments:
        folders: each a library of a known kind (`echousd.assets.catalogues`), a folder of models, or one model.
        file: the Parquet file; models in it whose files have neither another size nor another time are not read again.
        workers: processes. table: a person's corrections (`echousd.assets.index`), None = none.
        descriptors: of every shape, by the encoder of the weights that ship (for `--shapes guided`).
        progress: called with (models done, models in all).

    Raises ValueError where a folder is none, nothing is found, or the file is no index and cannot be replaced.
    """
    arrow()
    unread: list[str] = []
    entries = list(_entries(folders, unread.append))
    if not entries:
        where = ", ".join(map(str, folders))
        kinds = "usd, usda, usdc, usdz, glb, gltf, obj, and libraries"
        why = f" ({unread[0]})" if unread else ""
        raise ValueError(f"{where}: holds no models; allowed: {kinds}{why}")
    wishes = read_corrections(table) if table is not None and table.exists() else {}
    before: Mapping[str, AssetRecord] = {}
    if file.exists():
        with suppress(OldIndex):
            before = read_library(file).records
    done: dict[str, AssetRecord] = {}
    fresh: list[Entry] = []
    for entry in entries:
        old = before.get(entry.key)
        if old is not None and _stays(old, entry, file, wishes) and (old.descriptor or old.fault or not descriptors):
            done[entry.key] = old
        else:
            fresh.append(entry)
    saved = time.monotonic()
    deadly = fatal(entry.file.path for entry in fresh if entry.file.suffix in STAGE_FORMS)
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
    return Indexed(file, len(done), sum(r.usable for r in done.values()), len(fresh), (*unread, *faults))


def _entries(folders: Sequence[Path], tell: Callable[[str], None]) -> Iterator[Entry]:
    """Entries of all folders, keys made unique by the folders' names where two folders have the same."""
    found = [(folder, entries_of(folder, tell)) for folder in folders]
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


def _stays(old: AssetRecord, entry: Entry, file: Path, wishes: "Corrections") -> bool:
    """Whether a row is still true: the file is the same one, and nobody corrects it otherwise than before."""
    unchanged = bool(old.stamp) and old.stamp == stamp(entry.file.path)
    place = old.uri.partition("!")[0] == relative(entry.file.path, file)
    return unchanged and place and old.corrected == correction_of(wishes.get(old.id, {}))


def _read(entries: list[Entry], file: Path, workers: int, descriptors: bool) -> Iterator[AssetRecord]:
    if workers < 2 or len(entries) < FEW:
        for entry in entries:
            yield from _pack([entry], file, descriptors)
        return
    packs = [entries[start : start + PACK] for start in range(0, len(entries), PACK)]
    # spawned: USD and numpy hold threads that do not survive a fork
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for future in as_completed([pool.submit(_pack, pack, file, descriptors) for pack in packs]):
            yield from future.result()


def _pack(entries: list[Entry], file: Path, descriptors: bool) -> list[AssetRecord]:
    encoder = shipped(None) if descriptors else None
    return [described(entry, file, encoder=encoder) for entry in entries]


COLUMNS = ("id", "use", "category", "turn", "metres", "found", "name", "width", "height", "depth", "licence", "fault")
LARGEST = 64 * 2**20  # bytes of a table
Corrections = Mapping[str, Mapping[str, str]]


def write_table(path: Path, records: Iterable[AssetRecord], corrections: Corrections | None = None) -> None:
    """Write the table: what a person may say of each model, and beside it what was found.

    `use` 0 leaves a model out, `category` is of the vocabulary, `turn` is in degrees, counter-clockwise from above, and
    `metres` is the unit of the model's file. Empty where what was found is right.

    Arguments:
        corrections: what was said already, which stays.
    """
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for r in records:
            row = (corrections or {}).get(r.id, {})
            wishes = [row.get(name, "") for name in COLUMNS[1:5]]
            size = [f"{length:.3f}" for length in r.dims]
            writer.writerow([r.id, *wishes, r.category, r.name, *size, r.licence, r.fault])


def read_corrections(path: Path) -> Corrections:
    """The table by id; raises ValueError naming the file, the line, what was found and what is allowed."""
    out: dict[str, Mapping[str, str]] = {}
    unreadable = raising(f"{path}: cannot be read as a table", OSError, UnicodeDecodeError, csv.Error)
    with unreadable, io.StringIO(read_bounded(path, LARGEST).decode("utf-8"), newline="") as file:
        reader = csv.DictReader(file)
        missing = [name for name in COLUMNS[:5] if name not in (reader.fieldnames or ())]
        if missing:
            raise ValueError(f"{path}: misses the columns {', '.join(missing)}")
        for row in reader:
            plain = {name: (row.get(name) or "").strip() for name in COLUMNS}
            _check(plain, f"{path}:{reader.line_num}")
            out[plain["id"]] = plain
    return out


def _check(row: Mapping[str, str], where: str) -> None:
    if row["use"] not in ("", "0", "1"):
        raise ValueError(f"{where}: use is {row['use']!r}, allowed: 1 or 0")
    if row["turn"] not in ("", "0", "90", "180", "270", "-90"):
        raise ValueError(f"{where}: turn is {row['turn']!r}, allowed: 0, 90, 180, 270 degrees")
    with raising(f"{where}:"):
        if row["category"]:
            vocabulary().category(row["category"])
        if row["metres"] and not 0 < float(row["metres"]) < 1e6:
            raise ValueError(f"metres is {row['metres']!r}, allowed: a positive number")


def correction_of(row: Mapping[str, str]) -> str:
    """What a row corrects, as the index remembers it; "" for one that corrects nothing."""
    cells = [row.get("category", ""), row.get("turn", ""), row.get("metres", ""), "0" if row.get("use") == "0" else ""]
    return "|".join(cells) if any(cells) else ""


def corrected(record: AssetRecord, row: Mapping[str, str]) -> AssetRecord:
    """The record as a person's row of the table wants it."""
    record = replace(record, corrected=correction_of(row))
    category = vocabulary().category(row["category"]).name if row["category"] else record.category
    if category != record.category:
        place = PLACEMENT[vocabulary().category(category).support]
        record = replace(record, category=category, confidence=1.0, placement=place)
    if row["turn"] not in ("", "0"):
        record = replace(record.turned(int(row["turn"]) // 90 % 4), front_confidence=1.0)
    if row["metres"]:
        extents = np.array(record.high) - np.array(record.low)
        record = replace(record, dims=vector(extents * float(row["metres"])))
    if row["use"] == "0":
        return replace(record, fault="left out in the table")
    helped = record.category and min(record.dims) > 0 and (row["category"] or row["metres"])
    return replace(record, fault="") if helped and record.sha256 else record


OWN = re.compile(r"'[^']*'|\"[^\"]*\"|[/\w.-]*/[/\w.-]+|\d+(\.\d+)?")  # quoted words, paths and numbers in a reason
DOUBT = 0.7  # confidence below which a row is coloured


def write_page(path: Path, records: Sequence[AssetRecord]) -> None:
    """Write an HTML page that stands alone, over no other file: models by category, the unusable last, with why."""
    usable = sorted((r for r in records if r.usable), key=lambda record: record.id)
    page = template("echousd.assets", "models.html.j2", base64=lambda png: b64encode(png).decode(), swatches=swatches)
    text = page.render(usable=usable, all=len(records), out=by_reason(records), doubt=DOUBT) + "\n"
    head = text.partition("<style>")[0].encode()
    if path.is_file():
        with path.open("rb") as there:
            if there.read(len(head)) != head:
                raise ValueError(f"{path}: exists and is no page of models; choose another place")
    write_text(path, text)


def by_reason(records: Sequence[AssetRecord]) -> dict[str, list[AssetRecord]]:
    """The models that cannot be used by the reason, the commonest first; what is of one model alone is `...` there."""
    found: dict[str, list[AssetRecord]] = {}
    for record in sorted((r for r in records if not r.usable), key=lambda record: record.id):
        where, _, why = record.fault.partition(": ")
        reason = why if why and PurePath(where).name == PurePath(record.id).name else record.fault
        found.setdefault(OWN.sub("...", reason) or "no size or category", []).append(record)
    return dict(sorted(found.items(), key=lambda entry: (-len(entry[1]), entry[0])))
