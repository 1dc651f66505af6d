"""Tables and lists that catalogues come with, packed or not, read with doubt."""

from __future__ import annotations

import csv
import gzip
import io
import json
import zlib
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from echomodel.files import read_bounded, within_memory

BLOCK = 2**16  # a reader makes room for all that it is asked for
MAX_TEXT = 2**30  # bytes of one table, unpacked


def text_of(path: Path) -> str:
    """The text of a file, unpacked where it ends in `.gz`; raises ValueError that names it."""
    try:
        with within_memory(path):
            content = read_bounded(path, MAX_TEXT)
            if path.suffix == ".gz":
                with gzip.open(io.BytesIO(content)) as file:
                    blocks = islice(iter(lambda: file.read(BLOCK), b""), MAX_TEXT // BLOCK + 1)
                    content = b"".join(blocks)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from None
    if len(content) > MAX_TEXT:
        raise ValueError(f"{path}: more than {MAX_TEXT} bytes, allowed for a table: that many")
    return content.decode("utf-8-sig", "replace")


def json_of(path: Path) -> Any:
    """The plain data of a JSON file; raises ValueError that names it."""
    try:
        with within_memory(path):
            return json.loads(text_of(path))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: cannot be read as JSON ({error})") from None


def json_lines(path: Path) -> Iterator[Mapping[str, Any]]:
    """The mappings of a file with one in each line; lines that are none are left out."""
    for line in text_of(path).splitlines():
        try:
            found = json.loads(line) if line.strip() else None
        except (json.JSONDecodeError, RecursionError):
            continue
        if isinstance(found, dict):
            yield found


def rows_of(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV table, its column names in lower case; raises ValueError that names it."""
    try:
        with within_memory(path):
            reader = csv.DictReader(io.StringIO(text_of(path)))
            return [{str(k).strip().lower(): v or "" for k, v in row.items() if isinstance(v, str)} for row in reader]
    except csv.Error as error:
        raise ValueError(f"{path}: cannot be read as a table ({error})") from None


def words(value: Any) -> str:
    """A text from what a catalogue says: a text, or the English one of several languages, or the first."""
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value:
        english = [v for v in value if isinstance(v, dict) and str(v.get("language_tag", "en")).startswith("en")]
        first = (english or value)[0]
        return words(first.get("value", "") if isinstance(first, dict) else first)
    return ""
