"""What a run leaves (manifest, sheet, index, tars), how far it is, and whether its rooms are what the journal says."""

import io
import json
import math
import tarfile
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from echomodel.bounded import read_bounded, read_json
from echomodel.files import whole_file, write_json
from echousd.batches.plan import COLUMNS, RunPlan, fault_of, load_plan, read_journals, whole_keys
from echousd.folder.manifest import LARGEST
from echousd.folder.within import inside
from echousd.pages import template
from echousd.stage.apart import check_apart
from echousd.stage.files import layer_bytes, write_all
from echousd.stage.pen import ops, say
from echousd.stage.units import metres_from
from echousd.textures import MAX_BYTES

SHEET = "index.html"


def write_sheet(folder: Path, rows: Iterable[dict[str, Any]], title: str) -> Path:
    """Write `index.html`; its pictures are those of the rooms, by relative paths.

    Arguments:
        rows: of the manifest. title: what stands above.
    """
    cards = []
    for row in rows:
        picture, complaints = Path(row["root"]).with_suffix(".png") if row["root"] else None, _complaints(row)
        kept = f"{row['objects']} objects, {row['relations_kept']} of {row['relations_asked']} relations"
        shown = picture.as_posix() if picture and (folder / picture).is_file() else ""
        worst = 1000 if row["state"] != "done" else 100 * (not row["check"]) + len(complaints)
        own = {name: row[name] for name in ("id", "root", "type", "seed")}
        cards.append({**own, "kept": kept if row["root"] else "", "picture": shown, "told": complaints, "worst": worst})
    cards.sort(key=lambda card: (-card["worst"], card["id"]))
    kinds = sorted({card["type"] for card in cards} - {""})
    page = template("echousd.batches", "sheet.html.j2")
    with whole_file(folder / SHEET) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(page.generate(title=title, cards=cards, kinds=kinds))
    return folder / SHEET


def _complaints(row: dict[str, Any]) -> list[str]:
    """What is wrong with a room, a few words each."""
    if row["state"] != "done":
        return [row["error"] or "not made yet"]
    missed = row["relations_asked"] - row["relations_kept"]
    lines = [f"relations not kept: {missed}"] * bool(missed)
    lines += [f"collisions: {row['collisions']}"] * bool(row["collisions"])
    return [*lines, *["fails echousd check"] * (not row["check"]), *row["check_errors"], *row["living_faults"]]


MANIFEST, TABLE, SUMMARY = "manifest.jsonl", "manifest.parquet", "summary.json"


SUMS = ("objects", "relations_asked", "relations_kept", "collisions", "restless", "faces", "bytes", "seconds")


def manifest_rows(plan: RunPlan, folder: Path) -> Iterator[dict[str, Any]]:
    """One row for every room of the plan, whatever became of it; `root` is relative to the run's folder."""
    journals = read_journals(folder)
    for entry in plan.entries:
        found = journals.get(entry.id, {})
        row = {name: found.get(name, default) for name, default in COLUMNS.items()}
        if found:
            entry.folder(folder)  # no link on the way leads elsewhere
        root = f"{entry.path}/{found['root']}" if found.get("root") else ""
        about = {"id": entry.id, "source": entry.origin, "seed": entry.seed, "version": plan.head["version"]}
        yield {**row, **about, "root": root}


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


def write_manifest(plan: RunPlan, folder: Path) -> dict[str, Any]:
    """Write `manifest.jsonl`, `manifest.parquet` (extra `batch`) and `summary.json`, and return the summary.

    Parquet holds categories as JSON text, so that every run has the same columns.
    """
    with whole_file(folder / MANIFEST) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(row) + "\n" for row in manifest_rows(plan, folder))
    _write_table(plan, folder)
    found = summary(manifest_rows(plan, folder))
    write_json(folder / SUMMARY, found)
    return found


def _write_table(plan: RunPlan, folder: Path) -> None:
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


INDEX = "index.usda"
GAP = 2.0  # metres between two rooms


def write_index(plan: RunPlan, folder: Path) -> None:
    """Write `index.usda`; rooms are payloads, so that it opens without them (`Usd.Stage.LoadNone`).

    Rooms that are missing take no place. Unit and up axis are the first that the plan has; rooms of others are turned.
    """
    rows = zip(plan.entries, manifest_rows(plan, folder), strict=True)
    made = [(entry.options, row) for entry, row in rows if row["state"] == "done"]
    width = max(
        (max(row["bounds"][3] - row["bounds"][0], row["bounds"][5] - row["bounds"][2]) for _, row in made), default=0
    )
    pitch, columns = math.ceil(width + GAP), max(1, math.ceil(math.sqrt(len(made))))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageUpAxis(stage, plan.options[0].up_axis)
    UsdGeom.SetStageMetersPerUnit(stage, plan.options[0].meters_per_unit)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Rooms").GetPrim())
    frames = [metres_from(options.meters_per_unit, options.up_axis) for options in plan.options]
    back = np.linalg.inv(frames[0])
    with Sdf.ChangeBlock():
        for number, (options, row) in enumerate(made):
            prim = Sdf.CreatePrimInLayer(layer, f"/Rooms/{row['id']}")
            prim.specifier, prim.typeName = Sdf.SpecifierDef, "Xform"
            prim.payloadList.Prepend(Sdf.Payload(f"./{row['root']}"))
            low, high = np.array(row["bounds"]).reshape(2, 3)
            at = np.eye(4)
            at[[0, 2], 3] = np.array([number % columns, number // columns]) * pitch - ((low + high) / 2)[[0, 2]]
            place = np.round(back @ at @ frames[options], 9) + 0.0
            if np.array_equal(place[:3, :3], np.eye(3)):
                say(prim, ops(**{"translate:grid": ("double3", Gf.Vec3d(*place[:3, 3]))}))
            else:
                say(prim, ops(**{"transform:grid": ("matrix4d", Gf.Matrix4d(np.ascontiguousarray(place.T)))}))
    write_all({folder / INDEX: layer_bytes(layer, ".usda")})


def verify(folder: Path, *, check: bool = False) -> Iterator[tuple[str, str]]:
    """Ids of rooms that are missing, failed, changed or, with `check`, do not pass `echousd check`, and which of it.

    Raises ValueError for a folder without a run.
    """
    plan, rows, stored = load_plan(folder), read_journals(folder), whole_keys(folder)
    for entry in plan.entries:
        row, place = rows.get(entry.id), entry.folder(folder)
        settle = plan.options[entry.options].settle  # its verdict said so, too
        if row is None:
            yield entry.id, "missing" if not place.is_dir() else "in the folder, not in the journal"
        elif row["state"] != "done":
            yield entry.id, f"failed: {row['error']}"
        elif fault := _fault(place, row, stored, check=check, settle=settle):
            yield entry.id, fault


def _fault(place: Path, row: dict[str, Any], stored: Collection[str], *, check: bool, settle: bool) -> str:
    fault = fault_of(place, row, stored)
    if fault or not check:
        return fault
    from echousd.checks import check as checked

    try:
        check_apart(place / row["root"])
        report = checked(place / row["root"], settle=settle)
    except (ValueError, OSError) as error:
        return f"check: {error}"
    counts = (len(report.broken), len(report.collisions), len(report.placement), len(report.errors))
    restless = sum(len(found.restless) for found in report.settled or ())
    message = "check: {} relations, {} collisions, {} misplaced, {} errors".format(*counts)
    return "" if report.ok else message + f", {restless} restless" * bool(restless)


def finish(folder: Path, *, webdataset: bool = False) -> dict[str, Any]:
    """Write manifest, summary, contact sheet and index stage from plan and journals; returns the summary.

    Arguments:
        webdataset: write tars of previews and JSON, too.
    """
    plan = load_plan(folder)
    found = write_manifest(plan, folder)
    title = f"{folder.resolve().name}: {found['done']} of {found['rooms']} rooms"
    write_sheet(folder, manifest_rows(plan, folder), title)
    write_index(plan, folder)
    if webdataset:
        write_webdataset(folder, manifest_rows(plan, folder))
    return found


FOLDER = "webdataset"
ROOMS = 1000  # in one tar


def write_webdataset(folder: Path, rows: Iterable[dict[str, Any]], rooms: int = ROOMS) -> list[Path]:
    """Write `webdataset/rooms-000000.tar` and so on; `<id>.png` is left out of rooms that have no preview.

    `<id>.json` holds the room's row of the manifest and, as `room`, what lies beside the room: its graph, verdicts,
    assets and seed.

    Arguments:
        folder: of the run. rows: of its manifest; rooms that are not done are left out. rooms: in one tar.
    """
    place = inside(folder, FOLDER, f"{folder}: the run")
    place.mkdir(exist_ok=True)
    written: list[Path] = []
    done = (row for row in rows if row["state"] == "done")
    while pack := [row for _, row in zip(range(rooms), done)]:  # noqa: B905  # the last one is shorter
        path = place / f"rooms-{len(written):06d}.tar"
        with whole_file(path) as beside, tarfile.open(beside, "w", format=tarfile.USTAR_FORMAT) as tar:
            for row in pack:
                for name, content in _members(folder, row):
                    entry = tarfile.TarInfo(name)  # its time is 1970 and its owner nobody
                    entry.size = len(content)
                    tar.addfile(entry, io.BytesIO(content))
        written.append(path)
    for left in set(place.glob("rooms-*.tar")) - set(written):  # of a run that had more
        left.unlink()
    return written


def _members(folder: Path, row: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
    content = {key: value for key, value in row.items() if key != "seconds"}  # the only thing that no seed decides
    beside, picture = (
        inside(folder, str(PurePosixPath(row["root"]).with_suffix(ending)), f"{folder}: the manifest")
        for ending in (".json", ".png")
    )
    content["room"] = read_json(beside, LARGEST)
    yield f"{row['id']}.json", (json.dumps(content, sort_keys=True) + "\n").encode()
    if picture.is_file():
        yield f"{row['id']}.png", read_bounded(picture, MAX_BYTES)
