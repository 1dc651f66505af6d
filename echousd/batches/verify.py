"""How far a run is, and whether its rooms are what the journal says."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from echousd.batches.index import INDEX, write_index
from echousd.batches.journal import fault_of, read_journals, whole_keys
from echousd.batches.manifest import MANIFEST, SUMMARY, TABLE, manifest_rows, summary, write_manifest
from echousd.batches.plan import load_plan
from echousd.batches.remote import Remote, fetched
from echousd.batches.sheet import SHEET, write_sheet
from echousd.batches.webdataset import write_webdataset

ARTEFACTS = (MANIFEST, TABLE, SUMMARY, SHEET, INDEX)


@dataclass(frozen=True)
class Wrong:
    """A room that is not as it should be: its id, and what is wrong with it."""

    room: str
    problem: str


def status(folder: Path) -> dict[str, Any]:
    """The run's summary as the journals tell it now; raises ValueError for a folder without a run."""
    return summary(manifest_rows(load_plan(folder), folder))


def verify(folder: Path, *, check: bool = False, to: str = "") -> Iterator[Wrong]:
    """Rooms that are missing, failed, changed or, with `check`, do not pass `echousd check`.

    Arguments:
        to: URL of the run's rooms; nobody is contacted for what a plan says alone, which may come from anybody.

    Raises ValueError for a folder without a run, and for a URL that is not the plan's.
    """
    plan, rows, stored = load_plan(folder), read_journals(folder), whole_keys(folder)
    if plan.to != to:
        where = f"at {plan.to}, allowed: --to {plan.to}" if plan.to else "in its folder, allowed: no --to"
        raise ValueError(f"{folder}: the rooms are {where}")
    for entry in plan.entries:
        row, place = rows.get(entry.id), entry.folder(folder)
        settle = plan.options[entry.options].settle  # its verdict said so, too
        if row is None:
            yield Wrong(entry.id, "missing" if not place.is_dir() else "in the folder, not in the journal")
        elif row["state"] != "done":
            yield Wrong(entry.id, f"failed: {row['error']}")
        elif plan.to:
            with fetched(plan.to, entry.path) as copy:
                fault = _fault(copy / entry.path, row, whole_keys(copy), check=check, settle=settle)
        else:
            fault = _fault(place, row, stored, check=check, settle=settle)
        if row is not None and row["state"] == "done" and fault:
            yield Wrong(entry.id, fault)


def _fault(place: Path, row: dict[str, Any], stored: Collection[str], *, check: bool, settle: bool) -> str:
    fault = fault_of(place, row, stored)
    if fault or not check:
        return fault
    from echousd.checks import check as checked
    from echousd.stage.apart import check_apart

    try:
        check_apart(place / row["root"])
        report = checked(place / row["root"], settle=settle)
    except (ValueError, OSError) as error:
        return f"check: {error}"
    counts = (len(report.broken), len(report.collisions), len(report.placement), len(report.errors))
    restless = sum(len(found.restless) for found in report.settled or ())
    told = "check: {} relations, {} collisions, {} misplaced, {} errors".format(*counts)
    return "" if report.ok else told + f", {restless} restless" * bool(restless)


def finish(folder: Path, *, webdataset: bool = False) -> dict[str, Any]:
    """Write manifest, summary, contact sheet and index stage from plan and journals; returns the summary.

    Arguments:
        webdataset: write tars of previews and JSON, too; raises ValueError where the rooms are not in the folder.
    """
    plan = load_plan(folder)
    if plan.to and webdataset:
        raise ValueError(f"--webdataset: the rooms are at {plan.to}, allowed: rooms in the run's own folder")
    found = write_manifest(plan, folder)
    pictures = Remote(plan.to).sizes("rooms") if plan.to else None
    title = f"{folder.resolve().name}: {found['done']} of {found['rooms']} rooms"
    write_sheet(folder, manifest_rows(plan, folder), title, pictures)
    write_index(folder, manifest_rows(plan, folder))
    if webdataset:
        write_webdataset(folder, manifest_rows(plan, folder))
    if plan.to:  # the sheet and the index name rooms beside them
        Remote(plan.to).put(folder, [name for name in ARTEFACTS if (folder / name).is_file()])
    return found
