"""How far a run is, and whether its rooms are what the journal says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from echousd.batches.index import write_index
from echousd.batches.journal import fault_of, read_journals, whole_keys
from echousd.batches.manifest import manifest_rows, summary, write_manifest
from echousd.batches.plan import load_plan
from echousd.batches.sheet import write_sheet
from echousd.batches.webdataset import write_webdataset


@dataclass(frozen=True)
class Wrong:
    """A room that is not as it should be: its id, and what is wrong with it."""

    room: str
    problem: str


def status(folder: Path) -> dict[str, Any]:
    """The run's summary as the journals tell it now; raises ValueError for a folder without a run."""
    return summary(manifest_rows(load_plan(folder), folder))


def verify(folder: Path, *, check: bool = False) -> Iterator[Wrong]:
    """Rooms that are missing, failed, changed or, with `check`, do not pass `echousd check`.

    Raises ValueError for a folder without a run.
    """
    plan, rows, stored = load_plan(folder), read_journals(folder), whole_keys(folder)
    for entry in plan.entries:
        row, place = rows.get(entry.id), entry.folder(folder)
        if row is None:
            yield Wrong(entry.id, "missing" if not place.is_dir() else "in the folder, not in the journal")
        elif row["state"] != "done":
            yield Wrong(entry.id, f"failed: {row['error']}")
        elif fault := fault_of(place, row, stored):
            yield Wrong(entry.id, fault)
        elif check:
            from echousd.check import check_room

            report = check_room(place / row["root"])
            if not report.ok:
                counts = (len(report.broken), len(report.collisions), len(report.placement), len(report.errors))
                yield Wrong(entry.id, "check: {} relations, {} collisions, {} misplaced, {} errors".format(*counts))


def finish(folder: Path, *, webdataset: bool = False) -> dict[str, Any]:
    """Write manifest, summary, contact sheet and index stage from plan and journals; returns the summary.

    Arguments:
        webdataset: write tars of previews and JSON, too.
    """
    plan = load_plan(folder)
    found = write_manifest(plan, folder)
    write_sheet(
        folder, manifest_rows(plan, folder), f"{folder.resolve().name}: {found['done']} of {found['rooms']} rooms"
    )
    write_index(folder, manifest_rows(plan, folder))
    if webdataset:
        write_webdataset(folder, manifest_rows(plan, folder))
    return found
