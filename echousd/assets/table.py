"""The index of a library: one Parquet file, a row for each model."""

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from echomodel.files import telling, whole_file, within_memory
from echomodel.late import extra
from echomodel.vocabulary import vocabulary
from echousd.assets.colors import MOST
from echousd.assets.record import AssetRecord
from echousd.assets.reference import check_reach

VERSION = 2
KEY = b"echousd.assets"
LARGEST = 4 * 2**30  # bytes of an index when it is unpacked


@dataclass(frozen=True, eq=False)
class Library:
    """An index that was read.

    Arguments:
        file: the Parquet file, which paths of records are relative to. records: by id, in the index's order.
    """

    file: Path
    records: Mapping[str, AssetRecord]

    @cached_property
    def by_category(self) -> dict[str, tuple[AssetRecord, ...]]:
        """Category -> its usable models."""
        found: dict[str, list[AssetRecord]] = {}
        for record in self.records.values():
            if record.usable:
                found.setdefault(record.category, []).append(record)
        return {category: tuple(records) for category, records in found.items()}

    def path(self, record: AssetRecord) -> tuple[Path, str]:
        """The file of a record, and its member in it where it is an archive."""
        file, _, member = record.uri.partition("!")
        return (self.file.absolute().parent / file), member

    def check_reach(self, outside: Sequence[Path] = ()) -> None:
        """Raises ValueError where models lie neither below the index's folder nor in those that the caller allows."""
        here = self.file.absolute().parent
        for root in dict.fromkeys(record.root for record in self.records.values()):
            check_reach(here / root, here, outside, f"{self.file}: a row")

    def root(self, record: AssetRecord) -> Path:
        """The folder that a record's files lie in; the model's own where an index claims all that somebody has."""
        root = Path(os.path.realpath(self.file.absolute().parent / record.root))
        return self.path(record)[0].parent if Path.home().is_relative_to(root) else root


def arrow() -> Any:
    """The module pyarrow; raises ImportError that says how it is installed."""
    pyarrow = extra("pyarrow", "libraries of assets need pyarrow", "assets", ImportError)
    import_module("pyarrow.parquet")
    return pyarrow


def _schema() -> Any:
    pa = arrow()
    kinds = {"str": pa.string(), "float": pa.float64(), "int": pa.int64(), "bool": pa.bool_(), "bytes": pa.binary()}
    kinds |= {f"tuple[{kind}, ...]": pa.list_(kinds[kind]) for kind in ("str", "float")}
    kinds["Vector"] = kinds["tuple[float, ...]"]
    return pa.schema([(field.name, kinds[str(field.type)]) for field in fields(AssetRecord)])


def write_library(file: Path, records: Iterable[AssetRecord], about: Mapping[str, Any] | None = None) -> None:
    """Write an index as a whole or not at all; raises ValueError where that is impossible."""
    pa = arrow()
    schema = _schema().with_metadata({KEY: json.dumps({"version": VERSION, **(about or {})}).encode()})
    names = schema.names
    rows = sorted(records, key=lambda record: record.id)
    values = {name: [getattr(record, name) for record in rows] for name in names}
    columns = {name: [list(v) if isinstance(v, tuple) else v for v in values[name]] for name in names}
    with telling(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as beside:
            pa.parquet.write_table(pa.table(columns, schema=schema), beside, compression="zstd")


class OldIndex(ValueError):
    """An index of ours that this version does not read: whoever indexes its folders again makes it anew."""


def read_library(file: str | os.PathLike[str]) -> Library:
    """The library whose index is `file`, kept while that does not change; raises ValueError for any other file."""
    file = Path(file)
    if not file.is_file():
        found = "is a folder" if file.is_dir() else "not a regular file" if file.exists() else "no such file"
        raise ValueError(f"{file}: {found}, allowed: an index, made by `echousd assets index FOLDER -o {file.name}`")
    return _read(file, file.stat().st_mtime_ns)


@lru_cache(maxsize=2)
def _read(file: Path, changed: int) -> Library:
    pa = arrow()
    try:
        size = unpacked(pa.parquet.read_metadata(file))
        if size > LARGEST:
            raise ValueError(f"{size} bytes when unpacked, allowed: {LARGEST}")
        with within_memory(file):
            return _library(file, pa.parquet.read_table(file))
    except OldIndex:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:  # words that are no UTF-8, too
        reason = str(error).splitlines()[0]
        message = reason if reason.startswith(f"{file}: ") else f"{file}: cannot be read as an index ({reason:.120})"
        raise ValueError(message) from None


def _library(file: Path, table: Any) -> Library:
    about = json.loads((table.schema.metadata or {}).get(KEY, b"null"))
    version = about.get("version") if isinstance(about, dict) else None
    if version != VERSION:
        message = f"version {'none' if version is None else version} of an index of assets, allowed: {VERSION}"
        kind = OldIndex if isinstance(version, int) else ValueError
        raise kind(f"{file}: {message}; index the folder again")
    wanted = list(_schema())
    wrong = [f.name for f in wanted if f.name not in table.schema.names or table.schema.field(f.name).type != f.type]
    if wrong:
        raise OldIndex(f"{file}: columns {', '.join(wrong)} are missing or of another type; index the folder again")
    records: dict[str, AssetRecord] = {}
    for row in table.select([column.name for column in wanted]).to_pylist():
        empty = [name for name, value in row.items() if value is None or (isinstance(value, list) and None in value)]
        if empty:
            raise ValueError(f"{file}: row {len(records) + 1} has no {empty[0]}; index the folder again")
        fields_of: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in row.items()}
        record = AssetRecord(**fields_of)
        fault = _fault(record)
        if fault:
            raise ValueError(f"{file}: row {len(records) + 1}: {fault}; index the folder again")
        records[record.id] = record
    return Library(file, records)


def _fault(record: AssetRecord) -> str:
    """What no index of ours says of a model, "" where nothing is wrong."""
    for name, value in vars(record).items():
        if isinstance(value, str) and "\0" in value:
            return f"{name} is {value!r:.60}, allowed: text without a zero byte"
    for name, count in (("turn", 9), ("low", 3), ("high", 3), ("dims", 3)):
        numbers = getattr(record, name)
        if len(numbers) != count or not all(map(math.isfinite, numbers)):
            return f"{name} is {numbers!s:.60}, allowed: {count} finite numbers"
    if not record.fault and min(record.dims) <= 0:  # a model that could not be read has none
        return f"dims is {record.dims!s:.60}, allowed: metres above 0"
    for name in ("confidence", "front_confidence"):
        if not 0 <= getattr(record, name) <= 1:
            return f"{name} is {getattr(record, name)}, allowed: 0 to 1"
    for name in ("descriptor", "colors"):
        if not all(map(math.isfinite, getattr(record, name))):
            return f"{name} is {getattr(record, name)!s:.60}, allowed: finite numbers"
    if len(record.colors) % 4 or len(record.colors) > 4 * MOST or min(record.colors[::4], default=0) < 0:
        return f"colors is {record.colors!s:.60}, allowed: up to {MOST} times share and three numbers"
    if record.category and record.category not in {category.name for category in vocabulary().categories}:
        return f"category is {record.category!r:.60}, allowed: a word of the vocabulary"
    return ""


def unpacked(metadata: Any) -> int:
    """Bytes of all columns of a Parquet file as they are held in memory, as its own tables say."""
    groups = (metadata.row_group(number) for number in range(metadata.num_row_groups))
    return sum(max(group.total_byte_size, 8 * group.num_rows * group.num_columns) for group in groups)
