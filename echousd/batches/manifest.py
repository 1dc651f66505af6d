"""The manifest of a run: one row a room as JSON lines, and as Parquet where pyarrow is installed; a summary."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from echomodel.files import whole_file
from echousd.batches.journal import read_journals
from echousd.batches.plan import Plan
from echousd.batches.rows import COLUMNS

MANIFEST, TABLE, SUMMARY = "manifest.jsonl", "manifest.parquet", "summary.json"


SUMS = ("objects", "relations_asked", "relations_kept", "collisions", "restless", "faces", "bytes", "seconds")


def manifest_rows(plan: Plan, folder: Path) -> Iterator[dict[str, Any]]:
    """One row for every room of the plan, whatever became of it; `root` is relative to the run's folder."""
    journals = read_journals(folder)
    for entry in plan.entries:
        found = journals.get(entry.id, {})
        row = {name: found.get(name, default) for name, default in COLUMNS.items()}
        if found:
            entry.folder(folder)  # no link on the way leads elsewhere
        root = f"{entry.path}/{found['root']}" if found.get("root") else ""
        given = {"id": entry.id, "source": entry.origin, "seed": entry.seed, "version": plan.head["version"]}
        yield {**row, **given, "root": root}


def summary(rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """The manifest in a few numbers."""
    states, kinds, errors, sums = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    for row in rows:
        states[row["state"]] += 1
        if row["state"] == "failed":
            errors[row["error"][:120]] += 1
        if row["state"] != "done":
            continue
        kinds[row["type"]] += 1
        for name in SUMS:
            sums[name] += row[name]
        sums["living_faults"] += len(row["living_faults"])
        sums["passed_check"] += row["check"]
    return {
        "rooms": sum(states.values()),
        **{state: states[state] for state in ("done", "failed", "missing")},
        "types": dict(sorted(kinds.items())),
        **{name: round(value, 2) if isinstance(value, float) else value for name, value in sorted(sums.items())},
        "errors": dict(errors.most_common(20)),
    }


def write_manifest(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write `manifest.jsonl`, `manifest.parquet` (extra `batch`) and `summary.json`, and return the summary.

    Parquet holds categories as JSON text, so that every run has the same columns.
    """
    with whole_file(folder / MANIFEST) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(row) + "\n" for row in manifest_rows(plan, folder))
    _write_table(plan, folder)
    found = summary(manifest_rows(plan, folder))
    with whole_file(folder / SUMMARY) as beside:
        beside.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    return found


def _write_table(plan: Plan, folder: Path) -> None:
    try:
        import pyarrow
        import pyarrow.parquet as parquet
    except ImportError:
        return
    texts, numbers = pyarrow.list_(pyarrow.string()), pyarrow.list_(pyarrow.float64())
    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_()}
    special = {"bounds": numbers, "categories": pyarrow.string(), "seed": pyarrow.int64()}
    schema = pyarrow.schema(
        [(name, special.get(name, kinds.get(type(value), texts))) for name, value in COLUMNS.items()]
    )
    with whole_file(folder / TABLE) as beside, parquet.ParquetWriter(beside, schema) as writer:
        rows = []
        for row in manifest_rows(plan, folder):
            rows.append({**row, "categories": json.dumps(row["categories"])})
            if len(rows) == 10000:
                writer.write_table(pyarrow.Table.from_pylist(rows, schema))
                rows = []
        writer.write_table(pyarrow.Table.from_pylist(rows, schema))
