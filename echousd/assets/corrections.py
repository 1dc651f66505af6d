"""A person's corrections of an index: a CSV table of what was found, read again when the library is indexed."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.files import read_bounded, whole_file
from echomodel.vocabulary import vocabulary
from echousd.assets.describe import PLACEMENT
from echousd.assets.record import AssetRecord, vector

COLUMNS = ("id", "use", "category", "turn", "metres", "found", "name", "width", "height", "depth", "licence", "fault")
LARGEST = 64 * 2**20  # bytes of a table
Corrections = Mapping[str, Mapping[str, str]]


def write_table(path: Path, records: Iterable[AssetRecord], said: Corrections | None = None) -> None:
    """Write the table: what a person may say of each model, and beside it what was found.

    `use` 0 leaves a model out, `category` is of the vocabulary, `turn` is in degrees, counter-clockwise from above, and
    `metres` is the unit of the model's file. Empty where what was found is right.

    Arguments:
        said: what was said already, which stays.
    """
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for r in records:
            row = (said or {}).get(r.id, {})
            wishes = [row.get(name, "") for name in COLUMNS[1:5]]
            size = [f"{length:.3f}" for length in r.dims]
            writer.writerow([r.id, *wishes, r.category, r.name, *size, r.licence, r.fault])


def read_corrections(path: Path) -> Corrections:
    """The table by id; raises ValueError naming the file, the line, what was found and what is allowed."""
    out: dict[str, Mapping[str, str]] = {}
    try:
        with io.StringIO(read_bounded(path, LARGEST).decode("utf-8"), newline="") as file:
            reader = csv.DictReader(file)
            missing = [name for name in COLUMNS[:5] if name not in (reader.fieldnames or ())]
            if missing:
                raise ValueError(f"{path}: misses the columns {', '.join(missing)}")
            for row in reader:
                plain = {name: (row.get(name) or "").strip() for name in COLUMNS}
                _check(plain, f"{path}:{reader.line_num}")
                out[plain["id"]] = plain
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read as a table ({error})") from None
    return out


def _check(row: Mapping[str, str], where: str) -> None:
    if row["use"] not in ("", "0", "1"):
        raise ValueError(f"{where}: use is {row['use']!r}, allowed: 1 or 0")
    if row["turn"] not in ("", "0", "90", "180", "270", "-90"):
        raise ValueError(f"{where}: turn is {row['turn']!r}, allowed: 0, 90, 180, 270 degrees")
    try:
        if row["category"]:
            vocabulary().category(row["category"])
        if row["metres"] and not 0 < float(row["metres"]) < 1e6:
            raise ValueError(f"metres is {row['metres']!r}, allowed: a positive number")
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def said_of(row: Mapping[str, str]) -> str:
    """What a row corrects, as the index remembers it; "" for one that corrects nothing."""
    said = [row.get("category", ""), row.get("turn", ""), row.get("metres", ""), "0" if row.get("use") == "0" else ""]
    return "|".join(said) if any(said) else ""


def corrected(record: AssetRecord, row: Mapping[str, str]) -> AssetRecord:
    """The record as a person's row of the table wants it."""
    record = replace(record, corrected=said_of(row))
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
